"""Direct light on the surfaces of a bundle: Phong with shadows.

k_a I_a + sum over lights V [k_d (N.L)+ + k_s (R.V)+^n] I_light
"""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.materials.columns import TRANSMITTANCE
from renderer.materials.registry import reflected_light
from renderer.numerics.simd import load, offset, store
from renderer.numerics.vec3 import add, largest_component, put3, row3, sub, three, times
from renderer.shade.bundle import SIZE
from renderer.shade.crossing import place_at
from renderer.shade.lights import aim, aim_off, see_light
from renderer.shade.looks import OWN_COLUMNS
from renderer.shade.surface import bounds_at, look_at, raised, surface_at
from renderer.trace.rays import RayPointers
from renderer.trace.spawn import Facet, Place, put_all_visible, put_no_start, put_start, spawn_origin
from renderer.trace.starts.level import Spot
from renderer.trace.starts.record import ROW, StartPointers
from renderer.trace.traverse import trace_rays

# The surface that a ray of a bundle hit, for its light and the rays that it spawns: SURFACE_DOUBLES float64 per ray.
# GEOMETRIC is the first of the ``Facet``. Where light passes, CHANGE has the ``crossing.Change``, and LAST the
# ``level.Spot`` that a refracted ray leaves.
POINT, NORMAL, GEOMETRIC, BOUND, MATERIAL, INSIDE, LIGHT, PLACE, CHANGE, LAST = 0, 3, 6, 11, 12, 13, 14, 17, 22, 25
SURFACE_DOUBLES = 28
# Columns of the shadow rays: origin, direction and t_max, the unit direction to the light, the light from there, and
# the row of ``starts.record``.
_ORIGIN, _DIRECTION, _T_MAX = 0, 3 * SIZE, 6 * SIZE
# The most faces that light passes on its way to a surface.
MOST_PANES = 256
# The most holes that a ray goes through to a surface: rounding could keep it in one place for ever.
MOST_HOLES = 1 << 16
_TOWARDS, _ARRIVING, _START, SHADOW_DOUBLES = 7 * SIZE, 10 * SIZE, 13 * SIZE, (13 + ROW) * SIZE


@inlined
def begin_shadows(shadows):
    """Let shadow rays hit all instances of a ray scene."""
    for k in range(SIZE):
        put_all_visible(offset(shadows, _START + ROW * k))


@inlined
def place_of(surface):
    """The ``Place`` of a surface."""
    row = offset(surface, PLACE)
    return Place(load(row, 0), load(row, 1), load(row, 2), load(row, 3), load(row, 4), 0.0)


@inlined
def put_place(surface, spot, came):
    """Write the ``Place`` of a surface without the slack, which ``put_bounds`` writes."""
    row = offset(surface, PLACE)
    put3(row, 0, (float(spot.face), spot.u, spot.v))
    store(row, 4, came)


@inlined
def put_facet(surface, facet):
    """Write the ``Facet`` of a surface."""
    put3(surface, GEOMETRIC, facet.normal)
    store(surface, GEOMETRIC + 3, facet.double_area)
    store(surface, GEOMETRIC + 4, facet.side)


@inlined
def put_bounds(scene, surface):
    """Write the ``bounds_at`` a surface."""
    row, area = offset(surface, PLACE), offset(surface, GEOMETRIC + 3)
    facet = Facet(three(surface, GEOMETRIC), load(area, 0), load(area, 1))
    error, slack = bounds_at(scene, np.int64(load(row, 0)), load(row, 1), load(row, 2), three(surface, POINT), facet)
    store(surface, BOUND, error)
    store(row, 3, slack)


@kernel
def _aim_all(scene, bundle, surfaces, lit, count, light, rule, shadows):
    """Aim shadow rays from the surfaces of the ``count`` rays in ``lit`` at a light.

    Returns the number of surfaces that face it; their rays are written to ``lit`` from SIZE on.
    """
    aimed = 0
    for k in range(count):
        i = load(lit, k)
        surface = offset(surfaces, i * SURFACE_DOUBLES)
        p, n, n_g, error = (
            three(surface, POINT),
            three(surface, NORMAL),
            three(surface, GEOMETRIC),
            load(surface, BOUND),
        )
        seen = see_light(scene.lights, light, p, n, error)
        if seen.faces:
            start, d, place = offset(shadows, _START + ROW * aimed), row3(bundle.directions, i), place_of(surface)
            above = raised(scene, np.int64(place.face), place.u, place.v, p, n, n_g, error)
            if above.is_off:
                ray = aim_off(seen, above.point)
                put_no_start(start)
            else:
                ray = aim(seen, p, n_g, error, rule)
                put_start(start, place, n_g, ray.direction, d, rule)
            put3(shadows, _ORIGIN + 3 * aimed, ray.origin)
            put3(shadows, _DIRECTION + 3 * aimed, ray.direction)
            store(shadows, _T_MAX + aimed, ray.t_max)
            put3(shadows, _TOWARDS + 3 * aimed, seen.towards)
            put3(shadows, _ARRIVING + 3 * aimed, seen.arriving)
            store(lit, SIZE + aimed, i)
            aimed += 1
    return aimed


@inlined
def _add_light(scene, bundle, surface, i, towards, arriving):
    """Add the share of a light that reaches the surface of ray ``i`` and is reflected back along the ray."""
    m, n, d = np.int64(load(surface, MATERIAL)), three(surface, NORMAL), row3(bundle.directions, i)
    factor = reflected_light(scene.materials, m, n, d, towards)
    put3(surface, LIGHT, add(three(surface, LIGHT), times(factor, arriving)))


