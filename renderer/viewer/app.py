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

    async def open(self, file: str, fresh: bool) -> ShownScene:
        """The scene of one of the files offered, as ``SceneHost`` says."""
        async with self._one_opens:
            return self._kept(await run_in_threadpool(_opened, self.shown, self._known(), file, fresh))

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

    def _asked_for(self, request: Request) -> ShownScene:
        """The scene with the id of the request, by default the server's own. Raises a 404 if it is gone."""
        wanted = request.query_params.get("id", self.shown.id)
        if (shown := self._scenes.get(wanted)) is None:
            raise HTTPException(404, f"id: expected that of a scene that is shown, got {wanted[:40]!r}")
        return shown

    async def description(self, request: Request) -> Response:
        """GET /scene?id=ID."""
        told = await run_in_threadpool(description, self._asked_for(request))
        return JSONResponse(told | {"server": self.id})

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
        """Start no more computations."""
        for threads in (self._threads, self.files):
            threads.shutdown(wait=False, cancel_futures=True)


def _opened(own: ShownScene, known: list[ShownScene], file: str, fresh: bool) -> ShownScene:
    """The scene of ``file`` beside the server's ``own``: one of ``known`` that is up to date, or a new one."""
    if own.path is None and not fresh:
        return own
    path = own.beside(file) if fresh or file in own.files else own.path
    assert path is not None  # which mypy cannot tell
    return _loaded(known, path) if fresh else _unedited(known, path)


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
