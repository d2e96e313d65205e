"""A study on a cluster: a task for each part, whose answers are kept on this machine's disk as they come."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any, Literal

from renderer.cluster.tasks import Task, results
from renderer.cluster.workers import SentMesh, answer_part
from renderer.octree import Octree
from renderer.process.terminal import progress_bar
from renderer.runs.parts import Parts, digest_of
from renderer.runs.study import PART, Points, Study, parts_of


def run_on(
    client: Any,
    octree: Octree,
    study: Study,
    points: Points,
    folder: Path,
    *,
    size: int = PART,
    split: Literal["midpoint", "sah"] = "midpoint",
    progress: bool = False,
) -> Parts:
    """``renderer.runs.study.run`` on the workers of ``client``, a ``distributed.Client``.

    Parts are written here, whole, as they come; those that a killed run left are not computed again. A worker that dies
    loses its parts under way, which others compute. The bits are those of a run on this machine alone. Raises
    ``OSError`` where the scheduler is gone, or without a worker for 10 seconds; the same call then goes on.
    """
    mesh = octree.mesh
    parts = parts_of(octree, study, points, folder, size)
    missing = parts.missing()
    sent = SentMesh(digest_of(mesh.vertices, mesh.faces), mesh.vertices, mesh.faces, split)
    tasks = (Task(part, sent, (study, points.part(parts.rows(part)))) for part in missing)
    with (
        progress_bar(len(points), "point", progress) as update,
        closing(results(client, answer_part, tasks)) as answers,
    ):
        if update is not None:
            update(len(points) - sum(end - begin for begin, end in map(parts.plan.span, missing)))
        for part, values in answers:
            parts.write(part, values)
            if update is not None:
                begin, end = parts.plan.span(part)
                update(end - begin)
    return parts
