"""The answer to a click: the hit of the ray through a pixel, the rays it spawns, and the octree's nodes it opens."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from renderer.diagnostics.ray_path import Segment, ray_path
from renderer.diagnostics.ray_step import Vector
from renderer.diagnostics.tree_boxes import Visit, visited
from renderer.materials.columns import MATERIAL_COLUMNS
from renderer.picture.prepare import PreparedScene
from renderer.results.hits import Hits
from renderer.shade.surface import surface_of
from renderer.viewer.compare import Comparison
from renderer.viewer.parts import part_of_face
from renderer.viewer.protocol import Pick
from renderer.viewer.shown import ShownScene, varied
from renderer.viewer.viewpoint import ray_through

# The most boxes sent for one ray, the first that it opens: more cover each other on the screen. ``visited`` counts all.
_MAX_BOXES = 512


def picked(shown: ShownScene, pick: Pick, comparison: Comparison | None = None) -> dict[str, Any]:
    """The message for ``pick``: the ray through the pixel's centre; null for values that a miss does not have. With a
    ``comparison`` also the values that the pixel has in it.
    """
    prepared = varied(shown.prepared, pick.settings)
    origin, direction = ray_through(pick)
    x, y, z = direction.tolist()
    hits = prepared.octree.closest_hit(origin[None], direction[None])

    def followed(over: PreparedScene) -> tuple[Segment, ...]:
        """The path of the ray; over another tree its hits are found in another way."""
        least, settings = shown.scene.render.min_weight, pick.settings
        return ray_path(over, origin, direction, settings.max_depth, min_weight=least, shadows=settings.shadows)

    path = followed(prepared)
    nodes = visited(prepared.octree, origin, direction)
    boxes = [
        {"level": level, "lower": lower.tolist(), "upper": upper.tolist(), "leaf": leaf}
        for level, lower, upper, leaf in nodes[:_MAX_BOXES]
    ]
    met = _met(shown, prepared, (x, y, z), hits)
    steps = prepared.octree.count_steps(origin[None], direction[None])
    told = {"type": "pick", "seq": pick.seq, **met, "path": _told(path), "nodes": boxes, "visited": len(nodes)}
    told |= {"levels": _by_level(nodes), "tested": {"nodes": int(steps.nodes[0]), "triangles": int(steps.triangles[0])}}
    if comparison is None:
        return told
    again = followed(varied(shown.brute, pick.settings)) if comparison.by_brute_force else None
    return told | {"proof": _values(comparison, pick) | {"same_rays": None if again is None else again == path}}


def _by_level(nodes: Sequence[Visit]) -> list[int]:
    """The number of visited nodes of each level, from the root's."""
    return np.bincount([node.level for node in nodes]).tolist() if nodes else []


def _values(comparison: Comparison, pick: Pick) -> dict[str, Any]:
    """The values of the comparison's pixel under that of the view."""
    height, width = comparison.identical.shape
    x, y = pick.x * width // pick.w, pick.y * height // pick.h
    return {"at": [x, y], "of": [width, height], "values": comparison.values_at(x, y)}


def _met(shown: ShownScene, prepared: PreparedScene, direction: Vector, hits: Hits) -> dict[str, Any]:
    if not hits.hit[0]:
        return {"hit": False} | dict.fromkeys(("t", "face", "object", "material", "point", "normal"))
    face = int(hits.face[0])
    material = list(shown.scene.materials)[int(prepared.arrays.material[face]) // MATERIAL_COLUMNS]
    surface = surface_of(prepared.arrays, face, float(hits.u[0]), float(hits.v[0]), direction)
    return {
        "hit": True,
        "t": float(hits.t[0]),
        "face": face,
        "object": part_of_face(shown, face).name,
        "material": material,
        "point": hits.points[0].tolist(),
        "normal": surface.n_s,
    }


def _told(path: Sequence[Segment]) -> list[dict[str, Any]]:
    keys = ("kind", "depth", "parent", "start", "end", "hit", "face", "weight", "radiance")
    return [{key: getattr(segment, key) for key in keys} for segment in path]
