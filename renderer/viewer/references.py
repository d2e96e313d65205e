"""Other renderers' pictures of a scene, from packages that offer them under an entry point, each in its own process.

A reference is a function ``(scene, width, height, *, max_depth, progress)`` that returns linear radiance, (height,
width, 3), and calls ``progress(done, of)``. Its process can be ended in the middle of a picture, and what it loads,
selects or leaks stays there.
"""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint, entry_points
from queue import Empty, SimpleQueue
from threading import Thread
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.scene.scene import Scene
from renderer.system import child

GROUP = "octree_render.references"
# Seconds between looks at whether a picture is still wanted while its reference says nothing.
_TURN = 0.1


def references() -> dict[str, EntryPoint]:
    """The references that packages on this machine offer, by name."""
    return {entry.name: entry for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name)}


def reference_picture(
    name: str, scene: Scene, size: tuple[int, int], max_depth: int, finished: Callable[[float], object]
) -> NDArray[np.float32]:
    """The picture of ``scene`` by the reference of that name, of ``size`` (w, h), linear radiance (h, w, 3).

    ``finished(share)`` is called as it grows, and with 0 while nothing is heard of it; what it raises ends the other
    process. Raises ``ValueError`` where there is no such reference, or it fails.
    """
    expect(name in references(), "reference", f"one of {list(references())}", repr(name))
    asked = pickle.dumps((references()[name].value, scene, size, max_depth))
    other = subprocess.Popen(
        child.command(f"{__name__}:answer"), env=child.environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        for told in _heard(other, asked):
            if not isinstance(told, float):
                return _checked(name, told, size)
            finished(told)
    finally:
        other.kill()
        other.wait()
    raise ValueError(f"reference: expected a picture by {name}, got its process ended")


def _heard(other: "subprocess.Popen[bytes]", asked: bytes) -> Iterator[object]:
    """The messages of the other process about the picture ``asked`` for; 0.0 while it is silent."""
    assert other.stdin is not None and other.stdout is not None
    heard: SimpleQueue[Any] = SimpleQueue()
    # It waits for the pipe on a thread, since only the other process ends such a wait.
    Thread(target=_exchange, args=(other.stdin, other.stdout, asked, heard), daemon=True).start()
    while True:
        try:
            told = heard.get(timeout=_TURN)
        except Empty:
            told = 0.0
        if told is None:
            return
        yield told


def _exchange(to: IO[bytes], of: IO[bytes], asked: bytes, heard: "SimpleQueue[Any]") -> None:
    """Send the request ``asked``, and read answers until the other process ends, which gives None."""
    # Its end of ``to`` tells the other process, by then, that this one has ended.
    with to, of:
        try:
            to.write(asked)
            to.flush()
            while True:
                heard.put(pickle.load(of))
        except Exception:  # the pipe ends, in the middle of an answer too, or something else was written to it
            heard.put(None)


def _checked(name: str, told: object, size: tuple[int, int]) -> NDArray[np.float32]:
    """The picture of an answer. Raises ``ValueError`` for an error, another size, or values that are not finite."""
    expect(isinstance(told, np.ndarray), "reference", f"a picture by {name}", told)
    assert isinstance(told, np.ndarray)  # which mypy cannot tell
    shape = (size[1], size[0], 3)
    expect(told.shape == shape, "reference", f"a picture of shape {shape} by {name}", told.shape)
    wrong = told[~np.isfinite(told)]
    expect(not len(wrong), "reference", f"finite radiance by {name}", f"{wrong[:1].sum()} in {len(wrong)} values")
    return told


def answer() -> None:
    """In the other process: compute the picture; send shares of progress, then the picture or an error."""
    told, sys.stdout = sys.stdout.buffer, sys.stderr  # to which a reference may print
    target, scene, size, max_depth = pickle.load(sys.stdin.buffer)
    Thread(target=_end_with, args=(sys.stdin.fileno(),), daemon=True).start()
    before = 0.0

    def progress(done: int, of: int) -> None:
        nonlocal before
        pickle.dump(done / of - before, told)
        told.flush()
        before = done / of

    try:
        found = EntryPoint("", target, GROUP).load()
        seen = np.asarray(found(scene, *size, max_depth=max_depth, progress=progress))
        with np.errstate(over="ignore"):  # what is too large is told by the one who waits
            picture: object = seen.astype(np.float32, casting="same_kind")
    except Exception as error:  # told, whatever it is, to whoever waits for the picture
        picture = " ".join(f"{type(error).__name__}: {error}".split())
    pickle.dump(picture, told)
    told.flush()


def _end_with(pipe: int) -> None:
    """End this process where the one that asks has ended, however it did."""
    while os.read(pipe, 1):
        pass
    os._exit(1)
