"""Scans of scenes: returns, poses, and what is not hit, against single rays and closed forms."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from cases import cases
from numpy.typing import NDArray

from renderer import BruteForce, Mesh, Octree, RayScene
from renderer.mesh.shapes import box, grid, icosphere, torus
from renderer.studies import Scan, fibonacci_sphere, scan, scanner

pytestmark = pytest.mark.judges("studies.Scan", "studies.scan")

Floats = NDArray[np.float64]
# Of a sum of some products.
ROUNDED = 1e-12


def turns(count: int, seed: int) -> Floats:
    """Rotations (count, 3, 3)."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(count, 3, 3)))
    return q * np.linalg.det(q)[:, None, None]


def crowd() -> RayScene:
    """A floor, a wall that stands on it, turned boxes and a ring, all of them around the origin."""
    scene, rng = RayScene(threads=2), np.random.default_rng(5)
    placed = np.concatenate([turns(6, 1) * rng.uniform(0.4, 2.0, (6, 1, 3)), rng.normal(size=(6, 3, 1)) * 3.0], axis=2)
    placed[0, :, :3] *= -1.0  # mirrors
    scene.add(box((-9, -9, -5), (9, 9, -4)), name="floor")
    scene.add(box((2, -9, -4), (3, 9, 5)), name="wall")
    scene.add(box(), placed, name="boxes")
    scene.add(torus(around=16, across=8), name="ring")
    return scene


def arrays_of(cloud: Scan) -> dict[str, NDArray[Any]]:
    return vars(cloud)


def faces_in_merged(scene: RayScene, cloud: Scan) -> NDArray[Any]:
    counts = np.array([len(scene.mesh(k).faces) for k in scene.objects])
    firsts = np.cumsum([0, *counts * [len(scene.transforms(k)) for k in scene.objects]])
    return firsts[cloud.objects] + cloud.instances * counts[cloud.objects] + cloud.faces


