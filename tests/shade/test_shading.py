"""Shading kernels against textbook formulas in fifty-digit decimals and against exact rationals."""

import math
from collections.abc import Sequence
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st

from renderer.materials.dielectric import fresnel
from renderer.materials.phong import specular
from renderer.shade.shading import reflect, refract
from renderer.trace.spawn import BOUNDED, MITSUBA_EPSILON, OffsetRule, facet_of, offset_distance, spawn_origin

U = 2.0**-53
UP = (0.0, 1.0, 0.0)
Vector = tuple[float, float, float]


@pytest.fixture(autouse=True)
def fifty_digits() -> Any:
    with localcontext() as context:
        context.prec = 50
        yield


def vector(values: Sequence[float]) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))


def decimals(a: Sequence[float]) -> list[Decimal]:
    return [Decimal(float(x)) for x in a]


def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    return sum((x * y for x, y in zip(a, b, strict=True)), 0 * a[0])


def cross(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    return [a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3] for k in range(3)]


def length(a: Sequence[Decimal]) -> Decimal:
    return dot(a, a).sqrt()


def unit_pairs(count: int, seed: int) -> list[tuple[Vector, Vector]]:
    """Unit directions with unit normals against them; every fourth pair within 1e-6 to 1 of grazing or of normal."""
    rng = np.random.default_rng(seed)
    pairs = []
    for i in range(count):
        n, across = rng.normal(size=(2, 3))
        n /= np.linalg.norm(n)
        across -= across.dot(n) * n
        across /= np.linalg.norm(across)
        angle = rng.uniform(0, np.pi / 2)
        if i % 4 == 0:
            angle = 10.0 ** rng.uniform(-6, 0)
        elif i % 4 == 1:
            angle = np.pi / 2 - 10.0 ** rng.uniform(-6, 0)
        d = np.sin(angle) * across - np.cos(angle) * n
        pairs.append((vector(d / np.linalg.norm(d)), vector(n)))
    return pairs


def test_reflect_mirrors_the_direction() -> None:
    for d, n in unit_pairs(500, 1):
        dd, nn = decimals(d), decimals(n)
        expected = [x - 2 * dot(dd, nn) * y for x, y in zip(dd, nn, strict=True)]
        # Roundings of values of at most 2: dot 3, product 1 and difference 1, each of half an ulp of 2.
        assert all(abs(Decimal(a) - b) <= 8 * Decimal(U) for a, b in zip(reflect(d, n), expected, strict=True))


def snell_faults(d: Vector, n: Vector, n1: float, n2: float) -> str:
    """What is wrong with a refraction, judged backwards from its result in decimals; empty when nothing is."""
    cos_t, t = refract(d, n, n1, n2)
    dd, nn, tt = decimals(d), decimals(n), decimals(t)
    s = length(cross(dd, nn)) / length(nn) / length(dd)
    if cos_t < 0.0:
        # Total internal reflection is right where eta s > 1; 4 u for the roundings of s and eta.
        eta_s = Decimal(n1) / Decimal(n2) * s
        return "" if eta_s > 1 - 4 * Decimal(U) else f"no refraction, but eta s = {eta_s}"
    residual = abs(Decimal(n1) * length(cross(nn, dd)) - Decimal(n2) * length(cross(nn, tt)))
    if residual > 4 * Decimal(U * max(n1, n2)):
        return f"Snell's residual {residual}"
    # q = d - (d . n) n errs by some u, which eta multiplies; the renderer normalises t.
    if abs(length(tt) - 1) > 4 * Decimal(U * max(1.0, n1 / n2)) + 4 * Decimal(U):
        return f"length {length(tt)}"
    if abs(dot(tt, cross(dd, nn))) > 4 * Decimal(U * max(1.0, n1 / n2)):
        return "not coplanar"
    if dot(tt, nn) > 0 or dot(cross(dd, nn), cross(tt, nn)) < 0:
        return "on the wrong side"
    return ""


