"""Differences of the hits of a mesh from recorded ones."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from validation.recorded.rays import Rays
from validation.recorded.record import Answers, Record, bounds_of, digest, shoot

# How many of the rays that differ are listed, the furthest moved last.
_LISTED = 20


@dataclass(frozen=True)
class Comparison:
    """Recorded answers and those of today, ray by ray.

    lost, gained  (n,) bool: a hit became a miss, a miss became a hit
    shift         (n,): how far a hit moved along its ray, as a share of the mesh's size; 0 unless both are hits
    bounds        how far the mesh's bounds moved, as a share of its size
    tolerance     the largest shift that passes
    same_mesh     whether vertices and faces are as they were
    """

    rays: Rays
    before: Answers
    now: Answers
    lost: NDArray[np.bool_]
    gained: NDArray[np.bool_]
    shift: NDArray[np.float64]
    bounds: float
    tolerance: float
    same_mesh: bool

    @property
    def moved(self) -> NDArray[np.bool_]:
        return self.shift > self.tolerance

    @property
    def differ(self) -> NDArray[np.bool_]:
        return self.lost | self.gained | self.moved

    @property
    def passed(self) -> bool:
        """Whether no ray differs and the bounds moved no further than the tolerance; numbers of faces do not count."""
        return not self.differ.any() and self.bounds <= self.tolerance

    def summary(self) -> str:
        """The differences, in one line."""
        count = len(self.shift)
        if self.passed:
            mesh = "" if self.same_mesh else "the mesh changed, but "
            return f"PASS, {mesh}{count:,} rays hit as recorded"
        lost, gained, moved = (int(rows.sum()) for rows in (self.lost, self.gained, self.moved))
        kinds = f"{lost:,} lost, {gained:,} gained, {moved:,} moved by up to {self.shift.max():.3g} of the mesh's size"
        bounds = f"; its bounds moved by {self.bounds:.3g}" if self.bounds > self.tolerance else ""
        return f"FAIL, {int(self.differ.sum()):,} of {count:,} rays differ ({kinds}){bounds}"

    def as_json(self) -> dict[str, Any]:
        """The numbers for CI, and some of the rays that differ; ``t`` is None on a miss."""
        rows = np.flatnonzero(self.differ)
        rows = rows[np.argsort(self.shift[rows], kind="stable")][-_LISTED:]
        return {
            "passed": self.passed,
            "tolerance": self.tolerance,
            "same_mesh": self.same_mesh,
            "rays": len(self.shift),
            "differ": int(self.differ.sum()),
            "lost": int(self.lost.sum()),
            "gained": int(self.gained.sum()),
            "moved": int(self.moved.sum()),
            "largest_shift": float(self.shift.max()),
            "bounds_shift": self.bounds,
            "other_face": int((self.before.face != self.now.face).sum()),
            "listed": [self._ray(row) for row in rows.tolist()],
        }

    def _ray(self, row: int) -> dict[str, Any]:
        ray = {"origin": self.rays.origins[row].tolist(), "direction": self.rays.directions[row].tolist()}
        for name, answers in (("before", self.before), ("now", self.now)):
            t = float(answers.t[row]) if answers.hit[row] else None
            ray[name] = {"t": t, "face": int(answers.face[row])}
        return ray


def compare(record: Record, mesh: Mesh, tolerance: float) -> Comparison:
    """Shoot the recorded rays at a mesh. Raises ``ValueError`` for a record with too few answers."""
    rays, before = record.rays(), record.answers()
    now = shoot(mesh, rays)
    both = before.hit & now.hit
    shift = np.zeros(len(both))
    shift[both] = np.abs(now.t[both] - before.t[both]) * np.linalg.norm(rays.directions[both], axis=1) / record.size
    bounds = float(np.abs(bounds_of(mesh) - record.bounds).max()) / record.size
    lost, gained = before.hit & ~now.hit, ~before.hit & now.hit
    same = digest(mesh) == record.digest
    return Comparison(rays, before, now, lost, gained, shift, bounds, tolerance, same)
