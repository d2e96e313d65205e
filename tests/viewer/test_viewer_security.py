"""Who the viewer lets in: each rule tried from outside, by a client that breaks it, on a real server."""

import json
import logging
import re
import socket
import struct
from collections.abc import Iterator
from contextlib import ExitStack
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from cases import cases
from viewer_page import SCENE
from websockets.exceptions import ConnectionClosedError
from websockets.frames import Frame, Opcode
from websockets.sync.client import connect

import renderer
from renderer.viewer.app import MAX_CONNECTIONS
from renderer.viewer.protocol import MAX_MESSAGE_BYTES
from renderer.viewer.server import ViewerServer
from renderer.viewer.shown import ShownScene, open_file

# Of everything that is served, one of a kind.
PATHS = ["/", "/scene", "/mesh", "/octree?level=0", "/static/main.js", "/nowhere"]
# RFC 6455, section 1.3.
HANDSHAKE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}

# Seconds for an answer that should come at once: what a machine with other work may take.
_PATIENCE = 120.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Scene files, and beside their folder one more, which nobody is offered."""
    folder = tmp_path_factory.mktemp("served") / "scenes"
    folder.mkdir()
    for path in (folder / "blocks.toml", folder / "other.toml", folder.parent / "secret.toml"):
        path.write_text(SCENE)
    return folder


@pytest.fixture(scope="module")
def shown(folder: Path) -> ShownScene:
    return open_file(folder / "blocks.toml")


@pytest.fixture(scope="module")
def port(folder: Path) -> Iterator[int]:
    """Where ``renderer.view`` serves when nothing else is asked for."""
    with renderer.view(folder / "blocks.toml", browser=False) as viewing:
        yield urlsplit(viewing.url).port


@pytest.fixture(scope="module")
def wide(shown: ShownScene) -> Iterator[ViewerServer]:
    """A server that other machines reach."""
    with ViewerServer(shown, "0.0.0.0", 0, framed=False) as viewing:
        yield viewing


@pytest.fixture(autouse=True)
def no_fault_of_the_server(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """A bad client is refused; nothing of the server breaks on it, and it fills nobody's screen."""
    yield
    assert [record for record in caplog.get_records("call") if record.levelno >= logging.ERROR] == []


def asked(
    port: int, path: str, headers: dict[str, str] | None = None, method: str = "GET", address: str = "127.0.0.1"
) -> HTTPResponse:
    """The answer to exactly this path and these headers; Host is the server's own unless given."""
    connection = HTTPConnection(address, port, timeout=_PATIENCE)
    try:
        connection.putrequest(method, path, skip_host=True)
        for name, value in {"Host": f"127.0.0.1:{port}", **(headers or {})}.items():
            connection.putheader(name, value)
        connection.endheaders()
        response = connection.getresponse()
        if response.status != 101:  # after which no more of HTTP comes
            response.body = response.read().decode("latin-1")
        return response
    finally:
        connection.close()


def opening(port: int, path: str = "/ws", **headers: str) -> int:
    """The status with which a WebSocket's opening is answered; 101 lets it in."""
    return asked(port, path, HANDSHAKE | headers).status


def connected(port: int) -> Any:
    return connect(f"ws://127.0.0.1:{port}/ws", origin=f"http://127.0.0.1:{port}", open_timeout=_PATIENCE)


def told(port: int, text: str) -> dict[str, Any]:
    with connected(port) as client:
        client.send(text)
        return json.loads(client.recv(30))


def test_only_this_machine_reaches_it(port: int) -> None:
    # All of 127/8 is this machine on Linux, so a server bound to every address answers here; elsewhere nobody does.
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.2", port), timeout=5)
    socket.create_connection(("127.0.0.1", port), timeout=5).close()


@cases("path", [*PATHS, "/ws"])
@cases("host", ["evil.example", "evil.example:{}", "127.0.0.1.evil.example:{}", "127.0.0.1@evil.example", ""])
def test_a_foreign_name_that_points_here_is_refused(port: int, path: str, host: str) -> None:
    named = host.format(port)
    headers = {**HANDSHAKE, "Origin": f"http://{named}"} if path == "/ws" else {}
    assert asked(port, path, headers | {"Host": named}).status == 400


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "[::1]"])
def test_this_machines_own_names_are_served(port: int, name: str) -> None:
    assert asked(port, "/", {"Host": f"{name}:{port}"}).status == 200
    assert opening(port, Host=f"{name}:{port}", Origin=f"http://{name}:{port}") == 101


