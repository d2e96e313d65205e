"""Bounds on the answers that floating-point arithmetic may give for a ray, derived from exact arithmetic.

The exact determinants of ``validation.oracle.exact`` and derived bounds on their rounding judge each face. ``RayView``
decides whether an answer is the exact one, and if not, whether rounding permits it.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from validation.oracle import exact
from validation.oracle.distance import way_from

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Point = tuple[float, ...]
Edge = frozenset[Point]

FLOAT32_ROUNDOFF = 2.0**-24
FLOAT64_ROUNDOFF = exact.FLOAT64_ROUNDOFF


@dataclass(frozen=True)
class SeenFace:
    """One face as arithmetic with some unit roundoff sees it from a ray."""

    face: int
    t: Fraction | None  # where the ray meets its plane; None when parallel
    t_bound: float
    hit: bool  # exactly hit at t >= 0
    surely_hit: bool  # hit under any rounding
    edges: dict[Edge, float]  # determinant of each edge, 0 where it is below its bound

    @property
    def surely_in_front(self) -> bool:
        return self.t is not None and self.t > self.t_bound


class RayView:
    """Exact and rounding-tolerant verdicts on one ray's hits at t >= 0 on a mesh ``vertices`` (V, 3), ``faces`` (F, 3).

    ``seen`` holds all faces that are hit or that rounding might call hit; ``closest`` is the exact closest t, None on a
    miss, and ``closest_faces`` holds all faces that attain it.
    """

    def __init__(self, vertices: Floats, faces: Ints, origin: Point, direction: Point, unit_roundoff: float) -> None:
        possible = exact.possible_faces(vertices, faces, origin, direction, unit_roundoff)
        self._corners = vertices[faces[possible]]
        self._origin, self._direction = np.asarray(origin), np.asarray(direction)
        self.seen = self._see(possible, unit_roundoff)
        exactly = [(f.t, f.face) for f in self.seen if f.hit and f.t is not None]
        self.closest = min((t for t, _ in exactly), default=None)
        self.closest_faces = tuple(face for t, face in exactly if t == self.closest)

    def is_right(self, t: float | None, face: int | None) -> bool:
        """Whether the answer is exact: same hit or miss, t within bounds, no nearer face beyond rounding."""
        hits = [f for f in self.seen if f.hit and f.t is not None]
        named = next((f for f in hits if f.face == face), None)
        if t is None or named is None or named.t is None:
            return t is None and not hits
        if not way_from(t, named.t) <= named.t_bound:
            return False
        return all(named.t - f.t <= named.t_bound + f.t_bound for f in hits if f.t is not None)

    def is_permitted(self, t: float | None, face: int | None) -> bool:
        """Whether rounding can give this answer in a watertight kernel.

        The kernel must not pass a face that is surely hit (three determinants and t farther from 0 than their bounds),
        nor a sheet that is surely hit: see ``_sheets``. A named face must be one that may be hit, at its t.
        """
        stops = [(f.t, f.t_bound) for f in self.seen if f.surely_hit and f.t is not None] + self._sheets()
        if t is None:
            return not stops
        named = next((f for f in self.seen if f.face == face), None)
        if named is None or not 0.0 <= t < math.inf:
            return False
        if named.t is not None and not way_from(t, named.t) <= named.t_bound:
            return False
        return all(Fraction(t) - stop <= bound + named.t_bound for stop, bound in stops)

    def _see(self, possible: Ints, unit_roundoff: float) -> list[SeenFace]:
        if not len(possible):
            return []
        origins = np.broadcast_to(self._origin, (len(possible), 3))
        directions = np.broadcast_to(self._direction, (len(possible), 3))
        exactly = [exact.determinants(c, self._origin, self._direction) for c in self._corners]
        values = np.array([[float(value) for value in row[:3]] for row in exactly])
        margins = exact.determinant_bounds(self._corners - self._origin, directions, unit_roundoff)
        bounds = t_bounds(self._corners, origins, directions, values, unit_roundoff)

        seen = []
        for i, (u, v, w, depth) in enumerate(exactly):
            det = u + v + w
            t = depth / det if det else None
            inside = not min(u, v, w) < 0 < max(u, v, w)
            sure = np.where(np.abs(values[i]) > margins[i], values[i], 0.0)
            surely = t is not None and t > bounds[i] and bool((sure > 0).all() or (sure < 0).all())
            p = [tuple(corner) for corner in self._corners[i].tolist()]
            edges = {
                frozenset((p[1], p[2])): sure[0],
                frozenset((p[2], p[0])): sure[1],
                frozenset(p[:2]): sure[2],
            }
            hit = t is not None and inside and t >= 0
            seen.append(SeenFace(int(possible[i]), t, float(bounds[i]), hit, surely, edges))
        return seen

    def _sheets(self) -> list[tuple[Fraction, float]]:
        """(t, bound) of each set of joined faces that a watertight kernel must hit, though no single one is sure.

        Such a kernel shears each vertex once and takes the signs of the edges between the sheared points without error,
        so it sees a slightly moved mesh without gaps. Take the faces joined by common edges, and the edges that an odd
        number of them have: these close to polygons. Where all of them lie farther from the ray than rounding moves
        them, rounding does not change the parity with which they enclose the ray, and an odd parity means that some
        face of the set covers the ray. (At a silhouette two layers cover it: even.)
        """
        sheets = []
        for joined in _joined(self.seen):
            rim: dict[Edge, float] = {}
            for edge, count in Counter(edge for f in joined for edge in f.edges).items():
                if count % 2:
                    rim[edge] = next(f.edges[edge] for f in joined if edge in f.edges)
            if all(rim.values()) and all(f.surely_in_front for f in joined) and self._encloses(list(rim)):
                farthest = max(joined, key=lambda f: float(f.t or 0) + f.t_bound)
                sheets.append((farthest.t or Fraction(0), farthest.t_bound))
        return sheets

    def _encloses(self, rim: Sequence[Edge]) -> bool:
        """Whether the edges cross a half plane that starts at the ray an odd number of times."""
        axis = int(np.abs(self._direction).argmax())
        x, y = (axis + 1) % 3, (axis + 2) % 3
        slope = self._direction / self._direction[axis]
        odd = False
        for edge in rim:
            p, q = (np.asarray(point) - self._origin for point in edge)
            px, py, qx, qy = (c[k] - slope[k] * c[axis] for c in (p, q) for k in (x, y))
            if (py > 0) != (qy > 0):
                odd ^= bool((px * qy - py * qx > 0) == (qy > py))
        return odd


def _joined(seen: Sequence[SeenFace]) -> list[list[SeenFace]]:
    """Groups of faces that are connected by common edges."""
    by_edge: dict[Edge, list[SeenFace]] = {}
    for face in seen:
        for edge in face.edges:
            by_edge.setdefault(edge, []).append(face)
    groups, reached = [], set[int]()
    for start in seen:
        group, waiting = [], [start]
        while waiting:
            face = waiting.pop()
            if face.face not in reached:
                reached.add(face.face)
                group.append(face)
                waiting += [other for edge in face.edges for other in by_edge[edge]]
        if group:
            groups.append(group)
    return groups


def t_bounds(
    corners: Floats,
    origins: Floats,
    directions: Floats,
    determinants: Floats,
    unit_roundoff: float = FLOAT64_ROUNDOFF,
) -> Floats:
    """Bounds (n,) on the error of t that rounding explains; inf where rounding exceeds the determinant itself.

    With z_i the distances of the corners (n, 3, 3) along the ray's longest axis, Woop's kernel computes t' =
    sum U_i' z_i' / sum U_i', where |U_i' - U_i| <= B_i (``exact.determinant_bounds``) and z_i' has 3
    roundings, each product and sum 3 more, the quotient 1. As sum U_i (z_i - t) = 0,

        |t' - t| <= (sum B_i |z_i - t| + 10 u sum (|U_i| + B_i) |z_i|) / (|det| - sum B_i) + 10 u |t|.

    |z_i - t| is at most the distance r_i from corner to hit point (largest component) over |d|_inf. Kernels
    that divide plane terms, t' = (n'.a) / (n'.d), err by the turn of the normal, below sum B_i r_i / |d|_inf,
    and by at most 8 u sum |n_j a_j| / |det|. The sum of all covers both. ``determinants`` are U, V, W (n, 3),
    well known.
    """
    # Express the corners relative to the origin, and bound the determinants.
    u = unit_roundoff
    relative = corners - origins[:, None, :]
    bounds = exact.determinant_bounds(relative, directions, u)
    det = determinants.sum(axis=1)
    longest = np.abs(directions).max(axis=1)
    axis = np.abs(directions).argmax(axis=1)
    rows = np.arange(len(directions))
    normal = np.cross(relative[:, 1] - relative[:, 0], relative[:, 2] - relative[:, 0])

    # Sum the terms of the bound.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        depth = relative[rows, :, axis] / directions[rows, axis][:, None]
        t = (determinants * depth).sum(axis=1) / det
        reach = np.abs(relative - t[:, None, None] * directions[:, None, :]).max(axis=2) / longest[:, None]
        turned = (bounds * reach).sum(axis=1)
        rounded = 10 * u * ((np.abs(determinants) + bounds) * np.abs(depth)).sum(axis=1)
        plane = 8 * u * np.abs(normal * relative[:, 0]).sum(axis=1)
        left = np.abs(det) - bounds.sum(axis=1)
        bound = (turned + rounded + plane) / left + 10 * u * np.abs(t)
    return np.where(left > 0, bound, np.inf)
