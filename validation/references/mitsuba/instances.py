"""Embree's instances as a reference for hits of scenes, through Mitsuba's ``shapegroup`` and ``instance``.

Embree turns each ray into the frame of the mesh, in float32, so it finds another t than for the placed mesh, and a ray
may pass between two instances that share an edge.
"""

from typing import Any

import mitsuba as mi
import numpy as np

import validation.references.mitsuba.scene as mitsuba_scene  # selects the variant
from validation.oracle.placing import Body
from validation.references.mitsuba.hits import MitsubaHits


class MitsubaInstances(MitsubaHits):
    """A Mitsuba scene of ``bodies``, rounded to float32. Faces are numbered as ``oracle.placing.placed`` does."""

    def __init__(self, bodies: list[Body]) -> None:
        self._scene = instances(bodies)
        names = [(_name(i, k), len(body.faces)) for i, body in enumerate(bodies) for k in range(len(body.matrices))]
        starts = np.cumsum([0, *(count for _, count in names)]).tolist()
        first = dict(zip((name for name, _ in names), starts, strict=False))
        self._first = {shape: first[shape.id()] for shape in self._scene.shapes()}

    def _face(self, found: Any) -> int:
        return int(self._first[found.instance] + found.prim_index)


def instances(bodies: list[Body]) -> Any:
    """The scene of all bodies, of the variant that is selected."""
    content: dict[str, Any] = {"type": "scene", "embree_use_robust_intersections": True}
    for number, body in enumerate(bodies):
        mesh, group = mi.Mesh("mesh", len(body.vertices), len(body.faces)), f"group{number}"
        content[group] = {"type": "shapegroup", "mesh": mitsuba_scene.fill(mesh, body.vertices, body.faces)}
        for k, matrix in enumerate(body.matrices):
            place = mi.ScalarTransform4f(np.concatenate([matrix, [[0.0, 0.0, 0.0, 1.0]]]))
            of_group = {"type": "ref", "id": group}
            content[_name(number, k)] = {"type": "instance", "to_world": place, "group": of_group}
    return mi.load_dict(content)


def _name(body: int, instance: int) -> str:
    return f"group{body}_{instance}"
