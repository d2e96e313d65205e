"""Faces seen from an eye, depths from a camera, points from a scanner."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import (
    EquirectangularCamera,
    FisheyeCamera,
    Mesh,
    Octree,
    OpenCVCamera,
    OpenCVFisheyeCamera,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    PinholeCamera,
    RayScene,
    Scene,
    SceneObject,
    ThinLensCamera,
    render,
)
from renderer.mesh.shapes import box, grid, icosphere, torus
from renderer.studies import (
    ambient_occlusion,
    cosine_hemisphere,
    depth_map,
    fibonacci_hemisphere,
    fibonacci_sphere,
    reinhart,
    scan,
    scanner,
    sky_view_factor,
    views,
    visible_faces,
)
from renderer.studies.edge_on import are_edge_on

pytestmark = pytest.mark.judges("Image", "studies.Scan", "studies.depth_map", "studies.scan", "studies.visible_faces")


CAMERAS = [
    PerspectiveCamera(eye=(0.5, 1.5, 3.0), target=(0.0, 0.1, 0.0), fov=40.0),
    OrthographicCamera(eye=(0.5, 1.5, 3.0), target=(0.0, 0.1, 0.0), height=2.5),
    PinholeCamera(
        eye=(0.5, 1.5, 3.0), target=(0.0, 0.1, 0.0), width=122, height=94, fx=120.0, fy=110.0, cx=50.0, skew=7.0
    ),
    FisheyeCamera(eye=(0.5, 1.5, 3.0), target=(0.0, 0.1, 0.0), fov=70.0),
    EquirectangularCamera(eye=(0.5, 0.3, 0.3), target=(0.0, 0.1, 0.0)),
    OpenCVCamera(
        eye=(0.5, 1.5, 3.0), target=(0.0, 0.1, 0.0), width=61, height=47, fx=60.0, fy=55.0, cx=25.0, k1=-0.4, p2=0.02
    ),
    OpenCVFisheyeCamera(
        eye=(0.5, 1.5, 3.0), target=(0.0, 0.1, 0.0), width=61, height=47, fx=50.0, fy=60.0, k1=0.1, k3=-0.05
    ),
    ThinLensCamera(eye=(0.5, 1.5, 3.0), target=(0.0, 0.1, 0.0), fov=40.0, aperture=0.2),
]


@pytest.mark.parametrize("eye", [(3.0, 0.0, 0.0), (1.0, 2.0, -4.0), (0.0, 0.0, 1e6)])
def test_of_a_convex_body_the_faces_that_look_to_the_eye_are_seen(eye):
    ball = icosphere(4)
    facing = np.einsum("ij,ij->i", ball.face_normals(), np.array(eye) - ball.triangles.mean(axis=1))
    assert np.abs(facing).min() > 1e-9
    for cuts in (1, 3):
        np.testing.assert_array_equal(visible_faces(Octree.from_mesh(ball), eye, cuts=cuts), facing > 0.0)


def test_all_faces_are_seen_from_inside_a_convex_body_and_sheets_from_behind():
    assert visible_faces(Octree.from_mesh(icosphere(3)), [0.1, 0.2, 0.3]).all()
    for y in (1.0, -1.0):
        assert visible_faces(Octree.from_mesh(grid(3, 3)), [0.1, y, 0.0]).all()


def test_an_edge_on_face_is_not_seen_however_the_body_is_turned():
    """The eye in the planes of one, two and three walls of a box, which is then turned exactly and by any angle."""
    corner, turns = (
        Octree.from_mesh(box()),
        [np.eye(3)[[1, 2, 0]], -np.eye(3), np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])],
    )
    for eye, walls in (([0.5, 3.0, 1.0], 1), ([0.5, 3.0, 0.0], 1), ([4.0, 3.0, 1.0], 2), ([0.25, 1.0, 0.5], 5)):
        seen = visible_faces(corner, eye, cuts=2)
        inside = np.einsum("ij,ij->i", box().face_normals(), np.array(eye) - box().triangles[:, 0])
        assert seen.sum() == 2 * walls and not seen[inside == 0.0].any() and (inside == 0.0).any()
        for turn in turns:
            body = Mesh(box().vertices @ turn.T, box().faces)
            np.testing.assert_array_equal(visible_faces(Octree.from_mesh(body), turn @ eye, cuts=2), seen)


def test_whether_an_eye_lies_in_a_faces_plane_is_what_exact_arithmetic_says():
    """The eye at the centroids of every third face, of which every other has a corner moved to the next number."""
    rng = np.random.default_rng(3)
    for size in (1.0, 2.0**-400, 2.0**300):  # the last two are beyond float64's products
        corners, eye = rng.integers(-9, 10, (3000, 3, 3)) * size, np.array([1.0, 2.0, 3.0]) * size
        corners[::3, 2] = 3.0 * eye - corners[::3, 0] - corners[::3, 1]
        corners[::6, 0, 0] = np.nextafter(corners[::6, 0, 0], np.inf)
        exact = np.array([_volume(face, eye) == 0 for face in corners])
        np.testing.assert_array_equal(are_edge_on(corners, eye), exact)
        assert 300 < exact.sum() < 700 and not exact[::6].all() and exact[3::6].all()


def _volume(face, eye):
    (a, b, c), p = ([[Fraction(x) for x in row] for row in face.tolist()]), [Fraction(x) for x in eye.tolist()]
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = ([x - y for x, y in zip(row, p, strict=True)] for row in (a, b, c))
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


def test_faces_without_area_are_not_seen_and_blocks_change_nothing(monkeypatch):
    body = torus()
    flat = Mesh(np.concatenate([body.vertices, [[0, 9, 0]]]), np.concatenate([body.faces, [[len(body.vertices)] * 3]]))
    octree = Octree.from_mesh(flat)
    seen = visible_faces(octree, [0.0, 3.0, 0.5], cuts=2)
    assert not seen[-1] and 0.2 < seen.mean() < 0.8
    depth, cloud = depth_map(octree, CAMERAS[0], 31, 23), scan(octree, [0, 3, 0.5], 5000)
    monkeypatch.setattr(views, "_ROWS", 100)
    monkeypatch.setattr(scanner, "_ROWS", 100)
    np.testing.assert_array_equal(visible_faces(octree, [0.0, 3.0, 0.5], cuts=2), seen)
    np.testing.assert_array_equal(depth_map(octree, CAMERAS[0], 31, 23), depth)
    for ours, theirs in zip(scan(octree, [0, 3, 0.5], 5000), cloud, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@cases("samples", [1, 4, 9])
@cases("camera", CAMERAS)
def test_depths_have_the_bits_of_pictures(camera, samples):
    body = torus()
    scene = Scene(camera=camera, materials={"m": Phong()}, objects=[SceneObject(mesh=body, material="m")], ambient=1.0)
    depth = depth_map(Octree.from_mesh(body), camera, 61, 47)
    np.testing.assert_array_equal(depth, render(scene, resolution=(61, 47), samples=samples).depth)
    assert depth.shape == (47, 61) and 0.1 < np.isfinite(depth).mean() < 0.9


@cases("camera", CAMERAS)
def test_z_is_the_part_of_the_distance_along_the_axis(camera):
    octree, seen = Octree.from_mesh(torus()), (61, 47)
    z = depth_map(octree, camera, *seen, depth="z")
    origins, directions = camera.primary_rays(seen)
    there = ~np.isnan(directions).any(axis=-1)
    hits = octree.closest_hit(origins[there], directions[there])
    expected = (hits.points - camera.eye) @ camera.frame()[2]
    np.testing.assert_array_equal(np.isinf(z[there]), ~hits.hit)
    assert np.isinf(z[~there]).all() and hits.hit.any()
    np.testing.assert_allclose(z[there][hits.hit], expected[hits.hit], rtol=1e-12)
    if hasattr(camera, "rows"):  # of a camera of one's own, too
        own = depth_map(octree, _camera_of(camera.rows(*seen)), *seen, depth="z")
        np.testing.assert_allclose(own, z, rtol=1e-13)


@cases("camera", CAMERAS)
def test_a_scan_has_the_depths_of_a_camera_at_the_pixels_of_its_points(camera):
    octree, size = Octree.from_mesh(torus()), (61, 47)
    cloud, depth = scan(octree, camera, size), depth_map(octree, camera, *size).ravel()
    np.testing.assert_array_equal(cloud.rays, np.flatnonzero(np.isfinite(depth)))
    np.testing.assert_allclose(cloud.distances, depth[cloud.rays], rtol=1e-15)
    rows, columns = np.divmod(cloud.rays, size[0])
    pixels, away = camera.project(cloud.points, size)
    np.testing.assert_allclose(pixels, np.stack([columns, rows], axis=1) + 0.5, atol=1e-10)
    np.testing.assert_allclose(away, cloud.distances, rtol=1e-13)
    if camera.film_size is not None:
        np.testing.assert_array_equal(scan(octree, camera).rays, scan(octree, camera, camera.film_size).rays)


def test_a_camera_scans_scenes_in_blocks_through_glass_and_from_a_surface(monkeypatch):
    scene, camera = RayScene(), OrthographicCamera(eye=(0.5, 0.25, 1.0), target=(0.5, 0.25, 0.0), height=0.5)
    pane, wall = scene.add(box()), scene.add(box((0, 0, -3), (1, 1, -2)))
    for _ in range(2):
        cloud = scan(scene, camera, (3, 2), returns=3, through=pane)
        # It stands on the pane.
        np.testing.assert_allclose(cloud.distances, [0.0, 1.0, 3.0] * 6, rtol=1e-13)
        assert cloud.rays.tolist() == np.repeat(range(6), 3).tolist()
        assert cloud.objects.tolist() == [pane, pane, wall] * 6
        monkeypatch.setattr(scanner, "_ROWS", 4)
    away = PerspectiveCamera(eye=(0, 0, 9), target=(0, 0, 99))
    assert len(scan(scene, away, (2, 2)).rays) == 0
    nothing = OpenCVFisheyeCamera(eye=(0, 0, 9), target=(0, 0, 0), width=4, height=3, fx=1, fy=1, cx=99, k1=-0.5)
    assert len(scan(scene, nothing).rays) == 0


@cases("integer", [np.int16, np.uint64])
def test_counts_may_be_integers_of_numpy(integer):
    octree, flat = Octree.from_mesh(torus()), Octree.from_mesh(box())
    np.testing.assert_array_equal(scan(octree, [0, 2, 0.5], integer(1000)).rays, scan(octree, [0, 2, 0.5], 1000).rays)
    assert visible_faces(flat, [3, 3, 1.5], cuts=integer(3)).sum() == 6
    depth = depth_map(octree, CAMERAS[0], integer(31), integer(23))
    np.testing.assert_array_equal(depth, depth_map(octree, CAMERAS[0], 31, 23))
    for pattern in (fibonacci_sphere, fibonacci_hemisphere, cosine_hemisphere):
        np.testing.assert_array_equal(pattern(integer(300)).directions, pattern(300).directions)
    np.testing.assert_array_equal(reinhart(integer(3)).directions, reinhart(3).directions)
    points, up = np.array([[0.0, 2.0, 0.5]]), np.array([[0.0, 0.0, 1.0]])
    for ask, option in ((sky_view_factor, "patches"), (ambient_occlusion, "samples")):
        given = ask(octree, points, up, **{option: integer(145)})
        np.testing.assert_array_equal(given, ask(octree, points, up, **{option: 145}))


class _camera_of:  # noqa: N801  # as a function that gives a camera
    """A camera with rows of one's own."""

    def __init__(self, rows):
        self._rows = rows

    def rows(self, width, height):
        return self._rows


