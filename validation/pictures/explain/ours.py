"""Our tree of rays behind a pixel, by the steps of the kernel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.diagnostics.ray_step import Aim, Ray, Steps, SurfaceHit
from renderer.materials.columns import CLEAR, KIND, TRANSMITTANCE
from renderer.scene.camera import Camera
from renderer.trace.batch import check_rays
from renderer.trace.closest import closest_hits
from renderer.trace.starts.level import Spot
from validation.references.ray_tree import Node, Shadow, Vector

_WHOLE = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Ours:
    """A prepared scene under the rules of one picture, with ``max_depth`` bounces."""

    steps: Steps
    max_depth: int
    shadows: bool

    @property
    def has_masks(self) -> bool:
        """Whether rays pass through holes of any surface."""
        return self.steps.arrays.holes

    def pixel(self, camera: Camera, resolution: tuple[int, int], row: int, column: int) -> Node:
        """The tree of the ray through a pixel's centre, to the bit as the kernel has it."""
        origin, direction = map(_tuple, camera.rays((column + 0.5, row + 0.5), resolution))
        # Dividing by the length again could change a bit. A picture takes the media around its camera's eye, for all
        # points of an orthographic film.
        media = tuple(self.steps.arrays.media.tolist())
        ray = self.steps.camera_ray(origin, direction)._replace(direction=direction, media=media)
        return self._follow(ray, np.ones(3))

    def step(self, node: Node) -> Node:
        """One step: a ray's hit, and the rays that leave there. The children have hit nothing, and no shadow is traced.

        The ray is that of ``node``. It starts on no surface and is in no medium.
        """
        ray = _ray(node)
        return self._spawn(node, ray, self.steps.meet(ray))

    def step_at(self, node: Node) -> Node:
        """As ``step``, where the ray hits the face that ``node`` says, at the point that it says."""
        ray, (a, b, c) = _ray(node), self.steps.prepared.mesh.triangles[node.face]
        u, v = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), node.point - a, rcond=None)[0].tolist()
        return self._spawn(node, ray, self.steps.meet_at(ray, Spot(node.face, u, v), node.t))

    def first_faces(self, origins: NDArray[np.float64], directions: NDArray[np.float64]) -> NDArray[np.int64]:
        """The faces that rays hit first, -1 for none; the rays start on no surface."""
        if self.has_masks:
            found = (self.steps.meet(_free(o, d)) for o, d in zip(origins, directions, strict=True))
            return np.array([-1 if met is None else met.together.seen.face for met in found], np.int64)
        rays, _ = check_rays(origins, directions, 0.0, np.inf)
        return np.asarray(closest_hits(self.steps.prepared.tree, self.steps.prepared.mesh, 1, *rays).face)

    def hidden(self, origins: NDArray[np.float64], directions: NDArray[np.float64], length: float) -> NDArray[np.bool_]:
        """Whether rays hit anything within a length."""
        if self.has_masks:
            # A ray that ends goes on behind a hole to the same end.
            t_max, ways = (length, directions) if length == np.inf else (1.0, length * directions)
            aims = (
                Aim(0, _tuple(o), _tuple(d), t_max, _tuple(o + d), _WHOLE, np.empty(0))
                for o, d in zip(origins, ways, strict=True)
            )
            return np.array([self._arriving(aim)[1] >= 0 for aim in aims])
        rays, _ = check_rays(origins, directions, 0.0, length)
        return np.asarray(closest_hits(self.steps.prepared.tree, self.steps.prepared.mesh, 1, *rays).hit)

    def _follow(self, ray: Ray, share: Vector) -> Node:
        met = self.steps.meet(ray)
        node = self._made(ray, share, met)
        if met is None:
            return node
        for aim in self.steps.aims(ray, met):
            shadow = node.shadows[aim.light] = _shadow(aim, hidden=False)
            if self.shadows:
                shadow.radiance, shadow.face = self._arriving(aim)
                shadow.hidden = shadow.face >= 0
        if ray.depth < self.max_depth:
            for child in self._children(ray, met):
                node.children[child.kind] = self._follow(child._replace(weight=_WHOLE), np.array(child.weight))
        return node

    def _arriving(self, aim: Aim) -> tuple[Vector, int]:
        """The radiance that a shadow ray brings, and the face that hides it, or -1."""
        while True:
            hits = self.steps.closest(aim.origin, aim.direction, aim.t_max, aim.start)
            rest = self.steps.pass_through(aim, hits) if hits.hit[0] else None
            if rest is None:
                return np.array(aim.radiance), int(hits.face[0])
            aim = rest

    def _children(self, ray: Ray, met: SurfaceHit) -> list[Ray]:
        return [child for child in self.steps.bounce(ray, met) if max(child.weight) > 0.0]

    def _spawn(self, node: Node, ray: Ray, met: SurfaceHit | None) -> Node:
        made = self._made(ray, node.share, met)
        if met is not None:
            for aim in self.steps.aims(ray, met):
                made.shadows[aim.light] = _shadow(aim, hidden=False)
            if node.depth < self.max_depth:
                made.children = {child.kind: _node(child) for child in self._children(ray, met)}
        return made

    def _made(self, ray: Ray, share: Vector, met: SurfaceHit | None) -> Node:
        node = _node(ray, share)
        if met is None:
            node.own = np.array(self.steps.background(ray))
            return node
        node.face, node.t = int(met.together.seen.face), met.t
        surface = met.surface
        node.point, node.normal, node.shading = np.array(surface.p), np.array(surface.n_g), np.array(met.seen.n_s)
        node.own = np.array(self.steps.ambient(ray, met))
        if met.seen.columns[KIND] == CLEAR or max(met.seen.columns[TRANSMITTANCE : TRANSMITTANCE + 3]) > 0.0:
            node.indices = float(met.change.n1), float(met.change.n2)
        return node


def _ray(node: Node) -> Ray:
    """The ray of a node, which starts on no surface and is in no medium."""
    return _free(node.origin, node.direction)._replace(kind=node.kind, depth=node.depth)


def _free(origin: Vector, direction: Vector) -> Ray:
    return Ray("camera", 0, _tuple(origin), _tuple(direction), _WHOLE, (), 0.0, np.empty(0))


def _node(ray: Ray, share: Vector | None = None) -> Node:
    """A ray that has hit nothing yet; the share is its weight where none is given."""
    share = np.array(ray.weight) if share is None else share
    return Node(ray.kind, ray.depth, np.array(ray.origin), np.array(ray.direction), share)


def _shadow(aim: Aim, hidden: bool) -> Shadow:
    direction = np.array(aim.direction)
    length = float(np.linalg.norm(direction))
    return Shadow(np.array(aim.origin), direction / length, aim.t_max * length, np.array(aim.radiance), hidden)


def _tuple(vector: Vector) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
