"""Sky view factors and hours of sun, against closed forms."""

import numpy as np
import pytest
from cases import cases

from renderer import Octree
from renderer.mesh.shapes import box
from renderer.studies import Pattern, fibonacci_sphere, reinhart, sky_view_factor, sun_hours

pytestmark = pytest.mark.judges("studies.sky_view_factor", "studies.sun_hours")


SIZES = [145, 577, 2000, 20000]
SIDES = 720


def trench(width, depth, length=1e5):
    """A floor and two walls along y, in long thin faces."""
    x, y, z = width / 2.0, length, depth
    corners = [[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0], [-x, -y, z], [-x, y, z], [x, -y, z], [x, y, z]]
    return Octree(corners, [[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4], [1, 6, 7], [1, 7, 2]])


def shaft(radius, depth):
    """The wall of a round shaft, of so many sides that the circle's area is missed by 1.3e-5."""
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    corners = np.concatenate([np.insert(ring, 2, 0.0, axis=1), np.insert(ring, 2, depth, axis=1)])
    a, b = np.arange(SIDES), np.roll(np.arange(SIDES), -1)
    faces = np.concatenate([np.stack([a, b, SIDES + b], 1), np.stack([a, SIDES + b, SIDES + a], 1)])
    return Octree(corners, faces)


def bound(count):
    """How far a share may be off. The patches are sqrt(2 pi / count) wide, so boundaries of length 2 pi, the longest
    here, run through sqrt(2 pi count) of them, each of which is wrong by half its weight at most. That is 1 / count, or
    by cosine 2 cos / count, whose mean along half a great circle is 4 / pi at most. As if all erred to one side.
    """
    return 0.5 * np.sqrt(2.0 * np.pi / count) * 4.0 / np.pi


@cases("count", SIZES)
@cases(("width", "depth"), [(2.0, 1.0), (2.0, 3.0), (10.0, 1.0), (1.0, 4.0)])
def test_the_middle_of_a_streets_floor(count, width, depth):
    """cos(atan(2 h / w)) by cosine (Oke 1987); 1 - 2 atan(2 h / w) / pi of the sky's solid angle, a wedge."""
    octree, angle = trench(width, depth), np.arctan(2.0 * depth / width)
    asked = {"patches": count, "leaving": [0]}
    seen = sky_view_factor(octree, [[0.0, 0.125, 0.0]], [0, 0, 1], **asked)
    assert abs(seen[0] - np.cos(angle)) < bound(count)
    open_share = sky_view_factor(octree, [[0.0, 0.125, 0.0]], definition="geometric", **asked)
    assert abs(open_share[0] - (1.0 - 2.0 * angle / np.pi)) < bound(count)


@cases("count", SIZES)
@cases(("radius", "depth"), [(1.0, 0.5), (1.0, 1.0), (1.0, 3.0)])
def test_the_bottom_of_a_shaft(count, radius, depth):
    """The form factor of a disc above a point of a parallel plane, r^2 / (r^2 + h^2)."""
    octree = shaft(radius, depth)
    seen = sky_view_factor(octree, [[0.0, 0.0, 0.0]], patches=count)
    assert abs(seen[0] - radius**2 / (radius**2 + depth**2)) < bound(count)
    cap = sky_view_factor(octree, [[0.0, 0.0, 0.0]], patches=count, definition="geometric")
    assert abs(cap[0] - (1.0 - depth / np.hypot(radius, depth))) < bound(count)


@cases("count", SIZES)
def test_in_the_open_it_is_that_of_the_points_tilt(count):
    octree = Octree([[0, 0, -9], [1, 0, -9], [0, 1, -9]], [[0, 1, 2]])
    tilts = np.radians([0.0, 30.0, 60.0, 90.0, 120.0, 180.0])
    normals = np.stack([np.sin(tilts) * 0.6, np.sin(tilts) * 0.8, np.cos(tilts)], axis=1)
    seen = sky_view_factor(octree, np.zeros((6, 3)), normals, patches=count)
    np.testing.assert_allclose(seen, (1.0 + np.cos(tilts)) / 2.0, rtol=0, atol=bound(count))
    assert seen[0] == 1.0 and seen[5] == 0.0
    share = sky_view_factor(octree, np.zeros((6, 3)), normals, patches=count, definition="geometric")
    np.testing.assert_allclose(share, 1.0 - tilts / np.pi, rtol=0, atol=bound(count))
    assert share[0] == 1.0 and share[5] == 0.0
    assert sky_view_factor(octree, [[0, 0, 0]], patches=count).tolist() == [1.0]


