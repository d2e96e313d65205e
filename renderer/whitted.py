"""The radiance of one camera ray: Whitted's recursion as a loop over an explicit stack of weighted rays.

I(x) = k_a I_a + sum over lights V [k_d (N.L)+ + k_s (R.V)+^n] I_light + k_r I(reflected) + k_t I(refracted)
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.intersect import Ray
from renderer.jit import inlined, kernel
from renderer.layout import Tree
from renderer.light import DIRECTIONAL, LIGHT_COLUMNS
from renderer.material import (
    AMBIENT,
    DIELECTRIC,
    DIFFUSE,
    IOR,
    KIND,
    PHONG,
    REFLECTANCE,
    SHININESS,
    SPECULAR,
    TRANSMITTANCE,
)
from renderer.shading import fresnel, offset_distance, reflect, refract, spawn_origin, specular
from renderer.simd import get, keep, pointer, put
from renderer.traverse import NO_FACE, any_hit, any_hit_brute, closest_hit, closest_hit_brute, view
from renderer.vec3 import (
    add,
    barycentric,
    cross,
    dot,
    normalized,
    row3,
    scale,
    sub,
    three,
    times,
)

# One waiting ray: origin, direction, weight, depth, and the media it is in: how many, then their materials' rows,
# outermost first. A ninth medium is not remembered; leaving it then leads back into the eighth.
MAX_MEDIA = 8
_BRIGHTEST = np.finfo(np.float32).max
_DEPTH, _MEDIA = 9, 10
_RAY_WORDS = _MEDIA + 1 + MAX_MEDIA


class World(NamedTuple):
    """What the kernel reads of a scene; rows of materials and lights as in ``material`` and ``light``.

    vertices (V, 3), normals (V, 3) or (0, 3), faces (F, 3) int32, material (F,) int32, smooth (F,) bool,
    materials (M, MATERIAL_COLUMNS), lights (L, LIGHT_COLUMNS), colors (2, 3): ambient and background,
    media (m,) int64, m <= MAX_MEDIA: where in ``materials`` the rows begin of those that the eye is in, outermost
    first; ``material`` says the same of each face.
    """

    vertices: NDArray[np.float64]
    normals: NDArray[np.float64]
    faces: NDArray[np.int32]
    material: NDArray[np.int32]
    smooth: NDArray[np.bool_]
    materials: NDArray[np.float64]
    lights: NDArray[np.float64]
    colors: NDArray[np.float64]
    media: NDArray[np.int64]


class Sight(NamedTuple):
    """A ``World`` as the kernels read it: pointers, and the numbers of lights and of media around the eye."""

    vertices: Any
    normals: Any
    faces: Any
    material: Any
    smooth: Any
    materials: Any
    lights: Any
    colors: Any
    media: Any
    light_count: int
    media_count: int


@inlined
def look_at(world):
    """Pointers into a world, which the caller must keep alive."""
    return Sight(
        pointer(world.vertices),
        pointer(world.normals),
        pointer(world.faces),
        pointer(world.material),
        pointer(world.smooth),
        pointer(world.materials),
        pointer(world.lights),
        pointer(world.colors),
        pointer(world.media),
        len(world.lights),
        len(world.media),
    )


class Accelerator(NamedTuple):
    """The tree with its depth; depth 0 means that every block is tested."""

    tree: Tree
    depth: int


class Settings(NamedTuple):
    """Bounces, the weight below which a ray ends, and the offset rule of ``shading.spawn_origin``."""

    max_depth: int
    min_weight: float
    offset: float


class Scratch(NamedTuple):
    """Memory of one thread, as pointers: nodes that wait in a traversal, rays that wait in a recursion, and media on
    both sides of a surface.
    """

    nodes: Any
    rays: Any
    media: Any
    beyond: Any


class Surface(NamedTuple):
    """Where a ray met the scene: point, its distance bound, normals n_g and n_s, where its material's row begins."""

    p: tuple
    error: float
    n_g: tuple
    n_s: tuple
    material: int


