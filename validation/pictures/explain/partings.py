"""Partings of two trees of rays: the first rays, from the camera on, that do not do the same."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from validation.references.ray_tree import Node, Vector

# How near two hits of one ray are the same, whatever face each renderer names at an edge: relative to the coordinates,
# and for unit normals. More than offsets of 1e-4 make of a ray on its way through glass.
_NEAR = 1e-3

What = Literal["hit", "shadow", "faces the light", "spawned"]


@dataclass(frozen=True)
class Parting:
    """A place at which two trees part.

    what    rays hit different places; a light is hidden for one; one surface faces a light, or spawns a ray, alone
    where   the way there, as "camera, reflected, refracted", and which light or ray it is
    ours, theirs  the nodes there
    light   the number of the light of a shadow
    """

    what: What
    where: str
    ours: Node
    theirs: Node
    light: int = -1


def partings(ours: Node, theirs: Node, where: str = "camera") -> list[Parting]:
    """All the first places at which two trees part."""
    if not _same_hit(ours, theirs):
        return [Parting("hit", where, ours, theirs)]
    found = []
    for light in sorted(ours.shadows.keys() | theirs.shadows.keys()):
        one, other = ours.shadows.get(light), theirs.shadows.get(light)
        if one is None or other is None:
            found.append(Parting("faces the light", f"{where}, light {light}", ours, theirs, light))
        elif one.hidden != other.hidden:
            found.append(Parting("shadow", f"{where}, light {light}", ours, theirs, light))
    for kind in sorted(ours.children.keys() | theirs.children.keys()):
        below = f"{where}, {kind}"
        if kind in ours.children and kind in theirs.children:
            found += partings(ours.children[kind], theirs.children[kind], below)
        else:
            found.append(Parting("spawned", below, ours, theirs))
    return found


def way(ours: Node, theirs: Node) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Both ways from the camera to the first place at which two trees part, or to their ends, a ray after another."""
    nodes = [(ours, theirs)]
    while True:
        one, other = nodes[-1]
        below = [k for k in one.children if k in other.children and partings(one.children[k], other.children[k])]
        if not _same_hit(one, other) or not below:
            return [_ray(mine) for mine, _ in nodes], [_ray(its) for _, its in nodes]
        nodes.append((one.children[below[0]], other.children[below[0]]))


def _ray(node: Node) -> dict[str, Any]:
    """A ray as plain values, of nine digits, which float32 has no more of."""
    return {
        "kind": node.kind,
        "origin": _digits(node.origin),
        "direction": _digits(node.direction),
        "face": node.face,
        "t": float(f"{node.t:.9g}") if node.face >= 0 else None,
        "share": _digits(node.share),
        "spawned": sorted(node.children),
        "lights": {str(light): "hidden" if shadow.hidden else "seen" for light, shadow in node.shadows.items()},
    }


def _digits(vector: Vector) -> list[float]:
    return [float(f"{x:.9g}") for x in vector.tolist()]


def _same_hit(ours: Node, theirs: Node) -> bool:
    if ours.face == theirs.face:
        return True
    if ours.face < 0 or theirs.face < 0:
        return False
    near = np.abs(ours.point - theirs.point).max() <= _NEAR * (1.0 + np.abs(theirs.point).max())
    alike = np.abs(ours.shading - theirs.shading).max() <= _NEAR
    return bool(near and alike and np.array_equal(np.float32(ours.own), np.float32(theirs.own)))
