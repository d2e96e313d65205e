"""The faces around a point, in float64: whether they surely contain it or do not."""

from renderer.jit.decorators import inlined
from renderer.numerics.simd import maximum, minimum
from renderer.numerics.vec3 import cross, dot, largest_component, largest_of_three, sub
from renderer.trace.leaf import octants_around

# The share of lengths by which products of four differences in float64 err.
_ROUNDED = 2.0**-44


@inlined
def enter_around(tree, query, node, count):
    """For ``walk``: the octants that the box of a query holds, from ``low`` to ``high``."""
    return count, octants_around(tree, node, query.low, query.high)


@inlined
def _box_holds(corners, o, room):
    """Whether the box of a face, widened by ``room``, contains a point."""
    p0, p1, p2 = corners
    holds = True
    for k in range(3):
        low, high = minimum(p0[k], minimum(p1[k], p2[k])), maximum(p0[k], maximum(p1[k], p2[k]))
        holds = holds and low - room <= o[k] and o[k] <= high + room
    return holds


@inlined
def areas_at(corners, o):
    """For each corner of a face the product of the face's normal with that of the face that has the point in place of
    the corner.
    """
    a, b, c = sub(corners[0], o), sub(corners[1], o), sub(corners[2], o)
    n = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]))
    return dot(n, cross(b, c)), dot(n, cross(c, a)), dot(n, cross(a, b))


@inlined
def hold_sign(corners, o, room):
    """1 if a face, seen along its normal, contains every point within ``room`` of o; -1 if it contains none; 0 if
    float64 cannot tell.
    """
    if not _box_holds(corners, o, room):
        return -1
    p0, p1, p2 = corners
    side = largest_component(sub(p1, p0)) + largest_component(sub(p2, p0))
    reach = largest_of_three(sub(p0, o), sub(p1, o), sub(p2, o)) + room
    # An area errs by some 100 u of all these lengths, and by what moves the point.
    error = side * side * reach * (reach * _ROUNDED + 12.0 * room)
    e0, e1, e2 = areas_at(corners, o)
    least = minimum(e0, minimum(e1, e2))
    return 1 if least > error else (-1 if least < -error else 0)
