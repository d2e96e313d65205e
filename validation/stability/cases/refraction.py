"""Extreme cases 35 to 40: refraction at any index and angle, and nested media.

The judges take the refraction function as an argument, so that the tests can pass one that must fail.
"""

import math
from collections.abc import Callable
from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from renderer import Mesh, Scene, render
from renderer.materials.dielectric import Dielectric
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.shapes import box, icosphere, torus
from renderer.scene.scene import Floor
from renderer.shade.shading import refract
from validation.oracle.vectors import cross, dot
from validation.references.mitsuba.whitted import whitted
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.scenes import (
    GLOWS,
    REL,
    STORED,
    U,
    Vector,
    ball,
    close,
    eye_at,
    level,
    pixel,
    scene_of,
    unit,
    vector,
)

# Cosine of the refracted angle (negative: total internal reflection) and its direction, as ``shading.refract``.
Refract = Callable[[Vector, Vector, float, float], tuple[float, Vector]]

# Nearly air, water, crown glass, diamond.
_GLASS = (1.0000002, 1.33, 1.5, 2.417)


def _before_squares(*parts: tuple[Mesh, Material], smooth: bool = False) -> Scene:
    """Parts before a checkered floor and a sky, without lights, because dielectrics cast opaque shadows."""
    floor = Floor(min=(-9.0, -9.0), max=(9.1, 9.3), materials=("red", "blue"), squares=(23, 23))
    colors = {"red": Phong(diffuse=0.0, ambient=(1, 0.5, 0)), "blue": Phong(diffuse=0.0, ambient=(0, 0.25, 1))}
    moved = [(Mesh(mesh.vertices + np.array([0.0, 1.2, 0.0]), mesh.faces), m) for mesh, m in parts]
    camera = eye_at((0.3, 2.6, 4.0), (0.0, 0.9, 0.0), fov=50)
    return scene_of(camera, *moved, smooth=smooth, floor=floor, materials=colors, background=(0.2, 0.3, 0.4))


def _different(with_it: Scene, without: Scene, side: int, depths: tuple[int, int]) -> tuple[int, int]:
    """Number of differing pixels, and of pixels whose first hit differs, to prove that the object is in view."""
    a, b = (
        render(s, resolution=(side, side), max_depth=d, threads=1)
        for s, d in zip((with_it, without), depths, strict=True)
    )
    differ = (np.abs(a.radiance - b.radiance) > REL * np.maximum(a.radiance, b.radiance)).any(axis=-1)
    return int(differ.sum()), int((a.face != b.face).sum())


def _index_one(quick: bool) -> Outcome:
    air, wrong, seen = Dielectric(type="dielectric", ior=1.0), 0, 0
    for mesh in (icosphere(3), torus(), box((-0.5, -0.6, -0.7), (0.5, 0.6, 0.7))):
        for smooth in (False, True):
            scene = _before_squares((mesh, air), smooth=smooth)
            differ, covered = _different(scene, _before_squares(), 48 if quick else 200, (16, 16))
            wrong, seen = wrong + differ, seen + covered
    return Outcome(f"{wrong} pixels differ of {seen} behind the objects", wrong == 0 and seen > 1000)


def _pairs(count: int, sines: NDArray[np.float64]) -> list[tuple[Vector, Vector]]:
    """Unit directions and normals in ``count`` random frames for each sine of the angle between them."""
    rng = np.random.default_rng(36)
    pairs = []
    for s in sines:
        for _ in range(count):
            n = unit(rng.normal(size=3))
            across = unit(np.cross(n, rng.normal(size=3)))
            d = s * across - math.sqrt((1.0 - s) * (1.0 + s)) * n
            pairs.append((vector(unit(d)), vector(n)))
    return pairs


def snell_residual(d: Vector, n: Vector, t: Vector, n1: float, n2: float) -> float:
    """|n1 sin i - n2 sin t| in units of u max(n1, n2), in fifty digits.

    The sines are |n x d| / |d| and |n x t| / |t|: without the lengths, a wrong cos t would not show in t's sine.
    """
    with localcontext() as context:
        context.prec = 50
        dd, nn, tt = ([Decimal(x) for x in v] for v in (d, n, t))
        sines = [(dot(c, c) / dot(w, w)).sqrt() for c, w in ((cross(nn, dd), dd), (cross(nn, tt), tt))]
        return float(abs(Decimal(n1) * sines[0] - Decimal(n2) * sines[1]) / Decimal(U * max(n1, n2)))


def _beyond_critical(d: Vector, n: Vector, n1: float, n2: float) -> Fraction:
    """(n1 sin i / n2)^2 - 1 of these very floats, exactly; the vectors need not be of unit length to the last bit."""
    dd, nn = ([Fraction(x) for x in v] for v in (d, n))
    c = cross(dd, nn)
    return Fraction(n1) ** 2 * dot(c, c) / (Fraction(n2) ** 2 * dot(dd, dd) * dot(nn, nn)) - 1