@kernel
def _closest(accelerator, o, d, stack):
    ray = Ray(o[0], o[1], o[2], d[0], d[1], d[2], 0.0)
    if accelerator.depth == 0:
        return closest_hit_brute(accelerator.tree, ray, np.inf, stack)
    return closest_hit(accelerator.tree, ray, np.inf, stack)


@kernel
def _occluded(accelerator, o, d, t_max, stack):
    ray = Ray(o[0], o[1], o[2], d[0], d[1], d[2], 0.0)
    if accelerator.depth == 0:
        return any_hit_brute(accelerator.tree, ray, t_max, stack)
    return any_hit(accelerator.tree, ray, t_max, stack)


@kernel
def _surface(world, face, u, v):
    a, b, c = row3(world.faces, np.int64(face))
    p0, p1, p2 = row3(world.vertices, a), row3(world.vertices, b), row3(world.vertices, c)
    n_g = normalized(cross(sub(p1, p0), sub(p2, p0)))
    p = barycentric(p0, p1, p2, u, v)
    n_s = n_g
    if get(world.smooth, face):
        n_s = normalized(barycentric(row3(world.normals, a), row3(world.normals, b), row3(world.normals, c), u, v))
    error = offset_distance(p, p0, p1, p2, u, v, n_g)
    return Surface(p, error, n_g, n_s, get(world.material, face))


@kernel
def _visible_light(accelerator, world, surface, n, light, offset, stack):
    """Unit direction to a light, the light that arrives (irradiance facing it), and whether any does.

    A shadow ray to a point light ends at the light: t counts in units of the distance, and a surface at the light
    itself does not hide it.
    """
    row = light * LIGHT_COLUMNS
    towards, arriving = three(world.lights, row + 1), three(world.lights, row + 4)
    nothing = (0.0, 0.0, 0.0)
    if get(world.lights, row) == DIRECTIONAL:
        if dot(n, towards) <= 0.0:
            return towards, nothing, False, 0
        o = spawn_origin(surface.p, surface.error, surface.n_g, towards, offset)
        return towards, arriving, not _occluded(accelerator, o, towards, np.inf, stack), 1
    to_light = sub(towards, surface.p)
    squared = dot(to_light, to_light)
    # A light within rounding of the surface lies on it and does not light it; this also bounds 1 / r^2.
    if dot(n, to_light) <= surface.error:
        return to_light, nothing, False, 0
    o = spawn_origin(surface.p, surface.error, surface.n_g, to_light, offset)
    shadow = sub(towards, o)
    # A surface at the light must not hide it. Its t errs by some 32 u over the angle at which the ray meets it; 2^-36
    # covers angles down to 2^-12. Mitsuba stops ten of its epsilons short.
    t_max = 1.0 - 10.0 * offset if offset >= 0.0 else 1.0 - 2.0**-36
    seen = not _occluded(accelerator, o, shadow, t_max, stack)
    return normalized(to_light), scale(arriving, 1.0 / squared), seen, 1


@kernel
def _local(accelerator, world, surface, d, n, offset, stack):
    """Ambient, diffuse and specular light of a Phong surface, and the shadow rays that it took."""
    m, materials = surface.material, world.materials
    total = times(three(materials, m + AMBIENT), row3(world.colors, 0))
    diffuse, glossy = three(materials, m + DIFFUSE), three(materials, m + SPECULAR)
    shines = max(glossy[0], max(glossy[1], glossy[2])) > 0.0
    rays = 0
    for light in range(world.light_count):
        towards, arriving, seen, traced = _visible_light(accelerator, world, surface, n, light, offset, stack)
        rays += traced
        if not seen:
            continue
        factor = scale(diffuse, dot(n, towards))
        if shines:
            factor = add(factor, scale(glossy, specular(d, n, towards, get(materials, m + SHININESS))))
        total = add(total, times(factor, arriving))
    return total, rays


