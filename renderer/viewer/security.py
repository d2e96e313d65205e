"""The rules of access, which hold before any route is reached, whether for HTTP or for the WebSocket.

A page of another site can send requests to this machine, but it cannot forge Host and Origin: a foreign Host means a
foreign name made to point here (DNS rebinding), a foreign Origin a foreign page. Where other machines may connect too,
only those that know the token are served.
"""

import hmac
import ipaddress
import secrets
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOOPBACK = ("127.0.0.1", "localhost", "[::1]", "::1")
# The methods of HTTP by which a page may ask for anything: it reads no answer of another origin.
_READING = ("GET", "HEAD")


def is_loopback(address: str) -> bool:
    """Whether only this machine reaches the IP ``address``; a name may point anywhere, so it is resolved before."""
    return ipaddress.ip_address(address).is_loopback


def allowed_hosts(host: str, token: str | None) -> list[str]:
    """Names by which a page may call a server asked to listen on ``host``.

    With a token it may have any name: the token, which no foreign page knows, is the guard there.
    """
    return [*LOOPBACK, host] if token is None else ["*"]


def new_token() -> str:
    """256 random bits, as text for a URL."""
    return secrets.token_urlsafe(32)


class ResponseHeaders:
    """Headers that let the page load from here alone and be framed by ``ancestors``, and keep it out of caches."""

    def __init__(self, app: ASGIApp, ancestors: str) -> None:
        self.app = app
        # blob: and data: are pictures that the page itself makes.
        policy = f"default-src 'self'; img-src 'self' blob: data:; base-uri 'none'; form-action 'none'; {ancestors}"
        self.headers = {
            "Content-Security-Policy": policy,
            "X-Content-Type-Options": "nosniff",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Referrer-Policy": "no-referrer",  # the address may hold the token
            "Cache-Control": "no-store",
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_with_headers(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                MutableHeaders(scope=message).update(self.headers)
            await send(message)

        await self.app(scope, receive, send_with_headers)


class SameOrigin:
    """Refuse what changes something, a WebSocket or a POST, of a page that did not come from here: 403 unless Origin
    names this Host.

    Programs send no Origin; they are let in where ``token_required``, because ``TokenRequired`` checks them.
    """

    def __init__(self, app: ASGIApp, token_required: bool) -> None:
        self.app, self.token_required = app, token_required

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket" or (scope["type"] == "http" and scope["method"] not in _READING):
            headers = Headers(scope=scope)
            origin, host = headers.get("origin"), headers.get("host")
            # Neither names anything in "Origin: null" without a Host.
            same = self.token_required if origin is None else host is not None and _authority(origin) == host
            if not same:
                refusal = PlainTextResponse(f"Origin: expected {host}, got {origin}", 403)
                return await refusal(scope, receive, send)
        await self.app(scope, receive, send)


def _authority(origin: str) -> str | None:
    """Host and port of an http or https origin."""
    try:
        parts = urlsplit(origin)
    except ValueError:
        return None
    return parts.netloc if parts.scheme in ("http", "https") else None


class TokenRequired:
    """Serve only requests with the token: in the address (``?token=``), or in the cookie that the answer then sets.

    The cookie is there for the files that the page loads by plain links. Its name has the port, because cookies of one
    host reach all its ports.
    """

    def __init__(self, app: ASGIApp, token: str | None, port: int) -> None:
        self.app, self.token, self.cookie = app, token, f"octree-render-{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if self.token is None or scope["type"] not in ("http", "websocket"):
            return await self.app(scope, receive, send)
        if not any(_equal(given, self.token) for given in self._given(scope)):
            refusal = PlainTextResponse("token: expected the one in the address that octree-render printed", 403)
            return await refusal(scope, receive, send)

        async def send_with_cookie(message: Message) -> None:
            if message["type"] == "http.response.start":
                value = f"{self.cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/"
                MutableHeaders(scope=message).append("Set-Cookie", value)
            await send(message)

        await self.app(scope, receive, send_with_cookie)

    def _given(self, scope: Scope) -> list[str]:
        came = HTTPConnection(scope)
        return [*came.query_params.getlist("token"), came.cookies.get(self.cookie, "")]


def _equal(given: str, token: str) -> bool:
    """Whether both are equal, compared in a time that does not depend on how much of them is."""
    return hmac.compare_digest(given.encode("utf-8", "replace"), token.encode())