@cases(
    "origin",
    [
        "http://evil.example",
        "http://127.0.0.1",
        "http://127.0.0.1:1",
        "http://localhost:{}",
        "http://127.0.0.1:{}.evil.example",
        "http://127.0.0.1:{}@evil.example",
        "file://127.0.0.1:{}",
        "http://[",
        "null",
        "",
    ],
)
def test_a_foreign_pages_socket_is_refused(port: int, origin: str) -> None:
    assert opening(port, Origin=origin.format(port)) == 403


@cases("origin", ["http://evil.example", "http://127.0.0.1:1", "null"])
def test_a_foreign_page_drops_no_file(port: int, wide: ViewerServer, origin: str) -> None:
    """Browsers let it send some, and only keep the answer from it."""
    for host, path in ((port, "/drop"), (urlsplit(wide.url).port, f"/drop?{urlsplit(wide.url).query}")):
        answer = asked(host, path, {"Origin": origin}, method="POST")
        assert (answer.status, answer.body) == (403, f"Origin: expected 127.0.0.1:{host}, got {origin}")


def test_a_program_without_origin_is_refused_where_there_is_no_token(port: int) -> None:
    assert opening(port) == 403
    assert asked(port, "/drop", method="POST").status == 403


@cases("path", PATHS)
def test_answers_say_what_the_page_may_do(port: int, path: str) -> None:
    foreign = asked(port, path, {"Host": "evil.example", "Origin": "http://evil.example"})
    posted = asked(port, path, {"Origin": f"http://127.0.0.1:{port}"}, method="POST")
    assert (foreign.status, posted.status) == (400, 404 if path == "/nowhere" else 405)
    for answer in (asked(port, path, {"Origin": "http://evil.example"}), foreign, posted):
        rules = dict(rule.split(" ", 1) for rule in answer.headers["Content-Security-Policy"].split("; "))
        assert rules == {
            "default-src": "'self'",
            "img-src": "'self' blob: data:",
            "base-uri": "'none'",
            "form-action": "'none'",
            "frame-ancestors": "'self'",
        }
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Cache-Control"] == "no-store"
        assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        assert "Server" not in answer.headers
        assert not [name for name in answer.headers if name.lower().startswith("access-control")]


def test_a_refused_socket_is_told_the_rules_too(port: int) -> None:
    refused = asked(port, "/ws", HANDSHAKE | {"Origin": "http://evil.example"})
    assert refused.headers["Cache-Control"] == "no-store"
    assert "frame-ancestors" in refused.headers["Content-Security-Policy"]
    assert refused.body == f"Origin: expected 127.0.0.1:{port}, got http://evil.example"


@cases(
    "path",
    [
        "/static/../app.py",
        "/static/%2e%2e/app.py",
        "/static/..%2fapp.py",
        "/static/%2e%2e%2f%2e%2e%2fcli.py",
        "/static/..\\app.py",
        "/static//etc/passwd",
        "/static/%2fetc%2fpasswd",
        "/static/main.js%00.html",
        "/static/" + "a" * 5000,
        "/static/",
        "/app.py",
        "//etc/passwd",
    ],
)
def test_no_file_but_the_pages_is_served(port: int, path: str) -> None:
    assert asked(port, path).status == 404


@cases("level", ["", "-1", "1.5", "1e3", "100", "٣", "%00", "0&level=x", "9" * 5000])
def test_a_level_is_a_small_integer(port: int, level: str) -> None:
    answer = asked(port, f"/octree?level={_quoted(level)}")
    assert answer.status == 400 and answer.body.startswith("level: expected an integer from 0 to 99, got ")


def _quoted(text: str) -> str:
    return "".join(c if c.isascii() else "".join(f"%{byte:02X}" for byte in c.encode()) for c in text)


def test_a_level_that_the_tree_lacks_has_no_boxes(port: int) -> None:
    answer = asked(port, "/octree?level=99")
    assert answer.status == 200 and struct.unpack("<I", answer.body[:4].encode("latin-1")) == (0,)


@cases(
    "file",
    ["../secret.toml", "{0}/secret.toml", "{0}/scenes/other.toml", "./other.toml", "other", "", ".", "other.toml\0"],
)
def test_only_scene_files_that_were_offered_are_opened(port: int, folder: Path, file: str) -> None:
    named = file.format(folder.parent)
    answer = told(port, json.dumps({"type": "scene", "file": named}))
    assert answer["type"] == "error"
    assert answer["message"].startswith("scene.file: expected one of ['blocks.toml', 'other.toml'], got ")


def test_a_message_of_the_largest_size_is_read(port: int) -> None:
    assert told(port, "x" * MAX_MESSAGE_BYTES)["type"] == "error"


