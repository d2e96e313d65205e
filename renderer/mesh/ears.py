"""Cuts ears off simple polygons. Compiled, because each ear asks for all corners that may lie in it.

Source: Meisters, Polygons Have Ears, American Mathematical Monthly 82, 1975.
"""

from renderer.jit.decorators import inlined, kernel


@kernel
def is_simple(outline, order):
    """Whether edges that are not neighbours stay apart.

    ``outline`` is (n, 2) float64; ``order`` has the edges, each named by its first corner, by their least x.
    """
    count = len(outline)
    for i in range(count):
        first = order[i]
        for j in range(i + 1, count):
            second = order[j]
            if _least(outline, second, 0) > _most(outline, first, 0):
                break
            apart = (second - first) % count
            if apart != 1 and apart != count - 1 and _meet(outline, first, second):
                return False
    return True


@inlined
def _meet(outline, first, second):
    """Whether two edges share a point."""
    if _least(outline, second, 1) > _most(outline, first, 1) or _least(outline, first, 1) > _most(outline, second, 1):
        return False
    a, b, c, d = first, _next(outline, first), second, _next(outline, second)
    apart = (_turn(outline, a, b, c) > 0.0 and _turn(outline, a, b, d) > 0.0) or (
        _turn(outline, a, b, c) < 0.0 and _turn(outline, a, b, d) < 0.0
    )
    beside = (_turn(outline, c, d, a) > 0.0 and _turn(outline, c, d, b) > 0.0) or (
        _turn(outline, c, d, a) < 0.0 and _turn(outline, c, d, b) < 0.0
    )
    return not (apart or beside)


@inlined
def _next(outline, k):
    return k + 1 if k + 1 < len(outline) else 0


@inlined
def _least(outline, edge, axis):
    """The least coordinate of an edge on an axis."""
    return min(outline[edge, axis], outline[_next(outline, edge), axis])


@inlined
def _most(outline, edge, axis):
    """The largest coordinate of an edge on an axis."""
    return max(outline[edge, axis], outline[_next(outline, edge), axis])


@kernel
def cut_ears(outline, flat, links, triangles):
    """Fill ``triangles`` (n - 2, 3) with corner numbers of a simple polygon wound counter-clockwise.

    ``outline`` is (n, 2) float64; areas up to ``flat`` count as 0. ``links`` is (3, n) int64 for the corner before
    each, the one after it, and the corners that may lie in an ear. Returns False where rounding leaves no ear to cut.
    """
    count = len(outline)
    before, after, blockers = links[0], links[1], links[2]
    for k in range(count):
        before[k], after[k] = (k - 1) % count, (k + 1) % count

    # Of the remaining corners, only one that does not turn left can be the first to lie in an ear.
    blocking = 0
    for k in range(count):
        if not _turn(outline, before[k], k, after[k]) > flat:
            blockers[blocking] = k
            blocking += 1

    # Go round; after an ear, look again at the corner before it.
    cut, at, missed = 0, 1, 0
    while cut < count - 2:
        a, c = before[at], after[at]
        if _turn(outline, a, at, c) > flat and not _any_inside(outline, flat, blockers, blocking, a, at, c):
            triangles[cut, 0], triangles[cut, 1], triangles[cut, 2] = a, at, c
            cut += 1
            after[a], before[c] = c, a
            blocking = _still_blocking(outline, flat, links, blocking, (a, c))
            at, missed = a, 0
        else:
            at, missed = c, missed + 1
            if missed > count - cut:
                return False
    return True


@inlined
def _still_blocking(outline, flat, links, blocking, changed):
    """Drop the corners ``changed`` from the blockers where they turn left now; returns how many remain."""
    before, after, blockers = links[0], links[1], links[2]
    kept = 0
    for i in range(blocking):
        k = blockers[i]
        turned = (k == changed[0] or k == changed[1]) and _turn(outline, before[k], k, after[k]) > flat
        blockers[kept] = k
        kept += 0 if turned else 1
    return kept


@inlined
def _any_inside(outline, flat, blockers, blocking, a, b, c):
    """Whether any of the blockers lies in the triangle or on its edges."""
    for i in range(blocking):
        k = blockers[i]
        if (
            _turn(outline, c, a, k) >= -flat
            and _turn(outline, a, b, k) >= -flat
            and _turn(outline, b, c, k) >= -flat
            and k not in (a, b, c)
        ):
            return True
    return False


@inlined
def _turn(outline, a, b, c):
    """Twice the area of a b c; positive where the way from a over b to c turns left."""
    return (outline[b, 0] - outline[a, 0]) * (outline[c, 1] - outline[a, 1]) - (outline[b, 1] - outline[a, 1]) * (
        outline[c, 0] - outline[a, 0]
    )