@cases("eta", [1e-3, 0.1, 1 / 1.5, 1.0, 1.0000001, 1.33, 1.5, 10.0, 1e3])
def test_refraction_obeys_snell(eta: float) -> None:
    for n1, n2 in ((eta, 1.0), (1.0, 1.0 / eta)):
        faults = [(d, n, f) for d, n in unit_pairs(300, 2) if (f := snell_faults(d, n, n1, n2))]
        assert not faults, faults[0]


@cases("eta", [1.0000001, 1.33, 1.5, 10.0, 1e3])
@cases("off", [-1e-2, -1e-7, -1e-12, 1e-12, 1e-7, 1e-2])
def test_both_sides_of_the_critical_angle(eta: float, off: float) -> None:
    s = (1 + off) / eta
    if s > 1:
        s = 1.0  # beyond grazing there is no angle; grazing itself is total, too
    d = (s, -math.sqrt((1 - s) * (1 + s)), 0.0)
    cos_t, t = refract(d, UP, eta, 1.0)
    assert (cos_t < 0) == (off > 0)
    if off < 0:
        # cos^2 t = 1 - (1 + off)^2; the float eta and s are right to 2 u of 1, which the square root spreads.
        expected = math.sqrt(-off * (2 + off))
        assert cos_t == pytest.approx(expected, abs=4 * U / expected)
        assert snell_faults(d, UP, eta, 1.0) == ""
        assert all(map(math.isfinite, t))


def textbook_reflectance(s: Decimal, n1: float, n2: float) -> Decimal:
    """Fresnel's two reflectances from the sines: tan and sin of the sum and the difference of the angles."""
    t = Decimal(n1) / Decimal(n2) * s
    cos_i, cos_t = (1 - s * s).sqrt(), (1 - t * t).sqrt()
    minus, plus = s * cos_t - cos_i * t, s * cos_t + cos_i * t
    cos_minus, cos_plus = cos_i * cos_t + s * t, cos_i * cos_t - s * t
    across = (minus / plus) ** 2
    along = (minus / cos_minus * cos_plus / plus) ** 2
    return (across + along) / 2


@cases(("n1", "n2"), [(1.0, 1.5), (1.5, 1.0), (1.0, 1e3), (1.33, 1.5), (1e3, 1.0), (1.0, 1.0)])
def test_reflectance_against_the_sine_and_tangent_form(n1: float, n2: float) -> None:
    largest = min(1.0, n2 / n1)
    for share in (1e-3, 0.1, 0.3, 0.5, 0.77, 0.9, 0.99, 0.9999):
        s = share * largest
        cos_i = float((1 - Decimal(s) ** 2).sqrt())
        cos_t = float((1 - (Decimal(n1) / Decimal(n2) * Decimal(s)) ** 2).sqrt())
        f = fresnel(cos_i, cos_t, n1, n2)
        # Each difference errs by 3 u of its larger term, relative to a sum at least as large; squared and halved.
        assert f == pytest.approx(float(textbook_reflectance(Decimal(s), n1, n2)), abs=16 * U)


@given(st.floats(1e-6, 1.0), st.floats(1.0, 100.0))
def test_energy_is_kept_and_the_way_back_reflects_as_much(cos_i: float, n2: float) -> None:
    cos_t = math.sqrt((n2 - 1) * (n2 + 1) + cos_i**2) / n2
    f = fresnel(cos_i, cos_t, 1.0, n2)
    across, along = 2 * cos_i / (cos_i + n2 * cos_t), 2 * cos_i / (n2 * cos_i + cos_t)
    transmitted = n2 * cos_t / cos_i * (across**2 + along**2) / 2
    # Some ten roundings of quantities of at most 1.
    assert f + transmitted == pytest.approx(1.0, abs=32 * U) and 0.0 <= f <= 1.0
    assert fresnel(cos_t, cos_i, n2, 1.0) == pytest.approx(f, abs=8 * U)


