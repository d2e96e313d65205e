"""Determinants of differences of float64 as expansions: exact sums, with exact signs and digits.

A determinant of differences is a sum of products. Differences and products of float64 are exact as pairs. A sum of
float64 is exact as an expansion: parts that do not overlap, of which the largest has the sign of the sum. Source:
Shewchuk, Adaptive Precision Floating-Point Arithmetic, Discrete and Computational Geometry 18, 1997.
"""

from renderer.jit.decorators import kernel
from renderer.numerics.double_double import difference, exact_product, exact_sum
from renderer.numerics.simd import load, maximum, minimum, store

# The number of parts where products would vanish or overflow.
OUT_OF_RANGE = -1
# The most parts: a volume has 6 products of 2 x 2 x 2 parts, four numbers each. Callers may use the memory behind them.
PARTS = 192
# The least product of two or of three parts. The last bit of a product of three is 2^-156 of that, and of the sums and
# products before it no more is lost: it may not fall below the least denormal, 2^-1074.
_SMALLEST_AREA, _SMALLEST_VOLUME, _LARGEST = 2.0**-960, 2.0**-900, 2.0**960


@kernel
def expand_area(a, b, p, parts):
    """(a - p) x (b - p) of points (x, y) into ``parts``. Returns the number of parts, or OUT_OF_RANGE."""
    ax, ay, bx, by = difference(a[0], p[0]), difference(a[1], p[1]), difference(b[0], p[0]), difference(b[1], p[1])
    if _least(ax, bx) * _least(ay, by) <= _SMALLEST_AREA or _most(ax, bx) * _most(ay, by) >= _LARGEST:
        return OUT_OF_RANGE
    count = _add_area(parts, 0, ax, by, 1.0)
    return _add_area(parts, count, ay, bx, -1.0)


@kernel
def expand_volume(a, b, c, p, parts):
    """(a - p) . ((b - p) x (c - p)) of points (x, y, z), like ``expand_area``."""
    return _expand_triple(_differences(a, p), _differences(b, p), _differences(c, p), parts)


@kernel
def _expand_triple(a, b, c, parts):
    """a . (b x c) of vectors of pairs."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = a, b, c
    least = minimum(_least(ax, bx), _least(cx, cx)) * minimum(_least(ay, by), _least(cy, cy))
    most = maximum(_most(ax, bx), _most(cx, cx)) * maximum(_most(ay, by), _most(cy, cy))
    least *= minimum(_least(az, bz), _least(cz, cz))
    most *= maximum(_most(az, bz), _most(cz, cz))
    if least <= _SMALLEST_VOLUME or most >= _LARGEST:
        return OUT_OF_RANGE
    count = _add_volume(parts, 0, ax, by, cz, 1.0)
    count = _add_volume(parts, count, ay, bz, cx, 1.0)
    count = _add_volume(parts, count, az, bx, cy, 1.0)
    count = _add_volume(parts, count, az, by, cx, -1.0)
    count = _add_volume(parts, count, ax, bz, cy, -1.0)
    return _add_volume(parts, count, ay, bx, cz, -1.0)


@kernel
def expand_slope(a, b, c, d, parts):
    """((b - a) x (c - a)) . d of points and a direction (x, y, z), like ``expand_area``."""
    return _expand_triple(_differences(b, a), _differences(c, a), ((d[0], 0.0), (d[1], 0.0), (d[2], 0.0)), parts)


@kernel
def _differences(a, b):
    return difference(a[0], b[0]), difference(a[1], b[1]), difference(a[2], b[2])


@kernel
def sign_of(parts, count):
    """The sign of an expansion: that of its largest part."""
    if count == 0:
        return 0
    return 1 if load(parts, count - 1) > 0.0 else -1


@kernel
def pair_of(parts, count):
    """An expansion as a pair, to 2^-100 of itself."""
    head, tail = 0.0, 0.0
    for i in range(count - 1, -1, -1):
        head, rest = exact_sum(head, load(parts, i))
        tail += rest
    return exact_sum(head, tail)


@kernel
def _least(a, b):
    """The least nonzero part of two pairs, without signs; at most 1."""
    least = 1.0
    for x in (a[0], a[1], b[0], b[1]):
        least = minimum(least, abs(x)) if x != 0.0 else least
    return least


@kernel
def _most(a, b):
    """The largest part of two pairs, without signs; at least 1."""
    return maximum(maximum(abs(a[0]), abs(b[0])), 1.0)


@kernel
def _add_area(parts, count, a, b, sign):
    """Add a product of two pairs to an expansion. Returns the number of its parts, as do all functions below."""
    for x in a:
        for y in b:
            if x != 0.0 and y != 0.0:
                count = _add_pair(parts, count, exact_product(x, sign * y))
    return count


@kernel
def _add_volume(parts, count, a, b, c, sign):
    """Add a product of three pairs to an expansion."""
    for x in a:
        for y in b:
            head, tail = exact_product(x, sign * y)
            for z in c:
                if z != 0.0 and head != 0.0:
                    count = _add_pair(parts, count, exact_product(head, z))
                    if tail != 0.0:
                        count = _add_pair(parts, count, exact_product(tail, z))
    return count


@kernel
def _add_pair(parts, count, pair):
    return _add(parts, _add(parts, count, pair[1]), pair[0])


@kernel
def _add(parts, count, x):
    """Add a number to an expansion, whose parts are in rising order; zero parts are left out."""
    kept = 0
    for i in range(count):
        x, rest = exact_sum(x, load(parts, i))
        if rest != 0.0:
            store(parts, kept, rest)
            kept += 1
    if x != 0.0:
        store(parts, kept, x)
        kept += 1
    return kept
