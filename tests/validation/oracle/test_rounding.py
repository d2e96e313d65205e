"""The derived rounding bounds, held against a slow twin of the watertight kernel, and what rounding permits."""

from fractions import Fraction

import numpy as np
import pytest
import trimesh
from cases import cases

from validation.hits import rays
from validation.oracle import exact
from validation.oracle.rounding import FLOAT32_ROUNDOFF, FLOAT64_ROUNDOFF, RayView, t_bounds

BALL = trimesh.creation.icosphere(2)
VERTICES = rays.float32_exact(BALL.vertices)
FACES = BALL.faces.astype(np.int64)


def woop(corners, origin, direction, real=np.float64):
    """t (F,) of all triangles for one ray by Woop, Benthin and Wald (JCGT 2:1, 2013), inf on a miss."""
    relative, d = corners.astype(real) - origin.astype(real), direction.astype(real)
    z = np.abs(d).argmax()
    x, y = (z + 1) % 3, (z + 2) % 3
    px = relative[:, :, x] - d[x] / d[z] * relative[:, :, z]
    py = relative[:, :, y] - d[y] / d[z] * relative[:, :, z]
    depth = real(1) / d[z] * relative[:, :, z]
    i, j = [2, 0, 1], [1, 2, 0]
    edges = px[:, i] * py[:, j] - py[:, i] * px[:, j]
    det = edges.sum(axis=1)
    missed = ((edges < 0).any(axis=1) & (edges > 0).any(axis=1)) | (det == 0)
    with np.errstate(all="ignore"):
        t = (edges * depth).sum(axis=1) / det
    return np.where(missed | ~(t >= 0), np.inf, t).astype(np.float64)


def moller_trumbore(corners, origin, direction):
    """The same by Moller and Trumbore, which is not watertight."""
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p, s = np.cross(direction, e2), origin - corners[:, 0]
    with np.errstate(all="ignore"):
        inverse = 1 / (e1 * p).sum(axis=1)
        u = (s * p).sum(axis=1) * inverse
        q = np.cross(s, e1)
        v = (q @ direction) * inverse
        t = (e2 * q).sum(axis=1) * inverse
        return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0), t, np.inf)


def closest(kernel, corners, batch):
    t = np.array([kernel(corners, o, d) for o, d in zip(batch.origins, batch.directions, strict=True)])
    face = t.argmin(axis=1)
    t = t[np.arange(len(t)), face]
    return t, np.where(np.isfinite(t), face, -1)


def needles(rng, height):
    """Triangles of length 1 and the given height, turned at random, with rays at points of them."""
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, height, 0.0]])
    corners = np.array([flat @ np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in range(200)])
    target = np.einsum("nk,nkj->nj", rng.dirichlet((1.0, 1.0, 1.0), 200), corners)
    origins = rays.float32_exact(rng.standard_normal((200, 3)) * 3)
    return rays.float32_exact(corners), origins, rays.float32_exact(target - origins)


@cases("real, roundoff", [(np.float64, FLOAT64_ROUNDOFF), (np.float32, FLOAT32_ROUNDOFF)])
@cases("height", [1.0, 1e-2, 1e-4])
@cases("offset", [0.0, 64.0])
def test_bound_holds_for_the_kernel(real, roundoff, height, offset):
    corners, origins, directions = needles(np.random.default_rng(9), height)
    # Shift by a coarse number and round again: the mesh stays float32-exact.
    corners, origins = rays.float32_exact(corners + offset), rays.float32_exact(origins + offset)
    checked = 0
    for triangle, origin, direction in zip(corners, origins, directions, strict=True):
        t = woop(triangle[None], origin, direction, real)[0]
        u, v, w, depth = exact.determinants(triangle, origin, direction)
        if np.isinf(t) or not u + v + w:
            continue
        edges = np.array([[float(u), float(v), float(w)]])
        bound = t_bounds(triangle[None], origin[None], direction[None], edges, roundoff)[0]
        assert abs(Fraction(float(t)) - depth / (u + v + w)) <= bound
        checked += np.isfinite(bound)
    # Float32 bounds few of the thinnest triangles.
    assert checked > (10 if height < 1e-2 and real is np.float32 else 100)


