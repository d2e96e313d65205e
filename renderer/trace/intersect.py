"""Ray-box and ray-triangle tests, eight and four at a time.

Boxes are float32 and only ever too large; triangles are tested in float64, so precision never depends on a box.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.simd import (
    extract,
    fabs,
    is_negative,
    load,
    load4,
    load8,
    maximum,
    minimum,
    movemask,
    narrow,
    select,
    splat4,
    splat8,
    unlikely,
    widen,
)
from renderer.numerics.vec3 import largest_component
from renderer.trace.best import FaceHit
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, MASK_BITS, ORDERS

# (1 + 2 gamma(3)) in float32, rounded up: the far side of a slab after one subtraction, one product and one rounded
# reciprocal, against a near side that erred the other way (Ize, Robust BVH Ray Traversal, JCGT 2:2, 2013, sec. 3).
FAR_PADDING = np.float32(1.0 + 8.0 * 2.0**-23)
LARGEST_FLOAT = np.float32(np.finfo(np.float32).max)
_STEP = np.float32(2.0**-23)
_TINY = np.float32(2.0**-149)
# Where room is added to a step, this more covers that the sum and the difference are rounded too.
_MORE = np.float32(1.0 + 2.0**-9)
# The errors of the triangle test. Let u = 2^-53, A = ``across``, Z = ``along``, D = A + Z and S the spread of z. Then a
# sheared coordinate errs by 4 u D, the edge functions together by 9 u A D, the determinant by 10 u A D and the
# numerator of t by 11 u A D Z. Three limits say when a hit is uncertain.
#
# DOUBT for the determinant, as a share of A D. Above it the determinant errs by 2^-23 of itself, and the ray passes its
# plane beside the face by 9 * 2^-26 of the barycentrics at most: by 2^-21.8 of the width of the face's box, which is
# less than ``face_range`` adds.
#
# DOUBT for the numerator, as a share of A D Z. Above it t errs by 21 * 2^-26 = 2^-21.6 of itself, which is less than
# FAR_PADDING leaves after a slab's own roundings (2^-20.4). So a certain hit lies at or behind the entry of every box
# around its face, and ``resolve_uncertain`` moves the others there: the answer is the least t over all faces, whatever
# the tree, the packet or the order.
DOUBT = 2.0**-27
# SLANT for the determinant, as a share of A D S / Z: thin faces, and faces hit at small angles, are below it. A hit is
# a mean of the corners, so its distance from the plane is 9 u A D S over twice the face's area. Above the limit that is
# 9 sqrt(3) u Z / SLANT, because no determinant exceeds sqrt(3) times twice the area. Let L be the largest component of
# a corner relative to the origin. Z is at most 3 L, so the distance is at most 47 u L / SLANT, less than 2^-31 L.
SLANT = 2.0**-16
# The error of an uncertain numerator, as a share of A D Z: its own 11 u, and the determinant's share of 2^-27. What
# resolves it moves t by no more, because the ray meets the plane itself within the face's box.
ERROR = 2.0**-48
# The same where the determinant is uncertain, as a share of D cubed: such a face is hit where the ray comes within
# ``resolve.ROUNDING`` of it, 2^-46 L, times its normal, which is at most 3 D^2.
BESIDE = 2.0**-44
# The error of an edge function as a share of A D, of ``unsure_sides``: 10 u and room.
SIDE_ERROR = 2.0**-49
# The slack of a ray that starts exactly at its origin, a corner of the mesh.
CORNER = 2.0**-1000
# The share of its width by which a face's box is wider than the face, on each side.
ROOM = 2.0**-21


@inlined
def round_up(x):
    """A float32 >= x, within two ulp of it, or +inf. It is never -inf, so no difference with it is NaN.

    Of NaN it is the least float32.
    """
    # No branch, here and below: whether a random ray takes it cannot be predicted.
    y = maximum(-LARGEST_FLOAT, narrow(x))
    return y + select(widen(y) < x, fabs(y) * _STEP + _TINY, np.float32(0.0))


@inlined
def round_down(x):
    """A float32 <= x, within two ulp of it, or -inf. It is never +inf, so no difference with it is NaN.

    Of NaN it is the largest float32.
    """
    y = minimum(LARGEST_FLOAT, narrow(x))
    return y - select(widen(y) > x, fabs(y) * _STEP + _TINY, np.float32(0.0))


@inlined
def room_of(slack):
    """A float32 for ``round_both``, larger than a number >= 0."""
    return narrow(slack) * _MORE + _TINY


@inlined
def round_both(x, room):
    """A float32 <= x - room and one >= x + room. Each is within three ulp or infinite, never on the wrong side.

    The least float32 is never above +inf nor the greatest below -inf, so no difference with either is NaN.
    """
    y = maximum(-LARGEST_FLOAT, minimum(LARGEST_FLOAT, narrow(x)))
    # rule: origin-bounds
    step = fabs(y) * (_STEP * _MORE) + room
    return y - step, y + step


@inlined
def face_range(a, b, c):
    """The interval of a face's box on one axis, from its corners' coordinates: float32, rounded outwards.

    Every box around the face contains this one. It is wider than the corners by ROOM on each side, because a ray that
    hits the face in float64 may pass it by that much.
    """
    low, high = minimum(a, minimum(b, c)), maximum(a, maximum(b, c))
    room = (high - low) * ROOM
    return round_down(low - room), round_up(high + room)


@inlined
def box_limit(t, largest):
    """The float32 distance that bounds a search for hits up to t: a box entered later contains none."""
    return round_up(t * largest) * FAR_PADDING


class Ray(NamedTuple):
    """One ray, or eight as vectors: origin, direction, the least t that counts, and how it starts on the surface.

    slack    bound of the distance of the origin from the start on the surface, with room; 0 if it starts on none
    leaving  the face that it starts on, as float64; -1 for none
    mask     in a scene, the bits of the instances that it may hit, as float64
    ignored  in a scene, the instance that it does not hit, as float64; -1 for none
    """

    ox: Any
    oy: Any
    oz: Any
    dx: Any
    dy: Any
    dz: Any
    t_min: Any
    slack: Any = 0.0
    leaving: Any = -1.0
    mask: Any = float(MASK_BITS)
    ignored: Any = -1.0


@inlined
def largest_of(ray):
    """The largest component of a ray's direction, without its sign."""
    return maximum(maximum(fabs(ray.dx), fabs(ray.dy)), fabs(ray.dz))


