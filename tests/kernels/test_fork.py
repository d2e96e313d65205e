"""Processes forked while another thread compiles or loads kernels."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import os, signal, threading, time
from numba.core.compiler_lock import global_compiler_lock
from renderer import Octree

compiling = threading.Event()

def compile_for_a_while():
    with global_compiler_lock:
        compiling.set()
        time.sleep(0.3)

threading.Thread(target=compile_for_a_while).start()
compiling.wait()
child = os.fork()
if child == 0:
    signal.alarm(60)  # ends the child if it waits for ever
    hits = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).closest_hit([0.2, 0.2, 1.0], [0.0, 0.0, -1.0])
    os._exit(0 if hits.t == 1.0 else 1)
print(os.waitpid(child, 0)[1])
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_child_does_not_inherit_the_compilers_lock():
    """It waited for a thread that it does not have."""
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=120)
    assert (done.stdout.strip(), done.returncode) == ("0", 0), done.stderr