def test_bound_is_sharp_enough_to_see_a_fault():
    """On a well-shaped mesh it is far below the smallest shift that a float32 reference could notice."""
    corners = VERTICES[FACES]
    batch = rays.from_inside_rays(corners, 200, np.random.default_rng(1))
    hits = exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)
    for hit, o, d in zip(hits, batch.origins, batch.directions, strict=True):
        triangle = corners[hit.face]
        edges = np.array([[float(x) for x in exact.determinants(triangle, o, d)[:3]]])
        assert t_bounds(triangle[None], o[None], d[None], edges)[0] < 1e-12 * float(hit.t)


def view(origin, direction):
    return RayView(VERTICES, FACES, tuple(map(float, origin)), tuple(map(float, direction)), FLOAT64_ROUNDOFF)


@pytest.mark.parametrize("family", [0, 1])
def test_leaks_are_not_permitted_but_the_watertight_kernel_is(family):
    corners = VERTICES[FACES]
    inside = rays.leak_rays(VERTICES, FACES, 500, seed=3)[family]
    t, face = closest(woop, corners, inside)
    _, leaky_face = closest(moller_trumbore, corners, inside)
    leaks = np.flatnonzero(leaky_face < 0)
    assert (face >= 0).all() and len(leaks) > 0
    for i in range(0, len(inside), 5):
        ray = view(inside.origins[i], inside.directions[i])
        assert ray.is_right(t[i], face[i]) or ray.is_permitted(t[i], face[i])
    for i in leaks:
        ray = view(inside.origins[i], inside.directions[i])
        assert not ray.is_right(None, None) and not ray.is_permitted(None, None)


def test_leaks_at_a_vertex_hit_exactly_are_not_permitted():
    """Every face at the vertex is in doubt, none surely hit; yet they close around the ray."""
    for target in VERTICES[:20]:
        ray = view([0, 0, 0], target)
        assert ray.closest == 1 and len(ray.closest_faces) >= 5
        assert not any(face.surely_hit for face in ray.seen if face.t is not None and face.t > 0)
        assert not ray.is_permitted(None, None)
        assert ray.is_permitted(1.0, ray.closest_faces[-1])
        assert not ray.is_permitted(1.0 + 1e-6, ray.closest_faces[-1])


def test_going_through_a_vertex_to_the_far_side_is_not_permitted():
    target = VERTICES[0]
    ray = view(2 * target, -target)
    far = max((face for face in ray.seen if face.hit), key=lambda face: face.t)
    assert ray.closest == 1 and far.t > 2
    assert not ray.is_permitted(float(far.t), far.face)


def test_a_silhouette_may_go_either_way():
    top = VERTICES[VERTICES[:, 2].argmax()]
    ray = view(top - [2, 0, 0], [2, 0, 0])
    assert ray.closest == 1
    assert not ray.is_right(None, None) and ray.is_permitted(None, None)
    above = view(top - [2, 0, -1e-12], [2, 0, 0])
    assert above.closest is None and above.is_right(None, None)
    assert not above.is_permitted(1.0, ray.closest_faces[0])
    below = view(top - [2, 0, 1e-12], [2, 0, 0])
    assert below.closest is not None and not below.is_permitted(None, None)


def test_an_open_edge_may_go_either_way():
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    on_rim = RayView(square, faces, (0.5, 0.0, 1.0), (0.0, 0.0, -1.0), FLOAT64_ROUNDOFF)
    on_diagonal = RayView(square, faces, (0.5, 0.5, 1.0), (0.0, 0.0, -1.0), FLOAT64_ROUNDOFF)
    assert on_rim.closest == on_diagonal.closest == 1
    assert on_rim.is_permitted(None, None)
    assert not on_diagonal.is_permitted(None, None)
    assert on_diagonal.is_permitted(1.0, 0) and on_diagonal.is_permitted(1.0, 1)


def test_a_face_behind_the_origin_is_not_permitted():
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    behind = RayView(square, np.array([[0, 1, 2]]), (0.75, 0.25, 1.0), (0.0, 0.0, 1.0), FLOAT64_ROUNDOFF)
    assert behind.closest is None and behind.is_right(None, None)
    assert not behind.is_permitted(-1.0, 0)


@pytest.mark.parametrize("t", [np.inf, -np.inf, np.nan])
def test_a_hit_at_no_number_is_neither_right_nor_permitted(t):
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    for origin in ((0.75, 0.25, 1.0), (0.75, 0.25, -1.0), (0.5, 0.25, 0.0)):
        ray = RayView(square, np.array([[0, 1, 2]]), origin, (0.0, 0.0, -1.0), FLOAT64_ROUNDOFF)
        assert not ray.is_right(t, 0) and not ray.is_permitted(t, 0)
