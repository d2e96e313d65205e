"""A study on a cluster: a task for each part, whose answers are kept on this machine's disk as they come."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, Literal

from renderer.cluster.workers import SentMesh, answer_part
from renderer.octree import Octree
from renderer.process.terminal import progress_bar
from renderer.runs.parts import Parts, digest_of
from renderer.runs.study import PART, Points, Study, parts_of

# Parts under way for each thread of the cluster: one that is computed, one that has arrived and waits.
_AHEAD = 2
# Times that a part is tried again whose worker died with it.
_RETRIES = 5


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
    loses its parts under way, which others compute. The bits are those of a run on this machine alone.
    """
    parts = parts_of(octree, study, points, folder, size)
    missing = parts.missing()
    with progress_bar(len(points), "point", progress) as update:
        for part, answers in _answers(client, octree, study, points, parts, missing, split):
            parts.write(part, answers)
            if update is not None:
                begin, end = parts.plan.span(part)
                update(end - begin)
    return parts


def _answers(
    client: Any,
    octree: Octree,
    study: Study,
    points: Points,
    parts: Parts,
    missing: Iterable[int],
    split: Literal["midpoint", "sah"],
) -> Iterator[tuple[int, Any]]:
    """Each missing part's answers, as they come; few parts are under way at a time, so that memory is bounded."""
    from distributed import as_completed

    mesh = octree.mesh
    digest = digest_of(mesh.vertices, mesh.faces)
    # By reference where a worker is this process, so never written.
    sent = client.scatter(SentMesh(digest, mesh.vertices, mesh.faces, split), broadcast=True, hash=False)
    waiting, part_of = iter(missing), dict[Any, int]()

    def submit(part: int) -> Any:
        some = points.part(parts.rows(part))
        future = client.submit(answer_part, sent, study, some, pure=False, retries=_RETRIES)
        part_of[future] = part
        return future

    ahead = _AHEAD * max(1, sum(client.nthreads().values()))
    under_way = as_completed([submit(part) for part in islice(waiting, ahead)])
    for future in under_way:
        yield part_of.pop(future), future.result()
        for part in islice(waiting, 1):
            under_way.add(submit(part))