def critical_angle(rule: Refract, count: int) -> tuple[int, int, float]:
    """Directions 1e-7 and less about the critical angle to air: (wrong sides, NaN, largest Snell residual).

    Within 4 u of n1 sin i = 1 either side is accepted. For indices above those of glass the range is 4 u of sin i, the
    rounding of the direction itself, which n1 multiplies.
    """
    wrong = nan = 0
    largest = 0.0
    offs = np.array([sign * off for off in (1e-7, 1e-10, 1e-13, 1e-15) for sign in (-1, 1)])
    for n1 in (*_GLASS, 10.0, 1e3):
        near = 4 * U if n1 in _GLASS else 4 * U * n1
        for d, n in _pairs(count, np.minimum((1.0 + offs) / n1, 1.0)):
            cos_t, t = rule(d, n, n1, 1.0)
            nan += not all(map(math.isfinite, (cos_t, *t)))
            beyond = _beyond_critical(d, n, n1, 1.0)
            # The square's distance from 1 is twice that of n1 sin i.
            wrong += (cos_t < 0.0) != (beyond > 0) and abs(beyond) > 2 * near
            if cos_t >= 0.0:
                largest = max(largest, snell_residual(d, n, t, n1, 1.0))
    return wrong, nan, largest


def steep_indices(rule: Refract, count: int) -> float:
    """The largest Snell residual for eta = 1e-3 and 1e3, in units of u max(n1, n2); inf for a NaN."""
    largest = 0.0
    for n1, n2 in ((1.0, 1e3), (1e-3, 1.0), (1e3, 1.0), (1.0, 1e-3)):
        sines = np.concatenate([np.linspace(0.0, 0.999, 40), [1e-9, 1e-4, 1 - 1e-9]]) * min(1.0, n2 / n1)
        for d, n in _pairs(count, sines):
            cos_t, t = rule(d, n, n1, n2)
            if cos_t >= 0.0:
                largest = max(largest, snell_residual(d, n, t, n1, n2))
            elif _beyond_critical(d, n, n1, n2) <= -8 * U or math.isnan(cos_t):
                largest = math.inf
    return largest


def _critical_angle(quick: bool) -> Outcome:
    wrong, nan, residual = critical_angle(refract, 20 if quick else 1000)
    holds = wrong == 0 and nan == 0 and residual <= 4.0
    return Outcome(f"{wrong} on the wrong side, {nan} NaN, residual {residual:.2g} u", holds)


def _steep_indices(quick: bool) -> Outcome:
    residual = steep_indices(refract, 5 if quick else 200)
    return Outcome(f"residual {residual:.2g} u", residual <= 4.0)


def _plate(edge: float) -> Scene:
    """A plate of thickness 1, hit at 60 degrees; behind it a glowing plane that ends at x = ``edge``."""
    plate = box((-4.0, -1.0, -4.0), (5.0, 0.0, 4.5))
    clear = Phong(diffuse=0.0, ambient=0.0, transmittance=1.0, ior=1.5)
    camera = eye_at((-math.sqrt(3.0), 1.0, 0.0), (0.0, 0.0, 0.0))
    return scene_of(camera, (plate, clear), (level(edge - 10.0, -5.0, 1.0, 10.0), GLOWS))


def _shift(sees: Callable[[Scene], bool], halvings: int) -> float:
    """The sideways shift of the plate's ray, by bisection of the x at which the plane's edge disappears."""
    low, high = 0.0, 5.0 * math.tan(math.pi / 3)
    for _ in range(halvings):
        middle = (low + high) / 2
        low, high = (low, middle) if sees(_plate(middle)) else (middle, high)
    return (5.0 * math.tan(math.pi / 3) - high) * math.cos(math.pi / 3)


def _plate_shift(quick: bool) -> Outcome:
    ours = _shift(lambda scene: pixel(scene, max_depth=2) > 0.5, 46)
    theirs = _shift(lambda scene: bool(whitted(scene, 1, 1, max_depth=2)[0, 0, 0] > 0.5), 22)
    expected = math.sin(math.pi / 3) * (1 - math.cos(math.pi / 3) / math.sqrt(1.5**2 - 0.75))
    return Outcome(f"{ours:.12f}", abs(ours - expected) <= 1e-12, mitsuba=f"{theirs:.6f}")


