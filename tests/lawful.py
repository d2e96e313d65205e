"""A tracer whose first hits are those of the exact judge, in place of an octree, sound or with a rule broken."""

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from validation.oracle.starts import Start, Surface


@dataclass
class LawfulHits:
    """What gates read of hits; ``side`` is the side that a ray came from, ``passed`` that it goes on through, and
    ``pile`` the face at which it came upon those that coincide.
    """

    t: np.ndarray
    face: np.ndarray
    u: np.ndarray
    v: np.ndarray
    side: np.ndarray
    pile: np.ndarray
    corners: np.ndarray
    passed: bool = False

    @property
    def hit(self):
        return self.face >= 0

    @property
    def points(self):
        w = 1 - self.u - self.v
        return np.einsum("kn,nkx->nx", np.stack([w, self.u, self.v]), self.corners)

    @property
    def normals(self):
        a, b, c = self.corners.transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def through(self):
        return replace(self, side=-self.side, passed=True)


class Lawful:
    """``closest_hit`` by exact arithmetic."""

    def __init__(self, vertices, faces):
        self.vertices, self.faces = np.asarray(vertices, float), np.asarray(faces)
        self.surface = Surface(self.vertices, self.faces)

    def rule(self, side, through):
        """The side and whether a ray goes through, as the tracer takes them."""
        return side, through

    def closest_hit(self, origins, directions, leaving=None, side=None):
        count, passed = len(origins), False
        sides = np.zeros(count, int) if side is None else np.asarray(side)
        if isinstance(leaving, LawfulHits):
            piles = leaving.pile.tolist() if leaving.passed else [None] * count
            starts = [
                self.surface.start_on(f, u, v)._replace(pile=pile)
                for f, u, v, pile in zip(leaving.face, leaving.u, leaving.v, piles, strict=True)
            ]
            sides, passed = leaving.side, leaving.passed
        elif leaving is not None:
            starts = [self.surface.start_near(f, o) for f, o in zip(leaving.tolist(), origins, strict=True)]
        else:
            starts = [Start(tuple(map(Fraction, o))) for o in origins.tolist()]
        found = []
        for start, direction, one in zip(starts, directions, sides.tolist(), strict=True):
            first = self.surface.first(start, direction, *self.rule(one, passed))[0]
            found.append(self._row(start, direction, first))
        columns = [np.array(column) for column in zip(*found, strict=True)]
        return LawfulHits(*columns, self.vertices[self.faces[columns[1]]])

    def _row(self, start, direction, first):
        if first.face < 0:
            return np.inf, -1, np.nan, np.nan, 0, -1
        way, normal = [Fraction(x) for x in direction.tolist()], self.surface.normal(first.face)
        point = [x + first.t * d for x, d in zip(start.place, way, strict=True)]
        side = -1 if sum(n * d for n, d in zip(normal, way, strict=True)) > 0 else 1
        pile = first.face if start.pile is None or first.t > 0 else start.pile
        u, v = _barycentrics(self.vertices[self.faces[first.face]].tolist(), point)
        return float(first.t), first.face, u, v, side, pile


def _barycentrics(corners, point):
    """u and v on a grid of 2^-53, so that 1 - u - v is exact; 0 where the point is on an edge."""
    p0, p1, p2 = ([Fraction(x) for x in corner] for corner in corners)
    e1, e2, q = ([b - a for a, b in zip(p0, p, strict=True)] for p in (p1, p2, point))
    k, m = max(((0, 1), (1, 2), (2, 0)), key=lambda axes: abs(e1[axes[0]] * e2[axes[1]] - e1[axes[1]] * e2[axes[0]]))
    area = e1[k] * e2[m] - e1[m] * e2[k]
    u, v = (q[k] * e2[m] - q[m] * e2[k]) / area, (e1[k] * q[m] - e1[m] * q[k]) / area
    grid = 2**53
    i = min(max(round(u * grid), 0), grid)
    j = grid - i if u + v == 1 else min(max(round(v * grid), 0), grid - i)
    return i / grid, j / grid
