"""Scenes in which meshes stand more than once, for the Whitted kernel: each mesh and its tree once.

Pictures have the bits of those of the merged mesh, as a ray scene answers like it.
"""

from collections.abc import Callable, Iterator
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.split import Split
from renderer.materials.appearance import Appearance
from renderer.materials.base import appearance_of
from renderer.mesh.mesh import Mesh
from renderer.octree import SMALLEST, Octree
from renderer.picture.maps import texcoords_of, tints_of
from renderer.picture.pack import without_faces
from renderer.queryable import Built
from renderer.rayscene.built import BuiltScene, Member, tree_over
from renderer.scene.instance import Instance
from renderer.scene.needs import Features
from renderer.scene.scene import Scene
from renderer.shade.surface import SceneArrays
from renderer.trace.layout import MASK_BITS

# The least number of faces that copies add. Of fewer, the merged mesh is small: 200 bytes a face with its tree.
_LEAST = 1 << 14
_NOT_MOVED = np.eye(3, 4)
Floats = NDArray[np.float64]


def placed(scene: Scene, needs: Features, split: Split, threads: int) -> BuiltScene | None:
    """``scene`` with each mesh once, where it pays; None where it does not, or where a mesh cannot be placed."""
    if _copied(scene) < _LEAST:
        return None
    stands = list(_stands(scene))
    sources = {id(mesh): mesh for mesh, _ in stands}
    trees = {key: Octree.from_mesh(mesh, split=split, threads=threads).tree for key, mesh in sources.items()}
    members, transforms = list[Member](), list[NDArray[np.float64]]()
    for mesh, matrices in stands:
        own = Built(mesh, trees[id(mesh)])
        members.append(Member(len(members), "", own, len(matrices)))
        transforms += matrices
    flags = np.full(len(transforms), MASK_BITS)
    try:
        top = tree_over(members, np.array(transforms), flags, threads)
    except ValueError:  # a mesh that a matrix makes flat, or coordinates beyond those of pictures
        return None
    built = BuiltScene(top, threads)
    usual = all(tree.scale == 1.0 for tree in trees.values()) and np.abs(built.bounds).max() >= SMALLEST
    return built if usual else None


def _copied(scene: Scene) -> int:
    """The faces of all meshes, less those of each mesh once."""
    shared = [i for i in scene.instances if i.shares_normals]
    return sum(i.faces for i in shared) - sum({id(i.source): i.faces for i in shared}.values())


def _stands(scene: Scene) -> Iterator[tuple[Mesh, list[NDArray[np.float64]]]]:
    """Meshes in the order of the scene's instances, and the matrices (3, 4) by which each stands there."""
    own = [(_standing(i), i.matrix[:3] if i.shares_normals else _NOT_MOVED) for i in scene.instances]
    for _, together in groupby(own, lambda pair: id(pair[0])):
        pairs = list(together)
        yield pairs[0][0], [matrix for _, matrix in pairs]


def placed_arrays(scene: Scene, needs: Features, built: BuiltScene) -> SceneArrays:
    """The kernel's arrays other than ``built``, with the addresses of smooth meshes' normals, which ``scene`` keeps."""
    smooth = [i.smooth and needs.smooth_normals for i in scene.instances]
    own = [_normals(i).ctypes.data if is_smooth else 0 for i, is_smooth in zip(scene.instances, smooth, strict=True)]
    arrays = without_faces(scene, needs)._replace(normals=np.array(own, np.int64), placed=built.top.descriptor)
    if not needs.textures:
        return arrays
    return arrays._replace(texcoords=_each_once(scene, texcoords_of), tints=_each_once(scene, tints_of))


def _each_once(scene: Scene, values_of: Callable[[Instance, Mesh, Appearance], NDArray[np.float64]]) -> Floats:
    """For each instance the place where its vertices' values start, and behind them the values of each mesh once."""
    starts, places, parts, end = list[float](), dict[Any, int](), list[Floats](), len(scene.instances)
    for instance in scene.instances:
        look, mesh = appearance_of(scene.materials[instance.material]), _standing(instance)
        which = id(mesh), look.vertex_colors
        if which not in places:
            parts.append(values_of(instance, mesh, look).astype(np.float64).ravel())
            places[which], end = end, end + len(parts[-1])
        starts.append(places[which])
    return np.concatenate([np.array(starts, np.float64), *parts])


def _standing(instance: Instance) -> Mesh:
    """The mesh that stands in the scene for an instance, placed or as it is."""
    return instance.source if instance.shares_normals else instance.mesh


def _normals(instance: Instance) -> NDArray[np.float64]:
    """The normals of the mesh that stands in the scene for a smooth instance."""
    own = instance.source.normals
    return instance.normals if own is None else own
