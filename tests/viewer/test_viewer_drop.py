"""Files that are dropped on the page, by a client that posts them: what is taken, what is refused, and what is left."""

import gzip
import json
import os
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import closing
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlencode, urlsplit

import pytest
from cases import cases
from viewer_client import PATIENCE, Client, fetched, wait_for
from viewer_page import MODELS, SCENE, served

import renderer
from renderer.viewer import app, drops
from renderer.viewer.shown import open_file

BLOCK, STAIRS = ((MODELS / name).read_bytes() for name in ("block.ply", "stairs.ply"))
# As a user has it: with its meshes in a folder beside it.
MOVABLE = SCENE.replace(f"{MODELS}/", "models/").encode()
MESHES = {"block.ply": BLOCK, "stairs.ply": STAIRS}
TRIANGLE = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
TRIANGLE += b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The system's folder of temporary files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


@pytest.fixture
def url(temporary: Path, scene: Path) -> Iterator[str]:
    """A server that keeps what is dropped in ``temporary``."""
    with renderer.view(scene, browser=False) as viewing:
        yield viewing.url


def posted(url: str, files: dict[str, bytes], listed: Any = None) -> tuple[int, str]:
    """The answer to a drop of these files; ``listed`` in the place of their names and sizes."""
    connection, headers, path = begun(url, listed or [[name, len(content)] for name, content in files.items()])
    with closing(connection):
        connection.request("POST", path, b"".join(files.values()), headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()


def begun(url: str, listed: Any) -> tuple[HTTPConnection, dict[str, str], str]:
    host = urlsplit(url).netloc
    text = listed if isinstance(listed, str) else json.dumps(listed)
    return HTTPConnection(host, timeout=PATIENCE), {"Origin": f"http://{host}"}, f"/drop?{urlencode({'files': text})}"


def refused(url: str, files: dict[str, bytes], listed: Any = None) -> str:
    """What is said of a drop, of which nothing is offered."""
    before = description(url)["files"]
    status, said = posted(url, files, listed)
    assert status == 400 and description(url)["files"] == before
    return said


def description(url: str, **which: str) -> dict[str, Any]:
    return json.loads(fetched(url, f"scene?{urlencode(which)}"))


def files_in(folder: Path) -> list[str]:
    return sorted(name for _, _, names in os.walk(folder) for name in names)


def test_a_scene_is_shown_with_the_meshes_that_came_with_it(url: str, client: Client, scene: Path) -> None:
    """Where it looks for them; in the list, beside one of the same name; and to a page that is loaded again."""
    own = description(url)
    files = ["blocks.toml", "mine.toml", "mine (2).toml", "blocks (2).toml"]
    for name, offered in (("mine.toml", files[1]), ("mine.toml", files[2]), (scene.name, files[3])):
        status, said = posted(url, {name: MOVABLE, **MESHES})
        assert status == 200 and json.loads(said) == {"file": offered}
    for message in ({"type": "scene"}, {"type": "hello", "server": own["server"]}):
        client.send(**message, file="mine.toml")
        shown = description(url, id=client.told("scene")["id"])
        assert (shown["name"], shown["faces"], shown["files"]) == ("mine.toml", own["faces"], files)
    client.send(type="command", mode="octree", **VIEW)
    assert client.told("error")["message"].startswith("command: expected a file in a folder of yours, got")
    client.send(type="scene", file="blocks.toml")
    assert description(url, id=client.told("scene")["id"])["name"] == "blocks.toml"


VIEW = {"m": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0.5, 5, 1], "fovy": 0.7, "w": 8, "h": 8}


def test_a_scene_of_python_is_left_for_a_dropped_one_and_returned_to() -> None:
    scene = renderer.load_scene(MODELS / "block.ply")
    with renderer.view(scene, browser=False) as viewing, Client(viewing.url) as client:
        own = description(viewing.url)["faces"]
        assert posted(viewing.url, {"t.ply": TRIANGLE})[0] == 200
        for file, faces in (("t.ply", 3), ("scene", own)):
            client.send(type="scene", file=file)
            shown = description(viewing.url, id=client.told("scene")["id"])
            assert (shown["faces"], shown["files"]) == (faces, ["scene", "t.ply"])


