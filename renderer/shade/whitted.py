"""The radiance of a bundle of camera rays: Whitted's recursion as a loop over an explicit stack of bundles.

I(x) = k_a I_a + sum over lights V [k_d (N.L)+ + k_s (R.V)+^n] I_light + k_r I(reflected) + k_t I(refracted)

A bundle spawns two: its refracted and its reflected rays. The reflected one is traced first, with all that it spawns.
So each pixel sums its light in the order of its own recursion, whatever other pixels share its bundle.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.materials.columns import REFLECTANCE
from renderer.materials.registry import bounced_light, is_lit, passes_light
from renderer.numerics.simd import load, offset, store
from renderer.numerics.vec3 import add, dot, largest_component, normalized, put3, row3, scale, three, times
from renderer.shade.bundle import (
    BUNDLE_DOUBLES,
    BUNDLE_INTEGERS,
    SIZE,
    append,
    bundle_at,
    clear,
    count_of,
    depth_of,
)
from renderer.shade.crossing import (
    SPARE,
    Media,
    Together,
    came_from,
    cross,
    faces_together,
    leaves_other,
    look_together,
    may_coincide,
    place_beyond,
)
from renderer.shade.direct import (
    BOUND,
    CHANGE,
    GEOMETRIC,
    INSIDE,
    LAST,
    LIGHT,
    MATERIAL,
    NORMAL,
    PLACE,
    POINT,
    SHADOW_DOUBLES,
    SURFACE_DOUBLES,
    begin_shadows,
    behind_holes,
    light_surfaces,
    place_of,
    put_bounds,
    put_facet,
    put_place,
)
from renderer.shade.looks import OWN_COLUMNS
from renderer.shade.shading import reflect, refract
from renderer.shade.surface import Look, look_at, missed, scene_pointers, surface_at
from renderer.trace.rays import HitPointers, RayPointers
from renderer.trace.spawn import OffsetRule, Place, put_all_visible, put_start, spawn_origin
from renderer.trace.starts.level import Spot
from renderer.trace.starts.record import ROW, StartPointers
from renderer.trace.traverse import ScratchPointers, trace_rays


class Settings(NamedTuple):
    """The settings of a whole picture.

    max_depth   the most bounces
    min_weight  the weight below which a ray ends
    offset      the offset rule of spawned rays
    media       the largest number of media of a ray, ``surface.MAX_MEDIA``, or 0 if nothing refracts
    shadows     whether surfaces hide lights
    max_rays    the number of rays of a pixel's sample after which no more are spawned
    """

    max_depth: int
    min_weight: float
    offset: OffsetRule
    media: int
    shadows: bool
    max_rays: int


# The rows of materials of a bundle's rays, and of a shadow ray.
OWN = (SIZE + 1) * OWN_COLUMNS


class BundleScratch(NamedTuple):
    """Scratch of one thread, as pointers.

    The bundles and the order of their places: waiting ones first, then free ones. For tracing: scratch, hits, and a
    zero and an infinity as bounds. For the current bundle: surfaces, shadow rays, the list of lit rays, and the media
    beyond the surfaces; the hit of one shadow ray. For each pixel: colour, number of rays traced, and whether
    ``Settings.max_rays`` cut it. For each ray, and one shadow ray, the row of its material at the point hit.
    """

    bundles: Any
    bundle_words: Any
    order: Any
    trace: ScratchPointers
    found: HitPointers
    zero: Any
    infinity: Any
    surfaces: Any
    shadows: Any
    lit: Any
    beyond: Any
    passed: HitPointers
    color: Any
    traced: Any
    cut: Any
    own: Any


def scratch_lengths(settings: Settings) -> tuple[int, int]:
    """Numbers of float64 and int64 of a ``BundleScratch``, without those of ``trace``.

    At most one bundle waits on each level; one more is current, and two places are free for those that it spawns.
    """
    slots = settings.max_depth + 4
    doubles = slots * BUNDLE_DOUBLES + 3 * SIZE + 2 + SIZE * SURFACE_DOUBLES + SHADOW_DOUBLES + 3 * SIZE + 3 + OWN
    beyond = SIZE * (settings.media + SPARE)
    integers = slots * (BUNDLE_INTEGERS + SIZE * settings.media + 1) + SIZE + 1 + 2 * SIZE + beyond + 3 * SIZE + 2
    return doubles, integers


@inlined
def bundle_scratch(doubles, integers, hits, settings, trace):
    """A ``BundleScratch`` in arrays of ``scratch_lengths``, SIZE bools, and scratch for tracing.

    ``begin_bundles`` comes first.
    """
    slots = settings.max_depth + 4
    t = offset(doubles, slots * BUNDLE_DOUBLES)
    u, v, zero = offset(t, SIZE), offset(t, 2 * SIZE), offset(t, 3 * SIZE)
    infinity, surfaces = offset(zero, 1), offset(zero, 2)
    shadows = offset(surfaces, SIZE * SURFACE_DOUBLES)
    order = offset(integers, slots * (BUNDLE_INTEGERS + SIZE * settings.media))
    face = offset(order, slots)
    lit = offset(face, SIZE)
    beyond = offset(lit, 1 + 2 * SIZE)
    traced = offset(beyond, SIZE * (settings.media + SPARE))
    side = offset(traced, 2 * SIZE)
    found = HitPointers(t, face, u, v, side, side, hits)
    color = offset(shadows, SHADOW_DOUBLES)
    one, its_face = offset(color, 3 * SIZE), offset(side, SIZE)
    own = offset(one, 3)
    its_side = offset(its_face, 1)
    passed = HitPointers(one, its_face, offset(one, 1), offset(one, 2), its_side, its_side, hits)
    return BundleScratch(
        doubles, integers, order, trace, found, zero, infinity, surfaces, shadows, lit, beyond, passed, color, traced,
        offset(traced, SIZE), own,
    )  # fmt: skip


@inlined
def begin_bundles(scratch, settings):
    """Set the bounds of all rays, let them hit all that a ray scene has, and set the order of the places."""
    store(scratch.zero, 0, 0.0)
    store(scratch.infinity, 0, np.inf)
    begin_shadows(scratch.shadows)
    for place in range(settings.max_depth + 4):
        store(scratch.order, place, place)
        starts = slot(scratch, settings, place).starts
        for i in range(SIZE):
            put_all_visible(offset(starts, i * ROW))


@inlined
def slot(scratch, settings, k):
    """The bundle in the k-th place of the order."""
    return bundle_at(scratch.bundles, scratch.bundle_words, settings.media, load(scratch.order, k))


@inlined
def _goes_on(weight, min_weight):
    largest = largest_component(weight)
    return largest > 0.0 and largest >= min_weight


@inlined
def _beyond(scratch, limit, i):
    """The place for the media beyond the surface hit by ray ``i``."""
    return offset(scratch.beyond, i * (limit + SPARE))


@inlined
def _media_of(bundle, i):
    """The ``Media`` of ray ``i``."""
    return Media(offset(bundle.media, i * bundle.limit), load(bundle.media_counts, i), bundle.limit)


@inlined
def _put_change(scene, bundle, scratch, i, together, inside, m):
    """Write the change of media of ray ``i`` at the surface that it hit, of material ``m``."""
    surface, media = offset(scratch.surfaces, i * SURFACE_DOUBLES), _media_of(bundle, i)
    change = cross(scene, together, m, inside, media, _beyond(scratch, bundle.limit, i), scratch.trace.holders)
    put3(surface, CHANGE, (change.n1, change.n2, float(change.left)))
    last = together.far
    put3(surface, LAST, (float(last.face), last.u, last.v))


@inlined
def _put_look(scene, bundle, scratch, i, together, look):
    """Write what ray ``i`` sees where it hits several faces together, and its ambient light, to ``scratch``. Returns
    the row of its material, see ``LookWays.row``.
    """
    surface, d = offset(scratch.surfaces, i * SURFACE_DOUBLES), row3(bundle.directions, i)
    width = load(bundle.widths, i) + scene.spread * load(scratch.found.t, i)
    store(bundle.widths, i, width)
    row = scene.looks.row(scene, together.seen, look, d, width, offset(scratch.own, i * OWN_COLUMNS))
    look = Look(look.p, look.facet, scene.looks.normal(scene, together.seen, look, d, width), look.material)
    # The shading normal faces the eye; a surface without light from behind has two sides.
    inside = dot(d, look.n_s) > 0.0
    put3(surface, POINT, look.p)
    put3(surface, NORMAL, scale(look.n_s, -1.0) if inside else look.n_s)
    put_facet(surface, look.facet)
    put_place(surface, together.near, came_from(look.facet.normal, d))
    store(surface, MATERIAL, float(row))
    store(surface, INSIDE, 1.0 if inside else 0.0)
    put3(surface, LIGHT, scene.looks.glow(scene, row))
    if passes_light(scene.materials, row):
        _put_change(scene, bundle, scratch, i, together, inside, look.material)
    return row


@kernel
def _meet_together(tree, scene, bundle, scratch, i, spot):
    """``_meet_surface`` at a ``Spot`` where it may hit several faces."""
    d, media = row3(bundle.directions, i), _media_of(bundle, i)
    together = faces_together(tree, scene, spot, d, media, scratch.trace.packet_stack, scratch.trace.holders)
    store(scratch.found.face, i, together.seen.face)
    return _put_look(scene, bundle, scratch, i, together, look_together(scene, together, d))


@inlined
def _meet_surface(tree, scene, bundle, scratch, i):
    """Write what ray ``i`` sees. Returns the row of its material."""
    found = scratch.found
    spot = Spot(load(found.face, i), load(found.u, i), load(found.v, i))
    if may_coincide(scene, spot.face):
        return _meet_together(tree, scene, bundle, scratch, i, spot)
    d = row3(bundle.directions, i)
    look = look_at(scene, spot.face, spot.u, spot.v, d)
    if leaves_other(scene, look, d, _media_of(bundle, i)):
        return _meet_together(tree, scene, bundle, scratch, i, spot)
    return _put_look(scene, bundle, scratch, i, Together(spot, spot, spot, 0), look)


@kernel
def _meet_surfaces(tree, scene, bundle, scratch):
    """Write the surfaces hit by rays to ``scratch``, and list the lit rays; a miss adds the background."""
    lit = 0
    for i in range(count_of(bundle)):
        pixel = load(bundle.pixels, i)
        store(scratch.traced, pixel, load(scratch.traced, pixel) + 1)
        if load(scratch.found.face, i) < 0:
            seen = times(row3(bundle.weights, i), missed(scene, row3(bundle.directions, i)))
            put3(scratch.color, 3 * pixel, add(row3(scratch.color, pixel), seen))
        elif is_lit(scene.materials, _meet_surface(tree, scene, bundle, scratch, i)):
            lit += 1
            store(scratch.lit, lit, i)
    store(scratch.lit, 0, lit)
    # In a loop of their own, as the processor overlaps more of short rounds.
    for i in range(count_of(bundle)):
        if load(scratch.found.face, i) >= 0:
            put_bounds(scene, offset(scratch.surfaces, i * SURFACE_DOUBLES))


@inlined
def _refract(scene, m, d, n, n1, n2):
    """The refracted ray of a ray in direction d from index n1 to n2 at a surface of material ``m``, whose normal n
    faces it: its direction, whether there is one, k_r and k_t.
    """
    # rule: refraction
    cos_t, through = refract(d, n, n1, n2)
    k_r, k_t = bounced_light(scene.materials, m, -dot(d, n), cos_t, n1, n2)
    return through, cos_t >= 0.0, k_r, k_t


@kernel
def passes_light_of(arrays, m):
    """``passes_light``, for Python."""
    return passes_light(scene_pointers(arrays).materials, m)


@kernel
def refract_from(arrays, m, d, n, n1, n2):
    """``_refract``, for Python."""
    return _refract(scene_pointers(arrays), m, d, n, n1, n2)


class _Exit(NamedTuple):
    """The place where rays leave a surface: the point, its ``offset_distance``, the normal and the ``Place``."""

    p: tuple
    error: float
    n_g: tuple
    place: Place


@inlined
def _exit_of(surface):
    """The ``_Exit`` of rays that stay on the side of a surface from which it was hit."""
    return _Exit(three(surface, POINT), load(surface, BOUND), three(surface, GEOMETRIC), place_of(surface))


@inlined
def _exit_beyond(scene, surface, d):
    """The ``_Exit`` of a ray that crosses all the faces that a ray of direction d hit together."""
    if np.int64(load(surface, LAST)) == np.int64(load(surface, PLACE)):
        return _exit_of(surface)
    return _exit_at(scene, offset(surface, LAST), d)


@kernel
def _exit_at(scene, row, d):
    """The ``_Exit`` from the ``Spot`` in a row."""
    last = Spot(np.int64(load(row, 0)), load(row, 1), load(row, 2))
    met = surface_at(scene, last.face, last.u, last.v, d)
    return _Exit(met.p, met.error, met.n_g, place_beyond(last, met, d))


@inlined
def _spawn(leaving, pixel, d, w, weight, width, children, media, count, settings):
    """Add to ``children`` the ray in direction w from an ``_Exit``, spawned by a ray of ``pixel`` in direction d."""
    w = normalized(w)
    o = spawn_origin(leaving.p, leaving.error, leaving.n_g, w, settings.offset)
    row = append(children, o, w, weight, width, pixel, media, count)
    put_start(row, leaving.place, leaving.n_g, w, d, settings.offset)


@inlined
def _may_leave(scratch, pixel, weight, settings):
    """Whether a ray of this weight is spawned; that depends on its pixel alone, not on its bundle."""
    if not _goes_on(weight, settings.min_weight):
        return False
    # rule: ray-budget
    if load(scratch.traced, pixel) >= settings.max_rays:
        store(scratch.cut, pixel, 1)
        return False
    return True


@kernel
def _bounce(scene, bundle, settings, scratch, refracted, reflected):
    """Collect the refracted and reflected rays of a bundle."""
    materials = scene.materials
    for i in range(count_of(bundle)):
        if load(scratch.found.face, i) < 0:
            continue
        surface = offset(scratch.surfaces, i * SURFACE_DOUBLES)
        m, weight, pixel = np.int64(load(surface, MATERIAL)), row3(bundle.weights, i), load(bundle.pixels, i)
        d, n, k_r = row3(bundle.directions, i), three(surface, NORMAL), three(materials, m + REFLECTANCE)
        width = load(bundle.widths, i)
        if passes_light(materials, m):
            n1, n2, left = three(surface, CHANGE)
            w, passes, k_r, k_t = _refract(scene, m, d, n, n1, n2)
            if passes and _may_leave(scratch, pixel, times(weight, k_t), settings):
                leaving, beyond = _exit_beyond(scene, surface, d), _beyond(scratch, bundle.limit, i)
                _spawn(leaving, pixel, d, w, times(weight, k_t), width, refracted, beyond, np.int64(left), settings)
        if _may_leave(scratch, pixel, times(weight, k_r), settings):
            media, count = offset(bundle.media, i * bundle.limit), load(bundle.media_counts, i)
            w = reflect(d, n)
            _spawn(_exit_of(surface), pixel, d, w, times(weight, k_r), width, reflected, media, count, settings)


@inlined
def _collect_light(scene, bundle, scratch):
    """Add the ambient and direct light of a bundle's surfaces to the pixels."""
    for i in range(count_of(bundle)):
        if load(scratch.found.face, i) < 0:
            continue
        surface = offset(scratch.surfaces, i * SURFACE_DOUBLES)
        pixel = load(bundle.pixels, i)
        own = times(row3(bundle.weights, i), three(surface, LIGHT))
        put3(scratch.color, 3 * pixel, add(row3(scratch.color, pixel), own))


