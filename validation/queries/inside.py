"""Points within, on and beside closed solids: ours against exact signs, and other libraries beside."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.octree import Octree
from validation.job import Job
from validation.queries.peers import peers
from validation.queries.solids import Solid, nasty_points, random_points, solids

_SEED = 2041
# Offsets and scales of each solid: far away, tiny and huge, all exact in float64.
PLACES = ((0.0, 1.0), (2.0**20, 1.0), (0.0, 2.0**-40), (2.0**20, 2.0**20))


_SIGNED = 1000


def check_inside(random: int, nasty: int, beside: int, job: Job) -> list[dict[str, Any]]:
    """A row for each solid and kind of point: the number of points, and the wrong answers of ours and of others.

    random, nasty  points of each kind, over all solids and places
    beside         how many of each kind the other libraries are asked
    """
    rows, rng = [], np.random.default_rng(_SEED)
    for solid in solids():
        job.step(f"queries: inside, {solid.name}")
        for kind, points_of, count in (("random", random_points, random), ("nasty", nasty_points, nasty)):
            asked, wrong, others = 0, 0, dict[str, int]()
            for offset, scale in PLACES:
                points = points_of(solid, rng, count // (len(PLACES) * len(solids())))
                wrong += _wrong(solid, points, offset, scale)
                asked += len(points)
                some = points[: beside // len(PLACES)]
                for name, missed in (_others(solid, some, offset, scale) if beside else {}).items():
                    others[name] = others.get(name, 0) + missed
            rows.append({"subject": f"inside: {solid.name}, {kind} points", "asked": asked, "wrong": wrong,
                         "beside": len(PLACES) * (beside // len(PLACES)), "others": others})  # fmt: skip
    return rows


def _wrong(solid: Solid, points: NDArray[np.float64], offset: float, scale: float) -> int:
    """The points at which some answer of ours differs from the exact one, by either rule, with and without surface."""
    winding, on = solid.winding(points)
    octree, placed = Octree.from_mesh(solid.mesh(offset, scale)), (points + offset) * scale
    wrong = octree.contains(placed) != ((winding != 0) | on)
    wrong |= octree.contains(placed, boundary=False) != ((winding != 0) & ~on)
    wrong |= octree.contains(placed, boundary=False, rule="even-odd") != ((winding % 2 == 1) & ~on)
    # The sign of some distances: these take longer.
    some = slice(0, _SIGNED)
    signs = np.sign(octree.signed_distance(placed[some]))
    wrong[some] |= signs != np.where(on, 0, np.where(winding != 0, -1, 1))[some]
    return int(wrong.sum())


def _others(solid: Solid, points: NDArray[np.float64], offset: float, scale: float) -> dict[str, int]:
    """Wrong answers of other libraries, where a point is not on the surface and a rule does not matter."""
    winding, on = solid.winding(points)
    clear, mesh = ~on & ((winding == 0) | (winding == 1)), solid.mesh(offset, scale)
    placed, expected = ((points + offset) * scale)[clear], winding[clear] != 0
    found = {name: peer(mesh.vertices, mesh.faces) for name, peer in peers().items()}
    return {name: int((peer.contains(placed) != expected).sum()) for name, peer in found.items()}
