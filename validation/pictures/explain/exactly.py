"""Our rays where two trees part, judged by exact arithmetic: what they hit, and where they start and end."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from renderer.scene.light import DirectionalLight, Light
from validation.oracle import exact
from validation.oracle.rounding import FLOAT64_ROUNDOFF, RayView
from validation.pictures.explain.partings import Parting
from validation.pictures.explain.planes import Planes
from validation.pictures.explain.rounding import moved_ray
from validation.references.ray_tree import Node, Shadow

# A start is off its surface by roundings, or exactly on it where exact arithmetic gets it rounded: 2^-44 is 512 float64
# roundings of the coordinates.
_START = 2.0**-44
_TRIES = 32
# Our own rays start within a hundredth of Mitsuba's offset (8.94e-5) of their surface, and end as near to a light.
_OFF = 1e-6


def wrong(rays: Sequence[Parting], points: NDArray[np.float64], faces: NDArray[np.int64]) -> list[bool]:
    """Whether our ray at each parting hit what no ray hits that starts there, on a mesh (V, 3), (F, 3)."""
    judged = [_judged(parting) for parting in rays]
    rows = [row for row, one in enumerate(judged) if one is not None]
    if not rows:
        return [False] * len(rays)
    some = [one for one in judged if one is not None]
    origins, directions = np.array([ray.origin for ray, _ in some]), np.array([ray.direction for ray, _ in some])
    exactly = exact.closest_hits(points, faces, origins, directions)
    planes, result = Planes(points[faces]), [False] * len(rays)
    for row, (ray, length), hit in zip(rows, some, exactly, strict=True):
        said = rays[row].ours if length is None else rays[row].ours.shadows[rays[row].light]
        result[row] = not (_fits(said, hit, length) or _near(said, ray, length, planes, points, faces))
    return result


def misplaced(node: Node, lights: Sequence[Light]) -> Iterator[str]:
    """The rays of our own tree that leave a surface from elsewhere, hit the face that they leave, or lead past their
    light.
    """
    room = _OFF * (1.0 + float(np.abs(node.point).max(initial=0.0)))
    for kind, child in node.children.items():
        if not float(np.abs(child.origin - node.point).max()) <= room:
            yield f"{kind} ray starts {np.abs(child.origin - node.point).max():.3g} from its surface"
        if child.face >= 0 and child.face == node.face:
            yield f"{kind} ray hits face {node.face}, which it leaves, at {child.t!r}"
        yield from misplaced(child, lights)
    for number, shadow in node.shadows.items():
        light = lights[number]
        if not float(np.abs(shadow.origin - node.point).max()) <= room:
            yield f"shadow ray to light {number} starts {np.abs(shadow.origin - node.point).max():.3g} from its surface"
        if shadow.hidden and shadow.face == node.face:
            yield f"shadow ray to light {number} is hidden by face {node.face}, which it leaves"
        if not _leads_to(shadow, light, room):
            yield f"shadow ray to light {number} does not end there"


def _leads_to(shadow: Shadow, light: Light, room: float) -> bool:
    if isinstance(light, DirectionalLight):
        towards = -np.asarray(light.direction) / np.linalg.norm(light.direction)
        return bool(np.abs(shadow.direction - towards).max() <= _OFF and shadow.length == np.inf)
    end = shadow.origin + shadow.length * shadow.direction
    return bool(np.abs(end - np.asarray(light.position)).max() <= room * (1.0 + shadow.length))


def _judged(parting: Parting) -> tuple[Node | Shadow, float | None] | None:
    """The ray that decided a parting, and the length of a shadow ray; None where no hit decided it."""
    if parting.what == "hit":
        return parting.ours, None
    if parting.what == "shadow":
        shadow = parting.ours.shadows[parting.light]
        return shadow, shadow.length
    return None


def _fits(said: Node | Shadow, hit: exact.ExactHit | None, length: float | None) -> bool:
    if isinstance(said, Shadow):
        return said.hidden == (hit is not None and float(hit.t) <= (np.inf if length is None else length))
    return said.face == -1 if hit is None else said.face in hit.faces_at_t


def _near(
    said: Node | Shadow,
    ray: Node | Shadow,
    length: float | None,
    planes: Planes,
    points: NDArray[np.float64],
    faces: NDArray[np.int64],
) -> bool:
    """Whether rounding permits the hit, or a ray from where the start may really be has it."""
    if isinstance(said, Node):
        room = _START * (1.0 + float(np.abs(points).max()))
        if said.face >= 0 and said.t <= _OFF and planes.coinciding(said, room):
            # By the law of starts a ray stops at once at the next of the faces that coincide where it starts.
            return True
        view = RayView(points, faces, tuple(ray.origin.tolist()), tuple(ray.direction.tolist()), FLOAT64_ROUNDOFF)
        answer = (said.t, said.face) if said.face >= 0 else (None, None)
        if view.is_permitted(*answer):
            return True
    reach = said.t if isinstance(said, Node) and np.isfinite(said.t) else 1.0
    origins, directions = moved_ray(ray.origin, ray.direction, reach, _START, _TRIES)
    return any(_fits(said, hit, length) for hit in exact.closest_hits(points, faces, origins, directions))
