"""Octrees in files: the same bits again, nothing copied from a map, and one clear error for any other content."""

import copy
import errno
import json
import os
import pickle
import re
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from forged import Change, forge
from meshes import answers, make_mesh, rays_at
from numpy.typing import NDArray
from signatures import SIGNATURES

from renderer import Mesh, Octree
from renderer.mesh.shapes import icosphere
from renderer.system import files
from renderer.trace.layout import ANY_ORDER, BLOCK_WORDS, CACHE_LINE, CHILDREN, NODE_WORDS, ORDERS
from renderer.tree import container, store

pytestmark = pytest.mark.judges("Octree.load", "Octree.save")


MAPPED = pytest.mark.parametrize("mmap", [False, True], ids=["read", "mapped"])
ORIGINS, DIRECTIONS = rays_at(*make_mesh("soup", 1, 50), 1, 12)


def carrying() -> Mesh:
    """A closed mesh with all that vertices can carry, and a name that no encoding but JSON's holds."""
    ball = icosphere(3)
    return Mesh(ball.vertices, ball.faces, -ball.vertices, abs(ball.vertices), ball.vertices[:, :2], "a\ud800ü")


def repaired() -> Octree:
    vertices, faces = make_mesh("soup", 3, 60)
    vertices[7] = np.nan
    return Octree(vertices, faces, repair=True)


