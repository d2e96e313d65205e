"""What studies do that no other file of tests asks."""

import io
import tracemalloc
from typing import Any

import numpy as np
import pytest

from renderer import Mesh, Octree
from renderer.mesh.shapes import box, grid, icosphere, torus
from renderer.studies import (
    ambient_occlusion,
    cosine_hemisphere,
    depth_map,
    face_points,
    fibonacci_hemisphere,
    fibonacci_sphere,
    occlusion,
    openness,
    reinhart,
    scan,
    sky_view_factor,
    sun_hours,
    visible_faces,
)
from renderer.studies.share import check_request

pytestmark = pytest.mark.judges(
    "studies.FacePoints", "studies.Pattern", "studies.Scan", "studies.ambient_occlusion", "studies.cosine_hemisphere",
    "studies.depth_map", "studies.face_points", "studies.fibonacci_hemisphere", "studies.fibonacci_sphere",
    "studies.occlusion", "studies.openness", "studies.scan", "studies.sky_view_factor", "studies.sun_hours",
    "studies.visible_faces",
)  # fmt: skip


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


class Camera:
    """Parallel rays downwards onto the unit square, with nothing but ``rows``."""

    def rows(self, width: int, height: int) -> Any:
        along, across = [1.0 / width, 0.0, 0.0], [0.0, 1.0 / height, 0.0]
        return np.array([[0.0, 0.0, 3.0], along, across, [0.0, 0.0, -2.0], [0.0] * 3, [0.0] * 3])


def test_points_of_faces_are_centroids_with_unit_normals_to_the_outer_side() -> None:
    ball = icosphere(2)
    faces = np.insert(ball.faces, 7, [[5, 5, 6]], axis=0)
    place = face_points(Mesh(2.0 * ball.vertices, faces))
    assert place.faces.tolist() == [*range(7), *range(8, len(faces))] and place.faces.dtype == np.int64
    corners = 2.0 * ball.triangles
    np.testing.assert_allclose(place.points, corners.mean(axis=1), rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(place.normals, axis=1), 1.0, rtol=0, atol=4e-16)
    turn = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])  # counter-clockwise
    assert (np.einsum("ij,ij->i", place.normals, turn) > 0.0).all()
    assert (np.einsum("ij,ij->i", place.normals, place.points) > 0.0).all()
    assert place.points.dtype == place.normals.dtype == np.float64


