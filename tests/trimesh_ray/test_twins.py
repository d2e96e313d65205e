"""Every call of the drop-in with every argument against a slow twin, on a mesh as trimesh may have it.

Some faces are there twice, turned or not, vertices are shared or not, one face has a corner that is not finite, and one
names its vertices from the end. Numbers are small multiples of powers of two, so nothing is rounded.
"""

import inspect
from typing import Any

import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from twins import CORNERS, CUBES, FACES, MESH, Floats, Integers, dot, meetings, nearest_places

from renderer.mesh.mesh import face_normals
from renderer.trimesh_ray import RayMeshIntersector, distances

SEEDS = st.integers(0, 2**20)


def made(seed: int, shared: bool) -> tuple[Any, Floats, Integers]:
    """A mesh of trimesh, all its faces' corners, and the cube of each, -1 for one that has no place."""
    rng = np.random.default_rng(seed)
    again = rng.choice(FACES, 6, replace=False)
    order = rng.permutation(np.concatenate([np.arange(FACES), again]))
    faces = MESH.faces[order].astype(np.int64)
    for row in np.flatnonzero(rng.random(len(faces)) < 0.5):
        first = (order[:row] == order[row]).any()
        # A copy may be turned about; what is there first keeps its side.
        faces[row] = faces[row][::-1] if first and rng.random() < 0.5 else np.roll(faces[row], rng.integers(3))
    vertices = MESH.vertices.copy()
    if not shared:
        vertices, faces = vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
    vertices = np.concatenate([vertices, [[1.0, 1.0, np.nan]]])
    faces = np.concatenate([faces, [[0, 1, len(vertices) - 1]]])
    faces[3] -= len(vertices)
    cubes = np.append(order // 12, -1)
    corners = vertices[faces]
    return trimesh.Trimesh(vertices, faces, process=False, validate=False), corners, cubes


def firsts(corners: Floats, cubes: Integers) -> Integers:
    """The rows of faces that stand where none before them does."""
    places = [tuple(sorted(map(tuple, face))) for face in corners.tolist()]
    return np.array([i for i, place in enumerate(places) if cubes[i] >= 0 and place not in places[:i]])


def rays_of(seed: int) -> tuple[Floats, Floats, Any]:
    """Rays to places of the mesh, and which of them are none."""
    rng = np.random.default_rng(seed)
    count = int(rng.choice([1, 5, 60]))
    directions = rng.choice([-2.0, -1.0, -0.5, 0.0, 0.5, 1.0], (count, 3))
    weights = rng.multinomial(4, [1 / 3] * 3, count) / 4.0
    targets = (CORNERS[rng.integers(0, FACES, count)] * weights[:, :, None]).sum(axis=1)
    origins = targets - directions * rng.choice([0.25, 1.0, 4.0, -1.0], (count, 1))
    wrong = (rng.random(count) < 0.2) & (rng.random() < 0.5)
    origins[wrong & (rng.random(count) < 0.5), 1] = np.nan
    return origins, directions, np.isfinite(origins).all(axis=1) & directions.any(axis=1)


def rows_of(corners: Floats, cubes: Integers, origins: Floats, directions: Floats, good: Any) -> list[list[Any]]:
    """(t, face) of each ray's contacts: one for a cube's corner or edge."""
    known, rows = firsts(corners, cubes), []
    o, d = np.where(good[:, None], origins, 99.0), np.where(good[:, None], directions, 1.0)
    for ray, is_good in zip(meetings(corners[known], o, d), good, strict=True):
        found = sorted((ray[i], known[i]) for i in np.flatnonzero(ray >= 0.0)) if is_good else []
        first = {(t, cubes[face]): (t, face) for t, face in reversed(found)}
        rows.append([each for each in found if each in first.values()])
    return rows


@given(SEEDS, st.booleans(), st.sampled_from([None, True, False]), st.sampled_from([None, 0, 1, 2, 100]), st.booleans())
@settings(max_examples=40)
def test_hits_are_those_of_the_slow_twin(
    seed: int, shared: bool, multiple: bool | None, most: int | None, located: bool
) -> None:
    (mesh, corners, cubes), (origins, directions, good) = made(seed, shared), rays_of(seed)
    ray = RayMeshIntersector(mesh)
    rows = rows_of(corners, cubes, origins, directions, good)
    options = {} if multiple is None else {"multiple_hits": multiple}
    kept = [row[: 1 if multiple is False else None] for row in rows]
    places, rays, faces = ray.intersects_location(origins.tolist(), directions.tolist(), **options)
    check_rows((faces, rays, places), kept, origins, directions)
    some = {} if most is None else {"max_hits": most}
    found = ray.intersects_id(origins, directions, return_locations=located, **options, **some)
    assert len(found) == 2 + located
    check_rows(found, kept if multiple is False else [row[:most] for row in kept], origins, directions)
    first = [row[0][1] if row else -1 for row in rows]
    np.testing.assert_array_equal(ray.intersects_first(origins, directions), first)
    np.testing.assert_array_equal(ray.intersects_any(origins, directions), [bool(row) for row in rows])


def check_rows(found: Any, rows: list[list[Any]], origins: Floats, directions: Floats) -> None:
    expected = [(face, number, t) for number, row in enumerate(rows) for t, face in row]
    faces, rays = (np.array([each[k] for each in expected], np.int64) for k in (0, 1))
    np.testing.assert_array_equal(found[0], faces)
    np.testing.assert_array_equal(found[1], rays)
    if len(found) == 3:
        t = np.array([each[2] for each in expected]).reshape(-1, 1)
        np.testing.assert_array_equal(found[2].reshape(-1, 3), origins[rays] + directions[rays] * t)


def inside(points: Floats) -> Any:
    """By parity of the cubes that hold a point, or on the surface."""
    held = [((points > c) & (points < np.add(c, side))).all(axis=1) for c, side in CUBES]
    on = (nearest_places(CORNERS, points) == points[:, None]).all(axis=2).any(axis=1)
    return (np.sum(held, axis=0) % 2 == 1) | on


def part_with(face: Floats, place: Floats) -> set[Any]:
    """The corners of the least part of a face that has a place: a corner, a side, or all of it."""
    for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)):
        ways = place - face[a], place - face[b]
        if not np.cross(*ways).any() and ways[0] @ ways[1] <= 0.0:
            return {tuple(face[a].tolist()), tuple(face[b].tolist())}
    return set(map(tuple, face.tolist()))


