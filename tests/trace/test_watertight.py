"""No ray leaves a closed mesh unseen: from inside, aimed at edges and vertices, through every split rule."""

import numpy as np
import pytest
from cases import cases

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, torus
from renderer.octree import BruteForce, Octree

COUNT = 20_000


def aimed(mesh, inside, seed):
    """(origins, directions) of COUNT rays at points of edges and of COUNT rays at vertices."""
    rng = np.random.default_rng(seed)
    origins = inside(rng, 2 * COUNT)
    corners = mesh.triangles[rng.integers(0, len(mesh.faces), COUNT)]
    along = rng.random((COUNT, 1))
    at_edges = corners[:, 0] + along * (corners[:, 1] - corners[:, 0])
    at_vertices = mesh.vertices[rng.integers(0, len(mesh.vertices), COUNT)]
    return origins, np.concatenate([at_edges, at_vertices]) - origins


def in_ball(rng, count):
    return rng.uniform(-0.5, 0.5, (count, 3))


def in_tube(rng, count):
    """Points about the circle that the tube of the default torus follows."""
    angle = rng.uniform(0, 2 * np.pi, count)
    ring = np.stack([np.cos(angle), np.zeros(count), np.sin(angle)], axis=1)
    return ring + rng.uniform(-0.1, 0.1, (count, 3))


def in_box(rng, count):
    return rng.uniform(0.01, 0.99, (count, 3))


def as_float32(mesh):
    return Mesh(mesh.vertices.astype(np.float32), mesh.faces)


CLOSED = {
    "icosphere": (lambda: icosphere(5), in_ball),
    "icosphere float32": (lambda: as_float32(icosphere(5)), in_ball),
    "torus": (lambda: torus(around=500, across=100), in_tube),
    "box": (box, in_box),
}


@cases("split", ["midpoint", "sah"])
@cases("name", CLOSED)
def test_no_ray_from_inside_leaks(name, split):
    make, inside = CLOSED[name]
    mesh = make()
    assert mesh.is_closed()
    origins, directions = aimed(mesh, inside, 7)
    octree = Octree.from_mesh(mesh, split=split)
    hits = octree.closest_hit(origins, directions)
    leaks = ~hits.hit
    assert (leaks[:COUNT].sum(), leaks[COUNT:].sum()) == (0, 0)
    assert octree.any_hit(origins, directions).all()
    # The target lies on the mesh at t = 1, so nothing nearest lies past it, but for the target's own rounding,
    # which a grazing face magnifies.
    assert (hits.t > 1 + 1e-6).sum() < 1e-3 * len(hits.t)


@cases("offset, scale", [(1e6, 1.0), (0.0, 1e-3), (0.0, 1e6), (1e4, 1e3)])
def test_no_ray_leaks_from_a_moved_and_scaled_sphere(offset, scale):
    sphere = icosphere(3)
    mesh = Mesh(sphere.vertices * scale + offset, sphere.faces)
    rng = np.random.default_rng(8)
    origins = rng.uniform(-0.5, 0.5, (COUNT, 3)) * scale + offset
    directions = mesh.vertices[rng.integers(0, len(mesh.vertices), COUNT)] - origins
    assert Octree.from_mesh(mesh).any_hit(origins, directions).all()


def test_no_axis_parallel_ray_leaks():
    # Straight through the vertices and edges of a lattice: the ray lies in planes of boxes and of other faces.
    mesh = box((0, 0, 0), (8, 8, 8))
    rng = np.random.default_rng(9)
    origins = rng.integers(1, 16, (10_000, 3)) / 2
    directions = np.where(rng.random((10_000, 3)) < 0.5, 0.0, -0.0)
    directions[np.arange(10_000), rng.integers(0, 3, 10_000)] = rng.choice([-1.0, 1.0], 10_000)
    assert Octree.from_mesh(mesh).any_hit(origins, directions).all()


def test_a_ray_that_embree_lets_through_at_a_vertex_is_hit():
    origin = [0.00018042983720079064, 0.02342480793595314, 0.03288514167070389]
    direction = [-0.17487755417823792, 0.9636120200157166, -0.20216260850429535]
    mesh = as_float32(icosphere(5))
    for accelerator in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        assert accelerator.closest_hit([origin], [direction]).t[0] == pytest.approx(0.98341822, abs=5e-9)


def test_rays_aimed_at_edges_of_boxes_enter_them():
    # Every face is a leaf of its own and the ray passes exactly through corners of their boxes.
    rng = np.random.default_rng(10)
    at = rng.integers(0, 1000, (400, 3)).astype(float)
    corners = at[:, None] + np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    octree = Octree(corners.reshape(-1, 3), np.arange(1200).reshape(-1, 3), leaf_size=1)
    targets = corners[rng.integers(0, 400, 20_000), rng.integers(0, 3, 20_000)]
    directions = rng.integers(-8, 9, (20_000, 3)).astype(float)
    directions[:, 2] = rng.choice([-8.0, 8.0], 20_000)
    # o and o + d are exact, and so is every product.
    assert octree.any_hit(targets - 4 * directions, directions).all()