@kernel
def _go_through_holes(tree, scene, settings, bundle, scratch):
    """Let the rays of a bundle go on where masks leave out the surfaces that they hit."""
    found = scratch.found
    for i in range(count_of(bundle)):
        spot = Spot(load(found.face, i), load(found.u, i), load(found.v, i))
        if spot.face >= 0 and not scene.looks.is_there(scene, spot):
            t, spot = behind_holes(tree, scene, scratch, row3(bundle.directions, i), spot, settings.offset)
            store(found.t, i, load(found.t, i) + t)
            store(found.face, i, spot.face)
            store(found.u, i, spot.u)
            store(found.v, i, spot.v)


@inlined
def meet(tree, scene, settings, bundle, scratch):
    """Trace the rays of a bundle and write the surfaces that they hit, not yet lit, to ``scratch``."""
    # Those of camera rays are all alike: they start on no surface.
    starts = StartPointers(bundle.starts, ROW if depth_of(bundle) > 0 else 0, scene.vertices, scene.faces)
    rays = RayPointers(bundle.origins, bundle.directions, scratch.zero, scratch.infinity, 3, 3, 0, 0, 1.0, starts)
    trace_rays(tree, rays, scratch.found, count_of(bundle), scratch.trace, None)
    # rule: holes-for-rays
    if scene.looks.has_holes(scene):
        _go_through_holes(tree, scene, settings, bundle, scratch)
    _meet_surfaces(tree, scene, bundle, scratch)


