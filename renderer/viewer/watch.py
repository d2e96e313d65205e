"""Files that are watched: scenes are loaded again soon after they were edited."""

import asyncio
import logging
from collections.abc import Iterable, Mapping
from pathlib import Path

from starlette.concurrency import run_in_threadpool

from renderer.viewer.session import Session
from renderer.viewer.shown import ShownScene

# Seconds between looks, each of a microsecond a file. An edit is taken over once it has rested for one turn, so that
# none is read while its editor still writes.
PERIOD = 0.5
Marks = Mapping[Path, object]
_log = logging.getLogger(__name__)


class Watch:
    """The files of scenes on show, as they were seen last."""

    def __init__(self) -> None:
        self._seen: Mapping[ShownScene, Marks] = {}
        self._taken: Mapping[ShownScene, Marks] = {}

    def edited(self, scenes: Iterable[ShownScene]) -> set[ShownScene]:
        """Those of ``scenes`` whose files have changed, and rested since the last call. Each change is told once, also
        where the scene cannot be loaded from it.
        """
        now = {scene: scene.marks_now() for scene in set(scenes)}
        rested = {scene for scene, marks in now.items() if marks != scene.marks and marks == self._seen.get(scene)}
        told = {scene for scene in rested if now[scene] != self._taken.get(scene)}
        # Of scenes that are not shown any more nothing is kept.
        self._taken = {scene: now[scene] for scene in rested}
        self._seen = now
        return told


async def follow(sessions: set[Session]) -> None:
    """Let sessions show edited scenes anew, until cancelled."""
    watch = Watch()
    while True:
        await asyncio.sleep(PERIOD)
        try:
            await _look(watch, sessions)
        except Exception:  # or no page would see an edit from then on
            _log.exception("the files on show could not be looked at")


async def _look(watch: Watch, sessions: set[Session]) -> None:
    if not sessions:
        return
    edited = await run_in_threadpool(watch.edited, [session.shown for session in sessions])
    for session in tuple(sessions):
        if session.shown in edited:
            try:
                session.reload()
            except Exception:  # as above, for the other pages
                _log.exception("an edited scene could not be loaded again")
