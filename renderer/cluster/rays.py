"""Ray queries on dask arrays: lazy, chunk by chunk, each traced where the chunk is."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.split import SPLIT
from renderer.checkpoints.parts import digest_of
from renderer.cluster.workers import SentMesh
from renderer.errors import expect
from renderer.octree import Octree
from renderer.rayscene.scene import RayScene
from renderer.studies.share import octree_of

# A row of the hits of ``closest_hit``, as ``renderer.Hits`` has them: inf, -1 and nan where a ray hits nothing.
HIT = np.dtype([("t", "f8"), ("face", "i8"), ("u", "f8"), ("v", "f8")])


def closest_hit(
    octree: Octree | RayScene, origins: Any, directions: Any, *, t_min: float = 0.0, t_max: float = np.inf
) -> Any:
    """The closest hits of rays in dask arrays, lazily.

    Parameters
    ----------
    octree : Octree or RayScene
        Its mesh is sent to each worker once; of a scene that is the ``merged`` one, with all copies.
    origins, directions : dask.array.Array, shape (n, 3)
        The result has the chunks of the origins.
    t_min, t_max : float, default 0, inf
        The range of t in which hits count, in units of the directions' lengths; one for all rays.

    Returns
    -------
    dask.array.Array, shape (n,)
        Records with the fields ``t``, ``face``, ``u`` and ``v``: inf, -1 and nan if a ray hits nothing. A field such as
        ``hits["t"]`` is lazy, too. The bits are those of ``Octree.closest_hit``.

    Raises
    ------
    ValueError
        If an argument is not as above. Rays out of range raise when their chunk is computed.

    Examples
    --------
    >>> import dask.array as da
    >>> from renderer import Octree
    >>> from renderer.cluster import closest_hit
    >>> floor = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> origins, directions = da.array([[0.25, 0.25, 2.0], [9, 9, 2]]), da.array([[0.0, 0, -1], [0, 0, -1]])
    >>> closest_hit(floor, origins, directions)["t"].compute()
    array([ 2., inf])
    """

    def trace(mesh: SentMesh, o: NDArray[Any], d: NDArray[Any]) -> NDArray[Any]:
        hits = mesh.octree().closest_hit(o, d, t_min=t_min, t_max=t_max)
        rows = np.empty(len(o), HIT)
        for name in ("t", "face", "u", "v"):
            rows[name] = getattr(hits, name)
        return rows

    return _by_chunks(octree, origins, directions, trace, HIT)


def any_hit(
    octree: Octree | RayScene, origins: Any, directions: Any, *, t_min: float = 0.0, t_max: float = np.inf
) -> Any:
    """Whether each of the rays in dask arrays hits anything, lazily.

    Parameters
    ----------
    octree : Octree or RayScene
    origins, directions : dask.array.Array, shape (n, 3)
    t_min, t_max : float, default 0, inf
        As for `closest_hit`.

    Returns
    -------
    dask.array.Array of bool, shape (n,)

    Raises
    ------
    ValueError
        As for `closest_hit`.

    Examples
    --------
    >>> import dask.array as da
    >>> from renderer import Octree
    >>> from renderer.cluster import any_hit
    >>> floor = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> origins, directions = da.array([[0.25, 0.25, 2.0], [9, 9, 2]]), da.array([[0.0, 0, -1], [0, 0, -1]])
    >>> any_hit(floor, origins, directions).compute()
    array([ True, False])
    """

    def trace(mesh: SentMesh, o: NDArray[Any], d: NDArray[Any]) -> NDArray[Any]:
        return mesh.octree().any_hit(o, d, t_min=t_min, t_max=t_max)

    return _by_chunks(octree, origins, directions, trace, np.dtype(bool))


def _by_chunks(octree: Octree | RayScene, origins: Any, directions: Any, trace: Any, dtype: np.dtype[Any]) -> Any:
    import dask.array as da
    from dask import delayed

    for name, array in (("origins", origins), ("directions", directions)):
        expect(isinstance(array, da.Array), name, "a dask array", type(array).__name__)
        expect(array.ndim == 2 and array.shape[1] == 3, name, "shape (n, 3)", f"shape {array.shape}")
    same = origins.shape == directions.shape
    expect(same, "directions", f"shape {origins.shape} as origins have", f"shape {directions.shape}")
    o = origins.rechunk({1: 3})
    d = directions.rechunk((o.chunks[0], (3,)))
    mesh = octree_of(octree).mesh
    digest = digest_of(mesh.vertices, mesh.faces)
    # One task that all chunks need: a cluster keeps what it returns on each worker that asked for it.
    sent = delayed(SentMesh(digest, mesh.vertices, mesh.faces, SPLIT), name=f"mesh-{digest}", traverse=False)
    blocks = [
        da.from_delayed(delayed(trace)(sent, a, b), (rows,), dtype)
        for rows, a, b in zip(o.chunks[0], o.to_delayed()[:, 0], d.to_delayed()[:, 0], strict=True)
    ]
    return da.concatenate(blocks) if blocks else da.zeros(0, dtype)