def test_hours_are_those_of_the_suns_that_are_seen():
    octree = trench(2.0, 1.0)
    angles = np.radians(np.arange(1, 180) + 0.5)
    suns = np.stack([np.cos(angles), np.zeros(179), np.sin(angles)], axis=1)
    hours = sun_hours(
        octree, [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0, 0, 9]], [0, 0, 1], suns, np.full(179, 0.25), leaving=[0, 0, -1]
    )
    expected = [90, np.degrees(np.pi - np.arctan(1.0 / 1.5) - np.arctan(1.0 / 0.5)).round(), 179]
    assert hours.tolist() == [0.25 * number for number in expected]
    assert sun_hours(octree, [0, 0, 9], None, suns).tolist() == 179.0
    assert sun_hours(octree, [0, 0, 9], [1, 0, 0], suns).tolist() == 89.0  # not those behind it, nor that along it


@cases(
    ("argument", "value", "said"),
    [
        ("patches", 0, "an integer from 1 to .*, or a Pattern, got 0"),
        ("patches", 2**25, "an integer from 1 to 16777216, or a Pattern"),
        ("patches", "tregenza", ", or a Pattern"),
        ("patches", fibonacci_sphere(9), r"above the horizon, z > 0, got \[.*\] in row 0"),
        ("patches", Pattern(np.eye(3)[2:], [1.0, 2.0]), r"shape \(1,\)"),
        ("patches", Pattern(np.eye(3)[2:], [0.0]), "a weight that is not 0"),
        ("patches", Pattern(np.full((1, 3), np.nan), [1.0]), "finite"),
        ("definition", "oke", r"one of \['cosine', 'geometric'\], got 'oke'"),
        ("definition", None, "one of"),
        ("up", (0, 0, 0), "non-zero"),
        ("up", (0, 1), "shape"),
        ("up", np.eye(3), r"shape \(3,\)"),
        ("up", None, "real numbers"),
        ("normals", np.zeros((4, 3)), "not zero"),
        ("normals", np.ones((5, 3)), "shape"),
        ("points", [[np.inf, 0, 0]], "finite"),
    ],
)
def test_bad_arguments_of_a_sky_are_named(argument, value, said):
    given = {"octree": Octree.from_mesh(box()), "points": np.zeros((4, 3)), "normals": None, argument: value}
    with pytest.raises(ValueError, match=rf"^{argument}: expected .*{said}"):
        sky_view_factor(given.pop("octree"), given.pop("points"), given.pop("normals"), **given)


def test_of_a_sky_within_a_points_horizon_nothing_is_seen():
    """No patch adds anything there: a share of 0, where it was NaN."""
    octree = Octree([[0, 0, -9], [1, 0, -9], [0, 1, -9]], [[0, 1, 2]])
    across = Pattern(np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 1.0]]), np.ones(2))
    for patches in (across, 1):
        assert sky_view_factor(octree, np.zeros((2, 3)), [[1, 0, 0], [0, 0, 1]], patches=patches).tolist() == [0.0, 1.0]


@cases("bad", [[1.0], np.full(3, np.nan), [[1.0, 1.0, 1.0]], [-1, 0, 0]])
def test_bad_hours_are_named(bad):
    with pytest.raises(ValueError, match=r"^weights: expected "):
        sun_hours(Octree.from_mesh(box()), np.zeros((4, 3)), None, np.eye(3), bad)
    with pytest.raises(ValueError, match=r"^sun_directions: expected .* in row 1"):
        sun_hours(Octree.from_mesh(box()), np.zeros((4, 3)), None, [[0, 0, 1], [0, 0, 0]])


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
