"""The watertight sweep: it passes on our kernel, its rays are hard, and it fails on a mesh with a hole."""

from collections import Counter

import numpy as np
import pytest
from cases import cases

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.hits import watertight
from validation.hits.watertight import BUILDS, ClosedMesh, LeakEffort, Placement

SHAPES = {closed.name: closed for closed in watertight.closed_meshes()}
BALL = SHAPES["icosphere 3"]
PLACES = {
    "turned": Placement(BALL, True, 0.0, 1.0),
    "far": Placement(BALL, False, 1e6, 1.0),
    "far and small": Placement(BALL, True, 1e4, 1e-6),
    "large": Placement(BALL, False, 0.0, 1e6),
}


def rng():
    return np.random.default_rng(5)


def shots(closed, rays=400):
    return [s for p in watertight.placements(closed) for s in watertight.shoot(p, BUILDS[:2], rays, rng())]


def moller_trumbore_misses(mesh, rays):
    """Rays that Moller and Trumbore's float64 test, which is not watertight, lets through."""
    corners = mesh.vertices[mesh.faces]
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    missed = 0
    for o, d in zip(rays.origins, rays.directions, strict=True):
        p, s = np.cross(d, e2), o - corners[:, 0]
        inverse = 1 / (e1 * p).sum(axis=1)
        q = np.cross(s, e1)
        u, v, t = (s * p).sum(axis=1) * inverse, (q @ d) * inverse, (q * e2).sum(axis=1) * inverse
        missed += not ((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)).any()
    return missed


@cases("name", SHAPES)
def test_what_is_shot_at_is_closed(name):
    closed = SHAPES[name]
    assert closed.mesh.is_closed()
    assert closed.inside(rng(), 7).shape == (7, 3)


@cases("place", PLACES)
@cases("kind", watertight.KINDS)
def test_the_rays_come_so_close_that_a_leaky_kernel_leaks(place, kind):
    placement = PLACES[place]
    rays = placement.rays(kind, 400, rng())
    assert moller_trumbore_misses(Mesh(placement.vertices(), BALL.mesh.faces), rays) > 0
    assert watertight.leaks(Octree(placement.vertices(), BALL.mesh.faces), rays) == 0


def test_no_ray_leaks_in_any_place():
    gates = watertight.gates(shots(BALL))
    assert [gate.value for gate in gates] == [0.0, 0.0]
    assert all(gate.passed for gate in gates)


@pytest.mark.parametrize("name", ["icosphere 3", "torus", "integer box"])
def test_a_hole_fails_every_gate(name):
    closed = SHAPES[name]
    # The rays are aimed at what is left, so only those at the rim of the holes can leak.
    holed = ClosedMesh(
        name, Mesh(closed.mesh.vertices, closed.mesh.faces[np.arange(len(closed.mesh.faces)) % 8 > 0]), closed.inside
    )
    gates = watertight.gates(shots(holed))
    assert len(gates) == 2 and not any(gate.passed for gate in gates)


def test_any_hit_counts_as_well(monkeypatch):
    octree = Octree.from_mesh(BALL.mesh)
    rays = Placement(BALL, False, 0.0, 1.0).rays("vertex", 100, rng())
    monkeypatch.setattr(octree, "any_hit", lambda origins, directions: np.arange(len(origins)) >= 3)
    assert watertight.leaks(octree, rays) == 3


@pytest.mark.parametrize(("count", "least"), [(1, 1), (3, 3)])
def test_every_mesh_meets_every_build(count, least):
    places = 2 * len(watertight.OFFSETS) * len(watertight.SCALES)
    met = Counter(build for place in range(places) for build in watertight.builds(place, count))
    assert set(met) == set(BUILDS) and min(met.values()) >= least


def test_a_place_that_flattens_faces_is_known():
    fine = SHAPES["icosphere 6"]
    good, bad = Placement(fine, False, 1e6, 1e-6), Placement(fine, False, 1e9, 1e-6)
    assert good.keeps_sides(good.vertices())
    assert not bad.keeps_sides(bad.vertices())


def test_a_sweep_counts_all_rays_and_names_what_it_left_out(monkeypatch):
    monkeypatch.setattr(watertight, "QUICK", LeakEffort(rays=3_000, builds=1, embree=20))
    monkeypatch.setattr(watertight, "closed_meshes", lambda: (BALL, SHAPES["integer box"]))
    monkeypatch.setattr(watertight, "OFFSETS", (0.0, 1e12))
    record, gates = watertight.summary([watertight.sweep(index, True) for index in range(2)])
    assert {row["mesh"] for row in record["meshes"]} == {"icosphere 3", "integer box"}
    assert {(row["mesh"], row["offset"], row["scale"]) for row in record["left_out"]} >= {("icosphere 3", 1e12, 1e-6)}
    assert all(row["offset"] == 1e12 and row["scale"] < 1e6 for row in record["left_out"])
    assert sum(row["ours_rays"] for row in record["meshes"]) >= 5_800
    assert len(gates) == 4 and all(gate.passed for gate in gates)
    small = [row for row in record["places"] if row["offset"] == 1e12 and row["scale"] < 1e6]
    assert {(row["embree_robust_rays"], row["embree_robust"]) for row in small} == {(0, None)}
    robust = [row["embree_robust"] for row in record["meshes"]]
    default = [row["embree_default"] for row in record["meshes"]]
    assert sum(default) > sum(robust)
