"""The tree of rays that one camera ray spawns, as the Whitted kernel traces it: for looking at, not for speed.

Surfaces are met and left by the kernel's own functions, so the rays are the same to the bit, and their light adds up to
the pixel's.
"""

from collections import deque
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.errors import expect, is_count
from renderer.kernels.vec3 import add, dot, normalized, scale, times
from renderer.picture.pack import media_around
from renderer.picture.prepare import PreparedScene
from renderer.scene.camera import checked_vector
from renderer.shade.crossing import SPARE, Change, Together, change_of, place_at, surface_together_of, together_of
from renderer.shade.lights import aim_from
from renderer.shade.records import AMBIENT, KIND, LAMBERT, MATERIAL_COLUMNS, PHONG
from renderer.shade.shading import reflect
from renderer.shade.surface import MAX_MEDIA, Surface, phong_of, surface_of
from renderer.shade.whitted import passes_light_of, refract_from
from renderer.trace.batch import check_rays, make_starts
from renderer.trace.hits import Hits
from renderer.trace.query import closest_hits
from renderer.trace.singly import stack_size
from renderer.trace.spawn import BOUNDED, Place, spawn_origin, start_row
from renderer.trace.starts.cone import HOLDERS_WORDS
from renderer.trace.starts.level import Spot
from renderer.trace.starts.record import HEAD, ROW

Vector = tuple[float, float, float]
Floats = NDArray[np.float64]
Kind = Literal["camera", "reflected", "refracted", "shadow"]
# The start of a ray that starts on no surface.
_NO_START = np.empty(0)

# In glass there are up to 2^d rays of depth d: too many to look at, and to wait for after a click. This many are all of
# them to depth 8, the shadow rays not counted, and take about a tenth of a second.
MAX_RAYS = 511


@dataclass(frozen=True)
class Segment:
    """One ray, from where it starts to where it ends; vectors in scene units.

    kind      "camera", "reflected", "refracted" or "shadow"
    depth     bounces before it; a shadow ray has that of the ray whose surface it leaves
    parent    index in the path of the ray that it continues; -1 for the camera ray
    start     where it starts, off the surface that it leaves by a rounding error
    end       the surface that it met; or else the point light that it reached; or else a point beyond all faces
    hit       whether it met a surface; for a shadow ray, whether that hides the light
    face      the face that it met, -1 for none
    weight    the share (red, green, blue) of what comes along it that the pixel receives
    radiance  what it adds to the pixel: the surface's ambient light or the background; a shadow ray, the light that it
              let through
    """

    kind: Kind
    depth: int
    parent: int
    start: Vector
    end: Vector
    hit: bool
    face: int
    weight: Vector
    radiance: Vector


class _Ray(NamedTuple):
    """A ray that waits to be traced; media are rows of materials, outermost first. start is its row of
    ``starts.record``, empty where it starts on no surface.
    """

    kind: Kind
    depth: int
    parent: int
    origin: Vector
    direction: Vector
    weight: Vector
    media: tuple[int, ...]
    start: Floats


class _Met(NamedTuple):
    """What a ray met: the faces that are crossed together, the place where they are seen, the surface there, the normal
    that faces the ray, and the material's row with its columns; and where light passes, the change of media and those
    beyond.
    """

    together: Together
    place: Place
    surface: Surface
    n: Vector
    inside: bool
    row: int
    material: NDArray[np.float64]
    change: Change
    beyond: tuple[int, ...]


class _Aim(NamedTuple):
    """A shadow ray, its end if nothing hides the light, and the radiance that it then adds to the pixel."""

    origin: Vector
    direction: Vector
    t_max: float
    end: Vector
    radiance: Vector
    start: Floats


