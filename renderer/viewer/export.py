"""Files that a page has made beside the view: a picture of any size, and a turntable; with progress, and an end at any
time.
"""

import asyncio
import io
import math
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.picture.animation import write_animation
from renderer.picture.encoding import encoded
from renderer.picture.exr import check_exr
from renderer.picture.image import PLANES, exr_of
from renderer.picture.matte import cut_out, matte_of
from renderer.scene.vectors import rotated, unit
from renderer.viewer.passes import Pass, colored, passes_of, picture, traced_by
from renderer.viewer.protocol import FILE, CameraMessage, Rows, Still, Turntable, packed
from renderer.viewer.shown import ShownScene
from renderer.viewer.viewpoint import camera_of

# Bytes of a message: pieces so small let pictures pass between them, and a client that stops reading takes one of them.
_PIECE = 1 << 20
# Seconds between messages of progress, as of pictures.
_PROGRESS = 0.1


class StoppedError(Exception):
    """Raised between tiles when a file is cancelled."""


def still(shown: ShownScene, asked: Still, finished: Callable[[float], object]) -> bytes:
    """The file of the picture that ``render`` gives for the view's camera and settings.

    ``finished(rays)`` is called with camera rays that are traced, of ``work(asked)`` in all, and with 0 while the
    background is left out; what it raises ends it.
    """
    view = _view(asked, asked.m)
    if asked.format == "exr":
        return _exr(shown, view, finished)
    return encoded((_cut_out if asked.format == "transparent" else _pixels)(shown, view, finished))


def turntable(shown: ShownScene, asked: Turntable, finished: Callable[[float], object]) -> bytes:
    """The animated file; see ``write_animation``.

    The first frame is the view's own, each next one turned by an equal angle. Of AOVs on a scale, each frame has one of
    its own. ``finished`` as of ``still``.
    """
    buffer = io.BytesIO()
    write_animation(buffer, _frames(shown, asked, finished), asked.frames, asked.format)
    return buffer.getvalue()


def work(asked: Still | Turntable) -> int:
    """The number of camera rays that are traced for a file."""
    count = asked.frames if isinstance(asked, Turntable) else 1
    return count * sum(wanted.work for wanted in _full(_view(asked, asked.m)))


def turned(m: list[float], pivot: NDArray[np.float64], axis: NDArray[np.float64], angle: float) -> list[float]:
    """The camera's matrix ``m`` (16) turned by ``angle`` (radians) about the line through ``pivot`` along the unit
    vector ``axis``, anticlockwise as seen against it. An angle of 0 gives ``m`` to the bit.
    """
    if angle == 0.0:
        return m
    columns = np.array(m, np.float64).reshape(4, 4)
    vectors = columns[:, :3]
    with np.errstate(over="ignore", invalid="ignore"):  # the camera refuses what is not finite
        vectors[3] -= pivot
        vectors[:] = rotated(vectors, axis, angle)
        vectors[3] += pivot
    return [float(value) for value in columns.ravel()]


class Exporter:
    """The files that one page asks for: one at a time, made on ``threads`` and sent in pieces.

    The page is told of the share that is done, and by a share of null that no file comes.
    """

    def __init__(
        self, tell: Callable[..., Awaitable[None]], binary: Callable[[bytes], Awaitable[None]], threads: Executor
    ) -> None:
        self._tell, self._binary, self._threads = tell, binary, threads
        self._asked: asyncio.Queue[tuple[ShownScene, Still | Turntable]] = asyncio.Queue()
        self._busy = self._stopped = False

    def begin(self, shown: ShownScene, asked: Still | Turntable) -> None:
        """Start a file. Raises ``ValueError`` while another is under way, and for a bad camera."""
        expect(not self._busy, asked.type, "one file at a time", "another one while one is made")
        camera_of(asked.m, asked.fovy, height=asked.height)
        if isinstance(asked, Still) and asked.format != "png":
            _expect_format(asked)
        self._busy, self._stopped = True, False
        self._asked.put_nowait((shown, asked))

    def stop(self) -> None:
        """Cancel the file under way, if there is one: after the current tiles, and between pieces."""
        self._stopped = True

    async def run(self, complain: Callable[[Exception], Awaitable[None]]) -> None:
        """Make files until cancelled; ``complain`` sends errors to the page."""
        while True:
            shown, asked = await self._asked.get()
            try:
                await self._send(asked, await self._made(shown, asked))
            except Exception as error:  # where the connection itself has failed, telling raises that again
                self._busy = False
                await self._tell(type="export", seq=asked.seq, done=None)
                if not isinstance(error, StoppedError):
                    await complain(error)
            self._busy = False

    async def _made(self, shown: ShownScene, asked: Still | Turntable) -> bytes:
        left, done, whole = False, 0.0, work(asked)

        def finished(rays: float) -> None:
            nonlocal done
            done += rays
            if left:
                raise StoppedError

        def make() -> bytes:
            finished(0)  # it may have been stopped while it waited for its turn
            return still(shown, asked, finished) if isinstance(asked, Still) else turntable(shown, asked, finished)

        running = asyncio.get_running_loop().run_in_executor(self._threads, make)
        running.add_done_callback(_heard)
        try:
            while not running.done():
                await self._tell(type="export", seq=asked.seq, done=min(done / whole, 1.0))
                await asyncio.wait({running}, timeout=_PROGRESS)
                self._expect_wanted()
            return running.result()
        finally:
            left = True

    async def _send(self, asked: Still | Turntable, file: bytes) -> None:
        for step, first in enumerate(range(0, len(file), _PIECE)):
            self._expect_wanted()
            piece = file[first : first + _PIECE]
            last, rows = first + _PIECE >= len(file), Rows(first, len(piece), len(file))
            await self._binary(packed(FILE, asked, step, last, asked.w, rows, (0.0, 0.0)) + piece)

    def _expect_wanted(self) -> None:
        if self._stopped:
            raise StoppedError