@cases("kind", [str, bytes])
@cases("pieces", [1, 3])
def test_a_larger_message_ends_its_connection_and_no_other(port: int, kind: type, pieces: int) -> None:
    """The last piece stays without its bytes: the server need not read them, and they cannot delay its answer."""
    piece = b"x" * (MAX_MESSAGE_BYTES // pieces + 1)
    codes = [Opcode.TEXT if kind is str else Opcode.BINARY] + [Opcode.CONT] * (pieces - 1)
    frames = [Frame(code, piece, fin=k == pieces - 1).serialize(mask=True) for k, code in enumerate(codes)]
    with connected(port) as good, connected(port) as bad:
        with pytest.raises(ConnectionClosedError) as closed:
            bad.socket.sendall(b"".join(frames)[: -len(piece)])
            bad.recv(30)
        assert closed.value.rcvd.code == 1009  # RFC 6455: too big
        good.send("x")
        assert json.loads(good.recv(30))["type"] == "error"


def test_one_connection_too_many_is_told_so_and_waits_for_another_to_leave(port: int) -> None:
    with ExitStack() as clients:
        first, *_ = [clients.enter_context(connected(port)) for _ in range(MAX_CONNECTIONS)]
        with connected(port) as late:
            message = json.loads(late.recv(30))
            assert message == {"type": "error", "message": "connections: expected at most 16, got another"}
            with pytest.raises(ConnectionClosedError) as closed:
                late.recv(30)
            assert closed.value.rcvd.code == 1013
        first.close()
        assert told(port, "x")["message"].startswith("message: Invalid JSON")


def test_a_client_that_floods_reads_nothing_and_leaves_disturbs_nobody(port: int) -> None:
    garbage = b"\x81\x81\0\0\0\0x"  # RFC 6455, section 5.2: text, of one byte, masked
    opened = HANDSHAKE | {"Host": f"127.0.0.1:{port}", "Origin": f"http://127.0.0.1:{port}"}
    with socket.create_connection(("127.0.0.1", port)) as client:
        lines = ["GET /ws HTTP/1.1", *(f"{name}: {value}" for name, value in opened.items()), "", ""]
        client.sendall("\r\n".join(lines).encode())
        assert client.recv(4096).startswith(b"HTTP/1.1 101")
        client.settimeout(0.3)
        # Every buffer on the way is full of answers, and the server stops reading.
        with pytest.raises(TimeoutError):
            while True:
                client.sendall(1000 * garbage)
        assert told(port, "x")["type"] == "error"
        # A reset in place of a proper end.
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    assert told(port, "x")["type"] == "error"


# A view of the scene from its side, and a file of it that takes seconds.
FILE_OF_VIEW = {"seq": 1, "m": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0.5, 5, 1], "fovy": 0.7, "w": 2048, "h": 2048}
LONG_STILL = FILE_OF_VIEW | {"type": "still", "settings": {"samples": 64}}
TURN = FILE_OF_VIEW | {"type": "turntable", "pivot": [0, 0, 0], "axis": [0, 1, 0]}


@cases(
    ("asked", "says"),
    [
        (LONG_STILL | {"w": 4096, "h": 4096}, "still: .*at most 8388608 pixels, got 4096 x 4096"),
        (LONG_STILL | {"file": "/etc/passwd"}, "still.file: Extra inputs are not permitted"),
        (LONG_STILL | {"m": [0] * 16}, "m: expected a last row of 0, 0, 0, 1"),
        (LONG_STILL | {"m": [0] * 15 + [1]}, "Camera: expected target != eye"),
    ],
)
def test_a_file_larger_than_allowed_is_refused_before_anything_is_computed(
    port: int, asked: dict[str, Any], says: str
) -> None:
    with connected(port) as client:
        client.send(json.dumps(asked))
        message = json.loads(client.recv(30))
        assert message["type"] == "error" and re.search(says, message["message"]), message
        client.send("x")
        assert json.loads(client.recv(30))["type"] == "error"


def test_a_second_file_is_refused_while_one_is_made(port: int) -> None:
    with connected(port) as client:
        client.send(json.dumps(LONG_STILL))
        while json.loads(client.recv(30))["type"] != "export":
            pass
        for asked in (LONG_STILL, TURN | {"w": 8, "h": 8}):
            client.send(json.dumps(asked | {"seq": 2}))
            while (message := json.loads(client.recv(30)))["type"] == "export":
                assert message["seq"] == 1
            assert (
                message["message"] == f"{asked['type']}: expected one file at a time, got another one while one is made"
            )


