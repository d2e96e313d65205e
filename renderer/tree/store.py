"""The file of a built octree: its mesh, tree and repairs, written whole, and checked when it is read.

Version 2 of a file as ``container`` describes it. Its text has {"depth": 8, "scale": 1.0, "name": "teapot"}; of a mesh
of several parts also "parts": [["body", 900], ["wheel", 120], ...], the name and the number of faces of each.
``_KINDS`` has the arrays that there are. ``trace.layout`` describes nodes and blocks; "block_faces" is ``Tree.faces``.
"""

import math
import os
from typing import Any, BinaryIO, NamedTuple

from renderer.arguments.counts import is_count
from renderer.errors import expect
from renderer.mesh.mesh import Mesh, Repairs, give_parts
from renderer.mesh.parts import Part, parts_of
from renderer.system.files import write_atomically
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, NODE_WORDS, Tree, locked
from renderer.tree.container import Arrays, Format, Reader, checked_path, opened, shown, write
from renderer.tree.invariants import check_safe

# No tree has more levels: cuts by the split rule end after 3 * 64 of them, the greatest ``max_depth``, and cuts in even
# halves within 31 more.
_MAX_LEVELS = 256

_KINDS: dict[str, tuple[tuple[str, ...], tuple[int, ...]]] = {
    "vertices": (("<f8",), (3,)),
    "faces": (("<i4",), (3,)),
    "normals": (("<f8",), (3,)),
    "colors": (("<f4",), (3,)),
    "texcoords": (("<f8",), (2,)),
    "nodes": (("<f4",), (NODE_WORDS,)),
    "blocks": (("<f4", "<f8"), (BLOCK_WORDS,)),
    "block_faces": (("<i4",), (BLOCK_FACES,)),
    "dropped_faces": (("<i8",), ()),
    "bad_vertices": (("<i8",), ()),
    "kept_faces": (("<i8",), ()),
    "bad_normals": (("<i8",), ()),
}
_OF_MESH = ("vertices", "faces", "normals", "colors", "texcoords")
_OF_REPAIRS = ("dropped_faces", "bad_vertices", "kept_faces", "bad_normals")
_FORMAT = Format(
    magic=b"\x89OCTREE\n",
    version=2,
    content="an octree that Octree.save wrote",
    keys=("depth", "scale", "name"),
    optional=("parts",),
    kinds=_KINDS,
    always=frozenset({"vertices", "faces", "nodes", "blocks", "block_faces"}),
)


class Stored(NamedTuple):
    """The parts of an octree that a file keeps; ``repairs`` is None without ``repair=True``."""

    mesh: Mesh
    tree: Tree
    repairs: Repairs | None


def save_octree(path: str | os.PathLike[str], stored: Stored) -> None:
    """Write an octree to a file, whole or not at all, see ``Octree.save``."""
    write_atomically(checked_path(path), lambda file: write_octree(file, stored))


def load_octree(path: str | os.PathLike[str], mapped: bool) -> Stored:
    """The octree in a file, in memory or as a map of the file, see ``Octree.load``."""
    with opened(path, mapped) as reader:
        stored = read_octree(reader)
        reader.expect_end()
    return stored


def write_octree(file: BinaryIO, stored: Stored) -> None:
    """Write an octree to an open file."""
    mesh, tree, repairs = stored
    arrays = {name: getattr(mesh, name) for name in _OF_MESH if getattr(mesh, name) is not None}
    arrays |= {"nodes": tree.nodes, "blocks": tree.blocks, "block_faces": tree.faces}
    arrays |= {name: getattr(repairs, name) for name in _OF_REPAIRS} if repairs is not None else {}
    described = {"depth": int(tree.depth), "scale": float(tree.scale), "name": mesh.name}
    if mesh._parts:
        described["parts"] = [[part.name, part.faces.stop - part.faces.start] for part in mesh._parts]
    write(file, _FORMAT, described, arrays)


def read_octree(reader: Reader) -> Stored:
    """The octree that comes next in a file, checked so far that tracing is safe."""
    described, arrays = reader.next(_FORMAT)
    depth, scale, name = (described[key] for key in _FORMAT.keys)
    expect(is_count(depth, 0, _MAX_LEVELS), "depth", f"an integer from 0 to {_MAX_LEVELS}", shown(depth))
    good = isinstance(scale, float) and math.frexp(scale)[0] == 0.5
    expect(good, "scale", "a power of two", shown(scale))
    expect(isinstance(name, str), "name", "a string", shown(name))
    mesh = _mesh(arrays, name, _parts(described.get("parts", [])))
    nodes, blocks, faces = (arrays[of].reshape(-1) for of in ("nodes", "blocks", "block_faces"))
    tree = Tree(nodes, blocks, faces, depth, scale)
    check_safe(tree, len(mesh.faces))
    return Stored(mesh, tree, _repairs(arrays, len(mesh.faces)))


def _mesh(arrays: Arrays, name: str, parts: tuple[Part, ...]) -> Mesh:
    mesh = Mesh._viewing({of: arrays[of] for of in _OF_MESH if of in arrays}, name)
    counted = parts[-1].faces.stop if parts else len(mesh.faces)
    expect(counted == len(mesh.faces), "parts", f"{len(mesh.faces)} faces in all", counted)
    return give_parts(mesh, parts)


def _parts(listed: Any) -> tuple[Part, ...]:
    """The parts of the mesh, none if it has one only."""
    good = isinstance(listed, list) and all(
        isinstance(entry, list) and len(entry) == 2 and isinstance(entry[0], str) and is_count(entry[1], 0, 2**32 - 1)
        for entry in listed
    )
    expect(good, "parts", "pairs of a name and a number of faces", shown(listed))
    return parts_of([name for name, _ in listed], [count for _, count in listed])


def _repairs(arrays: Arrays, faces: int) -> Repairs | None:
    given = [arrays[name] for name in _OF_REPAIRS if name in arrays]
    expect(len(given) in (0, len(_OF_REPAIRS)), "arrays", f"all of {_OF_REPAIRS} or none", f"{len(given)} of them")
    repairs = Repairs(*map(locked, given)) if given else None
    kept = faces if repairs is None else len(repairs.kept_faces)
    expect(kept == faces, "kept_faces", f"a row a face, {faces}", kept)
    return repairs