class Slabs(NamedTuple):
    """A ray prepared for ``enter_boxes``: for each axis the row, origin and reciprocal of its near and far planes.

    Distances count in units in which the largest component of the direction is 1, so that float32 does not overflow.
    """

    near_x: Any
    near_y: Any
    near_z: Any
    far_x: Any
    far_y: Any
    far_z: Any
    near_origin_x: Any
    near_origin_y: Any
    near_origin_z: Any
    far_origin_x: Any
    far_origin_y: Any
    far_origin_z: Any
    near_inverse_x: Any
    near_inverse_y: Any
    near_inverse_z: Any
    far_inverse_x: Any
    far_inverse_y: Any
    far_inverse_z: Any


@inlined
def make_slab(axis, o, d, largest, room):
    """Near row, far row, origins and reciprocals of one axis, each rounded so that the slab only grows, by ``room`` on
    both sides.

    The sign bit chooses the rows, so -0.0 is a direction like any other. The near reciprocal is finite and never above
    the true one. The far one may be infinite; times a difference of 0 it makes NaN, which ``enter_boxes`` ignores.
    """
    inverse, back = narrow(largest / d), is_negative(d)
    down, up = round_both(o, room)
    near_inverse = minimum(maximum(inverse, -LARGEST_FLOAT), LARGEST_FLOAT)
    low, high = np.int64(16 * axis), np.int64(16 * axis + 8)
    return (
        select(back, high, low), select(back, low, high), select(back, down, up), select(back, up, down),
        near_inverse, inverse,
    )  # fmt: skip


@inlined
def make_slabs(ray, largest):
    """Prepare a ray; ``largest`` is ``largest_of(ray)`` > 0."""
    # Infinite, it says that the ray goes through no box.
    room = room_of(select(ray.slack < np.inf, ray.slack, 0.0))
    nx, fx, nox, fox, nix, fix = make_slab(0, ray.ox, ray.dx, largest, room)
    ny, fy, noy, foy, niy, fiy = make_slab(1, ray.oy, ray.dy, largest, room)
    nz, fz, noz, foz, niz, fiz = make_slab(2, ray.oz, ray.dz, largest, room)
    return Slabs(
        nx, ny, nz, fx, fy, fz, nox, noy, noz, fox, foy, foz, nix, niy, niz, fix, fiy, fiz
    )  # fmt: skip


