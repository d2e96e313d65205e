"""A street without end with a block along its middle, cut into strips, whose exchange is known by crossed strings."""

import itertools

import numpy as np

from renderer.mesh.mesh import Mesh
from validation.meshes import squares
from validation.oracle.view_factors.strings import Point, Segment, exchange
from validation.studies.factors.rooms import Ints, Room

WIDTH, LEFT, RIGHT = 4.0, 3.0, 2.5
# The block's sides and its height.
BLOCK = (1.5, 2.25, 1.25)
TIPS = (Point(BLOCK[0], BLOCK[2]), Point(BLOCK[1], BLOCK[2]))
# A piece of the street from -REACH to REACH stands for it. Two of its lines at the distance d in the section exchange
# less than lines without end by the mean difference of their y, 2 d / pi, over the length.
REACH = 1e4
LENGTH = 2.0 * REACH
MISSING = 2.0 / np.pi * float(np.hypot(WIDTH, max(LEFT, RIGHT))) / LENGTH


def strips() -> list[tuple[str, Segment]]:
    """Each strip with the part of the street that it belongs to, its front to the right of start to end."""
    low, high, top = BLOCK
    parts = {
        "left floor": (Point(low, 0.0), Point(0.0, 0.0), 2),
        "left wall": (Point(0.0, 0.0), Point(0.0, LEFT), 4),
        "right wall": (Point(WIDTH, RIGHT), Point(WIDTH, 0.0), 4),
        "right floor": (Point(WIDTH, 0.0), Point(high, 0.0), 2),
        "right side": (Point(high, 0.0), Point(high, top), 2),
        "roof": (Point(high, top), Point(low, top), 1),
        "left side": (Point(low, top), Point(low, 0.0), 2),
    }
    found = []
    for name, (start, end, count) in parts.items():
        # The walls are cut at the block's height too.
        cuts = np.linspace(0.0, 1.0, count + 1)
        if name.endswith("wall"):
            height, share = abs(end.z - start.z), top / abs(end.z - start.z)
            share = share if name == "left wall" else 1.0 - share
            cuts = np.unique(np.append(cuts, share)) if height > top else cuts
        places = [Point(start.x + s * (end.x - start.x), start.z + s * (end.z - start.z)) for s in cuts.tolist()]
        found += [(name, Segment(a, b)) for a, b in itertools.pairwise(places)]
    return found


def room() -> Room:
    """The street along y: a rectangle for each strip."""
    plates = []
    for _, (start, end) in strips():
        # y cross (end - start) is to the right of the way in the section.
        plates.append(
            [[start.x, -REACH, start.z], [start.x, REACH, start.z], [end.x, REACH, end.z], [end.x, -REACH, end.z]]
        )
    mesh: Mesh = squares(np.array(plates))
    groups: Ints = np.repeat(np.arange(len(plates)), 2).astype(np.int64)
    return Room(mesh, groups)


def known(one: int, other: int) -> float:
    """Area times F of two strips for each unit of length."""
    (name, a), (beside, b) = strips()[one], strips()[other]
    if name == beside:
        return 0.0
    sides = {_side(name), _side(beside)}
    if "roof" in sides:
        return exchange(a, b, TIPS) if _above_roof(a) or _above_roof(b) else 0.0
    if len(sides) == 1:
        return exchange(a, b)
    # A side of the block has its back to the other side of the street.
    return 0.0 if name.endswith("side") or beside.endswith("side") else exchange(a, b, TIPS)


def _side(name: str) -> str:
    """Left, right or the roof."""
    return name.split()[0]


def _above_roof(strip: Segment) -> bool:
    """Whether it is a strip of a wall above the block's height."""
    return max(strip.start.z, strip.end.z) > BLOCK[2] and strip.start.x == strip.end.x