@cases("name", ["a.ply", "A.PLY", "a.ply.gz", "../b.ply", "..\\..\\c.ply", "/etc/d.ply", "C:\\e.ply", "ä (1).ply"])
def test_a_mesh_is_read_under_its_name_in_no_other_folder(url: str, temporary: Path, name: str) -> None:
    content = gzip.compress(TRIANGLE) if name.endswith("gz") else TRIANGLE
    status, said = posted(url, {name: content})
    bare = name.replace("\\", "/").rpartition("/")[2]
    assert status == 200 and json.loads(said)["file"] == bare
    (path,) = (path for path in temporary.rglob(bare) if path.read_bytes() == content)
    shutil.rmtree(path.parent)
    assert files_in(temporary.parent) == []


@cases("name", ["t.py", "t", "", "..", ".", "t.ply\0", "\nt.ply", "t.ply:x", "t.toml.gz"])
def test_other_names_are_refused(url: str, temporary: Path, name: str) -> None:
    said = refused(url, {}, [["good.ply", 0], [name, 0]])
    assert said.startswith("files: expected names in .ply.gz ") and files_in(temporary) == []


LISTED = ["", "x", "{}", "[]", '[["t.ply"]]', '[["t.ply", -1]]', '[["t.ply", "1"]]', "[" * 9000, [["t.ply", 1]] * 65]


@cases("listed", LISTED)
def test_names_and_sizes_are_pairs(url: str, listed: Any) -> None:
    assert refused(url, {}, listed or " ").startswith("files: expected 1 to 64 pairs of a name and a size, got ")


@cases(
    ("files", "says"),
    [
        ({"a.ply": TRIANGLE, "b.ply": TRIANGLE}, "a.ply, b.ply: expected one scene (.toml), or one mesh, with"),
        ({"a.toml": b"", "b.toml": b""}, "a.toml, b.toml: expected one scene (.toml), or one mesh, with"),
        ({"a.bin": b"x"}, "a.bin: expected one scene (.toml), or one mesh, with"),
        ({"a.ply": TRIANGLE, "x/a.ply": TRIANGLE}, "a.ply: expected names that differ, got 2 files"),
        ({"a.ply": TRIANGLE[:-3]}, "a.ply: "),
        ({"a.ply.gz": gzip.compress(TRIANGLE)[:-9]}, "a.ply.gz: malformed gzip"),
        ({"a.toml": b"[camera"}, "a.toml: expected TOML, got a syntax error"),
        ({"mine.toml": MOVABLE, **MESHES, "block.ply": TRIANGLE[:-3]}, "mine.toml: objects"),
        ({"mine.toml": MOVABLE, "block.ply": BLOCK}, "mine.toml: expected the files that it names to come with it"),
    ],
)  # fmt: skip
def test_what_cannot_be_shown_is_refused_by_name_and_removed(
    url: str, temporary: Path, files: dict[str, bytes], says: str
) -> None:
    said = refused(url, files)
    assert said.startswith(says) and str(temporary) not in said and files_in(temporary) == []


def named_by_scene(path: str) -> dict[str, bytes]:
    return {"a.toml": MOVABLE.replace(b"models/stairs.ply", path.encode()), **MESHES}


def named_by_gltf(path: str) -> dict[str, bytes]:
    return {"a.gltf": json.dumps({"asset": {"version": "2.0"}, "buffers": [{"uri": path, "byteLength": 1}]}).encode()}


def named_by_glb(path: str) -> dict[str, bytes]:
    text = named_by_gltf(path)["a.gltf"].ljust(400)
    head = b"glTF" + b"".join(number.to_bytes(4, "little") for number in (2, 20 + len(text), len(text)))
    return {"a.glb": head + b"JSON" + text}


@cases("naming", [named_by_scene, named_by_gltf, named_by_glb])
@cases("path", ["{0}/secret.ply", "../secret.ply", "x/../../secret.ply", "../../secret.ply"])
def test_no_file_of_this_machine_is_read_for_a_dropped_one(url: str, temporary: Path, naming: Any, path: str) -> None:
    """As a token's holder, or another user here, could have it shown."""
    (temporary / "secret.ply").write_bytes(TRIANGLE)
    said = refused(url, naming(path.format(temporary)))
    assert ": expected names of files beside it or in folders there, got " in said