@kernel
def trace_bundle(tree, scene, settings, bundle, scratch):
    """Trace the rays of a bundle and light the surfaces that they hit; ``push_children`` spawns further rays."""
    meet(tree, scene, settings, bundle, scratch)
    light_surfaces(tree, scene, bundle, scratch.surfaces, scratch.lit, settings, scratch)
    _collect_light(scene, bundle, scratch)


@inlined
def push_children(scene, settings, scratch, bundle, top):
    """Spawn the rays of the bundle in place ``top`` into the two free places above it. Returns the new top.

    The bundle's own place becomes free, behind the others. An empty bundle does not wait.
    """
    if depth_of(bundle) >= settings.max_depth:
        return top
    refracted, reflected = slot(scratch, settings, top + 1), slot(scratch, settings, top + 2)
    clear(refracted, depth_of(bundle) + 1)
    clear(reflected, depth_of(bundle) + 1)
    _bounce(scene, bundle, settings, scratch, refracted, reflected)
    order, own = scratch.order, load(scratch.order, top)
    first, second = load(order, top + 1), load(order, top + 2)
    if count_of(refracted) == 0:
        first, second = second, first
    store(order, top, first)
    store(order, top + 1, second)
    store(order, top + 2, own)
    return top + np.int64(count_of(refracted) > 0) + np.int64(count_of(reflected) > 0)
