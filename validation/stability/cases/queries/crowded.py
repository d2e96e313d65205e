"""Row 54 of the extreme cases: inside and all hits at a corner of 100,000 faces, far away, and beside bad faces.

The answers at the spindle follow from its shape alone; the others are those of exact arithmetic.
"""

import numpy as np

from renderer import Mesh, Octree
from renderer.mesh.shapes import box, icosphere
from validation.promises.refused import refused
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import SEED
from validation.stability.cases.queries.contacts import rays_of, wrong_rays
from validation.stability.cases.queries.inside import points_at, wrong_answers
from validation.stability.cases.queries.nearest import fan

# Of a winding number.
_TOLERANCE = 1e-9


def spindle(count: int) -> Mesh:
    """A closed double cone: ``count`` faces around its upper tip (0, 0, 1/2), then as many around the lower one."""
    upper = fan(count)
    below = np.where(upper.faces == count, count + 1, upper.faces)[:, ::-1]
    # The lower faces, too, begin with their tip.
    below = np.roll(below, 1, axis=1)
    return Mesh(np.concatenate([upper.vertices, [[0.0, 0.0, -0.5]]]), np.concatenate([upper.faces, below]))


def wrong_at_spindle(count: int) -> int:
    """The number of questions about a spindle that are answered wrongly, of ``ASKED``."""
    octree = Octree.from_mesh(spindle(count))
    # A tip, the outermost corner, and an edge between them.
    on = np.array([[0.0, 0.0, 0.5], [1.0, 0.0, 0.0], [0.5, 0.0, 0.25]])
    out, within = np.nextafter(on, 9 * on), np.nextafter(on, 0.0 * on)
    inside = [octree.contains(p, boundary=False).tolist() for p in (on, out, within)]
    wrong = inside != [[False] * 3, [False] * 3, [True] * 3]
    wrong += octree.contains(on).tolist() != [True] * 3
    wrong += octree.contains(within, winding=True).tolist() != [True] * 3
    wrong += not abs(octree.winding_number([0.0, 0.0, 0.0], _TOLERANCE) - 1.0) <= _TOLERANCE
    wrong += octree.signed_distance([[0, 0, 0.5], [0, 0, 2.0], [0, 0, -1e6]]).tolist() != [0.0, 1.5, 1e6 - 0.5]
    return int(wrong) + _wrong_down_axis(octree, count)


def _wrong_down_axis(octree: Octree, count: int) -> int:
    """Of a ray through both tips: wrong contacts, a wrong number of them, wrong faces, and a t beyond its bound."""
    axis = [0.0, 0.0, 2.0], [0.0, 0.0, -1.0]
    met, each = octree.all_hits(*axis, t_error=True), octree.all_hits(*axis, contacts=False, t_error=True)
    wrong = (met.face < count).tolist() != [True, False]
    wrong += octree.count_hits(*axis) != 2
    wrong += sorted(each.face.tolist()) != list(range(2 * count)) or bool((each.face[:count] >= count).any())
    for found in (met, each):
        off = abs(found.t - np.where(found.face < count, 1.5, 2.5))
        wrong += found.t_error is None or bool((off > found.t_error).any())
    return int(wrong)


# Questions of ``wrong_at_spindle`` and of ``_not_refused``.
ASKED = 10 + 2


def hard_solids() -> dict[str, Mesh]:
    """A tetrahedron 1e9 away, a box with faces that are lines and points, one three times in one place, and slivers."""
    corners, cube, ball = np.eye(4, 3, k=-1), box((-1, -1, -1), (1, 1, 1)), icosphere(1)
    return {
        "far away": Mesh(corners + 1e9, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
        "lines and points": Mesh(cube.vertices, np.concatenate([cube.faces, [[0, 0, 1], [2, 2, 2], [5, 0, 5]]])),
        "three times": Mesh.concatenate([cube, cube, cube]),
        "slivers": Mesh(ball.vertices * [1, 1e-4, 1e-8], ball.faces),
    }


def _not_refused() -> int:
    """The number of queries that take a point or an origin that is no number, or that do not name its row."""
    octree, bad = Octree.from_mesh(box()), np.array([[0.0, 0.0, 0.0], [0.0, np.nan, 0.0]])
    said = {"points": refused(octree.contains, bad), "origins": refused(octree.all_hits, bad, np.ones((2, 3)))}
    return sum(not (text and text.startswith(f"{argument}: ") and "row 1" in text) for argument, text in said.items())


def _crowded(quick: bool) -> Outcome:
    rng, asked = np.random.default_rng(SEED), ASKED
    wrong = wrong_at_spindle(1_000 if quick else 100_000) + _not_refused()
    for name, mesh in hard_solids().items():
        points = points_at(mesh, rng, 4 if quick else 20)
        wrong, asked = wrong + wrong_answers(mesh, points), asked + len(points)
        if name != "slivers":  # whose corners are no small integers
            rays = rays_of(mesh, rng, 10 if quick else 40)
            wrong, asked = wrong + wrong_rays(mesh, *rays), asked + len(rays[0])
    return Outcome(f"{wrong} of {asked:,} answers wrong", wrong == 0)


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        54, "inside and all hits at a corner of 100,000 faces, 1e9 away, beside faces that are lines, of triple faces",
        "inside, contacts and hits as in real arithmetic; NaN refused by its row", ("exact", "closed form"),
        f"none but that of winding numbers, {_TOLERANCE}, as asked", _crowded,
    ),
)  # fmt: skip
