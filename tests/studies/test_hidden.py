"""Which directions are hidden: the bits of rays that are written down, whatever the tiles, threads and places."""

import io
import tracemalloc
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st
from meshes import make_mesh, meshes

from renderer import BruteForce, Octree
from renderer.mesh.heightfield import heightfield_mesh
from renderer.mesh.shapes import box, icosphere, torus
from renderer.studies import (
    ambient_occlusion,
    face_points,
    fibonacci_sphere,
    occlusion,
    openness,
    scan,
    sky_view_factor,
    sun_hours,
    tregenza,
)
from renderer.studies.share import check_request
from renderer.studies.sweep import RAYS, TILE

pytestmark = pytest.mark.judges("studies.FacePoints", "studies.occlusion", "studies.openness", "studies.sun_hours")


def written_down(octree, points, normals, directions, leaving=None, distance=np.inf):
    """(n, k) bools of the same question by rays that are all written down."""
    count, size = len(points), len(directions)
    starts, ways = np.repeat(points, size, axis=0), np.tile(directions, (count, 1))
    faces = None if leaving is None else np.repeat(leaving, size)
    reach = distance / np.linalg.norm(ways, axis=1)
    side = None
    if faces is not None and normals is not None:
        side = np.sign(np.einsum("nx,nx->n", octree.mesh.face_normals()[faces], np.repeat(normals, size, axis=0)))
        side = np.where(faces >= 0, side, 0).astype(int)
    hit = octree.any_hit(starts, ways, t_max=reach, leaving=faces, side=side).reshape(count, size)
    return hit if normals is None else hit | ~(normals @ directions.T > 0.0)


def inside_of(corners, rng):
    """Points (n, 3) anywhere on triangles (n, 3, 3); on a lattice rounding would decide what centroids meet."""
    return np.einsum("nk,nkx->nx", rng.dirichlet(np.ones(3), len(corners)), corners)


def wide_faces(mesh):
    """The faces that are no lines, of which the side that a normal is on is beyond rounding."""
    corners = mesh.triangles
    sides = np.abs(corners - np.roll(corners, 1, axis=1)).max(axis=(1, 2), initial=0.0)
    doubles = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return np.flatnonzero(doubles > 2.0**-30 * sides**2)


def unpacked(bits, count):
    return np.unpackbits(bits, axis=-1, count=count).astype(bool)


@given(meshes, st.integers(0, 2**20), st.integers(1, 40), st.integers(1, 30), st.booleans(), st.booleans())
def test_bits_are_those_of_rays_that_are_written_down(mesh, seed, count, size, with_normals, leaves):
    vertices, faces = mesh
    octree, rng = Octree(vertices, faces), np.random.default_rng(seed)
    extent = float(np.abs(vertices).max(initial=1.0))
    points, normals = extent * rng.normal(size=(count, 3)), rng.normal(size=(count, 3))
    directions = rng.normal(size=(size, 3)) * 10.0 ** rng.integers(-3, 4, (size, 1))
    leaving, named = None, wide_faces(octree.mesh)
    if leaves and len(named):
        # Of a face without area, the study takes the side of those around.
        leaving = np.append(named, -1)[rng.integers(0, len(named) + 1, count)]
        on = inside_of(octree.mesh.triangles[leaving], rng)
        points = np.where((leaving >= 0)[:, None], on, points)
    # Of unit length to the last bit or not, the horizon is the same but for directions along it.
    bits = occlusion(octree, points, normals if with_normals else None, directions, leaving=leaving, packed=True)
    expected = written_down(octree, points, normals if with_normals else None, directions, leaving)
    np.testing.assert_array_equal(unpacked(bits, size), expected)
    brute = BruteForce(vertices, faces)
    again = occlusion(brute, points, normals if with_normals else None, directions, leaving=leaving, packed=True)
    np.testing.assert_array_equal(again, bits)


