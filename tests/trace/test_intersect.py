"""The ray/triangle and ray/box tests: analytic hits, a slow twin bit for bit, and what may never be missed."""

from fractions import Fraction

import numpy as np
import pytest
from cases import cases
from hypothesis import example, given
from hypothesis import strategies as st
from meshes import make_mesh, rays_at

from renderer.jit.decorators import kernel
from renderer.mesh.shapes import box
from renderer.numerics.simd import splat8, store
from renderer.octree import BruteForce, Octree
from renderer.trace.intersect import Ray, enter_boxes, make_slabs, room_of, round_both, round_down, round_up
from renderer.trace.layout import NODE_WORDS
from validation.oracle import exact

pytestmark = pytest.mark.judges("BruteForce", "Octree.closest_hit")


TRIANGLE = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]])
ONE = np.array([[0, 1, 2]])
BOTH = pytest.mark.parametrize("accelerator", [Octree, BruteForce])


def cast(accelerator, origin, direction, *interval):
    """(t, face, u, v) of one ray, after any_hit agreed."""
    hits = accelerator.closest_hit([origin], [direction], *interval)
    assert accelerator.any_hit([origin], [direction], *interval)[0] == hits.hit[0]
    return hits.t[0], hits.face[0], hits.u[0], hits.v[0]


@BOTH
@pytest.mark.parametrize("x, y", [(1, 1), (0, 0), (4, 0), (0, 4), (2, 0), (0, 2), (2, 2), (1, 3)])
@pytest.mark.parametrize("dz", [-1.0, -4.0, 0.5])
def test_a_triangle_is_closed_two_sided_and_gives_t_and_barycentrics(accelerator, x, y, dz):
    origin = [x, y, -3.0 * np.sign(dz)]
    assert cast(accelerator(TRIANGLE, ONE), origin, [0, 0, dz]) == (3 / abs(dz), 0, x / 4, y / 4)


@BOTH
@pytest.mark.parametrize("origin", [(-5e-324, 1, 1), (1, -5e-324, 1), (2, np.nextafter(2, 3), 1), (4, 4, 1)])
def test_a_hair_beside_the_edge_is_a_miss(accelerator, origin):
    assert cast(accelerator(TRIANGLE, ONE), origin, [0, 0, -1])[:2] == (np.inf, -1)


@BOTH
@pytest.mark.parametrize(
    "interval, hit",
    [
        ((2, 2), True),
        ((0, 2), True),
        ((2, 9), True),
        ((0, np.nextafter(2, 0)), False),
        ((np.nextafter(2, 3), 9), False),
        ((3, 1), False),
    ],
)
def test_the_interval_is_closed(accelerator, interval, hit):
    assert cast(accelerator(TRIANGLE, ONE), [1, 1, 2], [0, 0, -1], *interval)[0] == (2 if hit else np.inf)


@BOTH
def test_an_origin_on_the_surface_hits_at_zero_and_nothing_lies_behind(accelerator):
    plane = accelerator(TRIANGLE, ONE)
    assert cast(plane, [1, 1, 0], [0, 0, 1])[0] == 0
    assert cast(plane, [1, 1, 0], [0.3, 0.2, -0.5])[0] == 0
    assert cast(plane, [1, 1, 0], [0, 0, 1], 5e-324)[1] == -1
    assert cast(plane, [1, 1, 1], [0, 0, 1])[1] == -1


@BOTH
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 1, 0), (-1, -1, 0), (2, 1, -0.0)])
@pytest.mark.parametrize("origin", [(-1, 1, 0), (1, 1, 0), (0, 0, 0), (9, 9, 0)])
def test_a_ray_in_the_plane_misses_without_nan(accelerator, origin, direction):
    t, face, _, _ = cast(accelerator(TRIANGLE, ONE), origin, direction)
    assert (t, face) == (np.inf, -1)


@BOTH
@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_an_origin_in_the_plane_of_a_slab(accelerator, zero):
    cube = accelerator.from_mesh(box())
    assert cast(cube, [1, 0.5, -1], [zero, 0, 1])[0] == 1
    assert cast(cube, [0, 0.5, -1], [zero, zero, 1])[0] == 1
    assert cast(cube, [0, 0, -1], [zero, zero, 1])[0] == 1
    assert cast(cube, [1.0000001, 0.5, -1], [zero, 0, 1])[1] == -1
    assert cast(cube, [np.nextafter(1, 2), 0.5, -1], [zero, 0, 1])[1] == -1