@pytest.mark.parametrize(
    ("host", "needed"),
    [("127.0.0.1", False), ("localhost", False), ("127.0.0.2", False), ("::1", False), ("0.0.0.0", True), ("::", True)],
)
def test_a_token_is_needed_where_other_machines_may_connect(shown: ShownScene, host: str, needed: bool) -> None:
    try:
        viewing = ViewerServer(shown, host, 0, framed=False)
    except ValueError as error:
        pytest.skip(f"this machine has no such address: {error}")
    with viewing:
        url = urlsplit(viewing.url)
        assert bool(url.query) == needed
        named = {"Host": url.netloc}
        assert asked(url.port, "/scene", named, address=url.hostname).status == (403 if needed else 200)
        assert asked(url.port, f"/scene?{url.query}", named, address=url.hostname).status == 200


@pytest.mark.judges("view")
def test_two_servers_have_two_tokens_of_256_bits(shown: ShownScene, wide: ViewerServer) -> None:
    with ViewerServer(shown, "0.0.0.0", 0, framed=False) as other:
        tokens = [re.fullmatch(r"token=([\w-]{43})", urlsplit(viewing.url).query)[1] for viewing in (wide, other)]
        assert asked(urlsplit(other.url).port, f"/scene?token={tokens[0]}").status == 403
    assert tokens[0] != tokens[1]


@cases("path", ["/", "/scene", "/mesh", "/octree", "/drop", "/static/main.js", "/nowhere", "/ws"])
@cases("query", ["", "?token=", "?token=wrong", "?token=%ff%00", "?Token={}", "?token={}x", "?token={}%20"])
def test_without_the_token_nothing_is_served(wide: ViewerServer, path: str, query: str) -> None:
    url = urlsplit(wide.url)
    given = query.format(url.query.removeprefix("token="))
    own = {"Origin": f"http://127.0.0.1:{url.port}"}
    headers = {"/ws": HANDSHAKE | own, "/drop": own}.get(path, {})
    answer = asked(url.port, path + given, headers, "POST" if path == "/drop" else "GET")
    assert answer.status == 403 and "Set-Cookie" not in answer.headers
    assert answer.body == "token: expected the one in the address that octree-render printed"


def test_the_page_gets_the_token_as_a_cookie_for_what_it_links(wide: ViewerServer) -> None:
    url = urlsplit(wide.url)
    cookie, *attributes = asked(url.port, f"/?{url.query}").headers["Set-Cookie"].split("; ")
    assert set(attributes) == {"HttpOnly", "SameSite=Strict", "Path=/"}
    # Cookies of other servers on this machine come along, not all of them well-formed.
    for sent in (cookie, f"a=b; {cookie}", f'other={{"x": [1, 2]}}; {cookie}; last'):
        assert asked(url.port, "/static/main.js", {"Cookie": sent}).status == 200
        assert opening(url.port, Cookie=sent, Origin=f"http://127.0.0.1:{url.port}") == 101
    name, _, value = cookie.partition("=")
    for sent in (f"{name}=wrong", f"{name}=", f"x{name}={value}", f"{name}={value}x"):
        assert asked(url.port, "/static/main.js", {"Cookie": sent}).status == 403


def test_with_the_token_a_foreign_page_is_refused_and_a_program_let_in(wide: ViewerServer) -> None:
    url = urlsplit(wide.url)
    path = f"/ws?{url.query}"
    assert opening(url.port, path) == 101
    posted = asked(url.port, f"/drop?{url.query}", method="POST")
    assert (posted.status, posted.body[:6]) == (400, "files:")
    assert opening(url.port, path, Origin=f"http://127.0.0.1:{url.port}") == 101
    assert opening(url.port, path, Host="any.example", Origin="http://any.example") == 101
    for origin in ("http://evil.example", "http://127.0.0.1:1", "null"):
        assert opening(url.port, path, Origin=origin) == 403


def test_tokens_are_compared_in_constant_time(wide: ViewerServer, monkeypatch: pytest.MonkeyPatch) -> None:
    url = urlsplit(wide.url)
    monkeypatch.setattr("hmac.compare_digest", lambda _given, _token: False)
    assert asked(url.port, f"/scene?{url.query}").status == 403


@cases(
    ("host", "port", "message"),
    [
        (None, 0, "host: expected a string, got NoneType"),
        ("no such host", 0, "host: expected a name or address of this machine, got 'no such host'"),
        ("192.0.2.1", 0, "host and port: expected a free port, got 192.0.2.1:0"),  # RFC 5737: nobody's
        ("127.0.0.1", 65536, "port: expected an integer from 0 to 65535, got 65536"),
        ("127.0.0.1", -1, "port: expected an integer from 0 to 65535, got -1"),
        ("127.0.0.1", "80", "port: expected an integer from 0 to 65535, got '80'"),
    ],
)
def test_where_it_cannot_listen_it_says_so(shown: ShownScene, host: Any, port: Any, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        ViewerServer(shown, host, port, framed=False)
