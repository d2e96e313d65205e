"""The server in a thread of its own: its socket, its address and its end."""

import logging
import os
import socket
import threading
import webbrowser
from types import TracebackType

import uvicorn

from renderer.errors import expect
from renderer.viewer.app import make_app
from renderer.viewer.protocol import MAX_MESSAGE_BYTES
from renderer.viewer.security import is_loopback, new_token
from renderer.viewer.shown import ShownScene

# Connections at a time, so that none that wait for nothing take all the process's files: pages open some seven each.
_MOST_CONNECTIONS = 256
# Seconds for connections to end; their pictures stop between tiles.
_LAST_WORDS = 1
# Seconds per turn of ``wait``: on Windows Ctrl-C has no effect before a turn ends.
_PATIENCE = 0.5


class ViewerServer:
    """A scene on show at ``url`` until ``close``. Notebooks show the page itself, by way of a frame.

    Use as a context manager, or call ``wait`` to stay until Ctrl-C.
    """

    def __init__(self, shown: ShownScene, host: str, port: int, framed: bool) -> None:
        """Listen on ``host`` and ``port``, 0 for a free one; ``framed`` lets pages of this machine frame this one.

        On a ``host`` that other machines reach, only requests with the token of the printed address are served.
        Raises ``ValueError`` where the host is none of this machine's or the port is taken.
        """
        listening = _listen(host, port)
        address, port = listening.getsockname()[:2]
        token = None if is_loopback(address) else new_token()
        self.url = _address(host, port, token)
        # The notebook's server is another origin, on a port that is not known here.
        ancestors = "frame-ancestors 'self'" + (" http://127.0.0.1:* http://localhost:*" if framed else "")
        config = uvicorn.Config(
            make_app(shown, host, port, token, ancestors),
            log_config=None,  # the caller's logging is its own
            log_level="error",  # so that a bad client does not fill the screen
            access_log=False,
            server_header=False,
            ws_max_size=MAX_MESSAGE_BYTES,
            ws_per_message_deflate=False,  # pictures on loopback travel faster than they compress
            limit_concurrency=_MOST_CONNECTIONS,
            timeout_graceful_shutdown=_LAST_WORDS,
        )
        logging.getLogger("uvicorn.error").addFilter(_no_mere_refusal)
        logging.getLogger("asyncio").addFilter(_no_lost_client)
        self._server = uvicorn.Server(config)
        self._ended = threading.Event()
        threading.Thread(target=self._run, args=(listening,), name="viewer", daemon=True).start()

    def _run(self, listening: socket.socket) -> None:
        try:
            self._server.run([listening])
        finally:
            self._ended.set()

    def wait(self) -> None:
        """Return once the server has ended, as it does after ``close`` on another thread."""
        # Not by Thread.join: where Ctrl-C interrupts it, Python 3.11 takes the thread for one that has ended.
        while not self._ended.wait(_PATIENCE):
            pass

    def close(self) -> None:
        """End the server; pages say that the connection is lost."""
        self._server.should_exit = True
        self.wait()

    def open_browser(self) -> bool:
        """Show the page in the usual browser; False where there is none."""
        return webbrowser.open(self.url)

    def __enter__(self) -> "ViewerServer":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<viewer at {self.url}>"

    def _repr_html_(self) -> str:
        """The page in a frame; and a link, for notebooks that show no frames of this machine's servers."""
        frame = f'<iframe src="{self.url}" width="100%" height="640" style="border:0" allowfullscreen></iframe>'
        return f'{frame}<p><a href="{self.url}" target="_blank" rel="noopener">{self.url}</a></p>'


def _no_mere_refusal(record: logging.LogRecord) -> bool:
    """Leaves out uvicorn's message on each WebSocket refused by an HTTP answer, which 0.54 takes for an app's error."""
    return record.getMessage() != "ASGI callable returned without completing handshake."


def _no_lost_client(record: logging.LogRecord) -> bool:
    """Leaves out asyncio's message on data that our server sends to a page that has gone."""
    return not (record.threadName == "viewer" and record.getMessage() == "socket.send() raised exception.")


def _listen(host: str, port: int) -> socket.socket:
    """A listening socket. A busy port is an error, because the user expects the page on this port."""
    expect(isinstance(host, str), "host", "a string", type(host).__name__)
    expect(isinstance(port, int) and 0 <= port <= 65535, "port", "an integer from 0 to 65535", repr(port))
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError) as error:
        raise ValueError(f"host: expected a name or address of this machine, got {host!r} ({error})") from None
    listening = socket.socket(family, kind, protocol)
    try:
        if os.name == "posix":  # there it allows a port on which a connection of an ended server still lingers
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen()
    except OSError as error:
        listening.close()
        raise ValueError(f"host and port: expected a free port, got {host}:{port} ({error.strerror})") from None
    return listening


def _address(host: str, port: int, token: str | None) -> str:
    """The address to enter in a browser on this machine."""
    name = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(host, f"[{host}]" if ":" in host else host)
    return f"http://{name}:{port}/" + (f"?token={token}" if token else "")