@BOTH
@pytest.mark.parametrize("kind", ["repeated index", "repeated point", "point", "collinear", "collinear tilted"])
def test_a_triangle_without_area_is_met_within_rounding_of_its_line_or_never(accelerator, kind):
    """Between two neighbours it fills the slit that rounding may leave; with two corners in one there is no slit."""
    vertices = np.array([[0, 0, 0], [1, 2, 3], [0, 0, 0], [2, 4, 6], [1.0, 1.0, 0.0], [3.0, 3.0, 0.0]])
    face = {
        "repeated index": [0, 1, 1],
        "repeated point": [0, 1, 2],
        "point": [0, 0, 0],
        "collinear": [0, 4, 5],
        "collinear tilted": [0, 1, 3],
    }[kind]
    rng = np.random.default_rng(2)
    corners = vertices[face]
    share = rng.uniform(-1, 2, (4000, 1))
    targets = np.concatenate([corners[rng.integers(0, 3, 4000)], corners[0] + share * (corners[2] - corners[0])])
    origins = rng.normal(size=(8000, 3)) * 3
    lone = accelerator(vertices, [face])
    hits = lone.closest_hit(origins, targets - origins)
    if not kind.startswith("collinear"):
        assert not hits.hit.any()
        return
    assert hits.hit.any()
    on_ray = origins + hits.t[:, None] * (targets - origins)
    np.testing.assert_allclose(hits.points[hits.hit], on_ray[hits.hit], rtol=0, atol=1e-9)
    assert not lone.any_hit(origins, targets + 1e-9 * rng.normal(size=(8000, 3)) - origins).any()


@BOTH
def test_a_direction_too_short_for_a_finite_t_is_refused(accelerator):
    # |d| = 1e-310 would need t = 1e310, and inf is what a miss reports.
    for query in (accelerator(TRIANGLE, ONE).closest_hit, accelerator(TRIANGLE, ONE).any_hit):
        with pytest.raises(ValueError, match=r"directions: .* in row 0"):
            query([[1, 1, 1]], [[0, 0, -1e-310]])


@BOTH
@pytest.mark.parametrize("exponent", [-300, -100, 100, 300])
def test_directions_of_any_length_hit(accelerator, exponent):
    assert cast(accelerator(TRIANGLE, ONE), [1, 1, 2], [0, 0, -(2.0**exponent)])[0] == 2.0 ** (1 - exponent)


@BOTH
@pytest.mark.parametrize("distance", [1e6, 1e12, 1e30, 8e37])
@pytest.mark.parametrize("t_min", [0.0, 0.5])
def test_a_far_origin_on_one_axis(accelerator, distance, t_min):
    found = cast(accelerator(TRIANGLE, ONE), [1, 1, distance], [0, 0, -1], t_min * distance)
    assert found == (distance, 0, 0.25, 0.25)


@BOTH
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_hardly_tilted_ray_reaches_what_lies_hardly_beside_it(accelerator, sign):
    # 1 / 1e-42 is infinite in float32, and so would be the distance to a plane 5e-30 away that lies at 5e12.
    vertices = np.array([[sign * 5e-30, -1, 1e13], [sign * 5e-30, 1, 1e13], [sign * 1e-28, 0, 1e13]])
    assert cast(accelerator(vertices, ONE), [0, 0, 0], [sign * 1e-42, 0, 1])[0] == 1e13


def woop(corners, origin, direction):
    """Woop, Benthin and Wald for one triangle in numpy scalars: (t, u, v) or None. Rounds where the kernel rounds."""
    size = np.abs(direction)
    z = 2 if size[2] >= size[0] and size[2] >= size[1] else 1 if size[1] >= size[0] else 0
    x, y = (z + 1) % 3, (z + 2) % 3
    shear_x, shear_y = direction[x] / direction[z], direction[y] / direction[z]
    a, b, c = corners - origin
    ax, bx, cx = (p[x] - shear_x * p[z] for p in (a, b, c))
    ay, by, cy = (p[y] - shear_y * p[z] for p in (a, b, c))
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    # Where rounding leaves 0, the exact sign decides.
    ax, bx, cx, ay, by, cy = map(Fraction, (ax, bx, cx, ay, by, cy))
    exact = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    if min(exact) < 0 < max(exact) or not any(exact):
        return None
    whole = u + v + w
    return (u * a[z] + v * b[z] + w * c[z]) / (whole * direction[z]), v / whole, w / whole


