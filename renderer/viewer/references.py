"""Other renderers' pictures of a scene, from packages that offer them under an entry point, each in its own process.

A reference is a function ``(scene, width, height, *, max_depth, progress)`` that returns linear radiance, (height,
width, 3), and calls ``progress(done, of)``. Its process can be ended in the middle of a picture, and what it loads,
selects or leaks stays there.
"""

import pickle
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.process import child
from renderer.scene.scene import Scene

GROUP = "octree_render.references"


def references() -> dict[str, EntryPoint]:
    """The references that packages on this machine offer, by name."""
    return {entry.name: entry for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name)}


def reference_picture(
    name: str, scene: Scene, size: tuple[int, int], max_depth: int, finished: Callable[[float], object]
) -> NDArray[np.float32]:
    """The picture of ``scene`` by the reference of that name, of ``size`` (w, h), linear radiance (h, w, 3).

    ``finished(share)`` is called as it grows; what it raises ends the other process. Raises ``ValueError`` where there
    is no such reference, or it fails.
    """
    expect(name in references(), "reference", f"one of {list(references())}", repr(name))
    asked = pickle.dumps((references()[name].value, scene, size, max_depth))
    with subprocess.Popen(
        child.command(f"{__name__}:answer"), env=child.environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdin is not None and other.stdout is not None
        try:
            other.stdin.write(asked)
            other.stdin.close()
            while isinstance(told := pickle.load(other.stdout), float):
                finished(told)
        except (EOFError, BrokenPipeError, pickle.UnpicklingError):
            told = "its process ended"
        finally:
            other.kill()
    expect(not isinstance(told, str), "reference", f"a picture by {name}", str(told))
    return np.asarray(told, np.float32)


def answer() -> None:
    """In the other process: compute the picture that is asked for, and tell shares of it, then all of it or a fault."""
    told, sys.stdout = sys.stdout.buffer, sys.stderr  # to which a reference may print
    target, scene, size, max_depth = pickle.load(sys.stdin.buffer)
    before = 0.0

    def progress(done: int, of: int) -> None:
        nonlocal before
        pickle.dump(done / of - before, told)
        told.flush()
        before = done / of

    try:
        found = EntryPoint("", target, GROUP).load()
        picture: object = np.asarray(found(scene, *size, max_depth=max_depth, progress=progress), np.float32)
    except Exception as error:  # told, whatever it is, to whoever waits for the picture
        picture = " ".join(f"{type(error).__name__}: {error}".split())
    pickle.dump(picture, told)
    told.flush()