def test_rows_of_a_camera_of_ones_own_may_be_a_list():
    octree, rows = Octree.from_mesh(torus()), CAMERAS[0].rows(31, 23).tolist()
    np.testing.assert_array_equal(depth_map(octree, _camera_of(rows), 31, 23), depth_map(octree, CAMERAS[0], 31, 23))


@cases(
    ("ask", "argument", "said"),
    [
        (lambda o: visible_faces(o, [0, 0]), "eye", "shape"),
        (lambda o: visible_faces(o, [0, np.nan, 0]), "eye", "finite"),
        (lambda o: visible_faces(o, [0, 0, 9], cuts=0), "cuts", "from 1 to 64"),
        (lambda o: visible_faces(o, [0, 0, 9], progress=3), "progress", "True or False"),
        (lambda o: visible_faces(box(), [0, 0, 9]), "octree", "an Octree"),
        (lambda o: depth_map(o, CAMERAS[0], 0, 5), "width", "from 1 to 65536"),
        (lambda o: depth_map(o, CAMERAS[0], 5, 2.5), "height", "from 1 to 65536"),
        (lambda o: depth_map(o, "camera", 5, 5), "camera", "a camera, got str"),
        (lambda o: depth_map(o, CAMERAS[0], 5, 5, depth="Z"), "depth", "'distance' or 'z', got 'Z'"),
        (lambda o: depth_map(o, CAMERAS[2], 5, 50), "resolution", "122 x 94.* of that shape, got 5 x 50"),
        (
            lambda o: depth_map(o, PerspectiveCamera, 5, 5),
            "camera",
            r"rows\(width, height\) of shape \(6, 3\).* got .*height",
        ),
        (lambda o: depth_map(o, _camera_of(None), 5, 5), "camera", r"shape \(6, 3\), finite, got NoneType"),
        (lambda o: depth_map(o, _camera_of([[1.0], [2.0, 3.0]]), 5, 5), "camera", r"shape \(6, 3\), finite, got list"),
        (
            lambda o: depth_map(o, _camera_of(np.ones((3, 3))), 5, 5),
            "camera",
            r"shape \(6, 3\), finite, got shape \(3, 3\)",
        ),
        (
            lambda o: depth_map(o, _camera_of(np.full((6, 3), np.nan)), 5, 5),
            "camera",
            r"finite, got \[nan, nan, nan\] in row 0",
        ),
        (lambda o: depth_map(o, _camera_of(np.zeros((6, 3))), 5, 5), "camera", "non-zero directions, got"),
        (lambda o: scan(o, [[0, 0, 9]]), "origin", "shape"),
        (lambda o: scan(o, CAMERAS[0]), "pattern", "width and height of the camera's film.* got None"),
        (lambda o: scan(o, CAMERAS[0], 100), "pattern", "width and height.* got 100"),
        (lambda o: scan(o, CAMERAS[0], (5, 1 << 17)), "pattern", "from 1 to 65536"),
        (lambda o: scan(o, CAMERAS[2], (5, 50)), "resolution", "122 x 94"),
        (lambda o: scan(o, CAMERAS[0], (5, 5), normal=[0, 0, 1]), "normal", "is a camera"),
        (lambda o: scan(o, [0, 0, 9], 0), "pattern", "an integer from 1"),
        (lambda o: scan(o, [0, 0, 9], np.int64(0)), "pattern", "an integer from 1"),
        (lambda o: scan(o, [0, 0, 9], [[0, 0, 0]]), "pattern", "in row 0"),
        (lambda o: scan(o, [0, 0, 9], max_distance=-1), "max_distance", "a number >= 0"),
    ],
)
def test_bad_arguments_are_named(ask, argument, said):
    with pytest.raises(ValueError, match=rf"^{argument}: expected .*{said}"):
        ask(Octree.from_mesh(box()))