@cases("kind", ["soup", "soup_float32", "lattice", "sizes", "far_away"])
def test_the_kernel_equals_its_slow_twin_bit_for_bit(kind):
    vertices, faces = make_mesh(kind, 11, 12)
    origins, directions = rays_at(vertices, faces, 12, 25)
    hits = BruteForce(vertices, faces, threads=1).closest_hit(origins, directions)
    for row in range(len(origins)):
        met = {face: woop(corners, origins[row], directions[row]) for face, corners in enumerate(vertices[faces])}
        met = {face: found for face, found in met.items() if found is not None and found[0] >= 0}
        best = (np.inf, -1, np.nan, np.nan)
        if met:
            face = min(met, key=lambda face: (met[face][0], face))
            best = (met[face][0], face, *met[face][1:])
        np.testing.assert_array_equal((hits.t[row], hits.face[row], hits.u[row], hits.v[row]), best)


@cases("height", [10.0**-k for k in range(1, 9)])
def test_slivers_are_hit_as_exactly(height):
    rng = np.random.default_rng(13)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    corners = np.array([[0, 0, 0], [1, 0, 0], [0.4, height, 0]]) @ turn
    targets = rng.dirichlet(np.ones(3), 300) @ corners
    origins = targets + rng.normal(size=(300, 3))
    octree = Octree(corners, ONE)
    hits = octree.closest_hit(origins, targets - origins)
    for row, found in enumerate(exact.closest_hits(corners, ONE, origins, targets - origins)):
        values = [abs(float(x)) for x in exact.determinants(corners, origins[row], targets[row] - origins[row])[:3]]
        bounds = exact.determinant_bounds((corners - origins[row])[None], (targets[row] - origins[row])[None])[0]
        if (np.array(values) > bounds).all():
            assert hits.hit[row] == (found is not None)
    assert hits.hit.mean() > 0.9


# -------------------------------------------------------------------------------------------------------- boxes

ANY = st.floats(allow_nan=False, allow_infinity=False)


@given(ANY)
@example(1e39)
@example(-1e39)
@example(1e-50)
@example(-1e-50)
@example(float(np.finfo(np.float32).max) * (1 + 2.0**-30))
@example(0.1)
@example(-0.1)
def test_rounding_is_outward_and_close(x):
    down, up = round_down(x), round_up(x)
    assert isinstance(down, float) and np.float32(down) == down and np.float32(up) == up
    assert down <= x <= up
    if abs(x) <= 2.0**126:
        with np.errstate(under="ignore"):
            ulp = float(np.spacing(np.float32(abs(x))))
        assert up - x <= 2 * ulp and x - down <= 2 * ulp


@given(ANY, st.floats(0.0, 1e30))
@example(1e39, 0.0)
@example(-1e39, 1.0)
@example(1e-50, 2.0**-1000)
@example(float(np.finfo(np.float32).max), 1.0)
@example(-0.1, 0.0)
@example(-0.1, 1e-9)
def test_rounding_both_ways_is_outward_with_room_and_close(x, slack):
    down, up = round_both(x, np.float32(room_of(slack)))
    assert np.float32(down) == down and np.float32(up) == up and down < np.inf and up > -np.inf
    assert Fraction(x) + Fraction(slack) <= (Fraction(up) if up < np.inf else up)
    assert Fraction(x) - Fraction(slack) >= (Fraction(down) if down > -np.inf else down)
    if abs(x) <= 2.0**126:
        with np.errstate(under="ignore"):
            ulp = float(np.spacing(np.float32(abs(x) + slack)))
        assert max(up - x, x - down) <= slack * (1.0 + 2.0**-8) + 3 * ulp


@kernel
def entered(nodes, o, d, t_min, t_max, entry):
    largest = max(abs(d[0]), abs(d[1]), abs(d[2]))
    slabs = make_slabs(Ray(o[0], o[1], o[2], d[0], d[1], d[2], t_min, 0.0, -1.0), largest)
    lower, upper = splat8(round_down(t_min * largest)), splat8(round_up(t_max * largest))
    t0, bits = enter_boxes(nodes, 0, slabs, lower, upper)
    store(entry, 0, t0)
    return bits