@kernel
def _push(rays, top, o, d, weight, depth, media, count):
    """Let a ray wait above ``top`` in the first ``count`` of ``media``. Returns the new top."""
    at = top * _RAY_WORDS
    for k in range(3):
        put(rays, at + k, o[k])
        put(rays, at + 3 + k, d[k])
        put(rays, at + 6 + k, weight[k])
    put(rays, at + _DEPTH, float(depth))
    put(rays, at + _MEDIA, float(count))
    for k in range(count):
        put(rays, at + _MEDIA + 1 + k, float(get(media, k)))
    return top + 1


@kernel
def _goes_on(weight, min_weight):
    largest = max(weight[0], max(weight[1], weight[2]))
    return largest > 0.0 and largest >= min_weight


@kernel
def _enter_or_leave(media, count, material, inside):
    """Cross the surface of ``material``: change ``media`` in place, return how many there are then.

    Leaving takes out the innermost entry of that material, wherever it stands, so overlapping objects are left one
    by one.
    """
    if not inside:
        if count < MAX_MEDIA:
            put(media, count, np.int64(material))
            count += 1
        return count
    for k in range(count - 1, -1, -1):
        if get(media, k) == material:
            for j in range(k, count - 1):
                put(media, j, get(media, j + 1))
            return count - 1
    return count


@kernel
def _innermost_ior(world, media, count):
    return get(world.materials, get(media, count - 1) + IOR) if count > 0 else 1.0


@kernel
def _spawn(world, surface, ray, settings, scratch, top):
    """Push the reflected and the refracted ray of a hit. Returns the new top of the stack.

    ``scratch.media[:count]`` are the media that the ray came through.
    """
    d, n, inside, weight, depth, count = ray
    m, materials, media = surface.material, world.materials, scratch.media
    k_r, k_t = three(materials, m + REFLECTANCE), three(materials, m + TRANSMITTANCE)
    if max(k_t[0], max(k_t[1], k_t[2])) > 0.0 or get(materials, m + KIND) == DIELECTRIC:
        beyond = scratch.beyond
        for k in range(count):
            put(beyond, k, get(media, k))
        left = _enter_or_leave(beyond, count, m, inside)
        # From inside, n1 is this material even where no entry was seen: an open mesh.
        n1 = get(materials, m + IOR) if inside else _innermost_ior(world, media, count)
        n2 = _innermost_ior(world, beyond, left) if inside else get(materials, m + IOR)
        cos_t, through = refract(d, n, n1, n2)
        if get(materials, m + KIND) == DIELECTRIC:
            f = 1.0 if cos_t < 0.0 else fresnel(-dot(d, n), cos_t, n1, n2)
            k_r, k_t = scale(k_r, f), scale(k_t, 1.0 - f)
        passed = times(weight, k_t)
        if cos_t >= 0.0 and _goes_on(passed, settings.min_weight):
            through = normalized(through)
            o = spawn_origin(surface.p, surface.error, surface.n_g, through, settings.offset)
            top = _push(scratch.rays, top, o, through, passed, depth, beyond, left)
    returned = times(weight, k_r)
    if _goes_on(returned, settings.min_weight):
        mirrored = normalized(reflect(d, n))
        o = spawn_origin(surface.p, surface.error, surface.n_g, mirrored, settings.offset)
        top = _push(scratch.rays, top, o, mirrored, returned, depth, media, count)
    return top