def test_buffers_come_with_their_mesh(url: str) -> None:
    corners = b"\0\0\0\0" * 3 + b"\0\0\x80\x3f" + b"\0\0\0\0" * 3 + b"\0\0\x80\x3f" + b"\0\0\0\0"
    document = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"uri": "data%20of/t.bin", "byteLength": 36}],
    }
    files = {"t.gltf": json.dumps(document).encode()}
    assert "t.gltf: expected the files that it names to come with it, got no data of/t.bin" in refused(url, files)
    assert posted(url, files | {"t.bin": corners}) == (200, '{"file":"t.gltf"}')


def test_too_much_is_refused_before_it_is_read(url: str, temporary: Path) -> None:
    connection, headers, path = begun(url, [["a.ply", drops.MOST_BYTES], ["b.ply", 1]])
    connection.putrequest("POST", path)
    for name, value in {**headers, "Content-Length": str(drops.MOST_BYTES + 1)}.items():
        connection.putheader(name, value)
    with closing(connection):
        connection.endheaders(b"ply")
        answer = connection.getresponse()  # while all else is still to be sent
        said = answer.status, answer.read()
    assert said == (400, b"a.ply, b.ply: expected at most 512 MiB, got 513 MiB")
    assert answer.headers["Connection"] == "close" and files_in(temporary) == []


def test_what_unpacks_to_too_much_is_refused(url: str, temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drops, "MOST_BYTES", 1 << 20)
    said = refused(url, {"a.ply.gz": gzip.compress(TRIANGLE + bytes(1 << 20))})
    assert said == "a.ply.gz: expected at most 1 MiB unpacked, got more" and files_in(temporary) == []


def test_only_so_much_is_kept_of_all_drops(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drops, "MOST_KEPT", 2 * len(TRIANGLE))
    refused(url, {"a.ply": TRIANGLE[:-3]})  # which counts no more
    assert [posted(url, {"a.ply": TRIANGLE})[0] for _ in range(2)] == [200, 200]
    assert refused(url, {"a.ply": TRIANGLE}).startswith("a.ply: expected at most 0 MiB of all that was dropped until")


@cases("size", [-1, 1])
def test_a_file_has_the_size_that_is_stated(url: str, temporary: Path, size: int) -> None:
    said = refused(url, {"a.ply": TRIANGLE}, [["a.ply", len(TRIANGLE) + size]])
    assert ("1 more bytes, got none" if size > 0 else "as many bytes as stated, got more") in said
    assert files_in(temporary) == []


def test_of_a_page_that_leaves_midway_nothing_stays(url: str, temporary: Path) -> None:
    host = urlsplit(url)
    _, headers, path = begun(url, [["a.ply", 1000]])
    lines = [f"POST {path} HTTP/1.1", f"Host: {host.netloc}", f"Origin: {headers['Origin']}", "Content-Length: 1000"]
    with socket.create_connection((host.hostname, host.port)) as client:
        client.sendall("\r\n".join([*lines, "", "ply"]).encode())
        wait_for(lambda: files_in(temporary) == ["a.ply"], PATIENCE)
    wait_for(lambda: files_in(temporary) == [], PATIENCE)


def test_its_folder_is_private_and_ends_with_the_server(temporary: Path, scene: Path) -> None:
    with renderer.view(scene, browser=False) as viewing:
        posted(viewing.url, {"t.ply": TRIANGLE})
        (folder,) = temporary.iterdir()
        assert folder.stat().st_mode & 0o077 == 0 and files_in(folder) == ["t.ply"]
    assert list(temporary.iterdir()) == []


def test_its_folder_ends_with_a_command_that_is_ended(temporary: Path, scene: Path) -> None:
    with served(scene) as url:
        assert posted(url, {"t.ply": TRIANGLE})[0] == 200 and files_in(temporary) == ["t.ply"]
    assert files_in(temporary) == []


def test_what_was_dropped_is_read_once_for_its_page(url: str, client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """And anew where that asks for it again."""
    read: list[str] = []
    monkeypatch.setattr(app, "open_file", lambda path, up=None: (read.append(path.name), open_file(path, up))[1])
    posted(url, {"t.ply": TRIANGLE})
    shown = []
    for _ in range(2):
        client.send(type="scene", file="t.ply")
        shown.append(client.told("scene")["id"])
    assert read == ["t.ply", "t.ply"] and shown[0] != shown[1]
