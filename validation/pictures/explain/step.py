"""One step of Mitsuba's recursion against ours from the same ray: what it hit, what leaves there, what light it saw.

Our step starts from Mitsuba's own ray, so nothing has built up before it. What is left is float32's rounding of this
one step. Where values differ by more than a few roundings, the step is made again from rays moved within float32's
rounding, and the values may differ by as much as it then does.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from validation.pictures.explain.ours import Ours
from validation.pictures.explain.rounding import BEYOND, around, searched
from validation.references.ray_tree import Node

# Some twenty float32 roundings of 6e-8: a direction goes through a frame, a lobe, and back.
_FLOOR = 2e-6
# The cosine at which a directional light is in the plane of a face but for rounding.
_GRAZING = 8.0 * _FLOOR
# A shadow ray of a directional light is as long as Mitsuba likes, or endless.
_FAR = 1e30
# Of radiance and shares: the same, of the value itself, or of a channel of 1 where it is smaller than that.
_COLOR = 1e-5


class Fault(NamedTuple):
    """A quantity of a step in which two renderers differ by more than rounding: both values, and what was allowed."""

    quantity: str
    ours: Any
    theirs: Any
    allowed: float


class Compared(NamedTuple):
    """Differences in one step beyond rounding; and whether each renderer took another of faces that coincide there."""

    faults: list[Fault]
    coinciding: bool = False


def compare(theirs: Node, ours: Ours) -> Compared:
    """One step of theirs against ours from the same ray."""
    mine = ours.step(theirs)
    coinciding = mine.face != theirs.face and coincide(mine, theirs)
    if mine.face != theirs.face and at_one_place(mine, theirs):
        mine = ours.step_at(theirs)
    elif mine.face != theirs.face:
        found = _moved_to(theirs, ours)
        if found is None:
            return Compared([Fault("face", mine.face, theirs.face, 0.0)])
        mine = found
    return Compared([*_differing(theirs, mine, ours), *_hidden(theirs, ours)], coinciding)


def at_one_place(one: Node, other: Node) -> bool:
    """Whether two hits are at one place but for rounding."""
    if one.face < 0 or other.face < 0:
        return False
    return float(np.abs(one.point - other.point).max()) <= _place(other)


def _place(node: Node) -> float:
    """The distance by which rounding moves a point of a surface, as Mitsuba's offset counts coordinates."""
    return _FLOOR * (1.0 + float(np.abs(node.point).max()))


def coincide(one: Node, other: Node) -> bool:
    """Whether two rays hit faces at one place and in one plane."""
    return at_one_place(one, other) and abs(float(one.normal @ other.normal)) >= 1.0 - _FLOOR


def _moved_to(theirs: Node, ours: Ours) -> Node | None:
    """Our step from a moved ray that hits the face that they hit."""
    for origins, directions in searched(theirs):
        rows = np.flatnonzero(ours.first_faces(origins, directions) == theirs.face)
        if len(rows):
            origin, direction = origins[rows[0]], directions[rows[0]]
            return ours.step(Node(theirs.kind, theirs.depth, origin, direction, theirs.share))
    return None


def _differing(theirs: Node, mine: Node, ours: Ours) -> list[Fault]:
    """Differences beyond the floors, and beyond those of steps from moved rays."""
    if not [*_missing(theirs, mine), *_beyond(theirs, mine, [])]:
        return []
    near = [step for step in map(ours.step, around(theirs)) if step.face == mine.face]
    if any(_missing(theirs, mine)):
        mine = next((step for step in near if not any(_missing(theirs, step))), mine)
    return [*_missing(theirs, mine), *_beyond(theirs, mine, near)]


def _missing(theirs: Node, mine: Node) -> Iterator[Fault]:
    """Lights that only one of two surfaces faces, and rays that only one of them spawns."""
    if any(_faces(theirs, light, mine) for light in theirs.shadows.keys() ^ mine.shadows.keys()):
        yield Fault("lights that are faced", sorted(mine.shadows), sorted(theirs.shadows), 0.0)
    if theirs.children.keys() != mine.children.keys():
        yield Fault("spawned rays", sorted(mine.children), sorted(theirs.children), 0.0)


def _faces(theirs: Node, light: int, mine: Node) -> bool:
    """Whether a light is before a surface by more than rounding; it may be within a face's plane."""
    node = theirs if light in theirs.shadows else mine
    shadow = node.shadows[light]
    if shadow.length >= _FAR:
        return abs(float(shadow.direction @ node.shading)) > _GRAZING
    # The ray starts off the surface, perhaps beyond the light, and Mitsuba's ends 9e-4 of its length before it.
    towards = shadow.origin + shadow.length * shadow.direction - node.point
    return abs(float(towards @ node.shading)) > _place(node)


def _beyond(theirs: Node, mine: Node, near: list[Node]) -> Iterator[Fault]:
    """The values that differ by more than their floor and what steps from moved rays differ by."""
    values = _values(mine)
    others = [_values(step) for step in near]
    for quantity, (value, floor) in _values(theirs).items():
        if quantity not in values or not np.isfinite(values[quantity][0]).all():
            continue
        own = values[quantity][0]
        spread = [np.abs(other[quantity][0] - own).max() for other in others if quantity in other]
        allowed = floor + BEYOND * float(max(spread, default=0.0))
        if not float(np.abs(own - value).max()) <= allowed:
            yield Fault(quantity, own.tolist(), value.tolist(), allowed)


def _values(node: Node) -> dict[str, tuple[Any, float]]:
    """The values of a step by name, each with the least that may differ."""
    found: dict[str, tuple[Any, float]] = {"own radiance": (node.own, _color(node.own))}
    if node.face < 0:
        return found
    place = _place(node)
    found |= {"point": (node.point, place), "shading normal": (node.shading, _FLOOR)}
    for light, shadow in node.shadows.items():
        # Mitsuba's rays go to a place, for a directional light to one beyond all faces, from off the surface.
        turned = float(np.linalg.norm(shadow.origin - node.point)) / shadow.length
        found |= {
            f"light {light}, origin": (shadow.origin, place),
            f"light {light}, direction": (shadow.direction, _FLOOR + turned),
            f"light {light}, radiance": (shadow.radiance, _color(shadow.radiance)),
        }
        if shadow.length < _FAR:
            found[f"light {light}, length"] = (np.array(shadow.length), _COLOR * shadow.length)
    for kind, child in node.children.items():
        found |= {
            f"{kind} ray, origin": (child.origin, place),
            f"{kind} ray, direction": (child.direction, _FLOOR),
            f"{kind} ray, share": (child.share, _color(child.share)),
        }
    return found


def _color(value: Any) -> float:
    return _COLOR * max(1.0, float(np.abs(value).max()))


def _hidden(theirs: Node, ours: Ours) -> Iterator[Fault]:
    """Shadow rays of theirs that are hidden by rays of ours, or the reverse, however they are moved."""
    if not ours.shadows:
        return
    for light, shadow in theirs.shadows.items():
        hides = bool(ours.hidden(shadow.origin[None], shadow.direction[None], shadow.length)[0])
        ray = Node("camera", theirs.depth, shadow.origin, shadow.direction, theirs.share, t=min(shadow.length, _FAR))
        if hides != shadow.hidden and not any(
            (ours.hidden(origins, directions, shadow.length) == shadow.hidden).any()
            for origins, directions in searched(ray)
        ):
            yield Fault(f"light {light}, hidden", hides, shadow.hidden, 0.0)
