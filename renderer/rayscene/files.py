"""Mesh files as the objects of a scene."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.errors import MeshError
from renderer.mesh.load import FilePaths, load_placed, mesh_paths
from renderer.mesh.placements import Placed
from renderer.octree import Octree
from renderer.queryable import Built
from renderer.rayscene.built import BuiltScene, Member, tree_over
from renderer.rayscene.store import StoredScene
from renderer.rayscene.transforms import as_transforms, can_be_inverted
from renderer.trace.layout import MASK_BITS


class _Object(NamedTuple):
    """An object: its mesh with its tree, where its instances stand, (k, 3, 4), and their names, k or none."""

    built: Built
    transforms: NDArray[np.float64]
    names: tuple[str, ...]


def scene_of_files(paths: FilePaths, threads: int) -> StoredScene:
    """The scene in mesh files, see ``RayScene.from_files``."""
    members: list[Member] = []
    transforms = [np.empty((0, 3, 4))]
    for built, own, names in _objects(paths, threads):
        members.append(Member(len(members), built.mesh.name, built, len(own), names))
        transforms.append(own)
    matrices = np.concatenate(transforms)
    try:
        tree = tree_over(members, matrices, np.full(len(matrices), MASK_BITS), threads)
    except ValueError as error:
        raise MeshError(f"{paths!s:.300}: {error}") from error
    return StoredScene(BuiltScene(tree, threads), len(members))


def _objects(paths: FilePaths, threads: int) -> Iterator[_Object]:
    """The objects in mesh files."""
    for path, placed in _placed(paths):
        try:
            for each in placed:
                yield from _invertible(each, threads)
        except ValueError as error:
            raise MeshError(f"{path}: {error}") from error


def _placed(paths: FilePaths) -> Iterator[tuple[Path, list[Placed]]]:
    """The meshes of each file. Among several files, the names of meshes begin with that of their file."""
    files = mesh_paths(paths)
    alone = isinstance(paths, str | os.PathLike) and not os.path.isdir(paths)
    for file in files:
        placed, stem = load_placed(file), Path(file.name.removesuffix(".gz")).stem
        if not alone:
            names = [stem if len(placed) == 1 else f"{stem}/{each.mesh.name}" for each in placed]
            placed = [each._replace(mesh=replace(each.mesh, name=n)) for each, n in zip(placed, names, strict=True)]
        yield file, placed


def _invertible(placed: Placed, threads: int) -> Iterator[_Object]:
    """A mesh with the instances that can be inverted, and each other one as a mesh in the world."""
    mesh, matrices, names = placed
    built, transforms = Octree(mesh, threads=threads)._built, as_transforms(matrices)
    good = can_be_inverted(Member(0, "", built, 0).row, transforms)
    if good.any():
        yield _Object(built, transforms[good], tuple(compress(names, good)))
    for row in np.flatnonzero(~good):
        flat = Octree(mesh.transformed(matrices[row]), threads=threads)._built
        yield _Object(flat, as_transforms(None), names[row : row + 1])