@inlined
def _shadow_rays(scene, shadows, zero, k):
    """The shadow rays from the k-th on."""
    starts = StartPointers(offset(shadows, _START + ROW * k), ROW, scene.vertices, scene.faces)
    return RayPointers(
        offset(shadows, _ORIGIN + 3 * k), offset(shadows, _DIRECTION + 3 * k), zero, offset(shadows, _T_MAX + k),
        3, 3, 0, 1, 1.0, starts,
    )  # fmt: skip


@kernel
def _pass_through(tree, scene, scratch, k, rule):
    """Follow the k-th shadow ray, which hits something, through holes of masks, and where shadows are clear through all
    that transmits light: the light that arrives is multiplied by the transmittance of each face. Returns whether an
    opaque face hides the light, and the number of rays traced beyond the first.
    """
    shadows, found = scratch.shadows, scratch.passed
    row, rays = 3 * k, 0
    while True:
        trace_rays(tree, _shadow_rays(scene, shadows, scratch.zero, k), found, 1, scratch.trace, None)
        if load(found.face, 0) < 0:
            return False, rays
        d = three(shadows, _DIRECTION + row)
        spot = Spot(load(found.face, 0), load(found.u, 0), load(found.v, 0))
        if rays == MOST_PANES:
            return True, rays
        # rule: holes-in-shadows
        if scene.looks.is_there(scene, spot):
            through = _share_through(scene, scratch, spot, d)
            # rule: clear-shadows
            if not (scene.clear and largest_component(through) > 0.0):
                return True, rays
            put3(shadows, _ARRIVING + row, times(three(shadows, _ARRIVING + row), through))
        _go_on(scene, shadows, k, spot, rule)
        rays += 1


@inlined
def _share_through(scene, scratch, spot, d):
    """The share of light from direction d that the surface at a spot transmits."""
    look = look_at(scene, spot.face, spot.u, spot.v, d)
    row = scene.looks.row(scene, spot, look, d, 0.0, offset(scratch.own, SIZE * OWN_COLUMNS))
    return three(scene.materials, row + TRANSMITTANCE)


@inlined
def _go_on(scene, shadows, k, spot, rule):
    """Start the k-th shadow ray anew behind the ``Spot`` that it hit, towards the same end."""
    row, start = 3 * k, offset(shadows, _START + ROW * k)
    d, t_max = three(shadows, _DIRECTION + row), load(shadows, _T_MAX + k)
    met = surface_at(scene, spot.face, spot.u, spot.v, d)
    o = spawn_origin(met.p, met.error, met.n_g, d, rule)
    onwards = d if t_max == np.inf else sub(add(three(shadows, _ORIGIN + row), d), o)
    put_start(start, place_at(spot, met, d), met.n_g, onwards, d, rule)
    put3(shadows, _ORIGIN + row, o)
    put3(shadows, _DIRECTION + row, onwards)


@kernel
def behind_holes(tree, scene, scratch, d, spot, rule):
    """Follow a ray of direction d from a ``Spot`` where a mask leaves out the surface to the first where none does, or
    past everything: face -1. Returns the distance and that spot. In place of the first shadow ray.
    """
    shadows, found, t, panes = scratch.shadows, scratch.passed, 0.0, 0
    put3(shadows, _DIRECTION, d)
    store(shadows, _T_MAX, np.inf)
    while spot.face >= 0 and panes < MOST_HOLES and not scene.looks.is_there(scene, spot):
        _go_on(scene, shadows, 0, spot, rule)
        trace_rays(tree, _shadow_rays(scene, shadows, scratch.zero, 0), found, 1, scratch.trace, None)
        t, spot = t + load(found.t, 0), Spot(load(found.face, 0), load(found.u, 0), load(found.v, 0))
        panes += 1
    return t, spot


@inlined
def _trace_shadows(tree, scene, bundle, lit, aimed, rule, scratch):
    """Find which of the ``aimed`` shadow rays hit anything, and count all of them in their pixels."""
    rays = _shadow_rays(scene, scratch.shadows, scratch.zero, 0)
    trace_rays(tree, rays, scratch.found, aimed, scratch.trace, np.bool_(True))
    for k in range(aimed):
        pixel, more = load(bundle.pixels, load(lit, SIZE + k)), 0
        if (scene.clear or scene.looks.has_holes(scene)) and load(scratch.found.hit, k):
            hidden, more = _pass_through(tree, scene, scratch, k, rule)
            store(scratch.found.hit, k, hidden)
        store(scratch.traced, pixel, load(scratch.traced, pixel) + 1 + more)


@kernel
def light_surfaces(tree, scene, bundle, surfaces, lit, settings, scratch):
    """Write the direct light on the surfaces of a bundle to their LIGHT.

    ``lit`` has the number of rays whose material reflects direct light, these rays, and room for as many again. Shadow
    rays are counted in ``scratch.traced`` of their pixels; without ``settings.shadows`` there are none.
    """
    count, lit = load(lit, 0), offset(lit, 1)
    shadows = scratch.shadows
    for light in range(scene.light_count):
        aimed = _aim_all(scene, bundle, surfaces, lit, count, light, settings.offset, shadows)
        if settings.shadows:
            _trace_shadows(tree, scene, bundle, lit, aimed, settings.offset, scratch)
        for k in range(aimed):
            i = load(lit, SIZE + k)
            # rule: shadows
            if not (settings.shadows and load(scratch.found.hit, k)):
                towards, arriving = three(shadows, _TOWARDS + 3 * k), three(shadows, _ARRIVING + 3 * k)
                surface = offset(surfaces, i * SURFACE_DOUBLES)
                _add_light(scene, bundle, surface, i, towards, arriving)
