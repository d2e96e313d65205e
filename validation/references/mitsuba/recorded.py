"""Reference B's trees of rays: its own recursion, of which each step is written down."""

from dataclasses import dataclass, field

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from renderer.scene.scene import Scene
from validation.references.mitsuba import scene as mitsuba_scene
from validation.references.mitsuba.whitted import REFRACTION, Lobe, Recursion, Surface, recursion_of, scattered
from validation.references.ray_tree import Kind, Node, Shadow


@dataclass(frozen=True)
class _Recorded(Recursion):
    """A recursion that adds a node to ``made`` for each ray; ``under_way`` are those from the camera's on, and
    ``lengths`` those of their directions.

    first : the number of the first face of each shape.
    """

    first: dict[mi.Mesh, int] = field(default_factory=dict)
    under_way: list[Node] = field(default_factory=list)
    lengths: list[float] = field(default_factory=list)

    def leaving(self, si: mi.SurfaceInteraction3f, depth: int) -> mi.Color3f:
        node = self.under_way[-1]
        if si.is_valid():
            node.face, node.t = self.first[si.shape] + int(si.prim_index), float(si.t) * self.lengths[-1]
            node.point, node.normal, node.shading = _vector(si.p), _vector(si.n), _vector(si.sh_frame.n)
            node.own = _vector(self.surface(si).own)
        else:
            node.own = _vector(self.background.eval(si))
        return super().leaving(si, depth)

    def lit(self, si: mi.SurfaceInteraction3f, surface: Surface, light: int) -> mi.Color3f:
        sample, irradiance = self.lights[light].sample_direction(si, mi.Point2f(0.5, 0.5))
        wo = si.to_local(sample.d)
        found = super().lit(si, surface, light)
        if wo.z * si.wi.z > 0.0:
            ray = si.spawn_ray_to(sample.p)
            radiance, hidden = _vector(irradiance * scattered(si, surface, wo)), self.hides(si, sample)
            shadow = Shadow(_vector(ray.o), _vector(ray.d), float(ray.maxt), radiance, bool(hidden))
            self.under_way[-1].shadows[light] = shadow
        return found

    def spawn(self, lobe: Lobe, share: mi.Color3f, ray: mi.Ray3f, depth: int) -> mi.Color3f:
        kind: Kind = "refracted" if lobe.context is REFRACTION else "reflected"
        # In deep glass float32's directions are no unit vectors any more, by some roundings.
        direction = _vector(ray.d)
        length = float(np.linalg.norm(direction))
        node = Node(kind, depth, _vector(ray.o), direction / length, _vector(share))
        self.under_way[-1].children[kind] = node
        self.under_way.append(node)
        self.lengths.append(length)
        try:
            return super().spawn(lobe, share, ray, depth)
        finally:
            self.under_way.pop()
            self.lengths.pop()


class Trees:
    """The trees of a scene's rays by reference B, which follows ``max_depth`` bounces."""

    def __init__(self, scene: Scene, max_depth: int) -> None:
        recursion, shapes = recursion_of(scene, max_depth, _Recorded)
        assert isinstance(recursion, _Recorded)
        counts = [len(instance.mesh.faces) for instance in scene.instances]
        starts = np.cumsum([0, *counts]).tolist()
        recursion.first.update({shape: starts[index] for shape, index in shapes.items()})
        self._recursion = recursion

    def tree(self, origin: NDArray[np.float64], direction: NDArray[np.float64]) -> Node:
        """The tree of a camera ray, which is rounded to float32."""
        (ray,) = mitsuba_scene.mitsuba_rays((origin[None], direction[None]))
        node = Node("camera", 0, _vector(ray.o), _vector(ray.d), np.ones(3))
        self._recursion.under_way[:], self._recursion.lengths[:] = [node], [1.0]
        self._recursion.radiance(ray, 0)
        return node


def _vector(value: mi.Vector3f) -> NDArray[np.float64]:
    return np.array([value[0], value[1], value[2]], np.float64)