@kernel
def radiance(accelerator, world, settings, o, d, scratch):
    """Linear radiance (r, g, b) along one unit ray, what its first hit was, and the rays traced.

    Returns (color, t, face, n_s, rays) with t = inf and face = NO_FACE where the ray leaves the scene. The stack
    never holds more than ``max_depth + 2`` rays: each one popped leaves at most two of the next depth.
    """
    color, first_t, first_face, first_n, traced = (0.0, 0.0, 0.0), np.inf, NO_FACE, (0.0, 0.0, 0.0), 0
    rays, media = scratch.rays, scratch.media
    top = _push(rays, 0, o, d, (1.0, 1.0, 1.0), 0, world.media, world.media_count)
    while top > 0:
        top -= 1
        at = top * _RAY_WORDS
        o, d, weight = three(rays, at), three(rays, at + 3), three(rays, at + 6)
        depth, count = int(get(rays, at + _DEPTH)), int(get(rays, at + _MEDIA))
        t, face, u, v = _closest(accelerator, o, d, scratch.nodes)
        traced += 1
        if face == NO_FACE:
            color = add(color, times(weight, row3(world.colors, 1)))
            continue
        surface = _surface(world, face, u, v)
        if traced == 1:
            first_t, first_face, first_n = t, face, surface.n_s
        # The shading normal faces the eye; a surface without light from behind has two sides.
        inside = dot(d, surface.n_s) > 0.0
        n = scale(surface.n_s, -1.0) if inside else surface.n_s
        if get(world.materials, surface.material + KIND) == PHONG:
            local, shadow_rays = _local(accelerator, world, surface, d, n, settings.offset, scratch.nodes)
            color = add(color, times(weight, local))
            traced += shadow_rays
        if depth < settings.max_depth:
            # The children may take this ray's place on the stack, so its media move out first.
            for k in range(count):
                put(media, k, int(get(rays, at + _MEDIA + 1 + k)))
            top = _spawn(world, surface, (d, n, inside, weight, depth + 1, count), settings, scratch, top)
    return color, first_t, first_face, first_n, traced


class Film(NamedTuple):
    """What a tile writes: radiance and normal (h, w, 3), depth (h, w), face and rays (h, w)."""

    radiance: NDArray[np.float32]
    depth: NDArray[np.float64]
    normal: NDArray[np.float32]
    face: NDArray[np.int32]
    rays: NDArray[np.int32]


@kernel
def render_tile(accelerator, world, settings, camera, samples, film, tile):
    """Fill the pixels of ``tile`` = (x0, y0, x1, y1); ``camera`` are the rows of the camera's affine map.

    Depth, face and normal come from the middle sample (the pixel's centre for one sample), radiance from the mean.
    """
    x0, y0, x1, y1 = tile
    # Each ray leaves at most two, so one waits a level and one more.
    nodes, rays = np.empty(7 * accelerator.depth + 8, np.int64), np.empty((settings.max_depth + 2) * _RAY_WORDS)
    media = np.empty(2 * MAX_MEDIA, np.int64)
    scratch = Scratch(pointer(nodes), pointer(rays), pointer(media), pointer(media[MAX_MEDIA:]))
    seen, target = look_at(world), Accelerator(view(accelerator.tree), accelerator.depth)
    to_ray = pointer(camera)
    middle = len(samples) // 2 if len(samples) % 2 == 1 else (len(samples) + int(np.sqrt(len(samples)))) // 2
    for y in range(y0, y1):
        for x in range(x0, x1):
            total, count = (0.0, 0.0, 0.0), 0
            for s in range(len(samples)):
                px, py = x + samples[s, 0], y + samples[s, 1]
                o = add(row3(to_ray, 0), add(scale(row3(to_ray, 1), px), scale(row3(to_ray, 2), py)))
                d = add(row3(to_ray, 3), add(scale(row3(to_ray, 4), px), scale(row3(to_ray, 5), py)))
                color, t, face, n, traced = radiance(target, seen, settings, o, normalized(d), scratch)
                total = add(total, color)
                count += traced
                if s == middle:
                    film.depth[y, x], film.face[y, x] = t, -1 if face == NO_FACE else face
                    for k in range(3):
                        film.normal[y, x, k] = n[k]
            # The brightest float32 stands for anything brighter: a light within 1e-15 of a surface.
            for k in range(3):
                film.radiance[y, x, k] = min(total[k] / len(samples), _BRIGHTEST)
            film.rays[y, x] = count
    keep(nodes)
    keep(rays)
    keep(media)