def ray_path(
    prepared: PreparedScene,
    origin: ArrayLike,
    direction: ArrayLike,
    max_depth: int,
    *,
    min_weight: float = 0.0,
    shadows: bool = True,
) -> tuple[Segment, ...]:
    """The camera ray from ``origin`` in ``direction`` (3,) and all rays that it spawns: by depth, each followed by the
    shadow rays that leave its end.

    ``max_depth``, ``min_weight`` and ``shadows`` as in ``RenderSettings``; spawned rays leave by the bounded offset. At
    most MAX_RAYS rays, and for each as many shadow rays as ``prepared.arrays`` has lights; of more rays the deepest are
    left out. Otherwise the segments are as many as the pixel's ``Image.rays``, and their ``radiance`` sums to its
    colour. Without ``shadows`` the radiance of a ray that met a surface includes the direct light there. Raises
    ``ValueError`` naming the argument.
    """
    expect(is_count(max_depth), "max_depth", "an integer >= 0", repr(max_depth))
    o, d = checked_vector("origin", origin), checked_vector("direction", direction)
    expect(any(d), "direction", "a vector of non-zero length", repr(direction))
    bounces = max_depth if prepared.needs.reflection or prepared.needs.refraction else 0
    waiting = deque([_Ray("camera", 0, -1, o, normalized(d), (1.0, 1.0, 1.0), _media_at(prepared, o), _NO_START)])
    path: list[Segment] = []
    for _ in range(MAX_RAYS):
        if not waiting:
            break
        ray, own = waiting.popleft(), len(path)
        met = _meet(prepared, ray)
        path += _hit_segments(prepared, ray, met, own, shadows) if met else [_miss_segment(prepared, ray)]
        if met and ray.depth < bounces:
            waiting += [r for r in _bounce(prepared, ray, met, own) if _goes_on(r.weight, min_weight)]
    return tuple(path)


def _media_at(prepared: PreparedScene, eye: Vector) -> tuple[int, ...]:
    """The media around the eye, as ``PreparedScene.picture`` has them for a camera there."""
    if not prepared.needs.refraction:
        return ()
    return tuple(media_around(prepared.scene, prepared.scene.camera.model_copy(update={"eye": eye})).tolist())


def _goes_on(weight: Vector, min_weight: float) -> bool:
    return max(weight) > 0.0 and max(weight) >= min_weight