@inlined
def order_of_octants(near_x, near_y, near_z):
    """The word of a node that has the order of its octants for a ray with these near rows."""
    # A near row is 16 times its axis, and 8 more where the direction is negative.
    return ORDERS + ((near_x + 2 * (near_y - 16) + 4 * (near_z - 32)) >> 3)


@inlined
def order_for(links, base, slabs):
    """The order of the octants of the node at word ``base`` for a ray, int32."""
    return load(links, base + order_of_octants(slabs.near_x, slabs.near_y, slabs.near_z))


@inlined
def enter_in_order(nodes, links, base, slabs, lower, upper):
    """``enter_boxes``, and the order of the octants."""
    t0, bits = enter_boxes(nodes, base, slabs, lower, upper)
    return t0, bits, order_for(links, base, slabs)


@inlined
def enter_boxes(nodes, base, slabs, lower, upper):
    """``meet_boxes`` with the bits of the octants in place of the mask."""
    t0, meets = meet_boxes(nodes, base, slabs, lower, upper)
    return t0, movemask(meets)


@inlined
def meet_boxes(nodes, base, slabs, lower, upper):
    """Entry distances (8 x float32), and the mask of the octants that the ray enters within [lower, upper]; their rows
    begin at ``base``.
    """
    n_x = _distances(nodes, base + slabs.near_x, slabs.near_origin_x, slabs.near_inverse_x)
    n_y = _distances(nodes, base + slabs.near_y, slabs.near_origin_y, slabs.near_inverse_y)
    n_z = _distances(nodes, base + slabs.near_z, slabs.near_origin_z, slabs.near_inverse_z)
    f_x = _distances(nodes, base + slabs.far_x, slabs.far_origin_x, slabs.far_inverse_x)
    f_y = _distances(nodes, base + slabs.far_y, slabs.far_origin_y, slabs.far_inverse_y)
    f_z = _distances(nodes, base + slabs.far_z, slabs.far_origin_z, slabs.far_inverse_z)
    return meet_interval(n_x, n_y, n_z, f_x, f_y, f_z, lower, upper)


@inlined
def meet_interval(n_x, n_y, n_z, f_x, f_y, f_z, lower, upper):
    """Entry distances, and the mask of where a ray is in three slabs at once within [lower, upper]: from their near and
    far planes' distances.

    A distance is NaN where the direction is 0 and the origin lies in a slab's plane. Each comparison is false for NaN,
    so the interval stays as it was.
    """
    t0 = select(n_x > lower, n_x, lower)
    t0 = select(n_y > t0, n_y, t0)
    t0 = select(n_z > t0, n_z, t0)
    t1 = select(f_x < upper, f_x, upper)
    t1 = select(f_y < t1, f_y, t1)
    t1 = select(f_z < t1, f_z, t1)
    return t0, t0 <= t1 * splat8(FAR_PADDING)


@inlined
def _distances(nodes, row, origin, inverse):
    return (load8(nodes, row) - splat8(origin)) * splat8(inverse)


class Shear(NamedTuple):
    """A ray prepared for ``hit_triangles``: its axes turned so that z is the largest component of its direction.

    row_x, row_y, row_z       where a block has the coordinates of each axis
    origin_x to origin_z      the origin
    shear_x, shear_y          Woop's shear: the direction's x and y over its z
    direction_z               the direction's z
    slack, leaving            as of ``Ray``
    """

    row_x: Any
    row_y: Any
    row_z: Any
    origin_x: Any
    origin_y: Any
    origin_z: Any
    shear_x: Any
    shear_y: Any
    direction_z: Any
    slack: Any
    leaving: Any


@inlined
def make_shear(ray):
    """Turn the axes so that z is the largest component of the direction, then shear the direction onto it."""
    axis = longest_axis(ray)
    row_x, row_y, row_z = turned(axis, np.int64(0), np.int64(4), np.int64(8))
    ox, oy, oz = turned(axis, ray.ox, ray.oy, ray.oz)
    dx, dy, dz = turned(axis, ray.dx, ray.dy, ray.dz)
    # rule: shear
    return Shear(row_x, row_y, row_z, ox, oy, oz, dx / dz, dy / dz, dz, ray.slack, ray.leaving)


