"""A study as a record that can be stored and sent, and its run, part by part."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.checkpoints.parts import Computed, Parts, Plan, digest_of
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.studies.ambient import ambient_occlusion
from renderer.studies.places import FacePoints
from renderer.studies.points import Points
from renderer.studies.share import check_request
from renderer.studies.sky import sky_view_factor, sun_hours
from renderer.system.files import check_writable

Floats = NDArray[np.float64]
# Points of a part: some seconds of work on one thread at 145 directions, which a kill loses at most.
PART = 1 << 15


@dataclass(frozen=True, eq=False)
class Study:
    """A quantity computed for each of many points, as a record that can be stored, sent and repeated.

    Parameters
    ----------
    kind : {"sky", "sun", "ao"}
        `sky_view_factor`, `sun_hours` or `ambient_occlusion` of ``renderer.studies``.
    options : dict, optional
        Keyword arguments of that function, without points, normals, ``leaving``, ``threads`` and ``progress``. Arrays,
        such as ``transmittance``, are distinguished by their values.

    Raises
    ------
    ValueError
        If the kind is unknown.

    Examples
    --------
    >>> from renderer.cluster import Study
    >>> Study("sky", {"patches": 577})
    Study(kind='sky', options={'patches': 577})
    """

    kind: str
    options: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        expect(self.kind in KINDS, "kind", f"one of {list(KINDS)}", repr(self.kind))

    def evaluate(self, octree: Queries | RayScene, points: FacePoints | Points, threads: int | None = None) -> Floats:
        """The result of each point, on this machine.

        Parameters
        ----------
        octree : Octree or RayScene
        points : FacePoints
            Such as those of ``studies.face_points``.
        threads : int, optional
            By default those of the octree.

        Returns
        -------
        ndarray of float64, shape (n,)
            The result of a point does not depend on the other points.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.cluster import Study
        >>> from renderer.mesh.shapes import box
        >>> from renderer.studies import face_points
        >>> octree = Octree.from_mesh(box())
        >>> Study("ao").evaluate(octree, face_points(octree.mesh)).min()
        np.float64(1.0)
        """
        places = Points(*points) if isinstance(points, FacePoints) else points
        return KINDS[self.kind](
            octree, places.points, places.normals, leaving=places.leaving, threads=threads, **self.options
        )


def plan_of(study: Study, mesh: Mesh, points: Points, order: NDArray[np.int64], size: int = PART) -> Plan:
    """The study in parts of ``size`` points in an order, with all that the bits of each part depend on."""
    options = {name: _written(value) for name, value in study.options.items()}
    made_of = {
        "kind": study.kind, "options": options, "mesh": digest_of(mesh.vertices, mesh.faces),
        "points": digest_of(points.points, points.normals, points.leaving), "order": digest_of(order),
        "version": sys.modules["renderer"].__version__,
    }  # fmt: skip
    return Plan(len(points), size, 0, "<f8", made_of)


def _written(option: Any) -> Any:
    """An option in types of JSON: arrays, also those in lists, by their digests."""
    if isinstance(option, np.ndarray):
        return digest_of(option)
    if isinstance(option, list | tuple):
        return [_written(part) for part in option]
    return option.item() if isinstance(option, np.generic) else option


KINDS: dict[str, Callable[..., Floats]] = {"sky": sky_view_factor, "sun": sun_hours, "ao": ambient_occlusion}


def folder_of(output: Path) -> Path:
    """The folder for the parts of a result."""
    return output.with_name(f"{output.name}.parts")


def parts_of(octree: Queries, study: Study, points: Points, folder: Path, size: int | None = None) -> Parts:
    """The parts of a study in a folder, new or left by a killed run. The points of a part lie together.

    Raises ``ValueError`` for bad points, normals, faces or options, and for the folder of another study.
    """
    # All at once, as an error in a part would name the row in that part.
    check_request(octree, points.points, points.normals, points.leaving, None, False)
    # Without points, so that bad options leave no folder, which would then refuse good ones.
    study.evaluate(octree, points.part(slice(0)))
    order = points.order()
    plan = plan_of(study, octree.mesh, points, order, *(() if size is None else (size,)))
    return Parts(folder, plan, order)


def run(octree: Octree, study: Study, points: Points, folder: Path, *, progress: bool = False) -> Parts:
    """Compute the parts that ``folder`` lacks, one after the other. The same call goes on with a killed run.

    Returns all parts. Their bits depend neither on threads nor on kills.
    """
    check_writable(folder.with_name(f"{folder.name}.try"))
    parts = parts_of(octree, study, points, folder)

    def compute(missing: list[int]) -> Computed:
        for part in missing:
            yield part, study.evaluate(octree, points.part(parts.rows(part)))

    parts.complete(compute, "point", progress)
    return parts
