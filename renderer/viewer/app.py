"""The server's routes: the page, the data that it fetches, and the WebSocket."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Collection
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import Any
from weakref import WeakValueDictionary

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from renderer.viewer.drops import MOST_BYTES, SUFFIXES, Drops, arrange
from renderer.viewer.payload import Payload, boxes_payload, description, mesh_payload
from renderer.viewer.security import ResponseHeaders, SameOrigin, TokenRequired, allowed_hosts
from renderer.viewer.session import Connection, Session
from renderer.viewer.shown import ShownScene, hiding, open_file
from renderer.viewer.watch import follow

PAGE = Path(__file__).parent / "page"
# Each connection may keep all processors busy; beyond this many, pictures would come too slowly for all.
MAX_CONNECTIONS = 16
# Threads per session: for its picture under way, the one before it whose last tiles end, a click,
# a distance, the value under the pointer, and a file to save.
_THREADS_A_SESSION = 6
_TRY_LATER = 1013  # RFC 6455's registry of close codes


class Viewer:
    """The state that all connections share: the scene that new ones show, and the threads that compute.

    A connection holds the scene that it shows; ``_scenes`` finds it by its id as long as one does.
    """

    def __init__(self, shown: ShownScene) -> None:
        self.id = token_hex(8)  # which no other server has
        self.shown = shown
        self._scenes = WeakValueDictionary({shown.id: shown})
        self.sessions: set[Session] = set()
        self._threads = ThreadPoolExecutor(_THREADS_A_SESSION * MAX_CONNECTIONS, "viewer")
        # One file is computed at a time, for whichever page: each takes some 100 MB and all processors.
        self.files: Executor = ThreadPoolExecutor(1, "viewer-files")
        self._one_opens = asyncio.Lock()
        self._drops = Drops()
        self._dropped: ShownScene | None = None  # the last one, until its page opens it

    async def open(self, file: str, fresh: bool) -> ShownScene:
        """The scene of one of the files offered, as ``SceneHost`` says."""
        async with self._one_opens:
            dropped, self._dropped = self._dropped, None
            if dropped is not None and dropped.name == file:
                return dropped
            return self._kept(await run_in_threadpool(self._opened, file, fresh))

    def _opened(self, file: str, fresh: bool) -> ShownScene:
        """The scene of ``file``: one that is shown and up to date, or a new one; always that if ``fresh``."""
        path = self._path(file, fresh)
        if path is None:
            return self.shown
        return _loaded(self._known(), path) if fresh else _unedited(self._known(), path)

    def _path(self, file: str, fresh: bool) -> Path | None:
        """The path of one of ``files``, which any other file is an error for if ``fresh``, and else the server's own;
        None for a scene made in Python.
        """
        own = self.shown
        if file in self._drops.paths:
            return self._drops.paths[file]
        if own.path is None and (not fresh or file in self.offered):
            return None
        return own.beside(file) if fresh or file in own.files else own.path

    @property
    def offered(self) -> list[str]:
        """The files that pages may open: the server's own and those beside it, then those that were dropped."""
        dropped = self._drops.paths
        return [*(self.shown.files or [self.shown.name] * bool(dropped)), *dropped]

    async def reload(self, shown: ShownScene) -> ShownScene:
        """The scene of the file of ``shown`` as it is now, as ``SceneHost`` says."""
        async with self._one_opens:
            return self._kept(await run_in_threadpool(_current, shown, self._known()))

    def _known(self) -> list[ShownScene]:
        return [self.shown, *(session.shown.whole for session in self.sessions)]

    def _kept(self, shown: ShownScene) -> ShownScene:
        """Keep ``shown`` so that its id finds it; it replaces the server's own scene if both have one file."""
        if shown.path == self.shown.path:
            self.shown = shown
        self._scenes[shown.id] = shown
        return shown

    async def hide(self, shown: ShownScene, hidden: Collection[str]) -> ShownScene:
        """``shown`` without those objects, as ``SceneHost`` says."""
        async with self._one_opens:
            shown = await run_in_threadpool(hiding, shown, hidden)
            self._scenes[shown.id] = shown
            return shown

    def is_dropped(self, shown: ShownScene) -> bool:
        """As ``SceneHost`` says."""
        return shown.path in self._drops.paths.values()

    def _asked_for(self, request: Request) -> ShownScene:
        """The scene with the id of the request, by default the server's own. Raises a 404 if it is gone."""
        wanted = request.query_params.get("id", self.shown.id)
        if (shown := self._scenes.get(wanted)) is None:
            raise HTTPException(404, f"id: expected that of a scene that is shown, got {wanted[:40]!r}")
        return shown

    async def description(self, request: Request) -> Response:
        """GET /scene?id=ID."""
        told = await run_in_threadpool(description, self._asked_for(request))
        files = await run_in_threadpool(lambda: self.offered)
        return JSONResponse(
            told | {"server": self.id, "files": files, "drop": {"most": MOST_BYTES, "suffixes": SUFFIXES}}
        )

    async def drop(self, request: Request) -> Response:
        """POST /drop?files=[[NAME, BYTES], ...], with the files one after the other: the name of the scene to open."""
        listed = request.query_params.get("files", "")
        try:
            async with self._drops.received(listed, request.stream()) as arrived, self._one_opens:
                shown = await run_in_threadpool(lambda: open_file(arrange(arrived, self.offered)))
                self._drops.paths[shown.name] = arrived.folder / shown.name
                self._dropped = self._kept(shown)
        except Exception as error:  # whatever is wrong with the files
            # Of what is refused no more is read.
            return PlainTextResponse(" ".join(str(error).split()), 400, {"Connection": "close"})
        return JSONResponse({"file": shown.name})

    async def mesh(self, request: Request) -> Response:
        """GET /mesh?id=ID."""
        return _stream(mesh_payload(self._asked_for(request).prepared))

    async def boxes(self, request: Request) -> Response:
        """GET /octree?id=ID&level=K."""
        shown, level = self._asked_for(request), request.query_params.get("level", "0")
        # No tree has levels of three digits.
        if not (level.isascii() and level.isdigit() and len(level) < 3):
            return PlainTextResponse(f"level: expected an integer from 0 to 99, got {level[:40]!r}", 400)
        return _stream(await run_in_threadpool(boxes_payload, shown.prepared, int(level)))

    async def connect(self, socket: WebSocket) -> None:
        """The WebSocket: one session, until the page leaves."""
        with suppress(WebSocketDisconnect):  # a page may leave before its answer
            await socket.accept()
            session = Session(self, Connection(_telling(socket.send_text), _telling(socket.send_bytes)), self._threads)
            if len(self.sessions) < MAX_CONNECTIONS:
                return await self._attend(socket, session)
            await session.complain(ValueError(f"connections: expected at most {MAX_CONNECTIONS}, got another"))
            await socket.close(_TRY_LATER)

    async def _attend(self, socket: WebSocket, session: Session) -> None:
        self.sessions.add(session)
        running = asyncio.create_task(session.run())
        try:
            await _receive_all(socket, session)
        finally:
            self.sessions.discard(session)
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)

    async def stop(self) -> None:
        """Start no more computations, and keep nothing that was dropped."""
        for threads in (self._threads, self.files):
            threads.shutdown(wait=False, cancel_futures=True)
        self._drops.close()