@pytest.mark.parametrize("count", [1, 2, 9, 1000])
def test_spirals_have_equal_steps_of_height_or_of_its_square(count: int) -> None:
    """Zones of one height have one area (Archimedes); rings of the disc, one step of the radius' square."""
    even = (np.arange(count) + 0.5) / count
    half, whole, disc = fibonacci_hemisphere(count), fibonacci_sphere(count), cosine_hemisphere(count)
    # A few roundings of numbers up to 1; those of a square root count twice in its square.
    np.testing.assert_allclose(half.directions[:, 2], even, rtol=0, atol=1e-15)
    np.testing.assert_allclose(whole.directions[:, 2], 2.0 * even - 1.0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(disc.directions[:, 2] ** 2, even, rtol=0, atol=1e-15)
    for pattern in (half, whole, disc):
        assert len(np.unique(pattern.weights)) == 1
        # A golden part of a turn from each to the next.
        turn = np.diff(np.unwrap(np.arctan2(pattern.directions[:, 0], pattern.directions[:, 1])))
        golden = 2.0 * np.pi * (np.sqrt(1.25) - 0.5)
        # 1e-10: the fraction of up to 1e3 turns, over the sine of the angle to a pole, 0.03 at least.
        np.testing.assert_allclose(np.mod(turn, 2.0 * np.pi), golden, rtol=0, atol=1e-10)


def test_arrays_of_scans_faces_and_depths_have_their_types_and_dimensions() -> None:
    octree = Octree.from_mesh(torus())
    for cloud in (scan(octree, [0, 3, 0.5], 500), scan(octree, [0, 3, 0.5], [[0, 1, 0]])):
        m = len(cloud.rays)
        assert [array.shape for array in cloud] == [(m, 3), (m, 3), (m,), (m,), (m,)]
        assert [array.dtype for array in cloud] == [np.float64] * 3 + [np.int64] * 2
    seen, depth = visible_faces(octree, [0, 3, 0.5]), depth_map(octree, Camera(), 4, 3)
    assert (seen.dtype, seen.shape) == (np.bool_, (len(octree.mesh.faces),))
    assert (depth.dtype, depth.shape) == (np.float64, (3, 4))


def test_a_scanner_on_the_surface_meets_what_leads_through_it_at_once_and_none_beyond_its_reach() -> None:
    floor = Octree.from_mesh(grid(2, 2))
    ways = [[0, -1, 0], [0, 2, 0], [0.5, -0.5, 0]]
    # At a corner of several faces, on a side, and inside a face: on the outer side, if no normal says another.
    for x, z in ((0.0, 0.0), (0.25, 0.0), (0.1, 0.15)):
        for normal, through in ((None, [0, 2]), ([0, 3, 0], [0, 2]), ([0.1, 1e-9, 0.1], [0, 2]), ([0, -1, 0], [1])):
            cloud = scan(floor, [x, 0.0, z], ways, normal=normal)
            assert cloud.rays.tolist() == through and (cloud.distances == 0.0).all()
            np.testing.assert_allclose(cloud.points, np.tile([x, 0.0, z], (len(through), 1)), rtol=0, atol=1e-15)
    with pytest.raises(ValueError, match="normal: expected"):
        scan(floor, [0.1, 0.0, 0.1], ways, normal=[0, 0, 0])
    assert scan(floor, [0.1, 3.0, 0.1], ways, distance=3).distances.tolist() == [3.0]
    assert len(scan(floor, [0.1, 3.0, 0.1], ways, distance=np.nextafter(3.0, 0.0)).rays) == 0


def test_an_eye_on_a_sheet_sees_past_it_and_not_past_others() -> None:
    """Sheets at heights -2, -1, 0 and 1, the eye on that at 0: it hides neither of those beside it."""
    sheets = [Mesh(grid(2, 2).vertices + np.array([0.0, y, 0.0]), grid(2, 2).faces) for y in (-2.0, -1.0, 0.0, 1.0)]
    seen = visible_faces(Octree.from_mesh(Mesh.concatenate(sheets)), [0.03, 0.0, 0.02])
    assert seen.reshape(4, -1)[[0, 1, 3]].all(axis=1).tolist() == [False, True, True]
    assert not seen.reshape(4, -1)[0].any()


def test_a_face_that_counts_as_seen_is_seen_at_one_of_its_points() -> None:
    """From an eye above a floor whose middle a plate hides, of which the points tell apart what is open."""
    plate = Mesh([[-0.2, -0.2, 0.5], [0.2, -0.2, 0.5], [0.0, 0.3, 0.5]], [[0, 1, 2]])
    narrow = Mesh([[-0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.0, 0.1, 0.0]], [[0, 1, 2]])
    octree = Octree.from_mesh(Mesh.concatenate([narrow, plate]))
    assert not visible_faces(octree, [0.0, 0.0, 9.0], cuts=64)[0]
    # 0.05 of the plane's z = 0 is seen beyond the plate's shadow at x = 0.2 * 9 / 8.5.
    beside = Mesh([[-0.1, -0.1, 0.0], [0.22, -0.1, 0.0], [0.0, 0.1, 0.0]], [[0, 1, 2]])
    octree = Octree.from_mesh(Mesh.concatenate([beside, plate]))
    assert [bool(visible_faces(octree, [0.0, 0.0, 9.0], cuts=cuts)[0]) for cuts in (1, 64)] == [False, True]


def test_a_camera_is_what_has_rows_and_depths_are_along_the_ray() -> None:
    depth = depth_map(Octree.from_mesh(box()), Camera(), 5, 4)
    np.testing.assert_array_equal(depth, 2.0)  # not in units of the direction, whose length is 2


@pytest.mark.parametrize("study", ONE)
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


def test_walls_have_half_of_an_even_sky_with_patches_in_opposite_pairs() -> None:
    """To rounding, of sums over up to 577 patches; a level point has 1 with any patches."""
    octree = Octree([[0, 0, -9], [1, 0, -9], [0, 1, -9]], [[0, 1, 2]])
    for patches in (145, 577, reinhart(3)):
        for normal in ([1, 0, 0], [0, -2, 0], [0.6, 0.8, 0.0]):
            seen = sky_view_factor(octree, [[0, 0, 0]], [normal], patches=patches)
            assert abs(seen[0] - 0.5) < 577 * 2.0**-52
    for patches in (1, 3, 50, 145):
        for definition in ("cosine", "geometric"):
            seen = sky_view_factor(octree, [[0, 0, 0]], patches=patches, definition=definition)  # type: ignore[arg-type]
            assert abs(seen[0] - 1.0) < 577 * 2.0**-52