class Camera:
    """Parallel rays downwards onto the unit square, with nothing but ``rows``."""

    def rows(self, width: int, height: int) -> Any:
        along, across = [1.0 / width, 0.0, 0.0], [0.0, 1.0 / height, 0.0]
        return np.array([[0.0, 0.0, 3.0], along, across, [0.0, 0.0, -2.0], [0.0] * 3, [0.0] * 3])


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
    assert scan(floor, [0.1, 3.0, 0.1], ways, max_distance=3).distances.tolist() == [3.0]
    assert len(scan(floor, [0.1, 3.0, 0.1], ways, max_distance=np.nextafter(3.0, 0.0)).rays) == 0


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
    assert not visible_faces(octree, [0.0, 0.0, 9.0], cuts=8)[0]
    # 0.05 of the plane's z = 0 is seen beyond the plate's shadow at x = 0.2 * 9 / 8.5.
    beside = Mesh([[-0.1, -0.1, 0.0], [0.22, -0.1, 0.0], [0.0, 0.1, 0.0]], [[0, 1, 2]])
    octree = Octree.from_mesh(Mesh.concatenate([beside, plate]))
    assert [bool(visible_faces(octree, [0.0, 0.0, 9.0], cuts=cuts)[0]) for cuts in (1, 8)] == [False, True]


def test_a_camera_is_what_has_rows_and_depths_are_along_the_ray() -> None:
    depth = depth_map(Octree.from_mesh(box()), Camera(), 5, 4)
    np.testing.assert_array_equal(depth, 2.0)  # not in units of the direction, whose length is 2