def _meet(prepared: PreparedScene, ray: _Ray) -> _Met | None:
    """The nearest surface that the ray meets."""
    hits = _closest(prepared, ray.origin, ray.direction, np.inf, ray.start)
    if not hits.hit[0]:
        return None
    spot, d, arrays = Spot(int(hits.face[0]), float(hits.u[0]), float(hits.v[0])), ray.direction, prepared.arrays
    stack, memory = np.empty(stack_size(prepared.tree.depth), np.int64), np.empty(HOLDERS_WORDS, np.int64)
    together = together_of(prepared.tree.words, arrays, spot, d, stack, memory)
    surface = Surface(*surface_together_of(arrays, together, d))
    inside, row = dot(d, surface.n_s) > 0.0, int(surface.material)
    media, beyond = np.array(ray.media, np.int64), np.zeros(_media_limit(prepared) + SPARE, np.int64)
    change = Change(1.0, 1.0, 0)
    if passes_light_of(arrays, row):
        change = change_of(arrays, together, row, inside, media, beyond, memory)
    n, columns = scale(surface.n_s, -1.0) if inside else surface.n_s, arrays.materials[row // MATERIAL_COLUMNS]
    place = place_at(Spot(*together.near), surface, d)
    return _Met(together, place, surface, n, inside, row, columns, change, tuple(beyond[: change.left].tolist()))


def _media_limit(prepared: PreparedScene) -> int:
    """The most media that a ray remembers."""
    return MAX_MEDIA if prepared.needs.refraction else 0


def _closest(prepared: PreparedScene, origin: Vector, direction: Vector, t_max: float, start: Floats) -> Hits:
    """The closest hit of one ray as a picture traces it."""
    rays, _ = check_rays([origin], [direction], 0.0, [t_max])
    if len(start):
        starts = make_starts(1, prepared.mesh)
        starts[HEAD:].view(np.float64)[:] = start
        rays = rays._replace(starts=starts)
    return closest_hits(prepared.tree, rays, prepared.mesh, 1)


def _start(place: Place, n_g: Vector, direction: Vector, came: Vector) -> Floats:
    """The row of the start of a ray that leaves a surface of normal n_g, where one in direction ``came`` ended."""
    row = np.empty(ROW)
    start_row(row, place, n_g, direction, came)
    return row


def _color(columns: NDArray[np.float64], first: int) -> Vector:
    x, y, z = columns[first : first + 3].tolist()
    return x, y, z


def _miss_segment(prepared: PreparedScene, ray: _Ray) -> Segment:
    """The segment of a ray that met nothing."""
    radiance = times(ray.weight, _color(prepared.arrays.colors[1], 0))
    end = _beyond(prepared, ray.origin, ray.direction)
    return Segment(ray.kind, ray.depth, ray.parent, ray.origin, end, False, -1, ray.weight, radiance)


def _beyond(prepared: PreparedScene, origin: Vector, direction: Vector) -> Vector:
    """The point in unit ``direction`` at which the sphere around all faces is left behind for certain."""
    lower, upper = prepared.mesh.bounds if len(prepared.mesh.faces) else (np.zeros(3), np.ones(3))
    reach = np.linalg.norm(origin - (lower + upper) / 2.0) + np.linalg.norm(upper - lower) / 2.0
    return add(origin, scale(direction, float(reach)))


def _hit_segments(prepared: PreparedScene, ray: _Ray, met: _Met, own: int, shadows: bool) -> list[Segment]:
    """The segment of a ray that met a surface, in place ``own`` of the path, and those of its shadow rays."""
    radiance = times(ray.weight, times(_color(met.material, AMBIENT), _color(prepared.arrays.colors[0], 0)))
    aims, shadow_rays = _aim(prepared, ray, met), []
    for aim in aims:
        if shadows:
            shadow_rays.append(_shadow(prepared, ray, own, aim))
        else:
            radiance = add(radiance, aim.radiance)
    p = met.surface.p
    return [
        Segment(
            ray.kind, ray.depth, ray.parent, ray.origin, p, True, int(met.together.seen.face), ray.weight, radiance
        ),
        *shadow_rays,
    ]


def _aim(prepared: PreparedScene, ray: _Ray, met: _Met) -> list[_Aim]:
    """The shadow rays to the lights that the surface faces."""
    if met.material[KIND] not in (PHONG, LAMBERT):
        return []
    aims = []
    for light in range(len(prepared.arrays.lights)):
        seen, (o, way, t_max) = aim_from(prepared.arrays, met.surface, met.n, light)
        if not seen.faces:
            continue
        end = _beyond(prepared, o, way) if seen.directional else seen.place
        share = phong_of(prepared.arrays, met.row, met.n, ray.direction, seen.towards)
        radiance = times(ray.weight, times(share, seen.arriving))
        aims.append(_Aim(o, way, float(t_max), end, radiance, _start(met.place, met.surface.n_g, way, ray.direction)))
    return aims


def _shadow(prepared: PreparedScene, ray: _Ray, own: int, aim: _Aim) -> Segment:
    """The segment of a shadow ray; it ends at the nearest surface that hides the light."""
    hits = _closest(prepared, aim.origin, aim.direction, aim.t_max, aim.start)
    hidden = bool(hits.hit[0])
    end = _color(hits.points[0], 0) if hidden else aim.end
    radiance = (0.0, 0.0, 0.0) if hidden else aim.radiance
    return Segment("shadow", ray.depth, own, aim.origin, end, hidden, int(hits.face[0]), ray.weight, radiance)


def _bounce(prepared: PreparedScene, ray: _Ray, met: _Met, own: int) -> list[_Ray]:
    """The rays that leave the surface: the reflected one, then the refracted one where light passes."""
    change, m, d = met.change, met.row, ray.direction
    through, passes, k_r, k_t = refract_from(prepared.arrays, m, d, met.n, change.n1, change.n2)
    mirrored, weight = reflect(d, met.n), times(ray.weight, k_r)
    children = [_child("reflected", ray, own, met.surface, met.place, mirrored, weight, ray.media)]
    if passes_light_of(prepared.arrays, m) and passes:
        last, surface, place = Spot(*met.together.far), met.surface, met.place
        if last.face != int(met.place.face):
            surface = surface_of(prepared.arrays, *last, d)
            place = place_at(last, surface, d)
        children.append(_child("refracted", ray, own, surface, place, through, times(ray.weight, k_t), met.beyond))
    return children


def _child(
    kind: Kind,
    ray: _Ray,
    own: int,
    surface: Surface,
    place: Place,
    direction: Vector,
    weight: Vector,
    media: tuple[int, ...],
) -> _Ray:
    w, (p, error, n_g, *_) = normalized(direction), surface
    start = _start(place, n_g, w, ray.direction)
    return _Ray(kind, ray.depth + 1, own, spawn_origin(p, error, n_g, w, BOUNDED), w, weight, media, start)
