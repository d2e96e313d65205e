"""A study on a cluster: a task for each part, whose answers are kept on this machine's disk as they come."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from renderer.arguments.counts import count_argument
from renderer.arguments.split import SPLIT, Split
from renderer.checkpoints.parts import Parts, digest_of
from renderer.checkpoints.study import PART, Study, parts_of
from renderer.cluster.tasks import Results, Task, results
from renderer.cluster.workers import SentMesh, SentStudy, evaluate_part
from renderer.errors import expect
from renderer.octree import Octree
from renderer.picture.render import check_tree
from renderer.rayscene.scene import RayScene
from renderer.studies.places import FacePoints
from renderer.studies.points import Points
from renderer.studies.share import octree_of
from renderer.system.files import as_path


def run_on(
    client: Any,
    octree: Octree | RayScene,
    study: Study,
    points: FacePoints | Points,
    folder: str | Path,
    *,
    size: int = PART,
    split: Split = SPLIT,
    progress: bool = False,
) -> Parts:
    """The parts of a study that is computed on a cluster, with the bits of a run on this machine.

    Parameters
    ----------
    client : distributed.Client
        See `connected`.
    octree : Octree or RayScene
        As for `closest_hit`. The workers build the tree.
    study : Study
        What is computed.
    points : FacePoints
        Where, such as those of ``studies.face_points`` or ``studies.grid_points``.
    folder : str or Path
        For finished parts: a new folder, or that of a run that was killed, whose parts are kept. The caller removes
        it.
    size : int, default 32768
        Points of a part. It changes no bit.
    split : {"midpoint", "sah"}, default "sah"
        How workers build the tree, see ``Octree.from_mesh``. It changes no bit.
    progress : bool, default False
        Show a bar on standard error if that is a terminal.

    Returns
    -------
    Parts
        ``joined()`` is the result, float64 (n,), in the order of the points. ``remove()`` removes the folder.

    Raises
    ------
    ValueError
        If an argument is not as above, or if `folder` is that of another study.
    OSError
        If the scheduler is gone, or has had no worker for 10 seconds. The same call then goes on where this one
        stopped.

    Notes
    -----
    If a worker dies, others compute its parts.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from renderer import Octree
    >>> from renderer.cluster import Study, connected, run_on
    >>> from renderer.studies import face_points
    >>> floor = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> with connected(workers=1) as client, TemporaryDirectory() as folder:
    ...     run_on(client, floor, Study("sky"), face_points(floor.mesh), Path(folder) / "parts").joined().tolist()
    [1.0]
    """
    whole, points = octree_of(octree), Points(*points) if isinstance(points, FacePoints) else points
    folder = _checked(whole, study, points, folder, size, split)
    mesh = whole.mesh
    parts = parts_of(whole, study, points, folder, size)
    digest = digest_of(mesh.vertices, mesh.faces)
    sent = SentStudy(digest, SentMesh(digest, mesh.vertices, mesh.faces, split), study)

    def compute(missing: list[int]) -> Results:
        tasks = (Task(part, sent, (points.part(parts.rows(part)),)) for part in missing)
        return results(client, evaluate_part, tasks)

    parts.complete(compute, "point", progress)
    return parts


def _checked(octree: object, study: object, points: object, folder: object, size: object, split: object) -> Path:
    """The folder as a path. Raises ``ValueError`` for what a study on a cluster does not take."""
    expect(isinstance(octree, Octree), "octree", "an Octree or a RayScene", type(octree).__name__)
    expect(isinstance(study, Study), "study", "a Study", type(study).__name__)
    expect(isinstance(points, Points), "points", "FacePoints", type(points).__name__)
    count_argument("size", size, 1)
    check_tree("octree", split)
    return as_path("folder", folder)
