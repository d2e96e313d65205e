"""One step of Whitted's recursion by the kernel's own functions: the hit of a ray, and the rays spawned there.

The rays have the same bits as in a picture under the same rules.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.materials.columns import AMBIENT, KIND, LAMBERT, MATERIAL_COLUMNS, TRANSMITTANCE
from renderer.numerics.vec3 import add, dot, normalized, scale, sub, times
from renderer.picture.pack import media_around
from renderer.picture.prepare import MediaRule, PreparedScene, arrays_for, media_limit
from renderer.results.hits import Hits
from renderer.shade.crossing import (
    SPARE,
    Change,
    Together,
    change_of,
    place_at,
    place_beyond,
    surface_together_of,
    together_of,
)
from renderer.shade.direct import MOST_HOLES
from renderer.shade.lights import aim_from
from renderer.shade.looks import OWN_COLUMNS
from renderer.shade.shading import reflect
from renderer.shade.surface import SceneArrays, Surface, is_there_of, missed_of, own_look_of, reflected_of, surface_of
from renderer.shade.whitted import passes_light_of, refract_from
from renderer.trace.batch import check_rays, make_starts
from renderer.trace.closest import closest_hits
from renderer.trace.spawn import BOUNDED, OffsetRule, Place, spawn_origin, start_row
from renderer.trace.starts.cone import HOLDERS_WORDS
from renderer.trace.starts.level import Spot
from renderer.trace.starts.record import HEAD, ROW
from renderer.trace.walk import stack_size

Vector = tuple[float, float, float]
Floats = NDArray[np.float64]
Kind = Literal["camera", "reflected", "refracted"]
# The start of a ray that starts on no surface.
_NO_START = np.empty(0)


class Ray(NamedTuple):
    """A ray to be traced, in a unit direction; the pixel receives ``weight`` of what comes along it.

    depth  bounces before it
    media  rows of the materials that it is in, outermost first
    width  of what it sees where it starts, for textures
    start  its row of ``starts.record``, empty where it starts on no surface
    """

    kind: Kind
    depth: int
    origin: Vector
    direction: Vector
    weight: Vector
    media: tuple[int, ...]
    width: float
    start: Floats


class Seen(NamedTuple):
    """A material as a ray sees it at a point: its row in these arrays, the shading normal, and what it emits."""

    arrays: SceneArrays
    row: int
    n_s: Vector
    emission: Vector

    @property
    def columns(self) -> Floats:
        """The row's columns, (MATERIAL_COLUMNS,)."""
        return self.arrays.materials[self.row // MATERIAL_COLUMNS]


class SurfaceHit(NamedTuple):
    """The hit of a ray: t, the faces crossed together, the place where they are seen, the surface there, the normal
    that faces the ray, and the ``Seen`` material; for transmitted light also the change of media and the media beyond.
    """

    t: float
    together: Together
    place: Place
    surface: Surface
    n: Vector
    inside: bool
    seen: Seen
    change: Change
    beyond: tuple[int, ...]


class Aim(NamedTuple):
    """A shadow ray to a light, its end if nothing hides the light, and the radiance that it then adds to the pixel."""

    light: int
    origin: Vector
    direction: Vector
    t_max: float
    end: Vector
    radiance: Vector
    start: Floats


@dataclass(frozen=True)
class Steps:
    """A prepared scene under rules for offsets and media; ``steps_of`` creates it."""

    prepared: PreparedScene
    arrays: SceneArrays
    offset: OffsetRule
    media: int

    def camera_ray(self, origin: Vector, direction: Vector) -> Ray:
        """The ray from the eye, in the media there."""
        media, width = self._media_at(origin), self.arrays.pixel
        return Ray("camera", 0, origin, normalized(direction), (1.0, 1.0, 1.0), media, width, _NO_START)

    def meet(self, ray: Ray) -> SurfaceHit | None:
        """The nearest surface that the ray hits."""
        origin, start, t = ray.origin, ray.start, 0.0
        for _ in range(MOST_HOLES + 1):
            hits = self.closest(origin, ray.direction, np.inf, start)
            if not hits.hit[0]:
                return None
            spot, t = _spot_of(hits), t + float(hits.t[0])
            if self._is_there(spot):
                break
            origin, _, start = self._behind(spot, ray.direction)
        return self.meet_at(ray, spot, t)

    def meet_at(self, ray: Ray, spot: Spot, t: float) -> SurfaceHit:
        """The ``SurfaceHit`` of the ray at t, at barycentrics of a face."""
        d, arrays, tree = ray.direction, self.arrays, self.prepared.tree
        stack, memory = np.empty(stack_size(tree.depth), np.int64), np.empty(HOLDERS_WORDS, np.int64)
        media, beyond = np.array(ray.media, np.int64), np.zeros(self.media + SPARE, np.int64)
        together = together_of(tree.descriptor, arrays, spot, d, media, self.media, stack, memory)
        surface = Surface(*surface_together_of(arrays, together, d))
        seen = self._seen(together.seen, surface, d, ray.width + arrays.spread * t)
        inside, row, change = dot(d, seen.n_s) > 0.0, int(surface.material), Change(1.0, 1.0, 0)
        if passes_light_of(seen.arrays, seen.row):
            change = change_of(arrays, together, row, inside, media, beyond, memory)
        n = scale(seen.n_s, -1.0) if inside else seen.n_s
        place = place_at(Spot(*together.near), surface, d)
        left = tuple(beyond[: change.left].tolist())
        return SurfaceHit(t, together, place, surface, n, inside, seen, change, left)

    def background(self, ray: Ray) -> Vector:
        """The contribution to the pixel of a ray that misses."""
        return times(ray.weight, missed_of(self.arrays, ray.direction))

    def ambient(self, ray: Ray, met: SurfaceHit) -> Vector:
        """The contribution to the pixel of the ambient light on a surface, and of what it emits."""
        ambient = times(color_at(met.seen.columns, AMBIENT), color_at(self.arrays.colors[0], 0))
        return times(ray.weight, add(ambient, met.seen.emission))

    def aims(self, ray: Ray, met: SurfaceHit) -> list[Aim]:
        """The shadow rays to the lights that the surface faces."""
        if met.seen.columns[KIND] < LAMBERT:
            return []
        aims = []
        for light in range(len(self.arrays.lights)):
            spot = Spot(int(met.place.face), met.place.u, met.place.v)
            lamp, (o, way, t_max), is_off = aim_from(self.arrays, met.surface, spot, met.n, light, self.offset)
            if not lamp.faces:
                continue
            end = self.beyond(o, way) if lamp.directional else lamp.place
            share = reflected_of(met.seen.arrays, met.seen.row, met.n, ray.direction, lamp.towards)
            radiance = times(ray.weight, times(share, lamp.arriving))
            start = _NO_START if is_off else self._start(met.place, met.surface.n_g, way, ray.direction)
            aims.append(Aim(light, o, way, float(t_max), end, radiance, start))
        return aims

    def pass_through(self, aim: Aim, hits: Hits) -> Aim | None:
        """The rest of a shadow ray beyond the surface that it hit, if light passes there; None if it does not."""
        spot, d, through = _spot_of(hits), aim.direction, (1.0, 1.0, 1.0)
        if self._is_there(spot):
            met = Surface(*surface_of(self.arrays, *spot, d))
            through = color_at(self._seen(spot, met, d, 0.0).columns, TRANSMITTANCE)
            if not self.arrays.clear or not max(through) > 0.0:
                return None
        end = None if aim.t_max == np.inf else add(aim.origin, d)
        origin, onwards, start = self._behind(spot, d, end)
        return aim._replace(origin=origin, direction=onwards, radiance=times(aim.radiance, through), start=start)

    def bounce(self, ray: Ray, met: SurfaceHit) -> list[Ray]:
        """The rays spawned at the surface: the reflected one, then the refracted one if light is transmitted."""
        change, seen, d = met.change, met.seen, ray.direction
        through, passes, k_r, k_t = refract_from(seen.arrays, seen.row, d, met.n, change.n1, change.n2)
        mirrored, weight = reflect(d, met.n), times(ray.weight, k_r)
        ray = ray._replace(width=ray.width + self.arrays.spread * met.t)
        children = [self._child("reflected", ray, met.surface, met.place, mirrored, weight, ray.media)]
        if passes_light_of(seen.arrays, seen.row) and passes:
            last, surface, place = Spot(*met.together.far), met.surface, met.place
            if last.face != int(met.place.face):
                surface = surface_of(self.arrays, *last, d)
                place = place_beyond(last, surface, d)
            children.append(self._child("refracted", ray, surface, place, through, times(ray.weight, k_t), met.beyond))
        return children

    def closest(self, origin: Vector, direction: Vector, t_max: float, start: Floats) -> Hits:
        """The closest hit of one ray, traced as in a picture."""
        rays, _ = check_rays([origin], [direction], 0.0, [t_max])
        if len(start):
            starts = make_starts(1, self.prepared.mesh)
            starts[HEAD:].view(np.float64)[:] = start
            rays = rays._replace(starts=starts)
        return closest_hits(self.prepared.tree, self.prepared.mesh, 1, *rays)

    def beyond(self, origin: Vector, direction: Vector) -> Vector:
        """The point in unit ``direction`` that is certainly beyond the sphere around all faces."""
        mesh = self.prepared.mesh
        lower, upper = mesh.bounds if len(mesh.faces) else (np.zeros(3), np.ones(3))
        reach = np.linalg.norm(origin - (lower + upper) / 2.0) + np.linalg.norm(upper - lower) / 2.0
        return add(origin, scale(direction, float(reach)))

    def _media_at(self, eye: Vector) -> tuple[int, ...]:
        """The media around the eye, as in pictures by a camera there."""
        if not self.media:
            return ()
        scene = self.prepared.scene
        return tuple(media_around(scene, scene.camera.model_copy(update={"eye": eye})).tolist())

    def _start(self, place: Place, n_g: Vector, direction: Vector, came: Vector) -> Floats:
        """The row of the start of a ray that leaves a surface of normal n_g, where one of direction ``came`` ended."""
        if not self.offset.uses_error_bound:
            return _NO_START
        row = np.empty(ROW)
        start_row(row, place, n_g, direction, came)
        return row

    def _child(
        self, kind: Kind, ray: Ray, surface: Surface, place: Place, direction: Vector, weight: Vector,
        media: tuple[int, ...],
    ) -> Ray:  # fmt: skip
        w = normalized(direction)
        start = self._start(place, surface.n_g, w, ray.direction)
        origin = spawn_origin(surface.p, surface.error, surface.n_g, w, self.offset)
        return Ray(kind, ray.depth + 1, origin, w, weight, media, ray.width, start)

    def _is_there(self, spot: Spot) -> bool:
        """Whether no mask leaves out the surface at a ``Spot``."""
        return not self.arrays.holes or bool(is_there_of(self.arrays, spot))

    def _seen(self, spot: Spot, surface: Surface, d: Vector, width: float) -> Seen:
        """The part of a surface that a ray of direction d and that ``width`` sees."""
        if not len(self.arrays.maps):
            return Seen(self.arrays, int(surface.material), surface.n_s, (0.0, 0.0, 0.0))
        own = np.empty(OWN_COLUMNS)
        n_s = own_look_of(self.arrays, spot, d, width, own)
        return Seen(
            self.arrays._replace(materials=own[None, :MATERIAL_COLUMNS]), 0, n_s, color_at(own, MATERIAL_COLUMNS)
        )

    def _behind(self, spot: Spot, d: Vector, end: Vector | None = None) -> tuple[Vector, Vector, Floats]:
        """Origin, direction and the row of the start of a ray that goes on behind a ``Spot`` to the same end."""
        met = surface_of(self.arrays, *spot, d)
        origin = spawn_origin(met.p, met.error, met.n_g, d, self.offset)
        onwards = d if end is None else sub(end, origin)
        return origin, onwards, self._start(place_at(spot, met, d), met.n_g, onwards, d)


def steps_of(prepared: PreparedScene, offset: OffsetRule = BOUNDED, media: MediaRule = "stack") -> Steps:
    """The steps of rays in a prepared scene, under rules as in ``render``."""
    arrays = arrays_for(prepared, prepared.scene.camera, prepared.scene.render, offset, media)
    return Steps(prepared, arrays, offset, media_limit(prepared.needs, media))


def _spot_of(hits: Hits) -> Spot:
    """The point where the first ray of ``hits`` hits."""
    return Spot(int(hits.face[0]), float(hits.u[0]), float(hits.v[0]))


def color_at(columns: Floats, first: int) -> Vector:
    """Three columns of a row."""
    x, y, z = columns[first : first + 3].tolist()
    return x, y, z