SAVED: dict[str, Callable[[], Octree]] = {
    "carrying": lambda: Octree.from_mesh(carrying()),
    "float32": lambda: Octree(*make_mesh("soup_float32", 1, 300)),
    "sah": lambda: Octree(*make_mesh("lattice", 1, 300), split="sah", leaf_size=32),
    "in parts": lambda: Octree(*make_mesh("sizes", 1, 9000)),
    "tiny": lambda: Octree(icosphere(1).vertices * 1e-200, icosphere(1).faces),
    "huge": lambda: Octree(icosphere(1).vertices * 1e200, icosphere(1).faces),
    "one face": lambda: Octree(np.eye(3), [[0, 1, 2]]),
    "no faces": lambda: Octree(np.eye(3), np.empty((0, 3), int)),
    "nothing": lambda: Octree([], []),
    "repaired": repaired,
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "it.octree"


def asked(target: Octree) -> dict[str, bytes]:
    size = 1.0 / target.tree.scale
    return answers(target, ORIGINS * size, DIRECTIONS)


# --- the same again ---------------------------------------------------------------------------------------------


@MAPPED
@pytest.mark.parametrize("kind", SAVED)
def test_a_loaded_octree_is_the_one_that_was_saved(kind: str, mmap: bool, path: Path) -> None:
    saved = SAVED[kind]()
    saved.save(path)
    loaded = Octree.load(path, mmap=mmap, threads=1)
    assert asked(loaded) == asked(saved) and loaded.stats == saved.stats and loaded.threads == 1
    for name in ("nodes", "blocks", "faces"):
        ours, theirs = getattr(loaded.tree, name), getattr(saved.tree, name)
        assert ours.dtype == theirs.dtype and ours.tobytes() == theirs.tobytes()
    assert (loaded.tree.depth, loaded.tree.scale) == (saved.tree.depth, saved.tree.scale)
    for name in ("vertices", "faces", "normals", "colors", "texcoords"):
        ours, theirs = getattr(loaded.mesh, name), getattr(saved.mesh, name)
        assert (ours is None) == (theirs is None)
        assert ours is None or (ours.dtype, ours.tobytes()) == (theirs.dtype, theirs.tobytes())
        assert ours is None or not ours.flags.writeable
    assert loaded.mesh.name == saved.mesh.name
    assert str(loaded.repairs) == str(saved.repairs)


@MAPPED
@pytest.mark.parametrize("kind", ["carrying", "in parts", "tiny", "no faces", "repaired"])
def test_a_loaded_octree_refits_travels_and_is_saved_as_any(kind: str, mmap: bool, path: Path) -> None:
    saved = SAVED[kind]()
    saved.save(path)
    loaded = Octree.load(path, mmap=mmap)
    loaded.save(path.with_name("again"))
    assert path.with_name("again").read_bytes() == path.read_bytes()
    loaded.save(path)  # over the file that is mapped
    expected = asked(saved)
    for copied in (pickle.loads(pickle.dumps(loaded)), copy.deepcopy(loaded), copy.copy(loaded), loaded):
        assert asked(copied) == expected
        for array in (copied.tree.nodes, copied.tree.blocks):
            assert not len(array) or array.ctypes.data % CACHE_LINE == 0
    moved = saved.mesh.vertices * [1.0, 0.5, 2.0]
    for target in (saved, loaded):
        target.refit(moved)
    assert asked(loaded) == asked(saved) and (kind == "no faces" or asked(saved) != expected)
    loaded.save(path)
    assert asked(Octree.load(path, mmap=mmap)) == asked(saved)


def test_a_class_of_ones_own_is_loaded_as_such(path: Path) -> None:
    class Mine(Octree):
        pass

    Mine(np.eye(3), [[0, 1, 2]]).save(path)
    assert type(Mine.load(path)) is Mine


def test_the_file_is_as_its_description_says(path: Path) -> None:
    """Read by ``struct``, ``json`` and ``zlib``, from the texts at the heads of ``container.py`` and ``store.py``."""
    saved = Octree.from_mesh(carrying())
    saved.save(path)
    content = path.read_bytes()
    assert content[:8] == bytes.fromhex("89 4F 43 54 52 45 45 0A")
    order, version, length, crc = struct.unpack("<4I", content[8:24])
    assert (order, version, crc) == (0x01020304, 2, zlib.crc32(content[:20] + content[24 : 24 + length]))
    told = json.loads(content[24 : 24 + length])
    assert told.keys() == {"depth", "scale", "name", "arrays"}
    assert (told["depth"], told["scale"], told["name"]) == (saved.tree.depth, saved.tree.scale, saved.mesh.name)
    mesh, tree, begin = saved.mesh, saved.tree, 24 + length
    expected = {
        "vertices": mesh.vertices, "faces": mesh.faces, "normals": mesh.normals, "colors": mesh.colors,
        "texcoords": mesh.texcoords, "nodes": tree.nodes, "blocks": tree.blocks, "block_faces": tree.faces,
    }  # fmt: skip
    assert [entry["name"] for entry in told["arrays"]] == list(expected)
    for entry in told["arrays"]:
        array = expected[entry["name"]]
        assert array is not None and np.dtype(entry["dtype"]) == array.dtype and entry["dtype"][0] == "<"
        end = begin + array.nbytes
        filled = -(-end // 64) * 64
        assert begin % 64 == 0 and array.size % entry["rows"] == 0
        assert content[begin:end] == array.tobytes() and not any(content[end:filled])
        assert entry["crc32"] == zlib.crc32(content[begin:filled])
        begin = filled
    assert begin == len(content)


def test_a_mesh_of_several_parts_has_them_in_its_file(path: Path) -> None:
    mesh = Mesh.concatenate(carrying(), icosphere(0), name="both")
    Octree(mesh).save(path)
    content = path.read_bytes()
    told = json.loads(content[24 : 24 + struct.unpack("<I", content[16:20])[0]])
    assert told.keys() == {"depth", "scale", "name", "arrays", "parts"}
    assert told["parts"] == [["a\ud800ü", len(carrying().faces)], ["icosphere", 20]]


# --- memory -----------------------------------------------------------------------------------------------------


def base_of(array: NDArray[Any]) -> object:
    """What owns an array's memory."""
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    return base.obj if isinstance(base, memoryview) else base


def test_a_map_is_viewed_and_not_copied(path: Path) -> None:
    SAVED["carrying"]().save(path)
    loaded = Octree.load(path, mmap=True)
    mesh, tree = loaded.mesh, loaded.tree
    arrays = (mesh.vertices, mesh.faces, mesh.normals, mesh.colors, mesh.texcoords, tree.nodes, tree.blocks, tree.faces)
    owners = {id(base_of(array)): base_of(array) for array in arrays if array is not None}
    (owner,) = owners.values()
    assert type(owner).__name__ == "mmap" and not any(array.flags.writeable for array in arrays if array is not None)
    with pytest.raises(ValueError, match="WRITEABLE"):
        mesh.vertices.flags.writeable = True


@MAPPED
@pytest.mark.parametrize("kind", ["carrying", "float32", "in parts"])
def test_arrays_begin_on_cache_lines(kind: str, mmap: bool, path: Path) -> None:
    SAVED[kind]().save(path)
    loaded = Octree.load(path, mmap=mmap)
    for array in (loaded.tree.nodes, loaded.tree.blocks, loaded.tree.faces, loaded.mesh.vertices, loaded.mesh.faces):
        assert array.ctypes.data % CACHE_LINE == 0 and array.flags.c_contiguous and array.flags.aligned


def test_arrays_that_were_read_do_not_hold_each_other(path: Path) -> None:
    """The faces of the blocks outlive a refit; the rest of the file need not."""
    SAVED["carrying"]().save(path)
    loaded = Octree.load(path)
    assert not np.may_share_memory(base(loaded.tree.faces), base(loaded.tree.nodes))


def base(array: NDArray[Any]) -> NDArray[Any]:
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array


# In a process of its own, where no other test has called a kernel.
COMPILED = """
import numpy as np
from renderer import Octree
from renderer.diagnostics.tree_boxes import visited
from renderer.mesh.shapes import icosphere

def use(octree):
    for _ in range(2):
        for count in (3, 60):
            octree.closest_hit(octree.mesh.triangles[:count].mean(axis=1), RAYS[:count], leaving=np.arange(count))
        octree.all_hits(RAYS, -RAYS)
        octree.any_hit(RAYS, -RAYS)
        octree.signed_distance(RAYS)
        octree.visible(octree.mesh.triangles[:60].mean(axis=1), -RAYS, np.arange(60))
        visited(octree, RAYS[0], -RAYS[0])
        octree.refit(octree.mesh.vertices * 2.0)

RAYS = np.random.default_rng(1).normal(size=(60, 3))
octree = Octree.from_mesh(icosphere(3))
octree.save(sys.argv[1])
use(octree)
before = signatures()
for mmap in (False, True):
    use(Octree.load(sys.argv[1], mmap=mmap))
print(len(before), *(signatures() - before))
"""


def test_no_kernel_is_compiled_for_other_types(path: Path) -> None:
    command = [sys.executable, "-c", SIGNATURES + COMPILED, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    count, *new = done.stdout.split(maxsplit=1)
    assert int(count) > 10 and not new


# --- files that are none ----------------------------------------------------------------------------------------


def refusal(path: Path, mmap: bool = False) -> str:
    """What ``load`` says of a file, checked to be one line that names it."""
    with pytest.raises(ValueError) as caught:
        Octree.load(path, mmap=mmap)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and "\n" not in message and len(message) < 600
    return message.removeprefix(f"{path}: ")


def whole(path: Path, kind: str = "one face") -> bytes:
    SAVED[kind]().save(path)
    return path.read_bytes()


@MAPPED
def test_what_is_no_file_is_one_error(mmap: bool, tmp_path: Path) -> None:
    assert refusal(tmp_path / "absent", mmap) == "cannot be read: No such file or directory"
    assert refusal(tmp_path, mmap) == "cannot be read: expected a file, got a folder, pipe or device"
    (tmp_path / "device").symlink_to("/dev/zero")
    assert "got a folder, pipe or device" in refusal(tmp_path / "device", mmap)
    os.mkfifo(tmp_path / "pipe")
    assert "got a folder, pipe or device" in refusal(tmp_path / "pipe", mmap)
    for name, content in (("empty", b""), ("text", b"ply\nformat ascii 1.0\n"), ("start", b"\x89OCTREE")):
        (tmp_path / name).write_bytes(content)
        said = refusal(tmp_path / name, mmap)
        assert said.startswith(f"content: expected an octree that Octree.save wrote, got {len(content)} bytes")


@MAPPED
def test_a_file_cut_off_or_grown_anywhere_is_refused(mmap: bool, path: Path) -> None:
    content = whole(path)
    for size in [*range(0, 900, 7), *range(900, len(content), 61), len(content) - 1]:
        path.write_bytes(content[:size])
        said = refusal(path, mmap)
        assert said.startswith("content: ") if size < 8 else said.startswith("size: ")
    for more in (b"\0", bytes(64), content):
        path.write_bytes(content + more)
        assert (
            refusal(path, mmap)
            == f"size: expected {len(content)} bytes, as its header says, got {len(path.read_bytes())}"
        )


@MAPPED
def test_another_version_and_order_of_bytes_are_told(mmap: bool, path: Path) -> None:
    content = whole(path)
    for version in (1, 3, 2**32 - 1):
        path.write_bytes(content[:12] + struct.pack("<I", version) + content[16:])
        assert refusal(path, mmap) == f"version: expected 2, which this release reads, got {version}"
    path.write_bytes(content[:8] + struct.pack(">4I", *struct.unpack("<4I", content[8:24])) + content[24:])
    assert refusal(path, mmap) == "order of bytes: expected 0x01020304, little-endian, got 0x04030201"


@pytest.mark.parametrize("kind", ["carrying", "float32", "repaired"])
def test_a_flipped_bit_is_found_anywhere(kind: str, path: Path) -> None:
    content, rng = whole(path, kind), np.random.default_rng(1)
    first = content.index(b"}", 24) // 64 * 64
    places = [*range(24), *rng.integers(24, first, 60), *rng.integers(first, len(content), 200), len(content) - 1]
    for place in map(int, places):
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        refusal(path)


def test_bytes_that_fill_up_are_checked_too(path: Path) -> None:
    content = bytearray(whole(path))
    assert content[-1] == 0 and len(content) % CACHE_LINE == 0  # the faces of one block are 16 bytes
    content[-1] = 1
    path.write_bytes(content)
    assert refusal(path).startswith("block_faces: expected the checksum ")


def test_flipped_bits_in_a_map_are_refused_or_harmless(path: Path) -> None:
    """Those of the header are found; of arrays only what a query could crash at is looked for."""
    content, rng = whole(path, "carrying"), np.random.default_rng(2)
    begin, refused = 24 + struct.unpack("<I", content[16:20])[0], 0
    for place in [*range(0, begin, 5), *map(int, rng.integers(begin, len(content), 150))]:
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        try:
            asked(Octree.load(path, mmap=True))
        except ValueError as error:
            assert str(error).startswith(f"{path}: ") or "mesh: expected a closed mesh" in str(error)
            refused += 1
        else:
            assert place >= begin
    assert begin // 5 < refused < begin // 5 + 150


# --- forged files -----------------------------------------------------------------------------------------------


def forged(content: bytes, change: Change, **arrays: NDArray[Any]) -> bytes:
    return forge(content, store._KINDS, change, **arrays)


def nothing(told: dict[str, Any]) -> None:
    """No change of the header."""


def entry(which: str, /, **values: Any) -> Change:
    """A change of what the header says of one array."""
    return lambda told: next(e for e in told["arrays"] if e["name"] == which).update(values)


def without(name: str) -> Change:
    return lambda told: told.update(arrays=[e for e in told["arrays"] if e["name"] != name])


HEADERS: dict[str, tuple[Change, str]] = {
    "no depth": (lambda told: told.pop("depth"), "header: expected the keys"),
    "a key more": (lambda told: told.update(more=1), "header: expected the keys"),
    "depth -1": (lambda told: told.update(depth=-1), "depth: expected an integer from 0 to 256, got -1"),
    "depth less": (lambda told: told.update(depth=1), "depth: expected the levels of nodes, 2 or more, got 1"),
    "depth none": (lambda told: told.update(depth=0), "depth: expected the levels of nodes, 1 or more, got 0"),
    "depth of many digits": (lambda told: told.update(depth=10**4000), "depth: expected an integer from 0 to 256"),
    "scale 0": (lambda told: told.update(scale=0.0), "scale: expected a power of two, got 0.0"),
    "scale 1, an integer": (lambda told: told.update(scale=1), "scale: expected a power of two"),
    "scale nan": (lambda told: told.update(scale=np.nan), "scale: expected a power of two"),
    "name 3": (lambda told: told.update(name=3), "name: expected a string, got 3"),
    "arrays strings": (lambda told: told.update(arrays=["x" * 5000]), "arrays: expected entries with the keys"),
    "arrays empty": (lambda told: told.update(arrays=[]), "arrays: expected ['block_faces'"),
    "no nodes": (without("nodes"), "arrays: expected ['block_faces'"),
    "no bad normals": (without("bad_normals"), "arrays: expected all of"),
    "twice": (lambda told: told["arrays"].append(told["arrays"][0]), "arrays: expected each one once"),
    "another array": (entry("nodes", name="edges"), "arrays: expected names among"),
    "a list for a name": (entry("nodes", name=["nodes"]), "arrays: expected names among"),
    "float32 vertices": (entry("vertices", dtype="<f4"), "vertices: expected the type <f8, got '<f4'"),
    "big-endian nodes": (entry("nodes", dtype=">f4"), "nodes: expected the type <f4, got '>f4'"),
    "a list for a type": (entry("blocks", dtype=["<f8"]), "blocks: expected the type"),
    "rows 2^32": (entry("faces", rows=2**32), "faces: expected rows and crc32 from 0"),
    "rows 2^31": (entry("faces", rows=2**31), "size: expected "),
    "parts a name": (lambda told: told.update(parts="body"), "parts: expected pairs of a name and a number of faces"),
    "a part a name": (lambda told: told.update(parts=["body"]), "parts: expected pairs"),
    "a part of three": (lambda told: told.update(parts=[["body", 1, 2]]), "parts: expected pairs"),
    "a part without a name": (lambda told: told.update(parts=[[1, 1]]), "parts: expected pairs"),
    "a part of -1 faces": (lambda told: told.update(parts=[["body", -1]]), "parts: expected pairs"),
    "a part of one face": (lambda told: told.update(parts=[["body", 1]]), "parts: expected "),
    "crc -1": (entry("faces", crc32=-1), "faces: expected rows and crc32 from 0"),
}  # fmt: skip


@MAPPED
@pytest.mark.parametrize("fault", HEADERS)
def test_a_forged_header_is_refused(fault: str, mmap: bool, path: Path) -> None:
    change, said = HEADERS[fault]
    content = whole(path, "repaired")
    path.write_bytes(forged(content, nothing))
    Octree.load(path, mmap=mmap)  # so the forgery itself is sound
    path.write_bytes(forged(content, change))
    assert refusal(path, mmap).startswith(said)


@pytest.mark.parametrize("text", [b"", b"[", b"[]", b"null", b"[" * 10**6, b"\xff", b'{"depth": ' + b"1" * 5000])
def test_a_header_that_is_no_object_is_refused(text: bytes, path: Path) -> None:
    content = whole(path)
    start = content[:16] + struct.pack("<I", len(text))
    path.write_bytes(start + struct.pack("<I", zlib.crc32(text, zlib.crc32(start))) + text)
    assert refusal(path).startswith("header: expected ")


def links_of(it: Octree) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """A copy of the nodes, and its links."""
    nodes = it.tree.nodes.copy()
    return nodes, nodes.view(np.int32).reshape(-1, NODE_WORDS)[:, CHILDREN : CHILDREN + 8]


def linked(change: Callable[[NDArray[np.int32]], object]) -> Callable[[Octree], dict[str, NDArray[Any]]]:
    def arrays(it: Octree) -> dict[str, NDArray[Any]]:
        nodes, links = links_of(it)
        change(links)
        return {"nodes": nodes}

    return arrays


def put(at: tuple[int, ...], value: float, name: str) -> Callable[[Octree], dict[str, NDArray[Any]]]:
    """A value at a place of an array of the mesh, or of the faces of the blocks."""

    def arrays(it: Octree) -> dict[str, NDArray[Any]]:
        array = (it.tree.faces if name == "block_faces" else getattr(it.mesh, name)).copy()
        array[at] = value
        return {name: array}

    return arrays


def first_node(links: NDArray[np.int32]) -> tuple[int, ...]:
    """The place of a link to a node."""
    return tuple(int(i) for i in np.argwhere(links >= 0)[0])


def set_first(links: NDArray[np.int32], value: int) -> None:
    links[first_node(links)] = value


def set_deep(links: NDArray[np.int32]) -> None:
    """A node far below links to one before it, which nothing else does then."""
    a, b = np.argwhere(links >= 0)[[1, -1]]
    links[tuple(b)], links[tuple(a)] = links[tuple(a)], -1


def lower(links: NDArray[np.int32], step: int) -> None:
    """The link to the last leaf, of another first block or another number of blocks."""
    links[links == links.min()] -= step


def swap_blocks(it: Octree) -> dict[str, NDArray[Any]]:
    faces = it.tree.faces.copy()
    used = np.flatnonzero(faces >= 0)
    faces[used[0]] = faces[used[1]]
    return {"block_faces": faces}


ARRAYS: dict[str, tuple[Callable[[Octree], dict[str, NDArray[Any]]], str]] = {
    "a link to no node": (linked(lambda links: set_first(links, len(links))), "nodes: expected links to"),
    "a link far away": (linked(lambda links: set_first(links, 2**31 - 1)), "nodes: expected links to"),
    "a link to the root": (linked(lambda links: set_first(links, 0)), "nodes: expected children after their parents"),
    "a cycle": (linked(set_deep), "nodes: expected children after their parents"),
    "a node twice": (linked(lambda links: set_first(links, int(links.max()))), "nodes: expected one link to each"),
    "a node lost": (linked(lambda links: set_first(links, -1)), "nodes: expected one link to each"),
    "a leaf of no blocks": (linked(lambda links: set_first(links, -(2**31))), "nodes: expected leaves within"),
    "a leaf beyond": (linked(lambda links: lower(links, 8)), "nodes: expected leaves within"),
    "a leaf too long": (linked(lambda links: lower(links, 7)), "nodes: expected leaves within"),
    "an unknown face": (put((0,), 10**6, "block_faces"), "block_faces: expected faces of"),
    "a negative face": (put((0,), -2, "block_faces"), "block_faces: expected faces of"),
    "a lost face": (put((0,), -1, "block_faces"), "block_faces: expected each of"),
    "a face twice": (swap_blocks, "block_faces: expected each of"),
    "an unknown vertex": (put((5, 1), 10**6, "faces"), "a\ud800ü: faces: expected indices"),
    "a negative vertex": (put((5, 1), -1, "faces"), "faces: expected indices"),
    "nan": (put((5, 1), np.nan, "vertices"), "vertices: expected finite"),
    "fewer blocks": (lambda it: {"blocks": it.tree.blocks[:-BLOCK_WORDS]}, "blocks: expected 3"),
    "no nodes": (lambda it: {"nodes": it.tree.nodes[:0]}, "nodes: expected some where there are faces"),
    "no faces": (lambda it: {"faces": it.mesh.faces[:0]}, "block_faces: expected faces of 0"),
    "nodes alone": (
        lambda it: {"faces": it.mesh.faces[:0], "blocks": it.tree.blocks[:0], "block_faces": it.tree.faces[:0]},
        "nodes: expected some where there are faces, else none",
    ),
    "fewer normals": (lambda it: {"normals": it.mesh.normals[:-1]}, "normals: expected a row a vertex"),
    "bright": (put((5, 1), 2, "colors"), "colors: expected values in [0, 1]"),
}  # fmt: skip


@MAPPED
@pytest.mark.parametrize("fault", ARRAYS)
def test_forged_arrays_that_a_query_could_crash_at_are_refused(fault: str, mmap: bool, path: Path) -> None:
    arrays, said = ARRAYS[fault]
    it = SAVED["carrying"]()
    content = whole(path, "carrying")
    path.write_bytes(forged(content, nothing, **arrays(it)))
    with pytest.raises(ValueError, match=re.escape(said)) as caught:
        Octree.load(path, mmap=mmap)
    assert str(caught.value).startswith(f"{path}: ")


@MAPPED
def test_fewer_rows_of_repairs_than_faces_are_refused(mmap: bool, path: Path) -> None:
    content, it = whole(path, "repaired"), repaired()
    assert it.repairs is not None
    path.write_bytes(forged(content, nothing, kept_faces=it.repairs.kept_faces[:-1]))
    assert refusal(path, mmap) == "kept_faces: expected a row a face, 59, got 58"
    path.write_bytes(forged(content, nothing, kept_faces=np.append(it.repairs.kept_faces, 0)))
    assert refusal(path, mmap) == "kept_faces: expected a row a face, 59, got 60"


@MAPPED
@pytest.mark.parametrize("kind", ["carrying", "float32"])
@pytest.mark.parametrize("fill", ["bits", "nan", "infinities", "everywhere"])
def test_any_numbers_in_boxes_and_blocks_crash_no_query(fill: str, kind: str, mmap: bool, path: Path) -> None:
    """They may give any answer."""
    content, it, rng = whole(path, kind), SAVED[kind](), np.random.default_rng(3)
    nodes, links = links_of(it)
    kept, blocks = links.copy(), it.tree.blocks.copy()
    for array in (nodes, blocks):
        if fill == "bits":
            array.view(np.uint8)[:] = rng.integers(0, 256, array.nbytes)
        else:
            array[:] = {"nan": np.nan, "infinities": rng.choice([-np.inf, np.inf], len(array)), "everywhere": 0.0}[fill]
    if fill == "everywhere":  # boxes that every ray enters, and corners all over them
        boxes = nodes.reshape(-1, NODE_WORDS)[:, :CHILDREN].reshape(-1, 3, 2, 8)
        boxes[:, :, 0], boxes[:, :, 1], blocks[:] = -9.0, 9.0, rng.normal(size=len(blocks))
    links[:] = kept
    nodes.view(np.int32).reshape(-1, NODE_WORDS)[:, ORDERS : ORDERS + 8] = ANY_ORDER
    path.write_bytes(forged(content, nothing, nodes=nodes, blocks=blocks))
    loaded = Octree.load(path, mmap=mmap)
    found = asked(loaded)
    assert {name: len(bits) for name, bits in found.items() if "all" not in name} == {
        name: len(bits) for name, bits in asked(it).items() if "all" not in name
    }


def test_more_leaves_than_blocks_crash_no_query(path: Path) -> None:
    """Those who list the leaves below a node had room for one of each block: they wrote beyond it."""
    content, count = whole(path, "carrying"), 200
    nodes = np.zeros((count, NODE_WORDS), np.float32)
    nodes[:, :CHILDREN].reshape(count, 3, 2, 8)[:, :, 0], nodes[:, :CHILDREN].reshape(count, 3, 2, 8)[:, :, 1] = -1, 2
    links, levels = nodes.view(np.int32)[:, CHILDREN : CHILDREN + 8], np.zeros(count, int)
    links[:], nodes.view(np.int32)[:, ORDERS : ORDERS + 8] = -1, ANY_ORDER  # the first block
    for child in range(1, count):
        parent = (child - 1) // 8
        links[parent, (child - 1) % 8], levels[child] = child, levels[parent] + 1
    depth = int(levels.max()) + 1
    path.write_bytes(forged(content, lambda header: header.update(depth=depth), nodes=nodes.ravel()))
    script = (
        "import sys; from renderer import Octree; print(Octree.load(sys.argv[1]).winding_number([[0.1, 0.2, 0.3]]))"
    )
    done = subprocess.run([sys.executable, "-c", script, str(path)], capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr


# --- saving -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("failing", ["write", "replace"])
def test_a_file_that_cannot_be_written_stays_as_it_was(
    path: Path, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    content = whole(path)

    def refuse(*arguments: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    if failing == "replace":
        monkeypatch.setattr(files.os, "replace", refuse)
    else:
        monkeypatch.setattr(container, "_zeros_after", refuse)
    with pytest.raises(OSError, match="No space left on device"):
        SAVED["carrying"]().save(path)
    assert path.read_bytes() == content and os.listdir(path.parent) == [path.name]


def test_mesh_and_tree_are_saved_as_they_are_at_one_time(path: Path) -> None:
    class Restless(Octree):
        """It is refitted, as by another thread, when its mesh is read."""

        @property
        def mesh(self) -> Mesh:
            mesh = self._built[0]
            self.refit(mesh.vertices * 2.0)
            return mesh

    restless = Restless.from_mesh(icosphere(2))
    expected = asked(Octree.from_mesh(restless._built[0]))
    restless.save(path)
    assert asked(Octree.load(path)) == expected


def test_a_machine_of_another_order_of_bytes_is_told(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "byteorder", "big")
    for call in (SAVED["one face"]().save, Octree.load):
        with pytest.raises(ValueError, match=r"^sys.byteorder: expected little, as numbers in the file, got big"):
            call(path)
    assert not path.exists()


@pytest.mark.parametrize("bad", [None, 1, "yes", [], np.array([True, False])], ids=repr)
def test_mmap_is_true_or_false(bad: Any, path: Path) -> None:
    SAVED["one face"]().save(path)
    with pytest.raises(ValueError, match=r"^mmap: expected True or False, got"):
        Octree.load(path, mmap=bad)


def test_threads_are_checked_before_the_file() -> None:
    with pytest.raises(ValueError, match=r"^threads: expected an integer >= 1 or None, got 0"):
        Octree.load("absent", threads=0)