@inlined
def longest_axis(ray):
    """Two bools: the largest component of the direction is z; else it is y. Neither means x."""
    ax, ay, az = fabs(ray.dx), fabs(ray.dy), fabs(ray.dz)
    return (az >= ax) & (az >= ay), ay >= ax


@inlined
def turned(axis, x, y, z):
    """Three values in the order of the ray's axes, the one of ``longest_axis`` last."""
    on_z, on_y = axis
    return _chosen(on_z, on_y, y, z, x), _chosen(on_z, on_y, z, x, y), _chosen(on_z, on_y, x, y, z)


@inlined
def _chosen(on_z, on_y, if_x, if_y, if_z):
    return select(on_z, if_z, select(on_y, if_y, if_x))


class Edges(NamedTuple):
    """Four triangles as a ray sees them: sheared corners, edge functions, the least, the most and the sum of these.

    The sum is the determinant.
    """

    x0: Any
    x1: Any
    x2: Any
    y0: Any
    y1: Any
    y2: Any
    z0: Any
    z1: Any
    z2: Any
    e0: Any
    e1: Any
    e2: Any
    least: Any
    most: Any
    determinant: Any


@inlined
def load_corners(tree, base, rows):
    """The nine rows of a block: x, y and z of each corner, in the order of axes row_x, row_y, row_z of ``rows``."""
    return tree.ways.corners(tree, base, rows)


@inlined
def corners_of_block(tree, base, rows):
    """``load_corners`` of a mesh."""
    return _load_rows(tree.wide_blocks, base, rows) if tree.wide != 0 else _load_rows(tree.blocks, base, rows)


@inlined
def _load_rows(blocks, base, rows):
    x, y, z = base + rows.row_x, base + rows.row_y, base + rows.row_z
    return (
        load4(blocks, x), load4(blocks, x + 12), load4(blocks, x + 24),
        load4(blocks, y), load4(blocks, y + 12), load4(blocks, y + 24),
        load4(blocks, z), load4(blocks, z + 12), load4(blocks, z + 24),
    )  # fmt: skip


@inlined
def face_in(tree, slot):
    """The number of the face in a slot, -1 for none."""
    return tree.ways.face(tree, slot)


@inlined
def face_of_block(tree, slot):
    """``face_in`` of a mesh."""
    return load(tree.faces, slot)


@inlined
def see_triangles(tree, base, ray):
    """The ``Edges`` of a block's four triangles, and the bits of those whose edges a ray passes on the same side.

    Source: Woop, Benthin, Wald, Watertight Ray/Triangle Intersection, JCGT 2:1, 2013. fl(ab) - fl(cd) has the sign of
    ab - cd or is 0. 0 counts as inside here. If rounding could have made that 0, the hit is uncertain and
    ``edge_signs`` decides. A triangle whose corners lie on a line may be hit: it fills the slit between its neighbours'
    rounded edges.
    """
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = load_corners(tree, base, ray)
    zero, ox, oy, oz = splat4(0.0), splat4(ray.origin_x), splat4(ray.origin_y), splat4(ray.origin_z)
    sx, sy = splat4(ray.shear_x), splat4(ray.shear_y)
    z0, z1, z2 = z0 - oz, z1 - oz, z2 - oz
    x0, x1, x2 = (x0 - ox) - sx * z0, (x1 - ox) - sx * z1, (x2 - ox) - sx * z2
    y0, y1, y2 = (y0 - oy) - sy * z0, (y1 - oy) - sy * z1, (y2 - oy) - sy * z2
    e0 = x2 * y1 - y2 * x1
    e1 = x0 * y2 - y0 * x2
    e2 = x1 * y0 - y1 * x0
    least, most = minimum(e0, minimum(e1, e2)), maximum(e0, maximum(e1, e2))
    # rule: inside-edges
    seen = movemask((least >= zero) | (most <= zero))
    return Edges(x0, x1, x2, y0, y1, y2, z0, z1, z2, e0, e1, e2, least, most, e0 + e1 + e2), seen


class _Sizes(NamedTuple):
    """Sums of the sizes of the sheared corners of four triangles: of x, of y, of both, of z."""

    wide: Any
    high: Any
    across: Any
    along: Any


