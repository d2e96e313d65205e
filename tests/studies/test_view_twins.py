"""What is seen from one place against slow twins in plain NumPy.

All at once, and some rows at a time, as many faces and rays are.
"""

from typing import Any
from unittest.mock import patch

import numpy as np
from array_forms import FORMS, forms
from hypothesis import given, settings
from hypothesis import strategies as st
from twins import CORNERS, MESH, NORMALS, Floats, meetings

from renderer import BruteForce, Mesh, Octree, OrthographicCamera, PerspectiveCamera
from renderer.studies import Pattern, depth_map, fibonacci_sphere, scan, scanner, views, visible_faces

TARGETS = {"octree": Octree.from_mesh(MESH, threads=1), "brute force": BruteForce.from_mesh(MESH, threads=2)}
targets = st.sampled_from(sorted(TARGETS)).map(TARGETS.__getitem__)
# Faces that cross and hide each other in part.
_drawn = np.random.default_rng(6).normal(size=(2, 40, 3, 3))
CROWD = Mesh((_drawn[0, :, :1] + _drawn[1]).astype(np.float32).reshape(-1, 3), np.arange(120).reshape(-1, 3))
SEEDS = st.integers(0, 2**20)
# Faces, rays or pixels that go together: all, or few.
TOGETHER = st.sampled_from([views._ROWS, 7])
# Of products and quotients of some terms up to 20.
ROUNDED = 2.0**-40


def place_of(seed: int) -> Floats:
    """Any place around the mesh, as float32 has it."""
    return np.random.default_rng(seed).uniform(-3.0, 12.0, 3).astype(np.float32).astype(np.float64)


def first_hits(origins: Floats, directions: Floats) -> tuple[Any, Floats]:
    """The first face of each ray, -1 for none, and the distance."""
    t = meetings(CORNERS, origins, directions)
    t[~(t >= 0.0)] = np.inf
    away = t.min(axis=1) * np.linalg.norm(directions, axis=-1)
    return np.where(np.isfinite(away), t.argmin(axis=1), -1), away


@given(
    SEEDS,
    targets,
    TOGETHER,
    st.sampled_from([np.inf, 6.0, 0.0]),
    forms,
    st.sampled_from(["number", "pattern", "array"]),
)
@settings(max_examples=40)
def test_a_scan_is_that_of_its_slow_twin(
    seed: int, target: Any, together: int, distance: float, form: str, kind: str
) -> None:
    place, rng = place_of(seed), np.random.default_rng(seed)
    ways = rng.normal(size=(60, 3)).astype(np.float32).astype(np.float64) * rng.choice([0.5, 1.0, 8.0], (60, 1))
    if kind == "number":
        ways = fibonacci_sphere(60).directions
    given: Any = {"number": np.int64(60), "pattern": Pattern(ways, np.ones(60)), "array": FORMS[form](ways)}[kind]
    with patch.object(scanner, "_ROWS", together):
        cloud = scan(target, FORMS[form](place), given, max_distance=distance)
    face, away = first_hits(np.broadcast_to(place, ways.shape), ways)
    rays = np.flatnonzero((face >= 0) & (away <= distance))
    np.testing.assert_array_equal(cloud.rays, rays)
    np.testing.assert_array_equal(cloud.faces, face[rays])
    unit = ways[rays] / np.linalg.norm(ways[rays], axis=1)[:, None]
    np.testing.assert_allclose(cloud.distances, away[rays], rtol=ROUNDED)
    np.testing.assert_allclose(cloud.points, place + unit * away[rays][:, None], rtol=ROUNDED, atol=ROUNDED)
    np.testing.assert_array_equal(cloud.normals, NORMALS[face[rays]])


def middles(cuts: int) -> Floats:
    """The weights of the corners (cuts^2, 3) at the middles of the equal parts of a triangle."""
    whole = [(i, j, cuts - 1 - i - j) for i in range(cuts) for j in range(cuts - i)]
    turned = [(i, j, cuts - 2 - i - j) for i in range(cuts - 1) for j in range(cuts - 1 - i)]
    return np.concatenate([np.reshape(whole, (-1, 3)) + 1 / 3, np.reshape(turned, (-1, 3)) + 2 / 3]) / cuts


@given(SEEDS, TOGETHER, st.integers(1, 4), forms)
@settings(max_examples=40)
def test_faces_that_an_eye_sees_are_those_of_its_slow_twin(seed: int, together: int, cuts: int, form: str) -> None:
    eye = np.random.default_rng(seed).normal(size=3).astype(np.float32).astype(np.float64) * 3.0
    corners, count = CROWD.triangles, len(CROWD.faces)
    points = (middles(cuts) @ corners).reshape(-1, 3)
    t = meetings(corners, points, eye - points).reshape(count, -1, count)
    t[np.arange(count), :, np.arange(count)] = np.nan
    seen = ~((t >= 0.0) & (t <= 1.0)).any(axis=2)
    with patch.object(views, "_ROWS", together):
        found = visible_faces(Octree.from_mesh(CROWD), FORMS[form](eye), cuts=cuts)
    np.testing.assert_array_equal(found, seen.any(axis=1), strict=True)


@given(SEEDS, targets, TOGETHER, st.booleans(), st.sampled_from([(1, 1), (5, 3), (3, 8), (9, 9)]))
@settings(max_examples=20)
def test_depths_are_those_of_their_slow_twin(
    seed: int, target: Any, together: int, flat: bool, size: tuple[int, int]
) -> None:
    """Rays from the eye, or side by side, through the middles of pixels, from the top left one on."""
    eye, (width, height) = place_of(seed) + np.array([0.0, 0.0, 20.0]), size
    towards = np.array([4.0, 4.0, 5.0]) - eye
    axis = towards / np.linalg.norm(towards)
    right = np.cross(axis, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up, x, y = np.cross(right, axis), np.arange(width) + 0.5 - width / 2, height / 2 - np.arange(height) - 0.5
    pixel = (9.0 if flat else 2.0 * np.tan(np.radians(20.0))) / height
    film = pixel * (x[None, :, None] * right + y[:, None, None] * up)
    view: dict[str, Any] = {"eye": tuple(eye), "target": (4.0, 4.0, 5.0)}
    camera = OrthographicCamera(**view, height=9.0) if flat else PerspectiveCamera(**view, fov=40.0)
    with patch.object(views, "_ROWS", together):
        depth = depth_map(target, camera, width, np.int32(height))
    origins, ways = np.broadcast_to(eye + film * flat, film.shape), axis + film * (not flat)
    away = first_hits(origins.reshape(-1, 3), ways.reshape(-1, 3))[1]
    np.testing.assert_allclose(depth, away.reshape(height, width), rtol=ROUNDED)
