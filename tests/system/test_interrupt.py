"""Ctrl-C in the compiler ends the process at once; anywhere else it is a KeyboardInterrupt as always."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from renderer.system.interrupt import INTERRUPTED, ends_while_compiling

pytestmark = pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
ROOT = Path(__file__).parents[2]

# A module of the given name that is interrupted where Python swallows what is raised, and then raises another error.
SCRIPT = """
import os, signal, sys
from renderer.system.interrupt import ends_while_compiling
code = '''
class Swallows:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000): pass
try:
    Swallows()
except BaseException: pass
raise AssertionError("went on")
'''
with ends_while_compiling("it ends", own_process={own}):
    exec(code, {{"__name__": {name!r}, "os": os, "signal": signal}})
"""


def ended(name: str, own: bool = True, **options: object) -> tuple[int, str]:
    command = [sys.executable, "-c", SCRIPT.format(name=name, own=own)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, **options)  # type: ignore[call-overload]
    return done.returncode, done.stderr


@pytest.mark.parametrize("name", ["numba", "numba.core.typeinfer", "llvmlite.binding.ffi"])
def test_an_interrupt_in_the_compiler_ends_the_process_with_one_line(name):
    assert ended(name) == (INTERRUPTED, "it ends\n")


@pytest.mark.parametrize(
    ("name", "own"), [("renderer.shade.tile", True), ("numbat", True), ("numba.core.typeinfer", False)]
)
def test_elsewhere_and_in_processes_of_others_it_does_not(name, own):
    code, err = ended(name, own)
    assert code == 1 and "it ends" not in err and "went on" in err


def test_ignored_interrupts_stay_ignored():
    """As in a job that a script started by ``&``."""
    code, err = ended("numba", preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    assert code == 1 and "it ends" not in err and "went on" in err


def test_outside_the_compiler_it_raises_and_the_handler_before_is_there_again():
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), ends_while_compiling("it ends", own_process=True):
        assert signal.getsignal(signal.SIGINT) is not before
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000):
            pass
    assert signal.getsignal(signal.SIGINT) is before is signal.default_int_handler


def test_a_thread_other_than_the_main_one_changes_nothing():
    seen = []

    def enter() -> None:
        with ends_while_compiling("it ends", own_process=True):
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]


def test_what_compiles_beside_ends_with_its_parent(tmp_path):
    """Killed, a parent cannot end its child; the child then reads the end of its input."""
    command = [sys.executable, "-c", "from renderer.precompile import compile_parts; compile_parts('', 'pictures')"]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    child = subprocess.Popen(command, cwd=ROOT, env=environment, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        with pytest.raises(subprocess.TimeoutExpired):
            child.wait(timeout=2.0)  # compiling takes some ten seconds
        child.stdin.close()
        assert child.wait(timeout=60) == 1
    finally:
        child.kill()


AGAIN = """
import atexit, os, signal
from renderer.system.interrupt import interruptible
def interrupt():
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(1000): pass
atexit.register(interrupt)
@interruptible("it ends")
def main(arguments=None):
    interrupt()
main()
"""


def test_a_second_interrupt_while_the_process_ends_shows_no_traceback():
    """As where a thread still compiles, for which Python waits."""
    done = subprocess.run([sys.executable, "-c", AGAIN], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (-signal.SIGINT, "it ends\n")