def _current(shown: ShownScene, known: list[ShownScene]) -> ShownScene:
    """``shown``, or a new scene if its files were edited since."""
    return shown if shown.path is None else _unedited([shown, *known], shown.path)


def _unedited(known: list[ShownScene], path: Path) -> ShownScene:
    """The scene of the file: one of ``known`` that is up to date, or a new one."""
    for scene in known:
        if scene.path == path and not scene.edited:
            return scene
    return _loaded(known, path)


def _loaded(known: list[ShownScene], path: Path) -> ShownScene:
    """The scene of the file, loaded again; a mesh file keeps its axis ``up``."""
    return open_file(path, next((scene.up for scene in known if scene.path == path), None))


def _stream(payload: Payload) -> Response:
    headers = {"Content-Length": str(payload.size)}
    return StreamingResponse(payload.pieces, media_type="application/octet-stream", headers=headers)


def _telling(send: Callable[[Any], Awaitable[None]]) -> Callable[[Any], Awaitable[None]]:
    """``send``, which raises ``WebSocketDisconnect`` instead of ``RuntimeError`` when the page has gone."""

    async def tell(message: Any) -> None:
        try:
            await send(message)
        except RuntimeError as error:
            raise WebSocketDisconnect from error

    return tell


async def _receive_all(socket: WebSocket, session: Session) -> None:
    """Pass messages to the session until the page leaves."""
    while (message := await socket.receive())["type"] == "websocket.receive":
        if message.get("text") is not None:
            await session.receive(message["text"])
        else:
            await session.complain(ValueError(f"message: expected JSON text, got {len(message['bytes'])} bytes"))


def make_app(shown: ShownScene, host: str, port: int, token: str | None, ancestors: str) -> Starlette:
    """The application that shows ``shown`` on ``host`` and ``port``; without ``token``, to every client.

    ``ancestors`` is the content security policy's rule about frames around the page.
    """
    viewer = Viewer(shown)

    @asynccontextmanager
    async def lifespan(_app: Starlette) -> AsyncIterator[None]:
        following = asyncio.create_task(follow(viewer.sessions))
        yield
        following.cancel()
        await viewer.stop()

    return Starlette(
        routes=[
            Route("/", lambda _request: FileResponse(PAGE / "index.html")),
            Route("/scene", viewer.description),
            Route("/mesh", viewer.mesh),
            Route("/octree", viewer.boxes),
            Route("/drop", viewer.drop, methods=["POST"]),
            WebSocketRoute("/ws", viewer.connect),
            Mount("/static", StaticFiles(directory=PAGE)),
        ],
        middleware=[
            Middleware(ResponseHeaders, ancestors=ancestors),
            Middleware(TrustedHostMiddleware, allowed_hosts=allowed_hosts(host, token), www_redirect=False),
            Middleware(SameOrigin, token_required=token is not None),
            Middleware(TokenRequired, token=token, port=port),
        ],
        lifespan=lifespan,
    )