def _inside_ball(quick: bool) -> Outcome:
    side = 96 if quick else 256
    sphere = Mesh(icosphere(5).vertices, icosphere(5).faces, normals=icosphere(5).vertices)
    at = (np.arange(side) + 0.5) * 2 / side - 1
    weight = (1 + at[:, None] ** 2 + at[None, :] ** 2) ** -1.5
    dark = 0.0
    for way in (*np.eye(3), *-np.eye(3)):
        camera = eye_at((0.8, 0, 0), vector(way + np.array([0.8, 0, 0])), up=(0, 0, 1) if way[1] else (0, 1, 0), fov=90)
        scene = scene_of(camera, (sphere, Dielectric(type="dielectric")), background=1.0, smooth=True)
        image = render(scene, resolution=(side, side), max_depth=1, threads=1)
        dark += float((weight * (image.radiance[..., 0] == 0.0)).sum())
    share = dark / (6 * float(weight.sum()))
    return Outcome(f"{100 * share:.3f} %", abs(share - math.sqrt(11.0) / 6.0) <= 1e-3)


def _reflectance(n1: float, n2: float) -> float:
    """Fresnel's reflectance at normal incidence."""
    return ((n1 - n2) / (n1 + n2)) ** 2


def nested_radiance(outer: float, inner: float, from_inside: bool) -> tuple[float, float]:
    """Radiance of a sky of 1 seen straight through two nested boxes, or from inside both: (rendered, analytic)."""
    glass = [Dielectric(type="dielectric", ior=n, reflectance=0.0) for n in (outer, inner)]
    boxes = [box((-a, -a, -a), (a, a, a)) for a in (2.0, 1.0)]
    camera = eye_at((0.1 if from_inside else -5.0, 0.2, 0.3), (6.0, 0.2, 0.3))
    value = pixel(scene_of(camera, *zip(boxes, glass, strict=True), background=1.0), max_depth=8)
    passed = (1 - _reflectance(outer, inner)) * (1 - _reflectance(outer, 1.0))
    return value, passed if from_inside else passed**2


def _nested(quick: bool) -> Outcome:
    def clear(radius: float) -> tuple[Mesh, Material]:
        return ball(radius), Dielectric(type="dielectric", ior=1.5, reflectance=0.0)

    side = 64 if quick else 256
    differ = _different(_before_squares(clear(1.0), clear(0.5)), _before_squares(clear(1.0)), side, (4, 2))[0]
    # Both pictures show the outer ball first, so the empty picture is needed to prove that it is in view.
    seen = _different(_before_squares(clear(1.0)), _before_squares(), side, (2, 2))[1]
    wrong = []
    for outer, inner in ((1.5, 1.0), (1.5, 1.33), (1.33, 1.5), (1.5, 2.4), (1.5, 1.5), (1.5, 1e3), (1e3, 1.5)):
        for from_inside in (False, True):
            value, expected = nested_radiance(outer, inner, from_inside)
            if not close(value, expected):
                wrong.append(f"{inner} in {outer}: {value:.7g} for {expected:.7g}")
    faults = "; ".join(wrong) if wrong else "Fresnel's shares right"
    ours = f"{differ} of {seen} pixels differ; in 7 nestings, seen from without and within: {faults}"
    return Outcome(ours, differ == 0 and seen > 500 and not wrong)


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(35, "n1 = n2, any angle", "picture = no object", ("closed form",), STORED, _index_one),
    ExtremeCase(
        36,
        "glass, and indices 10 and 1e3, to air at the critical angle (1 +- 1e-7 to 1e-15)",
        "right side of it, or within 4 u; no NaN; Snell's residual <= 4 u max(n1, n2)",
        ("exact",),
        "4 u: the roundings of eta, of the sine and of the unit vectors; for 10 and 1e3, 4 u of the sine",
        _critical_angle,
    ),
    ExtremeCase(
        37,
        "eta = 1e-3, 1e3",
        "Snell's residual <= 4 u max(n1, n2)",
        ("closed form",),
        "4 u: the roundings of d . n, of q and of the product with eta; judged in fifty digits",
        _steep_indices,
    ),
    ExtremeCase(
        38,
        "plate of thickness 1, n = 1.5, 60 degrees",
        "parallel exit, shift .51247",
        ("closed form",),
        "1e-12: a hit on faces 20 long errs by up to 264 u 20 = 6e-13, and the interval is halved to 1e-13",
        _plate_shift,
    ),
    ExtremeCase(
        39,
        "camera at (.8, 0, 0) in a unit glass sphere",
        "total internal reflection at the first hit for sqrt(11) / 6 = 55.277 % of directions",
        ("closed form",),
        "1e-3: the rim crosses some 800 of 55,296 pixels, 3 sqrt(800) / 2 / 55,296 = 8e-4; facets of edge h = .04 lie "
        "h^2 / 8 = 2e-4 inside",
        _inside_ball,
    ),
    ExtremeCase(
        40,
        "n = 1.5 sphere inside an n = 1.5 sphere; air, water and denser glass in glass",
        "inner one invisible; Fresnel's shares of each boundary at normal incidence",
        ("closed form",),
        STORED,
        _nested,
    ),
)
