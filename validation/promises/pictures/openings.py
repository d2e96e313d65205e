"""The boxes that a ray opens, for looking at: those that plain arithmetic says, in the order in which it meets them."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.diagnostics.tree_boxes import Visit, boxes_at, visited
from renderer.diagnostics.tree_boxes import levels as count_levels
from renderer.octree import Octree
from validation.meshes import loose
from validation.promises import levels
from validation.promises.row import row

Floats = NDArray[np.float64]
_FACES = 120
# So small that the build scales the vertices, by a power of two.
_TINY = 2.0**-200
_JUDGE = "direct computation"


class _Octant(NamedTuple):
    """A node or leaf: its level, its box, the octants in it and the faces of a leaf."""

    level: int
    box: Floats
    octants: "list[_Octant]"
    triangles: Floats


def check_openings(rng: Generator, count: int) -> list[dict[str, Any]]:
    """Rays from between two heaps of faces and from outside, up to a hit, short of it, and on."""
    opened: list[bool] = []
    shown: list[bool] = []
    for unit in (1.0, _TINY):
        corners = rng.normal(size=(_FACES, 1, 3)) + 0.2 * rng.normal(size=(_FACES, 3, 3))
        corners[::2, :, 0] += 12.0
        octree = Octree.from_mesh(loose(unit * corners))
        root = _root(octree, corners, unit)
        shown += _shown(octree, root, unit)
        for origin, direction in _rays(rng, count):
            met = _visits(root, origin, direction, np.inf)[1]
            for t_max in (np.inf, 0.75 * met, 1.25 * met) if met < np.inf else (np.inf, 2.0):
                given = visited(octree, unit * origin, unit * direction, t_max)
                opened.append(_are(given, _visits(root, origin, direction, t_max)[0], unit))
    return [
        row("a ray opens the boxes up to its closest hit, in the order of their middles", _JUDGE, np.array(opened)),
        row("each level shows the boxes of its octants", _JUDGE, np.array(shown)),
    ]


def _rays(rng: Generator, count: int) -> Iterator[tuple[Floats, Floats]]:
    """Towards either heap, from between them or from anywhere around."""
    along = np.array([1.0, 0.0, 0.0])
    for number in range(count):
        origin = rng.normal(size=3) * (0.2 if number % 2 else 9.0) + 6.0 * along
        target = rng.normal(size=3) + 12.0 * rng.integers(0, 2) * along
        yield origin, (target - origin) * rng.choice([0.25, 1.0, 8.0])


def _root(octree: Octree, corners: Floats, unit: float) -> _Octant:
    """The tree as its layout says, in the units of ``corners``."""
    tree, found = octree.tree, levels.levels(octree.tree)
    octants: list[_Octant] = []
    for number in range(len(found), 0, -1):
        boxes, _, links = found[number - 1]
        inner: list[list[_Octant]] = [[] for _ in links]
        for octant, above in zip(octants, found[number].above if octants else (), strict=True):
            inner[above].append(octant)
        faces = [tree.faces[levels.places(link[link < 0])[1]] for link in links[:, None]]
        octants = [
            _Octant(number, box / (tree.scale * unit), inside, corners[face[face >= 0]])
            for box, inside, face in zip(boxes.astype(np.float64), inner, faces, strict=True)
        ]
    every = np.array([octant.box for octant in octants])
    return _Octant(0, np.array([every[:, 0].min(axis=0), every[:, 1].max(axis=0)]), octants, corners[:0])


def _visits(root: _Octant, origin: Floats, direction: Floats, t_max: float) -> tuple[list[_Octant], float]:
    """The octants that are opened, and t of the nearest hit, or ``t_max``."""
    best, opened, waiting = t_max, [], [(_entry(root, origin, direction), root)]
    while waiting:
        entry, octant = waiting.pop()
        if entry > best:
            continue
        opened.append(octant)
        best = min(best, _hit(octant.triangles, origin, direction))
        met = [(_entry(inner, origin, direction), inner) for inner in octant.octants]
        waiting += sorted((one for one in met if one[0] < np.inf), key=lambda one: -_along(one[1], direction))
    return opened, best


def _along(octant: _Octant, direction: Floats) -> float:
    """The coordinate of a box's middle along the diagonal with the direction's signs."""
    return float(octant.box.mean(axis=0) @ np.sign(direction))


def _entry(octant: _Octant, origin: Floats, direction: Floats) -> float:
    """The t at which a ray enters a box, from 0 on; infinite where it does not."""
    ways = (octant.box - origin) / direction
    first, last = max(ways.min(axis=0).max(), 0.0), ways.max(axis=0).min()
    return float(first if first <= last else np.inf)


def _hit(triangles: Floats, origin: Floats, direction: Floats) -> float:
    """t of the nearest of some triangles; infinite where there is none."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    normal = np.cross(b - a, c - a)
    t = ((a - origin) * normal).sum(axis=1) / (normal @ direction)
    point = origin + t[:, None] * direction
    sides = [(np.cross(q - p, point - p) * normal).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))]
    return float(np.where((np.min(sides, axis=0) >= 0.0) & (t >= 0.0), t, np.inf).min(initial=np.inf))


def _are(given: list[Visit], wanted: list[_Octant], unit: float) -> bool:
    return len(given) == len(wanted) and all(
        visit.level == octant.level
        and visit.is_leaf == (len(octant.triangles) > 0)
        and np.array_equal(np.array([visit.lower, visit.upper]) / unit, octant.box)
        for visit, octant in zip(given, wanted, strict=True)
    )


def _shown(octree: Octree, root: _Octant, unit: float) -> Iterator[bool]:
    """Whether each level shows its boxes, and no level follows the last."""
    some, level = [root], 0
    while some:
        given = (boxes_at(octree, level) / unit).reshape(-1, 2, 3)
        yield sorted(given.tolist()) == sorted(octant.box.tolist() for octant in some)
        some, level = [inner for octant in some for inner in octant.octants], level + 1
    yield count_levels(octree) == level and len(boxes_at(octree, level)) == 0
