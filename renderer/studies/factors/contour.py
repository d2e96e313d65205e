"""The exchange area A_i F_ij of two convex polygons in space that see each other whole.

For polygons that are far apart, the integral over both areas by symmetric rules for triangles. All terms have one sign,
so nothing cancels at any distance.

For all others, the integral over both contours, 1 / (2 pi) times the sum over pairs of edges of ln r dr_1 . dr_2
(Sparrow, A new and simpler formulation for radiative angle factors, J. Heat Transfer 85, 1963). The inner integral has
a closed form. As a function of the place t on the outer edge, it is analytic but at three complex t and their
conjugates: where r = 0 at an end of the inner edge, and where r = 0 on its line. The outer integral is cut into pieces,
none of which is longer than its distance from these. So edges that touch or share a line are no special case.
"""

import math
from typing import NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import fabs, load, local_doubles, maximum, minimum, offset, pointer, store
from renderer.numerics.vec3 import add, cross, dot, row3, scale, sub
from renderer.trace.layout import locked

# Nodes of Gauss and Legendre on each piece. A piece from 0 to 1 has a singularity at -1, 2, i or 1 + i at worst, which
# bounds the error by 4.2^(-2 n), 1e-15 for n = 12.
_NODES = 12
# The shortest piece, as a share of the edge. Singularities are as mild as t ln t, so a piece that has one at its end
# errs by a millionth of its length squared: 2e-17.
_SHORTEST = 2.0**-18
# A singularity so little ahead is taken as reached, so that each piece has some length.
_REACHED = 2.0**-40
# The squared sine of the angle of edges that count as parallel. Their distance then varies by 2^-46 of their length.
_PARALLEL = 2.0**-92
# The largest sum of the radii of polygons, as a share of their distance, for the rules of degree 5 and 8. Their errors
# grow by its 6th and 9th power; both err by 1e-12 there.
_FAR, _APART = 0.01, 0.08
# Errors over areas as a share of the result; over contours, where terms cancel, as a share of the radii's product. Of
# 90,000 pairs of needles, of faces that touch, nearly touch and others, turned at random or cut into parts, none
# changed by more than 1.4e-15 of that.
_AREA_ERROR, _CONTOUR_ERROR = 1e-11, 4e-15


# Places and weights on (0, 1), rounded from 60 digits.
_GAUSS = (
    (0.009219682876640375, 0.023587668193255914),
    (0.04794137181476257, 0.05346966299765921),
    (0.11504866290284765, 0.08003916427167311),
    (0.2063410228566913, 0.10158371336153296),
    (0.3160842505009099, 0.1167462682691774),
    (0.43738329574426554, 0.12457352290670139),
    (0.5626167042557345, 0.12457352290670139),
    (0.6839157494990901, 0.1167462682691774),
    (0.7936589771433087, 0.10158371336153296),
    (0.8849513370971523, 0.08003916427167311),
    (0.9520586281852375, 0.05346966299765921),
    (0.9907803171233597, 0.023587668193255914),
)


def _orbit(weight: float, *corners: float) -> list[float]:
    """Barycentrics and weights of a rule's points that change places when corners do."""
    a, b, c = corners
    turns = {(a, b, c), (b, c, a), (c, a, b), (a, c, b), (c, b, a), (b, a, c)}
    return [number for turn in sorted(turns) for number in (*turn, weight)]


_ROOT = math.sqrt(15.0)
_NEAR, _OFF = (6.0 - _ROOT) / 21.0, (6.0 + _ROOT) / 21.0
# Radon 1948, degree 5.
_SEVEN = (
    _orbit(0.225, 1 / 3, 1 / 3, 1 / 3)
    + _orbit((155.0 - _ROOT) / 1200.0, 1.0 - 2.0 * _NEAR, _NEAR, _NEAR)
    + _orbit((155.0 + _ROOT) / 1200.0, 1.0 - 2.0 * _OFF, _OFF, _OFF)
)
# Dunavant, High degree efficient symmetrical Gaussian quadrature rules for the triangle, 1985, degree 8.
_SIXTEEN = (
    _orbit(0.144315607677787, 1 / 3, 1 / 3, 1 / 3)
    + _orbit(0.095091634267285, 1.0 - 2.0 * 0.459292588292723, 0.459292588292723, 0.459292588292723)
    + _orbit(0.103217370534718, 1.0 - 2.0 * 0.170569307751760, 0.170569307751760, 0.170569307751760)
    + _orbit(0.032458497623198, 1.0 - 2.0 * 0.050547228317031, 0.050547228317031, 0.050547228317031)
    + _orbit(0.027230314174435, 0.008394777409958, 0.263112829634638, 0.728492392955404)
)
# All rules as kernels read them: where each begins.
RULES = locked(np.array([number for row in _GAUSS for number in row] + _SEVEN + _SIXTEEN))
_AT_SEVEN, _AT_SIXTEEN = 2 * _NODES, 2 * _NODES + 4 * 7