def test_a_scan_of_a_scene_has_the_bits_of_its_merged_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also from the surface: inside faces, on edges, at corners, at the foot of the wall, by normals and in parts."""
    scene, sides = crowd(), [[0.1, 0.2, 1.0], [-1.0, 0.0, -0.1], [0.3, -1.0, 0.2], [1.0, 0.1, -1.0]]
    options: list[dict[str, Any]] = [{}, {"max_distance": 4.0}, *({"normal": side} for side in sides)]
    # Three wings on one axis: each bounds two of the three rooms around it.
    axis, ends = [[0, 0, -1], [0, 0, 2]], [[np.cos(a), np.sin(a), 0] for a in (0.1, 2.0, 4.0)]
    scene.add(Mesh([*axis, *ends], [[0, 1, 2], [1, 3, 0], [4, 0, 1]]), np.insert(turns(1, 3)[0], 3, 7, axis=1))
    octree = Octree(scene.merged)
    corners = scene.merged.triangles[[1, 14, 30, 60, 100, 300, -1]]
    on = np.concatenate(
        [
            corners.mean(axis=1),
            corners[:, 0],
            corners[:, :2].mean(axis=1),
            corners[:, 1:].mean(axis=1),
            [[2, 0.3, -4], [2, -9, -4]],
        ]
    )
    places = [[0.1, 0.2, 0.3], *on, *on[:3].astype(np.float32)]
    stopped = 0
    for number, place in enumerate(places):
        monkeypatch.setattr(scanner, "_ROWS", [1 << 18, 20][number % 2])
        for option in options:
            ours, whole = scan(scene, place, 50, **option), scan(octree, place, 50, **option)
            np.testing.assert_array_equal(faces_in_merged(scene, ours), whole.faces)
            for name in ("points", "normals", "distances", "rays", "cosines", "returns"):
                np.testing.assert_array_equal(getattr(ours, name), getattr(whole, name), strict=True)
            stopped += int((whole.distances == 0.0).sum())
    assert stopped > 1000


def one_by_one(scene: RayScene, place: Any, ways: Floats, most: int, clear: list[int], reach: float) -> list[Any]:
    """Ray, return, object, instance, face and distance of each hit: one ray after the other, and hit after hit."""
    found = []
    for ray, way in enumerate(ways):
        start, leaving, gone, length = np.array(place, float), None, 0.0, float(np.linalg.norm(way))
        for number in range(1, most + 1):
            hit = scene.closest_hit(start, way, leaving=leaving)
            gone += float(hit.t) * length
            if not hit.hit or gone > reach:
                break
            found.append((ray, number, int(hit.object), int(hit.instance), int(hit.face), gone))
            if hit.object not in clear:
                break
            start, leaving = hit.points, hit.through()
    return found


@cases(("most", "reach"), [(1, np.inf), (2, np.inf), (4, np.inf), (9, np.inf), (9, 5.0)])
def test_returns_are_those_of_single_rays_that_go_on(most: int, reach: float) -> None:
    scene, ways = crowd(), fibonacci_sphere(200).directions * np.linspace(0.5, 4.0, 200)[:, None]
    known = one_by_one(scene, [0.1, 0.2, 0.3], ways, most, [2, 3], reach)
    cloud = scan(scene, [0.1, 0.2, 0.3], ways, returns=most, through=[3, 2], max_distance=reach)
    rows = zip(cloud.rays, cloud.returns, cloud.objects, cloud.instances, cloud.faces, strict=True)
    assert [tuple(map(int, row)) for row in rows] == [row[:5] for row in known]
    np.testing.assert_allclose(cloud.distances, [row[5] for row in known], rtol=ROUNDED)
    assert (cloud.returns.max() > 2) == (most > 2)


def panes(heights: list[float]) -> RayScene:
    """Level panes, the last of which is a floor."""
    scene, sheet = RayScene(), grid(2, 2, (400.0, 400.0))
    level = Mesh(sheet.vertices[:, [2, 0, 1]], sheet.faces)  # along z
    for height in heights:
        scene.add(level, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, height]])
    return scene


def test_through_parallel_panes_the_distances_and_cosines_are_those_of_trigonometry() -> None:
    heights, angles = [-1.0, -1.5, -4.0, -7.0, -8.0], np.linspace(0.0, 1.4, 30)
    ways = np.stack([np.sin(angles), 0.0 * angles, -np.cos(angles)], axis=1) * np.linspace(0.25, 8.0, 30)[:, None]
    scene = panes(heights)
    cloud = scan(scene, [0.2, 0.1, 0.0], ways, returns=9, through=[0, 1, 2, 4])
    # The fourth lets no light through, so that the fifth is never hit.
    np.testing.assert_array_equal(cloud.objects.reshape(30, 4), np.tile([0, 1, 2, 3], (30, 1)))
    np.testing.assert_array_equal(cloud.returns.reshape(30, 4), np.tile([1, 2, 3, 4], (30, 1)))
    np.testing.assert_array_equal(cloud.rays, np.repeat(np.arange(30), 4))
    slanted = -np.array(heights[:4]) / np.cos(angles)[:, None]
    # Behind a pane a ray starts off it by the bound of its rounding.
    np.testing.assert_allclose(cloud.distances.reshape(30, 4), slanted, rtol=1e-10)
    np.testing.assert_allclose(cloud.cosines.reshape(30, 4), np.tile(np.cos(angles)[:, None], 4), rtol=ROUNDED)
    assert cloud.cosines.max() == 1.0
    near = scan(scene, [0.2, 0.1, 0.0], ways, returns=2, through=[0, 1, 2, 4], max_distance=3.0)
    np.testing.assert_array_equal(np.bincount(near.rays, minlength=30), (slanted[:, :2] <= 3.0).sum(axis=1))


def test_a_ray_ends_at_a_pane_that_rounding_puts_beyond_its_reach() -> None:
    """The way that was left was less than nothing."""
    reach, first, last = 1.5102433809840485, 0.008263817764264547, 1.5102433809840488
    assert first + (reach - first) > reach
    scene, corner = panes([first, last, 5.0]), [-200.0, -200.0, 0.0]  # behind corners a ray starts exactly there
    cloud = scan(scene, corner, [[0, 0, 1]], returns=3, through=[0, 1, 2], max_distance=reach)
    assert cloud.objects.tolist() == [0, 1]


def test_a_scanner_where_something_is_hidden_stands_in_the_air() -> None:
    scene = RayScene()
    scene.show(scene.add(box()), False)
    assert len(scan(scene, [0.5, 0.5, 1.0], 100).rays) == 0


@cases("kind", [Octree, BruteForce])
def test_an_octree_is_an_object_that_light_may_go_through(kind: Callable[..., Any]) -> None:
    octree = kind(icosphere(2))
    cloud = scan(octree, [3.0, 0.1, 0.2], [[-1, 0, 0], [0, 1, 0]], returns=5, through=0)
    every = octree.all_hits([3.0, 0.1, 0.2], [-1, 0, 0])
    np.testing.assert_array_equal(cloud.faces, every.face)
    np.testing.assert_allclose(cloud.distances, every.t, rtol=ROUNDED)
    assert cloud.returns.tolist() == [1, 2] and not cloud.objects.any() and not cloud.instances.any()


@cases("form", ["(k, 3, 4)", "(k, 4, 4)"])
def test_a_ray_with_a_pose_is_that_of_a_scanner_there_alone(form: str) -> None:
    scene, count, rng = crowd(), 150, np.random.default_rng(8)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = turns(count, 2), rng.uniform(-1.0, 1.0, (count, 3))
    ways = rng.normal(size=(count, 3))
    given = poses if form == "(k, 4, 4)" else poses[:, :3]
    cloud = scan(scene, given, ways)
    assert len(cloud.rays) > 50 and len(np.unique(cloud.objects)) == 4
    for k in range(count):
        alone, own = scan(scene, poses[k, :3, 3], [poses[k, :3, :3] @ ways[k]]), np.flatnonzero(cloud.rays == k)
        for name in ("objects", "instances", "faces"):
            np.testing.assert_array_equal(getattr(cloud, name)[own], getattr(alone, name))
        for name in ("distances", "points", "cosines"):
            np.testing.assert_allclose(getattr(cloud, name)[own], getattr(alone, name), rtol=0, atol=1e-9)
    # One pose for all rays, one direction for all poses, and places alone.
    turned = ways @ poses[7, :3, :3].T
    for ours, theirs in (
        (scan(scene, given[7], ways), scan(scene, poses[7, :3, 3], turned)),
        (scan(scene, given, ways[:1]), scan(scene, given, np.tile(ways[:1], (count, 1)))),
        (
            scan(scene, poses[:, :3, 3], turned),
            scan(scene, np.insert(np.tile(np.eye(3), (count, 1, 1)), 3, poses[:, :3, 3], axis=2), turned),
        ),
    ):
        np.testing.assert_array_equal(ours.faces, theirs.faces)
        np.testing.assert_allclose(ours.distances, theirs.distances, rtol=1e-9)


def test_the_body_that_carries_the_scanner_is_not_hit() -> None:
    """The scanner is inside one of two shells; without it, all is as before it was there, behind panes too."""
    scene, place, ways = crowd(), [0.1, 0.2, 0.3], fibonacci_sphere(400).directions
    options: dict[str, Any] = {"returns": 3, "through": [2, 3]}
    before = scan(scene, place, ways, **options)
    shells = scene.add(
        icosphere(2), [[[s, 0, 0, 0.1], [0, s, 0, 0.2], [0, 0, s, 0.3]] for s in (0.1, 80.0)], mask=[2, 1]
    )
    assert (scan(scene, place, ways).objects == shells).all()
    own = scene.closest_hit(place, [0, 0, 1])
    for choice in ({"ignore": own}, {"mask": 1}):
        cloud = scan(scene, place, ways, **options, **choice)
        seen = cloud.objects != shells  # the far shell is behind all others
        assert (~seen).sum() > 0 and (cloud.instances[~seen] == 1).all()
        for name, array in arrays_of(before).items():
            np.testing.assert_array_equal(arrays_of(cloud)[name][seen], array, strict=True)


def test_all_rays_of_a_scan_see_one_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Something moves between the parts of a scan, and between the returns of a part."""
    scene = panes([-1.0, -2.0])
    expected = scan(scene, [0, 0, 0], [[0.1, 0.2, -1.0]] * 4, returns=2, through=0)
    sound = scanner._cloud

    def moving(*arguments: Any) -> Scan:
        scene.move(0, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1.5]])
        return sound(*arguments)

    monkeypatch.setattr(scanner, "_cloud", moving)
    monkeypatch.setattr(scanner, "_ROWS", 2)
    cloud = scan(scene, [0, 0, 0], [[0.1, 0.2, -1.0]] * 4, returns=2, through=0)
    np.testing.assert_array_equal(cloud.distances, expected.distances)


