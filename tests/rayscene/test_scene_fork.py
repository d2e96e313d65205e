"""Processes forked while another thread changes a scene."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import os, signal, threading, time
from renderer import RayScene
from renderer.mesh.shapes import box

scene, changing = RayScene(), threading.Event()
scene.add(box())

def change_for_a_while():
    with scene._lock:
        changing.set()
        time.sleep(0.3)
        scene.add(box((0, 0, 2), (1, 1, 3)))

threading.Thread(target=change_for_a_while).start()
changing.wait()
child = os.fork()
if child == 0:
    signal.alarm(60)  # ends the child if it waits for ever
    found = []
    asking = threading.Thread(target=lambda: found.append(scene.closest_hit([0.5, 0.25, 9], [0, 0, -1]).t))
    asking.start()
    asking.join()
    RayScene()
    os._exit(0 if found == [6] else 1)
# In the parent another thread may change the scene, and make others.
threading.Thread(target=lambda: (scene.add(box()), RayScene())).start()
print(os.waitpid(child, 0)[1])
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_child_has_the_scene_whole_and_no_lock() -> None:
    """It waited for a thread that it does not have."""
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=120)
    assert (done.stdout.strip(), done.returncode) == ("0", 0), done.stderr
