"""Arrays that another thread writes during a call: an error or some answer, and no memory but the arrays' is read."""

import subprocess
import sys

# In a process of its own, which would end by a fault: the check and the use of an index lie a moment apart.
SCRIPT = """
import threading, time
import numpy as np
from renderer import Mesh, Octree
octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
rng, count = np.random.default_rng(0), 300_000
origins, directions, leaving = rng.random((count, 3)), rng.random((count, 3)), np.full(count, -1)
faces = np.zeros((count, 3), np.int64)
ended = False
def write():
    while not ended:
        for array, good in ((leaving, -1), (faces, 0)):
            array[:] = good
        time.sleep(0.002)
        for array in (leaving, faces):
            array[:] = 2**40
writer = threading.Thread(target=write)
writer.start()
refused = 0
for _ in range(60):
    for call in (lambda: octree.any_hit(origins, directions, leaving=leaving), lambda: Mesh(np.eye(3), faces)):
        try:
            call()
        except ValueError:
            refused += 1
ended = True
writer.join()
print("refused" if refused else "never met")
"""


def test_an_index_is_checked_where_it_is_used():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=200)
    assert (done.returncode, done.stdout.strip()) == (0, "refused"), done.stderr