def test_a_scan_of_a_scene_makes_no_merged_mesh() -> None:
    scene = crowd()
    for place in ([0.1, 0.2, 0.3], [0, 0, -4]):
        assert len(scan(scene, place, 500, returns=2, through=2).rays)
    assert "merged" not in vars(scene._built)


POSE = np.eye(4)[:3]


@cases(
    ("options", "said"),
    [
        ({"returns": 0}, "returns: expected an integer >= 1"),
        ({"returns": 2}, "through: expected objects that let light through, for several returns, got none"),
        ({"through": [1, 7]}, r"through: expected some of the objects \[0, 1, 2, 3\], got \[7\]"),
        ({"origin": POSE.T}, r"origin: expected a place or pose, or 5, of shape \(\.\.\., 3\), got shape \(4, 3\)"),
        ({"origin": np.tile(POSE, (3, 1, 1))}, r"origin: expected a place or pose, or 5, .*got shape \(3, 3, 4\)"),
        (
            {"origin": np.empty((0, 3)), "pattern": [[0, 0, 1]]},
            r"origin: expected a place or pose, or 1, .*got shape \(0, 3\)",
        ),
        ({"origin": np.ones((4, 4))}, "origin: expected poses whose last row is 0 0 0 1"),
        ({"origin": 0.0 * POSE}, r"origin: expected finite, non-zero vectors.* got \[0.0, 0.0, 0.0\] in row 0"),
        ({"origin": np.zeros((5, 3)), "normal": [0, 0, 1]}, "normal: expected None where the scanner moves"),
        ({"mask": 1, "normal": [0, 0, 1]}, "normal: expected None where the scanner moves or has a mask"),
        ({"mask": [1, 2]}, r"mask: expected one for all rays, got shape \(2,\)"),
        ({"mask": -1}, "mask: expected 32 bits, got -1"),
        ({"ignore": 3}, "ignore: expected hits of a scene, got int"),
        ({"octree": Octree(box()), "mask": 1}, "mask: expected all bits, where there is no RayScene"),
        ({"octree": Octree(box()), "through": 1}, r"through: expected some of the objects \[0\], got \[1\]"),
        ({"octree": box()}, "octree: expected an Octree, a BruteForce or a RayScene, got Mesh"),
    ],
)
def test_bad_arguments_are_named(options: dict[str, Any], said: str) -> None:
    given = {"octree": crowd(), "origin": [0.1, 0.2, 0.3], "pattern": np.eye(5, 3) + 0.1} | options
    with pytest.raises(ValueError, match=f"^{said}"):
        scan(**given)