class Exchange(NamedTuple):
    """An exchange area and a bound of its rounding errors."""

    area: float
    error: float


class _Singular(NamedTuple):
    """A complex place t on an edge at which an integrand is not analytic."""

    real: float
    imaginary: float


class _Edge(NamedTuple):
    """An edge: its start, the vector to its end, and its length."""

    start: tuple[float, float, float]
    way: tuple[float, float, float]
    length: float


@kernel
def exchange_between(first, second, rules):
    """``exchange_of`` polygons (n, 3) and (m, 3), for Python: the area alone."""
    return exchange_of(pointer(first), len(first), pointer(second), len(second), pointer(rules)).area


@kernel
def exchange_of(first, n, second, m, rules):
    """The ``Exchange`` A_i F_ij of two convex polygons, in the unit of their corners squared.

    first, second  ``pointer`` to n and m corners, counter-clockwise seen from the side that sends
    rules          ``pointer`` to RULES

    It is negative if just one of the two shows the other its back.
    """
    a, b = _centre(first, n), _centre(second, m)
    radius_a, radius_b = _radius(first, n, a), _radius(second, m, b)
    way = sub(b, a)
    distance = math.sqrt(dot(way, way))
    if radius_a + radius_b <= _FAR * distance:
        area = _over_areas(first, n, second, m, offset(rules, _AT_SEVEN), 7)
        return Exchange(area, fabs(area) * _AREA_ERROR)
    if radius_a + radius_b <= _APART * distance:
        area = _over_areas(first, n, second, m, offset(rules, _AT_SIXTEEN), 16)
        return Exchange(area, fabs(area) * _AREA_ERROR)
    # Distances are measured in this unit, so that logarithms are near 0 and little cancels.
    unit = maximum(distance, maximum(radius_a, radius_b))
    per_square, error = 1.0 / (unit * unit), radius_a * radius_b * _CONTOUR_ERROR
    if radius_a <= radius_b:
        return Exchange(_over_contours(first, n, second, m, per_square, rules), error)
    return Exchange(_over_contours(second, m, first, n, per_square, rules), error)


@kernel
def _centre(corners, n):
    """The mean of the corners."""
    total = (0.0, 0.0, 0.0)
    for k in range(n):
        total = add(total, row3(corners, k))
    return scale(total, 1.0 / n)


@kernel
def _radius(corners, n, centre):
    """The distance of the farthest corner from the centre."""
    most = 0.0
    for k in range(n):
        way = sub(row3(corners, k), centre)
        most = maximum(most, dot(way, way))
    return math.sqrt(most)


# --- over both areas ----------------------------------------------------------------------------------------------


@kernel
def _over_areas(first, n, second, m, rule, count):
    """The sum over the triangles of both polygons by a rule of ``count`` points."""
    total = 0.0
    for i in range(1, n - 1):
        for j in range(1, m - 1):
            total += _between_triangles(first, i, second, j, rule, count)
    return total


@kernel
def _between_triangles(first, i, second, j, rule, count):
    """The sum for the triangles of the corners 0, i, i + 1 and 0, j, j + 1."""
    a, b, c = row3(first, 0), row3(first, i), row3(first, i + 1)
    d, e, f = row3(second, 0), row3(second, j), row3(second, j + 1)
    # Normals as long as the triangles are large.
    normal_a, normal_d = scale(cross(sub(b, a), sub(c, a)), 0.5), scale(cross(sub(e, d), sub(f, d)), 0.5)
    points, total = local_doubles(), 0.0
    for k in range(count):
        p = _point(d, e, f, rule, k)
        store(points, 4 * k, p[0])
        store(points, 4 * k + 1, p[1])
        store(points, 4 * k + 2, p[2])
        store(points, 4 * k + 3, load(rule, 4 * k + 3) * dot(normal_a, sub(p, a)))
    for k in range(count):
        p, some = _point(a, b, c, rule, k), 0.0
        for j in range(count):
            x, y, z = load(points, 4 * j) - p[0], load(points, 4 * j + 1) - p[1], load(points, 4 * j + 2) - p[2]
            square = x * x + y * y + z * z
            some += load(points, 4 * j + 3) / (square * square)
        total += load(rule, 4 * k + 3) * dot(normal_d, sub(p, d)) * some
    return total / math.pi


