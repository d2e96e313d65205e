"""View factors on a cluster: a task for each part of their rows and pairs, kept on this machine's disk as they come."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from renderer.arguments.split import SPLIT, Split
from renderer.arguments.types import ArrayLike
from renderer.checkpoints.parts import digest_of
from renderer.checkpoints.view_factors import Arrays, Job, KeptWork, folder_for
from renderer.cluster.tasks import Task, results
from renderer.cluster.workers import SentMesh, kept
from renderer.errors import expect
from renderer.octree import Octree
from renderer.picture.render import check_tree
from renderer.rayscene.scene import RayScene
from renderer.studies.factors.aim import senders_of
from renderer.studies.factors.assemble import warn_of_backs
from renderer.studies.factors.compute import checked_tracing, computed
from renderer.studies.factors.result import ViewFactors
from renderer.studies.factors.rows import Tracing, Update
from renderer.studies.factors.surfaces import Surfaces
from renderer.studies.share import octree_of
from renderer.system.files import as_path


class SentTracing(NamedTuple):
    """A ``Tracing`` as it travels: its digest, its mesh and surfaces, and ``rtol``."""

    digest: str
    mesh: SentMesh
    surfaces: Surfaces
    rtol: float

    def tracing(self, max_rays: int) -> Tracing:
        """The tracing of one thread, from this process's own or made now."""
        octree = self.mesh.octree()

        def make() -> Tracing:
            # Arrays that came over the wire cannot be written, which kernels would be compiled anew for.
            surfaces = Surfaces._make(map(np.array, self.surfaces))
            return Tracing(octree._built, surfaces, senders_of(octree.mesh, surfaces), self.rtol, 0, 1, False)

        made: Tracing = kept(f"{self.digest} {self.mesh.split}", make)
        return made._replace(max_rays=max_rays)


def view_factors_on(
    client: Any,
    octree: Octree | RayScene,
    folder: str | Path,
    groups: ArrayLike | None = None,
    *,
    split: Split = SPLIT,
    **options: Any,
) -> ViewFactors:
    """View factors that are computed on a cluster, with the bits of ``studies.view_factors``.

    Parameters
    ----------
    client : distributed.Client
        See `connected`.
    octree : Octree or RayScene
        The workers build the tree.
    folder : str or Path
        For finished parts: a new folder, or that of a run that was killed, whose parts are kept. The caller removes
        it.
    groups : array_like of int, shape (F,), optional
        The surface that each face belongs to.
    split : {"midpoint", "sah"}, default "sah"
        How workers build the tree, see ``Octree.from_mesh``. It changes no bit.
    **options
        ``sides``, ``transmittance``, ``rtol``, ``max_rays`` and ``progress``, as for ``studies.view_factors``.

    Returns
    -------
    ViewFactors

    Raises
    ------
    ValueError
        If an argument is not as above, or if `folder` is that of another run.
    ImportError
        If SciPy is not installed.
    OSError
        If the scheduler is gone, or has had no worker for 10 seconds. The same call then goes on where this one
        stopped.

    Notes
    -----
    If a worker dies, others compute its parts. Each part has 256 surfaces at least.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from renderer import Octree
    >>> from renderer.cluster import connected, view_factors_on
    >>> floor = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> with connected(workers=1) as client, TemporaryDirectory() as folder:
    ...     view_factors_on(client, floor, folder).sky
    array([1.])
    """
    whole = octree_of(octree)
    expect(isinstance(whole, Octree), "octree", "an Octree or a RayScene", type(whole).__name__)
    check_tree("octree", split)
    tracing = checked_tracing(whole, groups, **options)
    files = folder_for(tracing, as_path("folder", folder))
    found = computed(tracing, KeptWork(files, _on(client, _sent(tracing, split))))
    warn_of_backs(found.backs)
    return found


def _sent(tracing: Tracing, split: Split) -> SentTracing:
    mesh, surfaces = tracing.built.mesh, tracing.surfaces
    sent = SentMesh(digest_of(mesh.vertices, mesh.faces), mesh.vertices, mesh.faces, split)
    digest = f"{sent.digest} {digest_of(*surfaces)} {tracing.rtol}"
    return SentTracing(digest, sent, surfaces, tracing.rtol)


def _on(client: Any, sent: SentTracing) -> Any:
    """``Compute`` by tasks on a cluster."""

    def compute(tracing: Tracing, jobs: Iterator[Job], update: Update) -> Generator[tuple[int, Arrays], None, None]:
        tasks = (Task((job.part, job.size), sent, (tracing.max_rays, job.function, job.arguments)) for job in jobs)
        for (part, size), arrays in results(client, compute_part, tasks):
            yield part, arrays
            if update is not None:
                update(size)

    return compute


def compute_part(
    sent: SentTracing, max_rays: int, function: Callable[..., Arrays], arguments: tuple[Any, ...]
) -> Arrays:
    """The arrays of a part; a task."""
    return function(sent.tracing(max_rays), *arguments)