@cases("count", [1, 15, TILE - 1, TILE, TILE + 1, 3 * TILE + 7])
@cases("size", [1, 7, 8, 9, 145])
def test_bits_at_the_sizes_of_tiles(count, size):
    octree, rng = Octree.from_mesh(torus()), np.random.default_rng(count)
    place = face_points(octree.mesh)
    some = rng.integers(0, len(place.points), count)
    points, normals, leaving = place.points[some], place.normals[some], place.faces[some]
    directions = fibonacci_sphere(size).directions
    bits = occlusion(octree, points, normals, directions, leaving=leaving, packed=True)
    assert bits.shape == (count, -(-size // 8))
    expected = written_down(octree, points, normals, directions, leaving)
    np.testing.assert_array_equal(unpacked(bits, size), expected)
    assert count < 15 or size < 9 or 0 < expected.mean() < 1


def test_a_point_may_look_in_more_directions_than_are_listed_at_once():
    octree = Octree.from_mesh(torus())
    directions, points = fibonacci_sphere(3 * RAYS + 5).directions, np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    bits = occlusion(octree, points, None, directions, packed=True)
    expected = written_down(octree, points, None, directions)
    np.testing.assert_array_equal(unpacked(bits, len(directions)), expected)
    assert 0 < expected[0].mean() < 1 and expected[1].all()


def test_bits_depend_neither_on_threads_nor_on_the_other_points():
    octree, rng = Octree.from_mesh(torus()), np.random.default_rng(6)
    points, normals = rng.uniform(-1.5, 1.5, (2000, 3)), rng.normal(size=(2000, 3))
    directions, weights = fibonacci_sphere(61).directions, rng.random(61)
    whole = occlusion(octree, points, normals, directions, weights=weights, threads=1)
    for threads in (2, 5):
        again = occlusion(octree, points, normals, directions, weights=weights, threads=threads)
        np.testing.assert_array_equal(again, whole)
    for rows in (slice(0, 1), slice(3, 40), slice(777, 2000), rng.permutation(2000)):
        part = occlusion(octree, points[rows], normals[rows], directions, weights=weights)
        np.testing.assert_array_equal(part, whole[rows])


@pytest.mark.parametrize("shift", [(2.0**19, 5.0 * 2.0**20, 0.0), (-(2.0**21), 2.0**19, 2.0**10)])
def test_bits_stay_where_mesh_and_points_are_shifted_exactly(shift):
    """As to the coordinates of a map: float32 would have steps of half a metre there."""
    rng = np.random.default_rng(7)
    # Whole multiples of 2^-20, so that the shift rounds nothing.
    ball = np.round(torus().vertices * 2.0**20) / 2.0**20
    near, far = Octree(ball, torus().faces), Octree(ball + shift, torus().faces)
    free = np.round(rng.uniform(-1.5, 1.5, (500, 3)) * 2.0**20) / 2.0**20
    faces = rng.integers(0, len(near.mesh.faces), 500)
    on = np.round(near.mesh.triangles[faces].mean(axis=1) * 2.0**30) / 2.0**30
    assert all(((points + shift) - shift == points).all() for points in (ball, free, on))
    directions = rng.normal(size=(99, 3))
    for points, leaving in ((free, None), (on, faces)):
        seen = occlusion(near, points, None, directions, leaving=leaving, packed=True)
        np.testing.assert_array_equal(
            occlusion(far, points + shift, None, directions, leaving=leaving, packed=True), seen
        )
        assert 0.0 < np.unpackbits(seen).mean() < 1.0


def test_whether_points_lie_on_the_surface_is_found_out_and_their_normals_say_the_side():
    octree, around = Octree.from_mesh(box()), fibonacci_sphere(500).directions

    def hidden(point, normal):
        return unpacked(occlusion(octree, [point], normal, around, packed=True), 500)[0]

    into = (around < 0.0).all(axis=1)  # from the corner at 1, 1, 1
    np.testing.assert_array_equal(hidden([1, 1, 1], None), into)
    n = np.array([1.0, 0.0, -1.0])
    assert (into & (around @ n > 0.0)).any()
    np.testing.assert_array_equal(hidden([1, 1, 1], n), into | ~(around @ n > 0.0))
    assert hidden([1, 1, 1], [-1, -1, -1]).all()  # from within
    into, n = (around[:, :2] < 0.0).all(axis=1), np.array([1.0, 0.0, -0.5])
    assert (into & (around @ n > 0.0)).any()
    np.testing.assert_array_equal(hidden([1, 1, 0.3], n), into | ~(around @ n > 0.0))

    # As near as 32 roundings, or 8 of float32; farther within, a point is hidden all around.
    octree, place = Octree.from_mesh(icosphere(3)), face_points(icosphere(3))
    points, normals = place.points, place.normals
    below = ~(normals @ around.T > 0.0)
    assert (points != points.astype(np.float32)).any(axis=1).all()
    for near, on in (
        (points, True),
        (points - 2.0**-50 * normals, True),
        (points - 2.0**-44 * normals, False),
        (points.astype(np.float32), True),
        ((points * (1.0 - 2.0**-22)).astype(np.float32), True),
        ((points - 2.0**-15 * normals).astype(np.float32), False),
    ):
        seen = unpacked(occlusion(octree, near, normals, around, packed=True), 500)
        np.testing.assert_array_equal(seen, below if on else True)


def test_nothing_hides_beyond_the_distance():
    octree = Octree.from_mesh(box())
    points, ways = [[3.0, 0.5, 0.25]], [[-1.0, 0.0, 0.0], [-0.125, 0.0, 0.0], [-8.0, 0.0, 0.0]]
    assert occlusion(octree, points, None, ways, max_distance=2.0).tolist() == [1.0]
    assert occlusion(octree, points, None, ways, max_distance=np.nextafter(2.0, 0.0)).tolist() == [0.0]
    assert occlusion(octree, points, None, ways, max_distance=0).tolist() == [0.0]


def test_faces_without_a_plane_are_left_as_any_hit_leaves_them():
    """Corners on a line, as rounded: where the ray starts depends on its direction."""
    vertices, faces = make_mesh("soup", 4, 40)
    vertices, faces = (
        np.concatenate([vertices, [[0, 0, 0], [1, 1, 1], [2, 2, 2]]]),
        np.append(faces, [[120, 121, 122]], 0),
    )
    octree, points = Octree(vertices, faces), np.tile([0.75, 0.75, 0.75], (20, 1))
    directions, leaving = fibonacci_sphere(300).directions, np.full(20, len(faces) - 1)
    bits = occlusion(octree, points, None, directions, leaving=leaving, packed=True)
    np.testing.assert_array_equal(unpacked(bits, 300), written_down(octree, points, None, directions, leaving))


GOOD = {"points": np.zeros((4, 3)), "normals": np.ones((4, 3)), "directions": np.eye(3)}


@cases(
    ("argument", "value", "said"),
    [
        ("points", [[0, np.nan, 0]], "finite numbers .* in row 0"),
        ("normals", np.zeros((4, 3)), r"not zero, got \[0.0, 0.0, 0.0\] in row 0"),
        ("normals", np.ones((3, 3)), r"shape \(4, 3\) as points have, or \(3,\), got shape \(3, 3\)"),
        ("directions", np.zeros((2, 3)), "non-zero vectors.* in row 0"),
        ("directions", [[1, 0, 0], [1e-200, 0, 0]], "in row 1"),
        ("directions", np.empty((0, 3)), "k >= 1"),
        ("directions", [1, 0, 0], r"shape \(k, 3\)"),
        ("weights", [1, 1], r"shape \(3,\), one a direction, got shape \(2,\)"),
        ("weights", [1, -1, 1], "finite numbers >= 0, got -1.0 in row 1"),
        ("weights", [0, 0, 0], "one that is not 0"),
        ("leaving", 12, "faces from 0 to 11, or -1"),
        ("leaving", 0.5, "integer"),
        ("packed", 1, "True or False"),
        ("max_distance", -1, ">= 0"),
        ("max_distance", [1, 2], "a number"),
        ("threads", 0, "integer >= 1"),
        ("progress", "yes", "True or False"),
        ("octree", box(), "an Octree"),
    ],
)
def test_bad_arguments_are_named(argument, value, said):
    given = {"octree": Octree.from_mesh(box()), **GOOD, argument: value}
    with pytest.raises(
        ValueError, match=rf"^{argument}: expected .*{said}|^{argument}: expected .*, got .*{said}"
    ) as e:
        occlusion(given.pop("octree"), given.pop("points"), given.pop("normals"), given.pop("directions"), **given)
    assert "got" in str(e.value)


def test_bits_have_no_weights():
    with pytest.raises(ValueError, match=r"^weights: expected None, as bits have none"):
        occlusion(Octree.from_mesh(box()), [0, 0, 0], None, np.eye(3), weights=[1, 1, 1], packed=True)


@given(meshes, st.integers(0, 2**20), st.integers(16, 90), st.sampled_from([1e-3, 0.1, 1.0]), st.booleans())
def test_bits_of_points_that_are_traced_together(mesh, seed, count, apart, leaves):
    """Points near each other and far apart, directions that turn little from one to the next, and along the axes."""
    vertices, faces = mesh
    octree, rng = Octree(vertices, faces), np.random.default_rng(seed)
    extent = float(np.abs(vertices).max(initial=1.0))
    points = extent * (rng.normal(size=3) + apart * rng.normal(size=(count, 3)))
    turn = np.linspace(0.0, 2.0 * np.pi, 13)
    ways = np.concatenate([np.stack([np.sin(turn), np.cos(turn), 0.0 * turn + rng.normal()], 1), np.eye(3), -np.eye(3)])
    leaving = None
    if leaves and len(faces):
        leaving = rng.integers(0, len(faces), count)
        points = inside_of(octree.mesh.triangles[leaving], rng)
    reach = extent * float(rng.choice([0.5, np.inf]))
    bits = occlusion(octree, points, None, ways, leaving=leaving, packed=True, max_distance=reach)
    expected = written_down(octree, points, None, ways, leaving, reach)
    np.testing.assert_array_equal(unpacked(bits, len(ways)), expected)


@pytest.mark.parametrize("spread", [1e-3, 0.05, 1.0])
def test_bits_over_many_small_faces(spread):
    """Tiles that share their way, fill more than one list of leaves, and give up, as their points are apart."""
    height = np.random.default_rng(11).uniform(0.0, 0.06, (40, 40))
    octree = Octree.from_mesh(heightfield_mesh(height, spacing=1.0 / 40))
    rng = np.random.default_rng(12)
    points = np.column_stack([0.5 + spread * rng.uniform(-0.5, 0.5, (1600, 2)), rng.uniform(0.0, 0.06, 1600)])
    directions = tregenza().directions
    bits = occlusion(octree, points, [0, 0, 1], directions, packed=True)
    expected = written_down(octree, points, np.tile([0.0, 0.0, 1.0], (1600, 1)), directions)
    np.testing.assert_array_equal(unpacked(bits, 145), expected)
    assert 0.1 < expected.mean() < 0.95


POINTS = np.random.default_rng(2).uniform(-1.5, 1.5, (40, 3))


ONE: dict[str, Any] = {
    "occlusion": lambda octree, points=POINTS, **options: occlusion(octree, points, None, np.eye(3), **options),
    "sky_view_factor": lambda octree, points=POINTS, **options: sky_view_factor(octree, points, **options),
    "sun_hours": lambda octree, points=POINTS, **options: sun_hours(octree, points, None, np.eye(3), **options),
    "ambient_occlusion": lambda octree, points=POINTS, **options: ambient_occlusion(
        octree, points, [0, 0, 1], **options
    ),
    "openness": lambda octree, points=POINTS, **options: openness(octree, points, **options),
}


@cases("study", ONE)
def test_a_bar_is_drawn_on_a_terminal_and_nowhere_else(study: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    octree = Octree.from_mesh(torus())
    for stream, progress in ((Terminal(), True), (Terminal(), False), (io.StringIO(), True)):
        monkeypatch.setattr("sys.stderr", stream)
        ONE[study](octree, progress=progress)
        assert bool(stream.getvalue()) == (stream.isatty() and progress)


def test_threads_are_those_of_the_octree_unless_others_are_asked_for() -> None:
    octree = Octree.from_mesh(torus(), threads=3)
    for threads, used in ((None, 3), (1, 1), (7, 7)):
        assert check_request(octree, POINTS, None, None, threads, False).threads == used


def test_nothing_of_the_size_of_points_times_directions_is_made() -> None:
    """An array of bools would have 40 megabytes; 15 are reserved for the faces at a corner, on two threads."""
    octree, directions = Octree.from_mesh(box()), fibonacci_sphere(2000).directions
    points = np.random.default_rng(3).uniform(2.0, 3.0, (20_000, 3))
    occlusion(octree, points[:300], None, directions, threads=2)
    tracemalloc.start()
    try:
        occlusion(octree, points, None, directions, threads=2)
        assert tracemalloc.get_traced_memory()[1] < 15e6 + 6e6
    finally:
        tracemalloc.stop()


def test_distance_is_the_former_name_of_max_distance() -> None:
    """The same bits by both names, and an error for both at once."""
    octree, up = Octree.from_mesh(box((0, -9, 0), (1, 9, 9))), [0.0, 0.0, 1.0]
    points, ways = [[3.0, 0.0, 0.0], [1.5, 0.0, 0.5]], tregenza().directions
    asked: dict[str, Any] = {
        "occlusion": lambda **of: occlusion(octree, points, up, ways, **of),
        "ambient_occlusion": lambda **of: ambient_occlusion(octree, points, up, **of),
        "openness": lambda **of: openness(octree, points, **of),
        "sky_view_factor": lambda **of: sky_view_factor(octree, points, **of),
        "sun_hours": lambda **of: sun_hours(octree, points, up, ways, **of),
        "scan": lambda **of: scan(octree, points[0], 500, **of).distances,
    }
    for name, ask in asked.items():
        near, far = ask(max_distance=1.0), ask()
        assert near.tobytes() != far.tobytes(), name
        assert ask(distance=1.0).tobytes() == near.tobytes() and ask(distance=np.inf).tobytes() == far.tobytes()
        with pytest.raises(ValueError, match=r"^distance: expected max_distance alone, .*, got both"):
            ask(distance=1.0, max_distance=2.0)
        for former in ("distance", "max_distance"):
            with pytest.raises(ValueError, match=f"^{former}: expected a number >= 0, got nan"):
                ask(**{former: np.nan})
