"""The file of a scene: where its instances stand, then its octrees, each once, as ``tree.store`` writes them.

Version 1 of a file as ``tree.container`` describes it. Its text has {"next": 3, "octrees": 1, "objects": [{"id": 0,
"name": "tree", "octree": 0, "instances": 500}, ...]}: the number that the next object gets, how many octrees follow,
and the objects in order. An object whose instances have names also has "names", a list of them. The arrays have a row
for each instance: the transform, and as in ``trace.instances`` the mask and whether it is hidden.
"""

from __future__ import annotations

import os
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from renderer.arguments.counts import is_count
from renderer.errors import expect
from renderer.queryable import Built
from renderer.rayscene.built import BuiltScene, Member, placement, tree_over
from renderer.rayscene.transforms import as_transforms
from renderer.system.files import write_atomically
from renderer.trace.instances import HIDDEN
from renderer.trace.layout import MASK_BITS
from renderer.tree.container import Format, Reader, checked_path, opened, shown, write
from renderer.tree.store import Stored, read_octree, write_octree

_FORMAT = Format(
    magic=b"\x89SCENE\r\n",
    version=1,
    content="a scene that RayScene.save wrote",
    keys=("next", "octrees", "objects"),
    optional=(),
    kinds={"transforms": (("<f8",), (3, 4)), "flags": (("<i8",), ())},
    always=frozenset({"transforms", "flags"}),
)
_MOST = 2**32 - 1


class StoredScene(NamedTuple):
    """The content of a scene's file: the scene at one moment, and the number that the next object gets."""

    built: BuiltScene
    next: int


def save_scene(path: str | os.PathLike[str], stored: StoredScene) -> None:
    """Write a scene to a file, whole or not at all, see ``RayScene.save``."""
    write_atomically(checked_path(path), lambda file: _write(file, stored))


def load_scene(path: str | os.PathLike[str], mapped: bool, threads: int) -> StoredScene:
    """The scene in a file, see ``RayScene.load``."""
    # Boxes of forged meshes may be larger than float64 holds: those scenes are refused when they are placed.
    with opened(path, mapped) as reader, np.errstate(all="ignore"):
        stored = _read(reader, threads)
    return stored


def _write(file: BinaryIO, stored: StoredScene) -> None:
    members = stored.built.members
    octrees = {id(m.built): m.built for m in members}
    numbers = {key: number for number, key in enumerate(octrees)}
    objects = [_described(m, numbers[id(m.built)]) for m in members]
    transforms, flags = placement(members, stored.built.top.instances)
    described = {"next": stored.next, "octrees": len(octrees), "objects": objects}
    write(file, _FORMAT, described, {"transforms": transforms, "flags": flags})
    for mesh, tree in octrees.values():
        write_octree(file, Stored(mesh, tree, None))


def _described(member: Member, octree: int) -> dict[str, Any]:
    """The entry of an object."""
    entry = {"id": member.id, "name": member.name, "octree": octree, "instances": member.count}
    return entry | ({"names": list(member.names)} if member.names else {})


def _read(reader: Reader, threads: int) -> StoredScene:
    """The scene in a file, checked so far that tracing is safe."""
    described, arrays = reader.next(_FORMAT)
    count, following = described["octrees"], described["next"]
    expect(is_count(count, 0, _MOST), "octrees", "their number", shown(count))
    expect(is_count(following, 0, _MOST), "next", "the number of an object", shown(following))
    transforms, flags = as_transforms(arrays["transforms"]), arrays["flags"]
    expect(len(flags) == len(transforms), "flags", f"a row an instance, {len(transforms)}", len(flags))
    known = bool((flags & ~(MASK_BITS | HIDDEN) == 0).all())
    expect(known, "flags", "masks, and whether an instance is hidden", "other bits")
    entries = _entries(described["objects"], following, count)
    octrees = [_octree(reader, number) for number in range(count)]
    reader.expect_end()
    members = []
    for entry in entries:
        names = tuple(entry.get("names", ()))
        members.append(Member(entry["id"], entry["name"], octrees[entry["octree"]], entry["instances"], names))
    placed = sum(member.count for member in members)
    expect(placed == len(transforms), "objects", f"{len(transforms)} instances in all", placed)
    return StoredScene(BuiltScene(tree_over(members, transforms, flags, threads), threads), following)


def _octree(reader: Reader, number: int) -> Built:
    try:
        mesh, tree, _ = read_octree(reader)
    except ValueError as error:
        raise ValueError(f"octree {number}: {error}") from error
    return Built(mesh, tree)


def _entries(listed: Any, following: int, octrees: int) -> list[dict[str, Any]]:
    """The entries of objects, whose numbers rise to ``following``."""
    expect(isinstance(listed, list), "objects", "a list", shown(listed))
    least = 0
    for entry in listed:
        good = (
            isinstance(entry, dict)
            and sorted({"names", *entry}) == ["id", "instances", "name", "names", "octree"]
            and is_count(entry["id"], least, following - 1)
            and isinstance(entry["name"], str)
            and is_count(entry["octree"], 0, octrees - 1)
            and is_count(entry["instances"], 0, _MOST)
            and _are_names(entry.get("names", []), entry["instances"])
        )
        expect(good, "objects", f"id from {least}, name, octree below {octrees}, instances", shown(entry))
        least = entry["id"] + 1
    return listed


def _are_names(names: Any, count: int) -> bool:
    """Whether it is a list of a name for each instance, or of none."""
    return isinstance(names, list) and len(names) in (0, count) and all(isinstance(name, str) for name in names)
