"""One page's connection: its newest view is shown pass by pass, its clicks answered, its scene changed.

Messages arrive on the event loop and are only noted there; pictures are computed on threads, so that no message waits
for them. Of messages that arrive faster than they can be answered only the newest counts.
"""

import asyncio
import json
import threading
from collections.abc import Awaitable, Callable, Collection
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

from renderer.errors import expect
from renderer.scene.hide import is_side, object_names
from renderer.viewer.commands import command_of, saved, scene_text
from renderer.viewer.compare import Comparison
from renderer.viewer.export import Exporter
from renderer.viewer.growth import Growth
from renderer.viewer.measure import measured
from renderer.viewer.passes import Answer, Pass, answer, passes_of
from renderer.viewer.pick import picked
from renderer.viewer.probe import probed
from renderer.viewer.protocol import (
    SLOW,
    Ack,
    AskCommand,
    CameraMessage,
    Cancel,
    Hello,
    HideObjects,
    Measure,
    OpenScene,
    Pick,
    Probe,
    SaveCamera,
    SaveScene,
    Still,
    Stop,
    Turntable,
    parse,
)
from renderer.viewer.shown import ShownScene
from renderer.viewer.viewpoint import camera_of

# Seconds between messages of progress: ten per second look smooth and cost nothing.
_PROGRESS = 0.1

T = TypeVar("T")


class SupersededError(Exception):
    """Raised between tiles when a newer view replaces the picture."""


class Newest(Generic[T]):
    """A place for one item, where a newer one takes the place of one not yet taken."""

    def __init__(self) -> None:
        self._item: T | None = None
        self._came = asyncio.Event()

    def offer(self, item: T) -> None:
        """Leave ``item``, unless one is there that is not yet taken."""
        if self._item is None:
            self.put(item)

    def put(self, item: T | None) -> None:
        """Leave ``item``. None leaves nothing, but makes the item that was taken last outdated all the same."""
        self._item = item
        self._came.set()

    async def take(self) -> T:
        """The newest item, once there is one."""
        while self._item is None:
            self._came.clear()
            await self._came.wait()
        item, self._item = self._item, None
        self._came.clear()
        return item

    async def changed(self) -> None:
        """Return at the next ``put``, or now if one came since the last ``take``."""
        await self._came.wait()


class Reload:
    """A request to load the shown scene again from its files; no page sends it."""


class SceneHost(Protocol):
    """The holder of the scenes that connections show; ``files`` computes the files that pages ask for."""

    id: str
    shown: ShownScene
    files: Executor

    async def open(self, file: str, fresh: bool) -> ShownScene:
        """The scene of one of the files offered, or for "" the server's own; loaded anew where it was edited since it
        was loaded, and always if ``fresh``. Raises ``ValueError``.
        """

    async def reload(self, shown: ShownScene) -> ShownScene:
        """The scene of the file of ``shown``, loaded anew where it was edited. Raises ``ValueError``."""

    async def hide(self, shown: ShownScene, hidden: Collection[str]) -> ShownScene:
        """``shown`` without those of its objects. Raises ``ValueError``."""

    def is_dropped(self, shown: ShownScene) -> bool:
        """Whether its files came from a page, and go with the server."""


@dataclass
class Connection:
    """The functions that send messages to the page."""

    text: Callable[[str], Awaitable[None]]
    binary: Callable[[bytes], Awaitable[None]]


