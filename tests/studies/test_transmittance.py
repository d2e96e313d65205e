"""Faces that let a share of the light through: laws, closed forms, and the same bits however it is computed."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import box, icosphere, torus
from renderer.studies import (
    ambient_occlusion,
    face_points,
    fibonacci_sphere,
    occlusion,
    openness,
    sky_view_factor,
    sun_hours,
    through,
    translucent,
)

pytestmark = pytest.mark.judges(
    "studies.sky_view_factor", "studies.sun_hours", "studies.occlusion", "studies.ambient_occlusion",
    "studies.openness",
)  # fmt: skip

SUNS = fibonacci_sphere(40).directions
HOURS = np.random.default_rng(1).random(40)
STUDIES: dict[str, Callable[..., Any]] = {
    "occlusion": lambda on, points, normals, **k: occlusion(on, points, normals, SUNS, weights=HOURS, **k),
    "sky_view_factor": lambda on, points, normals, **k: sky_view_factor(on, points, normals, patches=60, **k),
    "sun_hours": lambda on, points, normals, **k: sun_hours(on, points, normals, SUNS, HOURS, up="z", **k),
    "ambient_occlusion": lambda on, points, normals, **k: ambient_occlusion(on, points, normals, samples=60, **k),
    "openness": lambda on, points, normals, **k: openness(on, points, samples=60, **k),
}


def square(height: float, half: float = 1e4) -> Mesh:
    """A level square of two faces."""
    corners = [[-half, -half, height], [half, -half, height], [half, half, height], [-half, half, height]]
    return Mesh(corners, [[0, 1, 2], [0, 2, 3]])


def screens(count: int) -> Mesh:
    return Mesh.concatenate([square(1.0 + k) for k in range(count)])


def court() -> tuple[Mesh, Any]:
    """Balls and a ring in a box without a lid, and points on and beside their faces."""
    walls = box((-3, -3, -1), (3, 3, 2))
    open_box = Mesh(walls.vertices, walls.faces[walls.triangles[:, :, 2].min(axis=1) < 2.0])
    ball = icosphere(2).transformed(np.diag([0.7, 0.7, 0.7, 1.0]))
    ring = torus(around=16, across=8).transformed([[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1], [0, 0, 0, 1]])
    mesh = Mesh.concatenate([open_box, ball, ring])
    return mesh, face_points(mesh)


def mixed(count: int, seed: int = 3) -> Any:
    return np.random.default_rng(seed).choice([0.0, 0.3, 0.6, 1.0], count)


@pytest.mark.parametrize("study", STUDIES)
class TestLaws:
    def test_faces_that_let_nothing_through_have_the_bits_of_no_argument(self, study: str) -> None:
        mesh, (points, normals, faces) = court()
        octree, ask = Octree.from_mesh(mesh), STUDIES[study]
        for leaving in (None, faces):
            known = ask(octree, points, normals, leaving=leaving)
            got = ask(octree, points, normals, leaving=leaving, transmittance=np.zeros(len(mesh.faces)))
            assert got.tobytes() == known.tobytes()
            assert len(np.unique(known)) > 9

    def test_clear_faces_have_the_bits_of_no_faces(self, study: str) -> None:
        """All that is left is the horizon of each point."""
        mesh, (points, normals, faces) = court()
        empty = Octree(mesh.vertices, np.empty((0, 3), np.int32))
        known = STUDIES[study](empty, points, normals)
        clear = np.ones(len(mesh.faces))
        got = STUDIES[study](Octree.from_mesh(mesh), points, normals, leaving=faces, transmittance=clear)
        assert got.tobytes() == known.tobytes()

    def test_clear_faces_are_as_if_they_were_left_out(self, study: str) -> None:
        """Also beside opaque and translucent ones."""
        mesh, (points, normals, _) = court()
        shares = mixed(len(mesh.faces))
        kept = Mesh(mesh.vertices, mesh.faces[shares < 1.0])
        known = STUDIES[study](Octree.from_mesh(kept), points + 0.01, normals, transmittance=shares[shares < 1.0])
        got = STUDIES[study](Octree.from_mesh(mesh), points + 0.01, normals, transmittance=shares)
        assert got.tobytes() == known.tobytes()

    def test_bits_depend_neither_on_tree_threads_nor_company(self, study: str, monkeypatch: pytest.MonkeyPatch) -> None:
        mesh, (points, normals, faces) = court()
        shares, ask = mixed(len(mesh.faces)), STUDIES[study]
        whole = ask(Octree.from_mesh(mesh, threads=1), points, normals, leaving=faces, transmittance=shares)
        assert len(np.unique(whole)) > 100
        for other in (BruteForce.from_mesh(mesh), Octree.from_mesh(mesh, split="midpoint", leaf_size=1, threads=3)):
            got = ask(other, points, normals, leaving=faces, transmittance=shares)
            assert got.tobytes() == whole.tobytes()
        octree = Octree.from_mesh(mesh)
        for rows in (slice(0, 1), slice(40, 90), np.random.default_rng(2).permutation(len(points))):
            got = ask(octree, points[rows], normals[rows], leaving=faces[rows], transmittance=shares)
            assert got.tobytes() == whole[rows].tobytes()
        # Too little room for the hits of a ray, which then grows.
        monkeypatch.setattr(through, "_CAPACITY", 1)
        got = ask(octree, points, normals, leaving=faces, transmittance=shares)
        assert got.tobytes() == whole.tobytes()

    def test_more_light_comes_through_clearer_faces(self, study: str) -> None:
        mesh, (points, normals, faces) = court()
        octree, sign = Octree.from_mesh(mesh), -1.0 if study == "occlusion" else 1.0
        found = [
            sign * STUDIES[study](octree, points, normals, leaving=faces, transmittance=np.full(len(mesh.faces), share))
            for share in (0.0, 2.0**-40, 0.25, 0.75, 1.0 - 2.0**-40, 1.0)
        ]
        steps = np.diff(found, axis=0)
        assert (steps >= -(2.0**-50)).all() and steps.max() > 0.1
        # There is no jump at either end: not for points on the faces, at whose horizons rays begin.
        assert np.abs(steps[[0, -1]]).max() < 2.0**-30


@cases("count", [1, 2, 7, 40, 200])
def test_each_of_parallel_screens_takes_its_share(count: int) -> None:
    """Halves, so that products are exact; the sums of patches round."""
    octree, halves = Octree.from_mesh(screens(count)), np.full(2 * count, 0.5)
    left = 0.5**count
    sun = [[0.3, 0.2, 0.9], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]]  # the last two through the diagonals of all
    assert sun_hours(octree, [[0.0, 0.0, 0.0]], None, sun, [1.0, 2.0, 4.0], transmittance=halves).tolist() == [7 * left]
    assert occlusion(octree, [[0.0, 0.0, 0.0]], None, sun, transmittance=halves).tolist() == [1.0 - left]
    sky = sky_view_factor(octree, [[5.0, 0.25, 0.0]], transmittance=halves)
    np.testing.assert_allclose(sky, left, rtol=1e-12)
    # Up to a distance, screens beyond it take nothing.
    near = sun_hours(octree, [[0.5, 0.25, 0.0]], None, [[0.0, 0.0, 7.0]], transmittance=halves, max_distance=2.5)
    assert near.tolist() == [0.5 ** min(count, 2)]


@cases("share", [0.25, 0.9])
@cases("patches", [145, 577, 20000])
def test_the_sky_through_a_round_awning(share: float, patches: int) -> None:
    """1 - (1 - share) times the form factor of a disc, r^2 / (r^2 + h^2); of the sky's solid angle its own share.

    The bound is that of test_sky.py, times what the disc takes; 720 sides miss 1.3e-5 of its area.
    """
    radius, height, sides = 2.0, 1.5, 720
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(sides, height)], axis=1)
    fan = np.stack([np.arange(sides), np.roll(np.arange(sides), -1), np.full(sides, sides)], axis=1)
    octree = Octree(np.append(ring, [[0.0, 0.0, height]], axis=0), fan)
    bound = (1.0 - share) * (0.5 * np.sqrt(2.0 * np.pi / patches) * 4.0 / np.pi)
    asked: dict[str, Any] = {"patches": patches, "transmittance": np.full(sides, share)}
    seen = sky_view_factor(octree, [[0.0, 0.0, 0.0]], **asked)
    assert abs(seen[0] - (1.0 - (1.0 - share) * radius**2 / (radius**2 + height**2))) < bound
    seen = sky_view_factor(octree, [[0.0, 0.0, 0.0]], definition="geometric", **asked)
    assert abs(seen[0] - (1.0 - (1.0 - share) * (1.0 - height / np.hypot(radius, height)))) < bound


def test_a_ray_crosses_one_of_the_faces_that_meet_at_an_edge_or_corner() -> None:
    """And both walls of a box, which it goes through."""
    octree, halves = Octree.from_mesh(box()), np.full(12, 0.5)
    rays = {
        (0.5, 0.5, 2.0): (0.0, 0.0, -1.0),  # along diagonals
        (0.25, 0.75, 2.0): (0.0, 0.0, -1.0),
        (0.25, 0.5, 2.0): (0.0, 0.0, -1.0),  # beside them
        (0.5, 0.625, 1.5): (0.25, 0.25, -1.0),  # from a face to an edge
        (2.0, 2.0, 2.0): (-1.0, -1.0, -1.0),  # from corner to corner
    }
    for point, way in rays.items():
        assert sun_hours(octree, [point], None, [way], transmittance=halves).tolist() == [0.25], point
    # What only touches an edge crosses one face there.
    assert sun_hours(octree, [[0.25, 0.5, 1.5]], None, [[0.0, 1.0, -1.0]], transmittance=halves).tolist() == [0.5]


def test_an_opaque_face_hides_before_and_behind_a_screen() -> None:
    mesh = Mesh.concatenate([square(1.0), square(2.0, 1.0), square(3.0)])
    hidden, behind, clear = [0.5, 0.5, 0, 0, 1, 1], [0, 0, 0.5, 0.5, 1, 1], [0.5, 0.5, 1, 1, 0.25, 0.25]
    for shares, at_middle in ((hidden, 0.0), (behind, 0.0), (clear, 0.125)):
        hours = sun_hours(Octree.from_mesh(mesh), [[0.5, 0.25, 0]], None, [[0.0, 0.0, 1.0]], transmittance=shares)
        assert hours.tolist() == [at_middle]


def test_a_point_on_a_translucent_face_looks_out_freely_and_back_through_it() -> None:
    """Back, as a normal that is not that of the face has it: some of its directions lead through the face."""
    octree, halves = Octree.from_mesh(square(0.0)), [0.5, 0.5]
    ways, normal = [[0.0, 0.0, 1.0], [3.0, 0.0, 1.0], [3.0, 0.0, -1.0], [0.0, 0.0, -1.0]], [1.0, 0.0, 0.5]
    for point in ([3.0, 5.0, 0.0], [0.25, 0.25, 0.0]):  # within a face, and on the edge between both
        for leaving in (None, [1]):
            asked: dict[str, Any] = {"leaving": leaving, "transmittance": halves}
            seen = [sun_hours(octree, [point], [normal], [way], **asked)[0] for way in ways]
            assert seen == [1.0, 1.0, 0.5, 0.0]
            assert [sun_hours(octree, [point], None, [way], **asked)[0] for way in ways] == [1.0] * 4
    # What only its face's number says to be on it is so, too; and a sheet below takes its share as well.
    two = Octree.from_mesh(Mesh.concatenate([square(0.0), square(-1.0)]))
    off = [[3.0, 5.0, -(2.0**-22)]]
    hours = [sun_hours(two, off, [normal], [way], leaving=[1], transmittance=[0.5] * 4)[0] for way in ways]
    assert hours == [1.0, 1.0, 0.25, 0.0]


def test_the_trees_are_built_once_for_the_same_shares_and_anew_for_a_moved_mesh(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    built, own = list[int](), translucent.octree_over
    monkeypatch.setattr(translucent, "octree_over", lambda *given: built.append(1) or own(*given))
    octree, point, sun = Octree.from_mesh(screens(2)), [[0.5, 0.25, 0.0]], [[0.0, 0.0, 1.0]]
    shares = np.array([0.5, 0.5, 0.25, 0.25])

    def hours() -> float:
        return float(sun_hours(octree, point, None, sun, transmittance=shares)[0])

    assert [hours(), hours()] == [0.125, 0.125] and len(built) == 2
    shares[2:] = 0.75
    assert hours() == 0.375 and len(built) == 4
    octree.refit(octree.mesh.vertices * [1.0, 1.0, -1.0])
    assert hours() == 1.0 and len(built) == 6


@cases(
    ("bad", "said"),
    [
        ([0.5] * 11, r"shape \(12,\), one a face, got shape \(11,\)"),
        (np.full((12, 1), 0.5), r"shape \(12,\), one a face, got shape \(12, 1\)"),
        (0.5, r"shape \(12,\), one a face, got shape \(\)"),
        ([0.5] * 7 + [-1e-300] + [0.5] * 4, "numbers from 0 to 1, got -1e-300 in row 7"),
        ([0.5] * 11 + [np.nextafter(1.0, 2.0)], "numbers from 0 to 1, got 1.0000000000000002 in row 11"),
        ([np.nan] + [0.5] * 11, "numbers from 0 to 1, got nan in row 0"),
        (["a"] * 12, "real numbers"),
    ],
)
@cases("study", STUDIES)
def test_bad_shares_are_named(study: str, bad: Any, said: str) -> None:
    with pytest.raises(ValueError, match=f"^transmittance: expected {said}"):
        STUDIES[study](Octree.from_mesh(box()), np.zeros((4, 3)), [0, 0, 1], transmittance=bad)


def test_bits_have_no_shares() -> None:
    with pytest.raises(ValueError, match=r"^transmittance: expected None with packed, as bits have no shares"):
        occlusion(Octree.from_mesh(box()), [0, 0, 0], None, np.eye(3), transmittance=[0.0] * 12, packed=True)


@cases("size", [1e-40, 1e-10, 1e30, 1e45])
def test_shares_are_those_of_any_size(size: float) -> None:
    """The opaque and the translucent part of a mesh have units of their own, and one of them may be empty."""
    mesh = Mesh.concatenate([square(1.0, 100.0), square(2.0, 1.0)])
    octree = Octree(mesh.vertices * size, mesh.faces)
    points = np.array([[0.5, 0.25, 0.0], [5.0, 5.25, 0.0], [5.0, 5.25, 1.0]]) * size
    for low, high, left in ((0.5, 0.25, [0.125, 0.5, 1.0]), (0.5, 0.0, [0.0, 0.5, 1.0]), (1.0, 0.5, [0.5, 1.0, 1.0])):
        asked = {"transmittance": [low, low, high, high]}
        assert sun_hours(octree, points, [0, 0, 1], [[0.0, 0.0, 1.0]], **asked).tolist() == left  # type: ignore[arg-type]
