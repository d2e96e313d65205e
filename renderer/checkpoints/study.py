"""A study as a record that can be stored, sent and repeated, and its run, part by part."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.checkpoints.parts import Computed, Parts, Plan, digest_of
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.studies.ambient import ambient_occlusion
from renderer.studies.points import Points
from renderer.studies.share import check_request
from renderer.studies.sky import sky_view_factor, sun_hours
from renderer.system.files import check_writable

Floats = NDArray[np.float64]
# Points of a part: with 145 directions some seconds of work on one thread, which is what a kill loses at most.
PART = 1 << 15


@dataclass(frozen=True, eq=False)
class Study:
    """A question to each of many points.

    kind        "sky": sky view factor; "sun": hours of sun; "ao": ambient occlusion
    options     the keyword arguments of the kind's function, other than points, threads and progress
    """

    kind: str
    options: dict[str, Any]

    def __post_init__(self) -> None:
        expect(self.kind in KINDS, "kind", f"one of {list(KINDS)}", repr(self.kind))

    def evaluate(self, octree: Octree, points: Points, threads: int | None = None) -> Floats:
        """The answers (n,) for points; each is the same whatever other points are evaluated with it."""
        return KINDS[self.kind](
            octree, points.points, points.normals, leaving=points.leaving, threads=threads, **self.options
        )

    def plan(self, mesh: Mesh, points: Points, order: NDArray[np.int64], size: int = PART) -> Plan:
        """The study in parts of ``size`` points in an order, with all that the bits of each part depend on."""
        options = {name: _written(value) for name, value in self.options.items()}
        made_of = {
            "kind": self.kind, "options": options, "mesh": digest_of(mesh.vertices, mesh.faces),
            "points": digest_of(points.points, points.normals, points.leaving), "order": digest_of(order),
            "version": sys.modules["renderer"].__version__,
        }  # fmt: skip
        return Plan(len(points), size, 0, "<f8", made_of)


def _written(option: Any) -> Any:
    """An option as a plan has it, in types that JSON has: an array by its digest, and so the arrays of a list."""
    if isinstance(option, np.ndarray):
        return digest_of(option)
    if isinstance(option, list | tuple):
        return [_written(part) for part in option]
    return option.item() if isinstance(option, np.generic) else option


KINDS: dict[str, Callable[..., Floats]] = {"sky": sky_view_factor, "sun": sun_hours, "ao": ambient_occlusion}


def folder_of(output: Path) -> Path:
    """The folder of the parts of a result that is under way."""
    return output.with_name(f"{output.name}.parts")


def parts_of(octree: Octree, study: Study, points: Points, folder: Path, size: int | None = None) -> Parts:
    """The parts of a study in a folder, new ones or those that a killed run left: points that lie together are one.

    Raises ``ValueError`` for points, normals or faces that no study takes, naming argument and row, for options that
    its kind refuses, and for the folder of another study.
    """
    # Here, as an error of a part would name its own row.
    check_request(octree, points.points, points.normals, points.leaving, None, False)
    # Of no point, so that options that the kind refuses leave no folder, which would stand in the way of right ones.
    study.evaluate(octree, points.part(slice(0)))
    order = points.order()
    plan = study.plan(octree.mesh, points, order, *(() if size is None else (size,)))
    return Parts(folder, plan, order)


def run(octree: Octree, study: Study, points: Points, folder: Path, *, progress: bool = False) -> Parts:
    """Compute the parts that ``folder`` lacks, one after the other; a run that is killed can be begun again.

    Returns all parts, whose bits do not depend on how often the run was killed, nor on threads.
    """
    check_writable(folder.with_name(f"{folder.name}.try"))
    parts = parts_of(octree, study, points, folder)

    def compute(missing: list[int]) -> Computed:
        for part in missing:
            yield part, study.evaluate(octree, points.part(parts.rows(part)))

    parts.complete(compute, "point", progress)
    return parts