@given(SEEDS, st.booleans())
@settings(max_examples=40)
def test_nearest_faces_and_signs_are_those_of_the_slow_twin(seed: int, shared: bool) -> None:
    """Of faces with the corners between which the place lies it is the one least aslant, the first of several."""
    (mesh, corners, _), rng = made(seed, shared), np.random.default_rng(seed)
    points = rng.integers(-8, 60, (int(rng.choice([1, 60])), 3)) / 4.0
    places = nearest_places(corners[:-1], points)
    squares = dot(places - points[:, None], places - points[:, None])
    named, normals = [], face_normals(corners[:-1])
    for point, all_places, square in zip(points, places, squares, strict=True):
        face = square.argmin()
        between = part_with(corners[face], all_places[face])
        around = [i for i in range(len(corners) - 1) if between <= set(map(tuple, corners[i].tolist()))]
        slopes = [normals[i] @ (point - all_places[face]) for i in around]
        named.append(around[int(np.argmax(slopes))])
    nearest, distance, faces = distances.closest_point(mesh, points)
    rows = np.arange(len(points))
    np.testing.assert_array_equal(nearest, places[rows, squares.argmin(axis=1)])
    np.testing.assert_array_max_ulp(distance, np.sqrt(squares.min(axis=1)), 1)
    np.testing.assert_array_equal(faces, named)
    within = inside(points)
    np.testing.assert_array_equal(RayMeshIntersector(mesh).contains_points(points), within)
    np.testing.assert_array_equal(distances.signed_distance(mesh, points), np.where(within, distance, -distance) + 0.0)


def test_no_call_of_the_drop_in_is_missing_here() -> None:
    calls = {n for n, f in vars(RayMeshIntersector).items() if callable(f) and not n.startswith("_")}
    assert calls == {"intersects_id", "intersects_location", "intersects_first", "intersects_any", "contains_points"}
    asked = inspect.signature(RayMeshIntersector.intersects_id).parameters.keys()
    assert asked - {"self", "ray_origins", "ray_directions"} == {"multiple_hits", "max_hits", "return_locations"}