def test_equal_media_reflect_nothing_even_along_the_surface() -> None:
    """A shading normal can stand at right angles to a ray that hits: cos i = cos t = 0 is no 0 / 0."""
    cos_t, _ = refract((1.0, 0.0, 0.0), UP, 1.0, 1.0)
    assert math.isfinite(fresnel(0.0, cos_t, 1.0, 1.0))


def phong_lobe(d: Vector, n: Vector, light: Vector, shininess: float) -> tuple[Decimal, Decimal]:
    """(R . V)^shininess and R . V of the normalised vectors."""
    dd, nn, ll = ([x / length(v) for x in v] for v in map(decimals, (d, n, light)))
    cosine = -dot([2 * dot(nn, ll) * x - y for x, y in zip(nn, ll, strict=True)], dd)
    return (cosine ** Decimal(shininess) if cosine > 0 else Decimal(0)), cosine


@cases("shininess", [0.0, 1.0, 2.5, 32.0, 1e6])
def test_specular_lobe(shininess: float) -> None:
    rng = np.random.default_rng(4)
    seen = 0
    for index, (d, n) in enumerate(unit_pairs(400, 5)):
        light = np.array(reflect(d, n)) + rng.normal(size=3) * (3.0 if index % 2 else 1.0 / (1.0 + shininess) ** 0.5)
        light /= np.linalg.norm(light)
        value = specular(d, n, vector(light), shininess)
        expected, cosine = phong_lobe(d, n, vector(light), shininess)
        if cosine > 1e-9:
            # |R - V|^2 / 2 errs by 8 u for vectors of unit length to u; the power multiplies that with n / cos.
            assert value == pytest.approx(float(expected), rel=16 * U * (shininess / float(cosine) + 2), abs=1e-300)
            seen += 1
        elif cosine < -1e-15:
            assert value == 0.0
    assert seen > 280


def test_specular_is_one_in_the_mirror_direction_and_none_behind() -> None:
    for shininess in (0.0, 1.0, 1e6):
        assert specular((0.6, -0.8, 0.0), UP, (0.6, 0.8, 0.0), shininess) == 1.0
        # R . V = 0 and below.
        assert specular((-1.0, 0.0, 0.0), UP, (0.0, 1.0, 0.0), shininess) == 0.0
        assert specular((0.8, -0.6, 0.0), UP, (-0.8, 0.6, 0.0), shininess) == 0.0


def test_specular_is_finite_where_the_mirror_direction_is_at_right_angles() -> None:
    """R . V is a rounding error above 0 while |R - V|^2 / 2 rounds to 1: 0 * log(0) must not come out."""
    half = math.sqrt(0.5)
    for shininess in (0.0, 1.0, 1e6):
        for tilt in np.linspace(-1e-15, 1e-15, 41):
            value = specular((-float(tilt), -1.0, 0.0), (half, half, 0.0), UP, shininess)
            assert 0.0 <= value <= 1.0


def exact_side(point: Vector, triangle: Any) -> Fraction:
    """Signed volume that says on which side of the triangle's plane the point lies, exactly."""
    p0, p1, p2, p = ([Fraction(float(x)) for x in row] for row in (*triangle, point))
    edges = [[a - b for a, b in zip(q, p0, strict=True)] for q in (p1, p2, p)]
    return dot(cross(edges[0], edges[1]), edges[2])


def random_hits(scale: float, shift: float, count: int) -> Any:
    """Triangles with a point of each as the renderer computes it: (p0, p1, p2, n_g, u, v, p)."""
    rng = np.random.default_rng(6)
    for _ in range(count):
        corners = (rng.uniform(-1, 1, (3, 3)) + shift * rng.uniform(-1, 1, 3)) * scale
        n = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        u, v = np.sort(rng.uniform(0, 1, 2)) * [1, 1]
        u, v = float(u), float(v - u)
        p = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v
        yield *map(vector, corners), vector(n / np.linalg.norm(n)), u, v, vector(p)


