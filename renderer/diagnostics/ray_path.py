"""The tree of rays that one camera ray spawns, as the Whitted kernel traces it: for inspection, not for speed.

Each step uses the kernel's own functions (``ray_step``), so the rays have the same bits, and their light adds up to the
pixel's.
"""

from collections import deque
from dataclasses import dataclass
from typing import Literal

from renderer.arguments.counts import count_argument
from renderer.arguments.types import ArrayLike
from renderer.diagnostics.ray_step import Aim, Ray, Steps, SurfaceHit, Vector, color_at, steps_of
from renderer.errors import expect
from renderer.numerics.vec3 import add
from renderer.picture.prepare import PreparedScene
from renderer.scene.vectors import checked_vector
from renderer.shade.direct import MOST_PANES

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

    kind: Literal["camera", "reflected", "refracted", "shadow"]
    depth: int
    parent: int
    start: Vector
    end: Vector
    hit: bool
    face: int
    weight: Vector
    radiance: Vector


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
    count_argument("max_depth", max_depth)
    o, d = checked_vector("origin", origin), checked_vector("direction", direction)
    expect(any(d), "direction", "a vector of non-zero length", repr(direction))
    bounces = max_depth if prepared.needs.reflection or prepared.needs.refraction else 0
    steps = steps_of(prepared)
    waiting = deque([(steps.camera_ray(o, d), -1)])
    path: list[Segment] = []
    for _ in range(MAX_RAYS):
        if not waiting:
            break
        (ray, parent), own = waiting.popleft(), len(path)
        met = steps.meet(ray)
        path += _hit_segments(steps, ray, met, parent, own, shadows) if met else [_miss_segment(steps, ray, parent)]
        if met and ray.depth < bounces:
            waiting += [(child, own) for child in steps.bounce(ray, met) if goes_on(child.weight, min_weight)]
    return tuple(path)


def goes_on(weight: Vector, min_weight: float) -> bool:
    """Whether a ray of this weight is traced further."""
    return max(weight) > 0.0 and max(weight) >= min_weight


def _miss_segment(steps: Steps, ray: Ray, parent: int) -> Segment:
    """The segment of a ray that misses."""
    end = steps.beyond(ray.origin, ray.direction)
    return Segment(ray.kind, ray.depth, parent, ray.origin, end, False, -1, ray.weight, steps.background(ray))


def _hit_segments(steps: Steps, ray: Ray, met: SurfaceHit, parent: int, own: int, shadows: bool) -> list[Segment]:
    """The segment of a ray that hits a surface, in place ``own`` of the path, and those of its shadow rays."""
    radiance, shadow_rays = steps.ambient(ray, met), []
    for aim in steps.aims(ray, met):
        if shadows:
            shadow_rays += _shadows(steps, ray, own, aim)
        else:
            radiance = add(radiance, aim.radiance)
    p, face = met.surface.p, int(met.together.seen.face)
    return [Segment(ray.kind, ray.depth, parent, ray.origin, p, True, face, ray.weight, radiance), *shadow_rays]


def _shadows(steps: Steps, ray: Ray, own: int, aim: Aim) -> list[Segment]:
    """The segments of a shadow ray: one that ends at the nearest surface that hides the light, and one before it for
    each surface that lets the light through.
    """
    found: list[Segment] = []
    while True:
        hits = steps.closest(aim.origin, aim.direction, aim.t_max, aim.start)
        hit, face = bool(hits.hit[0]), int(hits.face[0])
        onwards = steps.pass_through(aim, hits) if hit and len(found) < MOST_PANES else None
        end = color_at(hits.points[0], 0) if hit else aim.end
        radiance = (0.0, 0.0, 0.0) if hit else aim.radiance
        found.append(Segment("shadow", ray.depth, own, aim.origin, end, hit, face, ray.weight, radiance))
        if onwards is None:
            return found
        aim = onwards