@inlined
def _sizes_of(edges):
    wide = fabs(edges.x0) + fabs(edges.x1) + fabs(edges.x2)
    high = fabs(edges.y0) + fabs(edges.y1) + fabs(edges.y2)
    along = fabs(edges.z0) + fabs(edges.z1) + fabs(edges.z2)
    return _Sizes(wide, high, wide + high, along)


@inlined
def _numerator(edges):
    return edges.e0 * edges.z0 + edges.e1 * edges.z1 + edges.e2 * edges.z2


class PlaneHits(NamedTuple):
    """t for the planes of a block's four triangles, and the bits of those that rounding could decide.

    t                      of each triangle
    uncertain              rounding could decide t or an edge function
    determinant_uncertain  rounding could decide the determinant
    must_resolve           uncertain, and may fall in [t_min, t_max] once resolved; or near the start of a ray that
                           leaves a surface. Never the face that it leaves
    """

    t: Any
    uncertain: int
    determinant_uncertain: int
    must_resolve: int


@inlined
def meet_planes(tree, base, edges, seen, ray, t_min, t_max):
    """The ``PlaneHits`` of the block at ``base``; only triangles in ``seen`` have bits."""
    sizes, numerator = _sizes_of(edges), _numerator(edges)
    denominator = edges.determinant * splat4(ray.direction_z)
    t, height = numerator / denominator, fabs(numerator)
    product = sizes.across * (sizes.across + sizes.along)
    limit = product * sizes.along * splat4(DOUBT)
    slant = product * (fabs(edges.z1 - edges.z0) + fabs(edges.z2 - edges.z0)) * splat4(SLANT)
    determinant_uncertain = fabs(edges.determinant) * sizes.along <= maximum(limit, slant)
    near, zero = height <= limit, splat4(0.0)
    # Of those seen, an edge function is 0 where the least or the most is.
    some = seen & movemask(determinant_uncertain | near | (edges.least == zero) | (edges.most == zero))
    # rule: beside-start
    exact = _from_start(edges, seen, ray) if ray.slack != 0.0 else np.int64(0)
    # What only these need is computed here: they are rare, and one branch costs less than that would in each block.
    if unlikely(some | exact != 0):
        left = _left(tree, base, edges, ray) if ray.slack != 0.0 else np.int64(0)
        exact &= ~left
        # Most often the face that the ray leaves is the only one.
        if some & ~left | exact != 0:
            uncertain = determinant_uncertain | near | _may_be_on_edge(edges)
            # Whether the numerator, with its error, may make a t from t_min to t_max. A t that rounding made negative
            # may be 0. ERROR has the determinant's error too, because the numerator is t times the determinant.
            base_t, size = fabs(denominator), sizes.across + sizes.along
            error = product * sizes.along * splat4(ERROR)
            error = maximum(error, select(determinant_uncertain, size * size * size * splat4(BESIDE), splat4(0.0)))
            within = (height + error >= splat4(t_min) * base_t) & (height - error <= splat4(t_max) * base_t)
            ahead, extended = (t >= zero) | (height <= error), _is_extended(edges, sizes)
            due = uncertain & ahead & within & extended
            return PlaneHits(
                t,
                (seen & movemask(uncertain)) | ((some | seen) & left) | exact,
                seen & movemask(determinant_uncertain),
                (seen & movemask(due) & ~left) | exact,
            )
        some |= seen & left
    return PlaneHits(t, some, np.int64(0), np.int64(0))


@inlined
def _left(tree, base, edges, ray):
    """The bits of the faces of the block at ``base`` that a ray leaves: its own face, and at a corner all faces with
    that corner, which it cannot hit elsewhere.
    """
    slot, bits = base // BLOCK_WORDS * BLOCK_FACES, np.int64(0)
    for i in range(BLOCK_FACES):
        bits |= np.int64(np.float64(face_in(tree, slot + i)) == ray.leaving) << i
    if ray.slack == CORNER:
        zero = splat4(0.0)
        at0 = (edges.x0 == zero) & (edges.y0 == zero) & (edges.z0 == zero)
        at1 = (edges.x1 == zero) & (edges.y1 == zero) & (edges.z1 == zero)
        bits |= movemask(at0 | at1 | ((edges.x2 == zero) & (edges.y2 == zero) & (edges.z2 == zero)))
    return bits


