"""View factors as a run: its rows and pairs in parts, which are kept on disk until all are done."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.checkpoints.folder import RunFolder
from renderer.checkpoints.parts import digest_of
from renderer.numerics.compressed import firsts_of
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.studies.factors.assemble import warn_of_backs
from renderer.studies.factors.compute import checked_tracing, computed
from renderer.studies.factors.result import ViewFactors
from renderer.studies.factors.rows import Known, RowHits, Tracing, Update, in_order, order_of, trace_rows
from renderer.studies.factors.work import face_pairs
from renderer.system.files import check_writable
from renderer.system.terminal import progress_bar

Integers = NDArray[np.int64]
Arrays = tuple[NDArray[Any], ...]
# Rays and pairs of a part at most: half a minute of work on one thread, which is what a kill loses at most. Rows of a
# part at least: so many that threads share them.
RAYS, PAIRS, LEAST_ROWS = 1 << 25, 1 << 20, 256


class Job(NamedTuple):
    """A part that is to be computed: ``function(tracing, *arguments)``.

    part  its number
    size  its rows or pairs
    """

    part: int
    size: int
    function: Callable[..., Arrays]
    arguments: tuple[Any, ...]


# Computes jobs, and yields number and arrays of each, in any order.
Compute = Callable[[Tracing, Iterator[Job], Update], Generator[tuple[int, Arrays], None, None]]


class KeptWork:
    """``Work`` in parts that a folder keeps: ``compute`` does those that it lacks."""

    def __init__(self, files: RunFolder, compute: Compute) -> None:
        self._files, self._compute = files, compute

    def rows(self, name: str, tracing: Tracing, rows: Integers, known: Known) -> RowHits:
        """As ``trace_rows``. The rows of a part lie together."""
        order, size = order_of(tracing.senders, rows), rows_of_part(tracing.max_rays)

        def places(here: slice) -> Integers:
            return np.sort(order[here])

        def arguments(here: slice) -> tuple[Any, ...]:
            own = rows[places(here)]
            return own, *_of_rows(known, own)

        parts = self._complete(name, tracing, len(rows), size, "surface", trace_part, arguments)
        owned = [places(slice(begin, begin + size)) for begin in range(0, len(rows), size)]
        return in_order([(own, RowHits(*part)) for own, part in zip(owned, parts, strict=True)])

    def pairs(self, tracing: Tracing, faces: Integers) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """As ``face_pairs``."""
        parts = self._complete("pairs", tracing, len(faces), PAIRS, "pair", face_pairs, lambda here: (faces[here],))
        exchange = np.concatenate([np.empty(0), *(part[0] for part in parts)])
        return exchange, np.concatenate([np.empty(0, np.bool_), *(part[1] for part in parts)])

    def _complete(
        self,
        name: str,
        tracing: Tracing,
        count: int,
        size: int,
        unit: str,
        function: Callable[..., Arrays],
        arguments: Callable[[slice], tuple[Any, ...]],
    ) -> list[Arrays]:
        """The arrays of all parts of a step; those that the folder lacks are computed and written first."""
        spans = [slice(begin, min(begin + size, count)) for begin in range(0, count, size)]
        names = [f"{name}-{part:08d}" for part in range(len(spans))]
        missing = [part for part, own in enumerate(names) if self._files.read(own) is None]
        lengths = [span.stop - span.start for span in spans]
        jobs = (Job(part, lengths[part], function, arguments(spans[part])) for part in missing)
        with progress_bar(count, unit, tracing.progress) as update:
            if update is not None:
                update(count - sum(lengths[part] for part in missing))
            if missing:
                with closing(self._compute(tracing, jobs, update)) as done:
                    for part, arrays in done:
                        self._files.write(names[part], _bytes_of(arrays))
        return [_arrays_of(self._files.whole(own)) for own in names]


def rows_of_part(max_rays: int) -> int:
    """The rows of a part. It depends on the rays alone, so that a run goes on with any number of workers."""
    return max(LEAST_ROWS, RAYS // max_rays)


def trace_part(
    tracing: Tracing, rows: Integers, first: Integers, targets: Integers,
    update: Update = None,
) -> Arrays:  # fmt: skip
    """``trace_rows`` of rows, in ascending order, with what is known of these alone."""
    lengths = np.zeros(tracing.surfaces.number, np.int64)
    lengths[rows] = np.diff(first)
    known = Known(firsts_of(lengths), targets)
    return trace_rows(tracing, rows, known, update)


def compute_here(tracing: Tracing, jobs: Iterator[Job], update: Update) -> Generator[tuple[int, Arrays], None, None]:
    """``Compute`` in this process, one part after the other."""
    for job in jobs:
        yield job.part, job.function(tracing, *job.arguments, update)


def manifest_of(tracing: Tracing) -> dict[str, Any]:
    """All that the parts depend on, in types of JSON."""
    mesh, surfaces = tracing.built.mesh, tracing.surfaces
    return {
        "kind": "view factors", "mesh": digest_of(mesh.vertices, mesh.faces), "groups": digest_of(surfaces.of_face),
        "sides": digest_of(surfaces.both), "transmittance": digest_of(surfaces.transmittance), "rtol": tracing.rtol,
        "max_rays": tracing.max_rays, "size": [RAYS, PAIRS, LEAST_ROWS],
        "version": sys.modules["renderer"].__version__,
    }  # fmt: skip


def run_view_factors(
    octree: Queries | RayScene, folder: Path, groups: ArrayLike | None = None, **options: Any
) -> ViewFactors:
    """``view_factors(octree, groups, **options)`` in parts that ``folder`` keeps, with the same bits.

    The same call goes on with a killed run. The caller removes the folder. Raises ``ValueError`` also if it is that of
    another run.
    """
    tracing = checked_tracing(octree, groups, **options)
    found = computed(tracing, KeptWork(folder_for(tracing, folder), compute_here))
    warn_of_backs(found.backs)
    return found


def folder_for(tracing: Tracing, folder: Path) -> RunFolder:
    """The folder of a run, new or left by a killed one."""
    check_writable(folder.with_name(f"{folder.name}.try"))
    return RunFolder(folder, manifest_of(tracing))


def _of_rows(known: Known, rows: Integers) -> Known:
    """The known part of some rows, as rows that follow each other."""
    lengths = np.diff(known.first)[rows]
    first = firsts_of(lengths)
    entries = np.arange(first[-1]) + np.repeat(known.first[rows] - first[:-1], lengths)
    return Known(first, known.targets[entries])


def _bytes_of(arrays: Arrays) -> bytes:
    """Arrays one after the other, each as an ``.npy`` has it."""
    file = BytesIO()
    for array in arrays:
        np.lib.format.write_array(file, array, allow_pickle=False)
    return file.getvalue()


def _arrays_of(content: bytes) -> Arrays:
    file, arrays = BytesIO(content), []
    while file.tell() < len(content):
        arrays.append(np.lib.format.read_array(file, allow_pickle=False))
    return tuple(arrays)