@pytest.mark.judges("render")
@cases("scale", [1e-6, 1.0, 1e6])
@cases("shift", [0.0, 1.0, 1e3, 1e6])
def test_a_spawned_ray_starts_beyond_the_exact_plane(scale: float, shift: float) -> None:
    rng = np.random.default_rng(7)
    for p0, p1, p2, n_g, u, v, p in random_hits(scale, shift, 200):
        error, _ = offset_distance(p, p0, p1, p2, u, v, facet_of(p0, p1, p2, n_g))
        w = vector(rng.normal(size=3))
        start = spawn_origin(p, error, n_g, w, BOUNDED)
        side = exact_side(start, (p0, p1, p2))
        assert side != 0 and (side > 0) == (np.dot(n_g, w) >= 0)
        # No further than the bound itself and one float64 an axis.
        moved = np.linalg.norm(np.subtract(start, p))
        assert moved <= 4 * error + 2 * np.linalg.norm(np.spacing(np.abs(p)))


@cases("scale", [1e-6, 1.0, 1e6])
@cases("shift", [0.0, 1.0, 1e6])
def test_offset_distance_is_a_small_multiple_of_the_rounding(scale: float, shift: float) -> None:
    for p0, p1, p2, n_g, u, v, p in random_hits(scale, shift, 100):
        error, _ = offset_distance(p, p0, p1, p2, u, v, facet_of(p0, p1, p2, n_g))
        reach = max(np.abs(np.subtract(q, p)).max() for q in (p0, p1, p2))
        weights = (1 - u - v, u, v)
        magnitude = sum(
            abs(n_g[k]) * abs(w * q[k]) for k in range(3) for w, q in zip(weights, (p0, p1, p2), strict=True)
        )
        # PBRT 4, 6.8.6: gamma(7) sum |b_i p_i| along the normal; ours adds 264 u of the reach, times the aspect, and at
        # least 2^-45 of it, within which a hit in doubt counts.
        double_area = np.linalg.norm(np.cross(np.subtract(p1, p0), np.subtract(p2, p0)))
        aspect = reach * reach / double_area
        assert error == pytest.approx(7 * U * magnitude + reach * max(264 * U * aspect, 2.0**-45), rel=1e-9)


def test_offset_does_not_vanish_on_a_plane_through_the_origin() -> None:
    """Every vertex of the floor y = 0 has n . p = 0, so the rounding bound of p alone would be 0."""
    p0, p1, p2 = (-4.0, 0.0, -4.0), (-4.0, 0.0, 4.0), (4.0, 0.0, 4.0)
    error, _ = offset_distance((-1.0, 0.0, 1.0), p0, p1, p2, 0.25, 0.375, facet_of(p0, p1, p2, UP))
    assert error > 0.0
    assert spawn_origin((-1.0, 0.0, 1.0), error, UP, (0.3, 0.1, 0.2), BOUNDED)[1] >= error
    assert spawn_origin((-1.0, 0.0, 1.0), error, UP, (0.3, -0.1, 0.2), BOUNDED)[1] <= -error


@pytest.mark.judges("render")
def test_mitsubas_rule() -> None:
    p, away, mitsuba = (3.0, -5.0, 1.0), (0.1, 0.9, 0.2), OffsetRule(False, MITSUBA_EPSILON)
    # (1 + max|p|) epsilon along n_g, to the side of the new ray; the bound is not read.
    assert spawn_origin(p, 1e9, UP, away, mitsuba) == (3.0, -5.0 + 6 * MITSUBA_EPSILON, 1.0)
    assert spawn_origin(p, 1e9, UP, (0.1, -0.9, 0.2), mitsuba) == (3.0, -5.0 - 6 * MITSUBA_EPSILON, 1.0)
    assert spawn_origin(p, 1e9, UP, away, OffsetRule(False, 0.0)) == p
    assert pytest.approx(8.940697e-05, rel=1e-7) == MITSUBA_EPSILON
