"""Copies and pickles of meshes, trees and prepared scenes: used or not, they answer alike, and stay checked."""

import copy
import gc
import pickle
from typing import Any

import numpy as np
import pytest

from renderer import BruteForce, MeshError, Octree, PerspectiveCamera, Phong, Scene, SceneObject, prepare, render
from renderer.jit.notice import compile_seconds
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere

COPIES = {"deepcopy": copy.deepcopy, "copy": copy.copy, "pickle": lambda thing: pickle.loads(pickle.dumps(thing))}
by_any_way = pytest.mark.parametrize("way", COPIES)
RAYS = np.random.default_rng(3).normal(size=(100, 3)) * 3.0


def used(kind: Any) -> Any:
    """A tree that has answered once, as many and as few."""
    octree = kind.from_mesh(icosphere(3))
    octree.closest_hit(RAYS, -RAYS)
    octree.closest_hit(RAYS[:1], -RAYS[:1])
    return octree


def test_a_pickle_of_nodes_without_orders_is_refused() -> None:
    restore, (*parts, form) = Octree(icosphere(1)).tree.__reduce__()
    assert restore(*parts, form).depth > 0
    with pytest.raises(ValueError, match=r"^pickle: expected an octree of this release, got one of an earlier"):
        restore(*parts)


@by_any_way
@pytest.mark.parametrize("kind", [Octree, BruteForce])
def test_a_copy_of_a_used_tree_outlives_it(kind: Any, way: str) -> None:
    octree = used(kind)
    expected = [octree.closest_hit(RAYS[:n], -RAYS[:n]).t for n in (1, 100)]
    copied = COPIES[way](octree)
    # Its memory is given to others and written over.
    del octree
    gc.collect()
    other = [np.full(2000 * k, np.nan) for k in range(1, 60)]
    for n, t in zip((1, 100), expected, strict=True):
        np.testing.assert_array_equal(copied.closest_hit(RAYS[:n], -RAYS[:n]).t, t)
    assert other


@by_any_way
def test_a_copied_mesh_cannot_be_written(way: str) -> None:
    mesh = icosphere(1)
    full = Mesh(mesh.vertices, mesh.faces, mesh.vertices, abs(mesh.vertices), mesh.vertices[:, :2], "ball")
    copied = COPIES[way](full)
    for name in ("vertices", "faces", "normals", "colors", "texcoords"):
        np.testing.assert_array_equal(getattr(copied, name), getattr(full, name))
        assert not getattr(copied, name).flags.writeable
    assert copied.name == "ball"


@pytest.mark.parametrize("kind", [Octree, BruteForce])
def test_a_mesh_that_was_made_writable_is_checked_again(kind: Any) -> None:
    mesh = icosphere(1)
    mesh.faces.flags.writeable = True
    mesh.faces[5] = 10**8
    with pytest.raises(MeshError, match="faces: expected indices from 0 to 41"):
        kind.from_mesh(mesh)


def scene() -> Scene:
    ball = SceneObject(mesh=icosphere(2), material="grey")
    camera = PerspectiveCamera(eye=(0, 0, 4), target=(0, 0, 0))
    return Scene(camera=camera, materials={"grey": Phong(reflectance=0.3)}, objects=[ball], ambient=1)


@by_any_way
def test_a_copied_prepared_scene_renders_the_same_and_compiles_nothing(way: str) -> None:
    ready = prepare(scene())
    expected = render(ready, resolution=(16, 16)).radiance
    copied = COPIES[way](ready)
    del ready
    gc.collect()
    before = compile_seconds()
    np.testing.assert_array_equal(render(copied, resolution=(16, 16)).radiance, expected)
    assert compile_seconds() == before
    assert copied.mesh is copied.octree.mesh