def exactly_met(lower, upper, o, d):
    """Exact (entry, exit) of a ray in a closed box with entry >= 0, or None."""
    first, last = Fraction(0), None
    for low, high, a, b in zip(lower, upper, o, d, strict=True):
        low, high, a, b = Fraction(float(low)), Fraction(float(high)), Fraction(float(a)), Fraction(float(b))
        if b == 0:
            if not low <= a <= high:
                return None
            continue
        near, far = sorted(((low - a) / b, (high - a) / b))
        first, last = max(first, near), far if last is None else min(last, far)
    return None if last is None or first > last else (first, last)


def boxes_and_rays(seed):
    """A node of eight boxes, the last one empty, and rays aimed at their corners and edges, some parallel to axes."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(2, 8, 3)) if seed % 2 else rng.integers(-3, 4, (2, 8, 3)) / 4
    corners = corners.astype(np.float32)
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    upper[6] = lower[6]
    lower[7], upper[7] = np.inf, -np.inf
    node = np.zeros(NODE_WORDS, np.float32)
    for axis in range(3):
        node[16 * axis : 16 * axis + 8], node[16 * axis + 8 : 16 * axis + 16] = lower[:, axis], upper[:, axis]
    which = rng.integers(0, 7, 200)
    at = np.where(rng.random((200, 3)) < 0.5, lower[which], upper[which]).astype(float)
    inner = rng.random((200, 3)) < 0.2
    at[inner] = (0.3 * lower[which] + 0.7 * upper[which])[inner]
    directions = rng.normal(size=(200, 3)) * 10.0 ** rng.integers(-40, 41, (200, 1))
    directions[rng.random((200, 3)) < 0.2] = rng.choice([0.0, -0.0])
    directions[~directions.any(axis=1)] = [0.0, -0.0, 1.0]
    size = np.abs(directions).max(axis=1, keepdims=True)
    return node, lower, upper, at - directions / size * rng.choice([0.0, 0.5, 4.0, 1e4], (200, 1)), directions


@cases("seed", range(10))
def test_no_box_is_missed_that_a_ray_meets_and_no_entry_is_late(seed):
    node, lower, upper, origins, directions = boxes_and_rays(seed)
    entry = np.empty(8, np.float32)
    met = wrongly_entered = 0
    for o, d in zip(origins, directions, strict=True):
        bits = entered(node, o, d, 0.0, np.inf, entry)
        assert not bits >> 7, "the empty octant was entered"
        for k in range(7):
            found = exactly_met(lower[k], upper[k], o, d)
            if found is None:
                wrongly_entered += bits >> k & 1
                continue
            met += 1
            assert bits >> k & 1
            first = found[0] * Fraction(float(np.abs(d).max()))
            # What enters later than the best hit's padded distance is dropped, so an entry may err by the padding.
            assert Fraction(float(entry[k])) <= first * (1 + 8 * Fraction(2) ** -23)
    assert met >= 190
    # The rays are aimed at boxes to the last bit, so some misses within rounding enter; most misses must not.
    assert wrongly_entered < 0.2 * (7 * len(origins) - met)


@cases("seed", range(4))
def test_the_interval_keeps_boxes_at_its_ends_and_drops_those_beyond(seed):
    node, lower, upper, origins, directions = boxes_and_rays(seed)
    entry = np.empty(8, np.float32)
    dropped = 0
    for o, d in zip(origins, directions, strict=True):
        for k in range(7):
            found = exactly_met(lower[k], upper[k], o, d)
            if found is None or not 0 < found[0] < found[1]:
                continue
            first, last = float(found[0]), float(found[1])
            assert entered(node, o, d, np.nextafter(last, 0), np.inf, entry) >> k & 1
            assert entered(node, o, d, 0.0, np.nextafter(first, np.inf), entry) >> k & 1
            dropped += not entered(node, o, d, 1.001 * last, np.inf, entry) >> k & 1
            dropped += not entered(node, o, d, 0.0, 0.999 * first, entry) >> k & 1
    assert dropped > 350
