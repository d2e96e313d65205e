"""A study on a cluster: a task for each part, whose answers are kept on this machine's disk as they come."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from renderer.arguments.counts import count_argument
from renderer.checkpoints.parts import Parts, digest_of
from renderer.checkpoints.study import PART, Study, parts_of
from renderer.cluster.tasks import Results, Task, results
from renderer.cluster.workers import SentMesh, evaluate_part
from renderer.errors import expect
from renderer.octree import Octree
from renderer.picture.render import check_tree
from renderer.studies.points import Points
from renderer.system.files import as_path


def run_on(
    client: Any,
    octree: Octree,
    study: Study,
    points: Points,
    folder: str | Path,
    *,
    size: int = PART,
    split: Literal["midpoint", "sah"] = "midpoint",
    progress: bool = False,
) -> Parts:
    """``renderer.checkpoints.study.run`` on the workers of ``client``, a ``distributed.Client``.

    points  where, as ``renderer.studies.points`` makes them
    folder  for the parts, a new one or that of a run that was killed; the caller removes it
    size    points of a part at least. It changes no bit
    split   the tree that workers build, as ``Octree.from_mesh`` takes it. It changes no bit

    Returns the parts, whose ``joined()`` is the answer, float64 (n,), one for each point in their order.

    Parts are written here, whole, as they come; those that a killed run left are not computed again. A worker that dies
    loses its parts under way, which others compute. The bits are those of a run on this machine alone. Raises
    ``ValueError`` naming the argument, with the row of a bad point, or where the folder is of another study, and
    ``OSError`` where the scheduler is gone, or without a worker for 10 seconds; the same call then goes on.

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from renderer import Octree
    >>> from renderer.cluster import connected, run_on
    >>> from renderer.studies.points import on_faces
    >>> from renderer.checkpoints.study import Study
    >>> floor = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> with connected(workers=1) as client, TemporaryDirectory() as folder:
    ...     run_on(client, floor, Study("sky", {}), on_faces(floor).points, Path(folder) / "parts").joined().tolist()
    [1.0]
    """
    folder = _checked(octree, study, points, folder, size, split)
    mesh = octree.mesh
    parts = parts_of(octree, study, points, folder, size)
    sent = SentMesh(digest_of(mesh.vertices, mesh.faces), mesh.vertices, mesh.faces, split)

    def compute(missing: list[int]) -> Results:
        tasks = (Task(part, sent, (study, points.part(parts.rows(part)))) for part in missing)
        return results(client, evaluate_part, tasks)

    parts.complete(compute, "point", progress)
    return parts


def _checked(octree: object, study: object, points: object, folder: object, size: object, split: object) -> Path:
    """The folder as a path. Raises ``ValueError`` for what a study on a cluster does not take."""
    expect(isinstance(octree, Octree), "octree", "an Octree", type(octree).__name__)
    expect(isinstance(study, Study), "study", "a Study", type(study).__name__)
    expect(isinstance(points, Points), "points", "Points", type(points).__name__)
    count_argument("size", size, 1)
    check_tree("octree", split)
    return as_path("folder", folder)