def _expect_format(asked: Still) -> None:
    """Refuse a format that the picture cannot have, or that this machine cannot write."""
    expect(asked.settings.aov == "color", asked.format, "the picture in colour", repr(asked.settings.aov))
    if asked.format == "exr":
        check_exr()


def _heard(ended: "asyncio.Future[Any]") -> None:
    """Retrieve the error of a cancelled task, so that asyncio does not report it."""
    if not ended.cancelled():
        ended.exception()


def _frames(shown: ShownScene, asked: Turntable, finished: Callable[[float], object]) -> Iterator[NDArray[np.uint8]]:
    pivot, axis = np.array(asked.pivot, np.float64), unit(asked.axis)
    for step in range(asked.frames):
        m = turned(asked.m, pivot, axis, 2.0 * math.pi * step / asked.frames)
        yield _pixels(shown, _view(asked, m), finished)


def _view(asked: Still | Turntable, m: list[float]) -> CameraMessage:
    return CameraMessage(
        type="view",
        seq=asked.seq,
        mode="octree",
        m=m,
        fovy=asked.fovy,
        height=asked.height,
        w=asked.w,
        h=asked.h,
        settings=asked.settings,
    )


def _full(view: CameraMessage) -> list[Pass]:
    """The passes that together are the full picture: bands of rows of a large one, for the memory that they take."""
    return [wanted for wanted in passes_of(view) if (wanted.last or wanted.band) and not wanted.refines]


def _rows(wanted: Pass) -> tuple[int, int]:
    return wanted.band or (0, wanted.size[1])


def _pixels(shown: ShownScene, view: CameraMessage, finished: Callable[[float], object]) -> NDArray[np.uint8]:
    """The picture's colours, (h, w, 3)."""
    rgb = np.empty((view.h, view.w, 3), np.uint8)
    for wanted in _full(view):
        first, end = _rows(wanted)
        rgb[first:end], *_ = colored(shown, view, wanted, _in_rays(finished, wanted.work))
    return rgb


def _cut_out(shown: ShownScene, view: CameraMessage, finished: Callable[[float], object]) -> NDArray[np.uint8]:
    """The picture's colours without its background, (h, w, 4)."""
    rgba = np.empty((view.h, view.w, 4), np.uint8)
    for wanted in _full(view):
        first, end = _rows(wanted)
        image = picture(shown, view, wanted, _in_rays(finished, wanted.work))
        matte = matte_of(*traced_by(shown, view, wanted), shown.threads, lambda _: finished(0), wanted.band)
        rgba[first:end] = cut_out(image.radiance, matte.exposed(view.settings.exposure))
    return rgba


def _exr(shown: ShownScene, view: CameraMessage, finished: Callable[[float], object]) -> bytes:
    """The picture with its depth and normals, as ``Image.save`` writes it."""
    parts = [picture(shown, view, wanted, _in_rays(finished, wanted.work), PLANES) for wanted in _full(view)]
    planes: Any = {name: np.concatenate([getattr(part, name) for part in parts]) for name in PLANES}
    return exr_of(replace(parts[0], **planes), Path.cwd())


def _in_rays(finished: Callable[[float], object], rays: int) -> Callable[[float], object]:
    return lambda share: finished(share * rays)