@inlined
def _is_extended(edges, sizes):
    """The mask of triangles that the ray does not see as a point or as a piece of an axis. It hits none of those;
    without this check, rays along walls would all be uncertain.
    """
    zero = splat4(0.0)
    apart = (edges.x0 != edges.x1) | (edges.x1 != edges.x2) | (edges.y0 != edges.y1) | (edges.y1 != edges.y2)
    return apart & (sizes.wide > zero) & (sizes.high > zero)


@inlined
def _may_be_on_edge(edges):
    """The mask of triangles with an edge function that is 0 only after rounding."""
    zero, e0, e1, e2 = splat4(0.0), edges.e0, edges.e1, edges.e2
    x0, x1, x2 = edges.x0 != zero, edges.x1 != zero, edges.x2 != zero
    y0, y1, y2 = edges.y0 != zero, edges.y1 != zero, edges.y2 != zero
    # rule: rounded-edge
    on0 = (e0 == zero) & ((x2 & y1) | (y2 & x1))
    on1 = (e1 == zero) & ((x0 & y2) | (y0 & x2))
    return on0 | on1 | ((e2 == zero) & ((x1 & y0) | (y1 & x0)))


@inlined
def _from_start(edges, seen, ray):
    if ray.slack == CORNER:
        return near_start(edges, seen, slack_of((ray.origin_x, ray.origin_y, ray.origin_z), 0.0), False)
    return near_start(edges, seen, ray.slack, True)


@inlined
def near_start(edges, seen, slack, is_off):
    """The bits of the triangles that a ray from the surface tests from its exact start: those near it and, if the
    origin is off it, those whose edges the ray may therefore pass on the other side. So one start decides all of them.
    """
    near = seen & near_planes(edges, slack)
    return near | unsure_sides(edges, slack) if is_off else near


@inlined
def slack_of(o, distance):
    """The slack of a ray that starts at o, some distance from the surface. ``near_planes`` compares heights with a
    product that may be an eighth of the true one.
    """
    return 8.0 * (distance + 2.0**-51 * largest_component(o))


@inlined
def near_planes(edges, slack):
    """The bits of the triangles whose planes are within a ray's ``slack``, or a rounding, of its origin."""
    sizes, height = _sizes_of(edges), fabs(_numerator(edges))
    error = splat4(slack) + sizes.along * splat4(ERROR)
    return movemask(height <= sizes.across * (sizes.across + sizes.along) * error)


@inlined
def unsure_sides(edges, slack):
    """The bits of the triangles with an edge that the ray may pass on either side, if its origin is off by ``slack``.

    With D as above a sheared coordinate errs by 4 u D and the slack, so an edge function by 2 A times that and 2 u A^2.
    """
    sizes, zero = _sizes_of(edges), splat4(0.0)
    error = sizes.across * ((sizes.across + sizes.along) * splat4(SIDE_ERROR) + splat4(slack))
    may = (edges.least >= zero - error) | (edges.most <= error)
    return movemask(may) & ~movemask((edges.least > error) | (edges.most < zero - error))


@inlined
def bits_within(t, t_min, t_max):
    """The bits of those of four t that are from t_min to t_max."""
    return movemask((t >= splat4(t_min)) & (t <= splat4(t_max)))


class BlockHits(NamedTuple):
    """The hits of one ray in a block: the bits of the triangles hit, those of ``PlaneHits``, t, and the numerators and
    denominator of the barycentrics.
    """

    bits: int
    uncertain: int
    determinant_uncertain: int
    must_resolve: int
    t: Any
    u: Any
    v: Any
    w: Any


@inlined
def hit_triangles(tree, base, ray, t_min, t_max):
    """The ``BlockHits`` of the block at ``base`` by a watertight test; ``resolve`` decides the uncertain ones."""
    edges, bits = see_triangles(tree, base, ray)
    if bits == 0 and ray.slack == 0.0:
        zero = splat4(0.0)
        return BlockHits(bits, bits, bits, bits, zero, zero, zero, zero)
    planes = meet_planes(tree, base, edges, bits, ray, t_min, t_max)
    return BlockHits(
        bits, planes.uncertain, planes.determinant_uncertain, planes.must_resolve, planes.t,
        edges.e1, edges.e2, edges.determinant,
    )  # fmt: skip


@inlined
def hit_in(hits, i):
    """The i-th of ``BlockHits``, as a ``FaceHit``."""
    return FaceHit(extract(hits.t, i), extract(hits.u, i), extract(hits.v, i), extract(hits.w, i))