@dataclass(eq=False)
class Session:
    """One connection, which shows a scene of its own: at first the server's.

    ``threads`` computes a picture, the one before it whose last tiles end, a click, a distance, the value
    under the pointer, and a scene file to save.
    """

    host: SceneHost
    connection: Connection
    threads: Executor
    views: Newest[CameraMessage] = field(default_factory=Newest)
    picks: Newest[Pick] = field(default_factory=Newest)
    probes: Newest[Probe] = field(default_factory=Newest)
    measures: Newest[Measure] = field(default_factory=Newest)
    saves: Newest[SaveScene] = field(default_factory=Newest)
    scenes: Newest[Hello | OpenScene | HideObjects | Reload] = field(default_factory=Newest)

    def __post_init__(self) -> None:
        self.shown = self.host.shown
        self.exporter = Exporter(self._tell, self.connection.binary, self.host.files)
        self._outdated = False  # whether what is shown was edited, and no reload begun
        self._awaited: tuple[int, int] | None = None
        self._proof: tuple[int, Comparison] | None = None
        self._told_at = 0.0
        self._acknowledged = asyncio.Event()
        self._acknowledged.set()
        self._leaving: set[asyncio.Future[Any]] = set()

    async def receive(self, text: str) -> None:
        """Take one message; send the page an error if it is bad."""
        try:
            message = parse(text)
            if isinstance(message, CameraMessage):
                camera_of(message.m, message.fovy, height=message.height)
                self.views.put(message)
            elif isinstance(message, Ack):
                if (message.seq, message.step) == self._awaited:
                    self._acknowledged.set()
            elif isinstance(message, Cancel):
                self.views.put(None)
            elif isinstance(message, Pick):
                self.picks.put(message)
            elif isinstance(message, Probe):
                self.probes.put(message)
            elif isinstance(message, Measure):
                self.measures.put(message)
            elif isinstance(message, SaveCamera):
                await self._tell(type="camera", name="camera.toml", text=saved(self.shown, message))
            elif isinstance(message, SaveScene):
                self.saves.put(message)
            elif isinstance(message, AskCommand):
                dropped = self.host.is_dropped(self.shown)
                expect(
                    not dropped,
                    "command",
                    "a file in a folder of yours",
                    "one that this page has opened, of which there is a copy",
                )
                await self._tell(type="command", text=command_of(self.shown, message))
            elif isinstance(message, Still | Turntable):
                self.exporter.begin(self.shown, message)
            elif isinstance(message, Stop):
                self.exporter.stop()
            elif isinstance(message, Hello | OpenScene | HideObjects):
                self.scenes.put(message)
        except ValueError as error:
            await self.complain(error)

    async def run(self) -> None:
        """Show views, answer clicks, open scenes and make files until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._show_views())
            tasks.create_task(self._answer(self.picks, self._picked))
            tasks.create_task(self._answer(self.probes, probed))
            tasks.create_task(self._answer(self.measures, measured))
            tasks.create_task(self._save_scenes())
            tasks.create_task(self._open_scenes())
            tasks.create_task(self.exporter.run(self.complain))

    async def complain(self, error: Exception, **more: bool) -> None:
        """Send the page an error's message, on one line; with ``stays=True`` one that holds until the next scene."""
        await self._tell(type="error", message=" ".join(str(error).split()) or type(error).__name__, **more)

    def reload(self) -> None:
        """Show the scene as its files have it now, after what the page waits for."""
        self._outdated = True
        self.scenes.offer(Reload())

    async def show_scene(self, shown: ShownScene) -> None:
        """Show ``shown`` from now on, and say which that is. Views of the one before are dropped."""
        self.shown, self._proof, self._outdated = shown, None, False
        self.views.put(None)
        await self._tell(type="scene", id=shown.id)

    async def _show_views(self) -> None:
        while True:
            # No view is begun before the page has drawn the last picture: by then there may be a newer one.
            await self._acknowledged.wait()
            view = await self.views.take()
            try:
                await self._show_view(view)
            except SupersededError:
                pass
            except Exception as error:  # where the connection itself has failed, complaining raises that again
                await self.complain(error)

    async def _show_view(self, view: CameraMessage) -> None:
        """Compute and send all passes of a view."""
        passes, growth = passes_of(view, self.shown.threads), Growth()
        refined = passes and passes[-1].refines
        whole, done = sum(wanted.work for wanted in passes if not wanted.refines), 0
        for wanted in passes:
            made = await self._show(view, wanted, (done / whole, wanted.work / whole))
            done += wanted.work
            if told := growth.add(wanted, made.colors) if refined and made.colors is not None else None:
                await self._tell(**told, seq=view.seq)

    async def _show(self, view: CameraMessage, wanted: Pass, span: tuple[float, float]) -> Answer:
        """Compute and send one pass, which is that ``span`` of the view's work: its begin and its share.

        The first of a view is always shown, however fast views come, or a slow machine would show none while the camera
        moves. That of a slow mode is not, because it takes seconds.
        """
        stubborn = wanted.step == 0 and view.mode not in SLOW
        if view.mode in SLOW and self._leaving:
            # One such picture at a time: the tiles under way of the last one end first.
            await self._unless_newer(asyncio.wait(self._leaving))
        made = await self._computed(view, wanted, stubborn, span)
        if not stubborn:
            await self._unless_newer(self._acknowledged.wait())
        # Before any acknowledgement is waited for: of what cannot be told there comes none.
        told = None if made.told is None else _as_text(made.told)
        self._awaited = view.seq, wanted.step
        self._acknowledged.clear()
        if made.comparison is not None:
            self._proof = view.seq, made.comparison
        if told is not None:
            await self.connection.text(told)
        await self.connection.binary(made.message)
        return made

    async def _computed(self, view: CameraMessage, wanted: Pass, stubborn: bool, span: tuple[float, float]) -> Answer:
        """The pass's answer. A newer view does not wait for the tiles under way, which end soon; no others begin."""
        shown, left, done = self.shown, threading.Event(), 0.0

        def finished(share: float) -> None:
            nonlocal done
            done += share
            if left.is_set():
                raise SupersededError

        running = asyncio.get_running_loop().run_in_executor(self.threads, answer, shown, view, wanted, finished)
        self._leaving.add(running)
        running.add_done_callback(self._left)
        try:
            while not stubborn and not running.done():
                await self._unless_newer(asyncio.wait({running}, timeout=_PROGRESS))
                await self._tell_progress(view, span[0] + span[1] * done)
            return await asyncio.shield(running)
        finally:
            left.set()

    async def _tell_progress(self, view: CameraMessage, done: float) -> None:
        """Send the progress of a slow view, at most ten times a second."""
        now = asyncio.get_running_loop().time()
        if view.mode in SLOW and now - self._told_at >= _PROGRESS:
            self._told_at = now
            await self._tell(type="progress", seq=view.seq, done=min(done, 1.0))

    def _left(self, ended: asyncio.Future[Answer]) -> None:
        self._leaving.discard(ended)
        if not ended.cancelled():
            ended.exception()  # asked for, so that none is reported as lost

    async def _unless_newer(self, awaited: Awaitable[Any]) -> None:
        """Wait for it; raise ``SupersededError`` as soon as there is a newer view."""
        newer, wanted = asyncio.ensure_future(self.views.changed()), asyncio.ensure_future(awaited)
        try:
            await asyncio.wait({newer, wanted}, return_when=asyncio.FIRST_COMPLETED)
            if newer.done():
                raise SupersededError
        finally:
            newer.cancel()
            wanted.cancel()

    async def _answer(self, asked: Newest[T], answer: Callable[[ShownScene, T], dict[str, Any]]) -> None:
        """Answer the newest question of a kind, one at a time."""
        while True:
            question = await asked.take()
            try:
                running = asyncio.get_running_loop().run_in_executor(self.threads, answer, self.shown, question)
                await self._tell(**await running)
            except Exception as error:  # as above
                await self.complain(error)

    async def _save_scenes(self) -> None:
        while True:
            asked, shown = await self.saves.take(), self.shown
            try:
                running = asyncio.get_running_loop().run_in_executor(self.threads, scene_text, shown, asked)
                await self._tell(type="saved", **(await running)._asdict())
            except Exception as error:  # as above
                await self.complain(error)

    def _picked(self, shown: ShownScene, pick: Pick) -> dict[str, Any]:
        return picked(shown, pick, self._proof_of(pick))

    def _proof_of(self, pick: Pick) -> Comparison | None:
        """The comparison that the click is on."""
        return self._proof[1] if self._proof is not None and self._proof[0] == pick.proof else None

    async def _open_scenes(self) -> None:
        while True:
            wanted = await self.scenes.take()
            try:
                shown = await self._wanted(wanted)
                if shown is not self.shown or not isinstance(wanted, Reload):
                    await self.show_scene(shown)
            except Exception as error:  # as above
                # What is shown is older than its file for as long as that cannot be loaded.
                await self.complain(error, **({"stays": True} if isinstance(wanted, Reload) else {}))
                if isinstance(wanted, Hello):  # a page that begins has no scene to go on with
                    await self.show_scene(self.shown)
                elif self._outdated:  # and one that goes on has to be as its file is
                    self.scenes.offer(Reload())

    async def _wanted(self, wanted: Hello | OpenScene | HideObjects | Reload) -> ShownScene:
        """The scene that the page is to see."""
        if isinstance(wanted, Reload):
            before, self._outdated = self.shown, False
            shown = await self.host.reload(before.whole)
            return before if shown is before.whole else await self._without(shown, before.hidden)
        if isinstance(wanted, HideObjects):
            return await self.host.hide(self.shown, wanted.hidden)
        if isinstance(wanted, OpenScene):
            return await self.host.open(wanted.file, fresh=True)
        # A page of another server's begins anew here.
        shown = await self.host.open(wanted.file if wanted.server == self.host.id else "", fresh=False)
        return await self._without(shown, wanted.hidden)

    async def _without(self, shown: ShownScene, hidden: Collection[str]) -> ShownScene:
        """``shown`` without those of the objects that it has."""
        known = object_names(shown.whole.scene)
        objects = [name for name in hidden if name in known]
        # What is hidden stays so where the file was edited, unless nothing else is left in it.
        if len(objects) == len(known):
            return shown
        return await self.host.hide(shown, [*objects, *filter(is_side, hidden)])

    async def _tell(self, **message: Any) -> None:
        await self.connection.text(_as_text(message))


def _as_text(message: dict[str, Any]) -> str:
    """The message as JSON. Raises ``ValueError`` for numbers that JSON has not."""
    return json.dumps(message, allow_nan=False)
