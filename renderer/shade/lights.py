"""Lights as seen from a surface, and shadow rays."""

from typing import NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load
from renderer.numerics.vec3 import dot, normalized, scale, sub, three
from renderer.shade.records import DIRECTIONAL, LIGHT_COLUMNS
from renderer.shade.surface import raised, scene_pointers
from renderer.trace.spawn import spawn_origin

# A surface at the light must not hide it. Its t errs by some 32 u over the angle at which the ray meets it; 2^-36
# covers angles down to 2^-12.
SHORT_OF_LIGHT = 1.0 - 2.0**-36


class SeenLight(NamedTuple):
    """A light as seen from a surface point.

    faces        whether the light lies before the surface
    directional  whether the light is directional
    place        the position of a point light; the unit vector towards a directional one
    towards      the unit vector towards the light, of any length where ``faces`` is False
    arriving     the irradiance of a surface that faces the light
    """

    faces: bool
    directional: bool
    place: tuple
    towards: tuple
    arriving: tuple


@inlined
def see_light(lights, light, p, n, error):
    """The ``SeenLight`` from the surface point p with normal n; ``error`` bounds its distance from its plane."""
    row = light * LIGHT_COLUMNS
    place, arriving = three(lights, row + 1), three(lights, row + 4)
    if load(lights, row) == DIRECTIONAL:
        return SeenLight(dot(n, place) > 0.0, True, place, place, arriving)
    to_light = sub(place, p)
    # A light within rounding of the surface lies on it and does not light it; this also bounds 1 / r^2.
    # rule: light-in-front
    if dot(n, to_light) <= error:
        return SeenLight(False, False, place, to_light, arriving)
    # rule: inverse-square
    arriving = scale(arriving, 1.0 / dot(to_light, to_light))
    return SeenLight(True, False, place, normalized(to_light), arriving)


class ShadowRay(NamedTuple):
    """A shadow ray from a surface to a light that it faces; t counts in units of ``direction``."""

    origin: tuple
    direction: tuple
    t_max: float


@inlined
def aim(seen, p, n_g, error, offset):
    """The ``ShadowRay`` from the surface point p to a ``SeenLight``.

    A shadow ray to a point light ends just before the light, so that a surface at the light does not hide it. Its t
    counts in units of the distance.
    """
    if seen.directional:
        return ShadowRay(spawn_origin(p, error, n_g, seen.place, offset), seen.place, np.inf)
    o = spawn_origin(p, error, n_g, sub(seen.place, p), offset)
    # Mitsuba stops ten of its epsilons short.
    t_max = SHORT_OF_LIGHT if offset.uses_error_bound else 1.0 - 10.0 * offset.epsilon
    return ShadowRay(o, sub(seen.place, o), t_max)


@inlined
def aim_off(seen, p):
    """The ``ShadowRay`` from a point p that lies on no surface."""
    if seen.directional:
        return ShadowRay(p, seen.place, np.inf)
    return ShadowRay(p, sub(seen.place, p), SHORT_OF_LIGHT)


@kernel
def aim_from(arrays, surface, spot, n, light, offset):
    """For Python: a ``SeenLight`` from a ``Surface`` at a ``Spot`` with normal n, the shadow ray by an offset rule, and
    whether it starts off the surface.
    """
    scene = scene_pointers(arrays)
    seen = see_light(scene.lights, light, surface.p, n, surface.error)
    start = raised(scene, spot.face, spot.u, spot.v, surface.p, n, surface.n_g, surface.error)
    if start.is_off:
        return seen, aim_off(seen, start.point), True
    return seen, aim(seen, surface.p, surface.n_g, surface.error, offset), False