@inlined
def _point(a, b, c, rule, k):
    """A rule's k-th point of a triangle."""
    u, v = load(rule, 4 * k + 1), load(rule, 4 * k + 2)
    return add(a, add(scale(sub(b, a), u), scale(sub(c, a), v)))


# --- over both contours -------------------------------------------------------------------------------------------


@kernel
def _over_contours(outer, n, inner, m, per_square, rules):
    """1 / (2 pi) times the sum over the pairs of edges."""
    total = 0.0
    for i in range(n):
        along = _edge(outer, i, n)
        for j in range(m):
            across = _edge(inner, j, m)
            together = dot(along.way, across.way)
            if together != 0.0:
                total += together / across.length * _along(along, across, per_square, rules)
    return total / (2.0 * math.pi)


@inlined
def _edge(corners, k, n):
    """The k-th edge of n."""
    start = row3(corners, k)
    way = sub(row3(corners, k + 1 if k + 1 < n else 0), start)
    return _Edge(start, way, math.sqrt(dot(way, way)))


@kernel
def _along(outer, inner, per_square, rules):
    """The integral over t from 0 to 1, a place on the outer edge, of ``_log_integral``."""
    first, last = _end(outer, inner.start), _end(outer, add(inner.start, inner.way))
    line = _line(outer, inner)
    begin, total = 0.0, 0.0
    while begin < 1.0:
        step = minimum(_step(first, begin), minimum(_step(last, begin), _step(line, begin)))
        step = minimum(step, 1.0 - begin)
        some = 0.0
        for k in range(_NODES):
            p = add(outer.start, scale(outer.way, begin + step * load(rules, 2 * k)))
            some += load(rules, 2 * k + 1) * _log_integral(p, inner, per_square)
        total += step * some
        begin += step
    return total


@kernel
def _log_integral(p, inner, per_square):
    """The integral of ln r over the length of an edge, r the distance from p, less a number that no p changes.

    With w the place on the edge's line, from the foot of p, and h its distance, w ln r - w + h atan(w / h).
    """
    along, way = scale(inner.way, 1.0 / inner.length), sub(p, inner.start)
    before = dot(way, along)
    beside = cross(way, along)
    square = dot(beside, beside)
    after = inner.length - before
    start, end = square + before * before, square + after * after
    logs = (after * math.log(end * per_square) if end > 0.0 else 0.0) + (
        before * math.log(start * per_square) if start > 0.0 else 0.0
    )
    h = math.sqrt(square)
    # The angle under which p sees the edge.
    return 0.5 * logs + h * math.atan2(h * inner.length, square - before * after)


@inlined
def _end(outer, q):
    """The place at which the distance from q is 0."""
    way, square = sub(q, outer.start), outer.length * outer.length
    beside = cross(way, outer.way)
    return _Singular(dot(way, outer.way) / square, math.sqrt(dot(beside, beside)) / square)


@inlined
def _line(outer, inner):
    """The place at which the distance from the inner edge's line is 0; too far to matter where nothing is singular.

    It is singular only if the foot is on the edge: else both angles change together.
    """
    normal, way = cross(outer.way, inner.way), sub(inner.start, outer.start)
    square, squares = dot(normal, normal), dot(outer.way, outer.way) * dot(inner.way, inner.way)
    if square <= _PARALLEL * squares:
        return _Singular(0.0, 4.0)
    foot = dot(cross(way, outer.way), normal) / square
    if foot < 0.0 or foot > 1.0:
        return _Singular(0.0, 4.0)
    place = dot(cross(way, inner.way), normal) / square
    return _Singular(place, fabs(dot(way, normal)) * inner.length / square)


@inlined
def _step(singular, begin):
    """The length of the next piece, at most its distance from a singularity."""
    ahead = singular.real - begin
    distance = math.sqrt(ahead * ahead + singular.imaginary * singular.imaginary)
    if ahead <= _REACHED:
        return maximum(distance, _SHORTEST)
    return 0.5 * distance if distance >= 2.0 * _SHORTEST else minimum(ahead, _SHORTEST)
