"""Kernels given rays of any float64 at all: they end, stay within their memory, and spoil no good ray beside them."""

import itertools
from typing import Any

import numpy as np
import pytest
from cases import cases
from meshes import make_mesh
from numpy.typing import NDArray

from renderer import (
    Mesh,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    Scene,
    SceneError,
    SceneObject,
    render,
)
from renderer.arguments.limits import FARTHEST, LONGEST, SHORTEST
from renderer.jit.decorators import kernel
from renderer.mesh.shapes import icosphere
from renderer.octree import Octree
from renderer.trace.batch import NO_STARTS, RayBatch
from renderer.trace.rays import HIT_ROWS, batch_pointers, hit_pointers
from renderer.trace.traverse import new_scratch, scratch_pointers, search_blocks, trace
from renderer.trace.trees import tree_pointers

# What arithmetic may end in, or begin with when nobody looked.
WORST = np.array([0.0, 1.0, 0.3, 5e-324, 1e-310, 1e-30, 1e30, FARTHEST, 2.0**127, 3.5e38, 1e40, 1e300, 1.7e308, np.inf])
ANY = np.concatenate([WORST, -WORST, [np.nan]])
# Written around the memory of a search, and looked for afterwards.
GUARD = 0x7EADBEEF


@kernel
def unchecked(descriptor, rays, out, any_hit, memory, by_blocks):
    """``trace_chunk`` without its check of the rays."""
    tree = tree_pointers(descriptor)
    count = len(rays[1])
    source, found = batch_pointers(rays, tree.scale), hit_pointers(out, count)
    if by_blocks:
        search_blocks(tree, source, found, 0, count, scratch_pointers(memory, source.starts).holders, any_hit)
    else:
        trace(tree, source, found, 0, count, scratch_pointers(memory, source.starts), any_hit)


def answers(octree, rays, any_hit, by_blocks=False):
    """t, u, v, face and side of rays that nobody checked, or hit; the words around the scratch are as they were."""
    count, memory = len(rays[1]), new_scratch(octree.tree.depth, len(rays[1]))
    padded = np.full(len(memory) + 128, GUARD, np.int64)
    padded[64:-64], memory = memory, padded[64:-64]
    out = np.full((HIT_ROWS, count), -7.0)
    unchecked(octree.tree.descriptor, rays, out, any_hit, memory, by_blocks)
    assert (padded[:64] == GUARD).all()
    assert (padded[-64:] == GUARD).all()
    return out.view(np.bool_)[0, :count] if any_hit else out


def any_rays(rng, count, alike):
    """Rays of the worst numbers, each alone or in sixteens with nearly one direction; and bounds as bad as they."""
    origins, directions = rng.normal(size=(2, count, 3))
    if alike:
        directions = np.repeat(rng.normal(size=(-(-count // 16), 3)), 16, axis=0)[:count]
        directions = directions * rng.choice([1.0, 1.0, 1e-300, 1e300, 5e-324], (count, 1))
    for array, share in ((origins, 0.2), (directions, 0.0 if alike else 0.3)):
        bad = rng.random(array.shape) < share
        array[bad] = rng.choice(ANY, bad.sum())
    t_min = np.where(rng.random(count) < 0.1, rng.choice(ANY, count), 0.0)
    t_max = np.where(rng.random(count) < 0.1, rng.choice(ANY, count), np.inf)
    return RayBatch(origins, directions, t_min, t_max)


def in_range(origins, directions, t_min, t_max, starts):
    """The rays that queries would take."""
    assert starts is NO_STARTS
    largest = np.abs(directions).max(axis=1)
    near, fits = (np.abs(origins) <= FARTHEST).all(axis=1), (largest >= SHORTEST) & (largest <= LONGEST)
    return near & fits & np.isfinite(directions).all(axis=1) & (t_min >= 0.0) & (t_min < np.inf) & (t_max >= 0.0)


@cases("alike", [False, True])
@cases("kind", ["soup", "lattice", "sphere", "flat"])
@cases("any_hit", [None, True])
def test_no_ray_leaves_its_stack_or_spoils_another(kind, alike, any_hit):
    rng = np.random.default_rng([1, len(kind), alike])
    mesh = icosphere(3) if kind == "sphere" else Mesh(*make_mesh(kind, 5, 500))
    octree = Octree.from_mesh(mesh, leaf_size=4)
    assert octree.tree.depth >= 3
    with np.errstate(all="ignore"):
        rays = any_rays(rng, 6000, alike)
        found, right = answers(octree, rays, any_hit), answers(octree, rays, any_hit, by_blocks=True)
    good = in_range(*rays)
    assert 500 < good.sum() < 5500
    if any_hit:
        np.testing.assert_array_equal(found[good], right[good])
        return
    faces = found[3].view(np.int64)
    assert (faces[good] >= 0).sum() > 450
    np.testing.assert_array_equal(found[:, good], right[:, good])
    assert (faces >= -1).all()
    assert (faces < len(mesh.faces)).all()


def scene_before(camera: Any) -> Scene:
    ball = SceneObject(mesh=icosphere(2), material="grey")
    return Scene(camera=camera, materials={"grey": Phong()}, objects=[ball], ambient=1)


@cases("far", [1e38, 1e300])
@cases("camera", [PerspectiveCamera, OrthographicCamera])
def test_an_eye_too_far_away_is_refused_by_name(camera: Any, far: float) -> None:
    lens = {"height": 4.0} if camera is OrthographicCamera else {"fov": 1e-9}
    with pytest.raises(SceneError, match=r"eye: expected coordinates within 8.51e\+37.* got \[0, 0, "):
        camera(eye=[0, 0, far], target=[0, 0, 0], **lens)


def film(image: Any) -> list[NDArray[Any]]:
    return [image.radiance, image.depth, image.face, image.normal]


@cases(
    "lens",
    [{"height": h} for h in (5e-324, 1e-300, 1e30, FARTHEST)] + [{"fov": f} for f in (5e-324, 1e-9, 180 - 2.0**-45)],
)
def test_any_camera_ends_and_sees_what_brute_force_sees(lens: Any) -> None:
    kind: Any = OrthographicCamera if "height" in lens else PerspectiveCamera
    for x, z in itertools.product((0.0, -FARTHEST, 3e-310), (2.0, -1e37, FARTHEST)):
        scene = scene_before(kind(eye=(x, 0, z), target=(0, 0, 0), **lens))
        found, right = (render(scene, accelerator=a, resolution=(40, 24)) for a in ("octree", "brute"))
        for ours, brute in zip(film(found), film(right), strict=True):
            np.testing.assert_array_equal(ours, brute)
        assert np.isfinite(found.radiance).all()
