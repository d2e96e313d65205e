"""Patches that are cut where radiosity changes: solve, mark, cut, and solve again."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.counts import count_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.mesh.crease import smooth_edges
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.radiosity.patch import Patches, refined
from renderer.radiosity.solve import Radiosity, radiosity
from renderer.radiosity.surfaces import check_channels
from renderer.studies.factors.compute import view_factors
from renderer.studies.factors.result import ViewFactors
from renderer.studies.factors.surfaces import areas_of

Floats = NDArray[np.float64]


class Adapted(NamedTuple):
    """Patches, and their radiosity.

    Attributes
    ----------
    patches : Patches
    radiosity : Radiosity

    See Also
    --------
    adaptive

    Examples
    --------
    >>> from renderer.mesh.shapes import box
    >>> from renderer.radiosity import adaptive, patches
    >>> found = adaptive(patches(box(), 9.0), emission=1.0, reflectance=0.5, rounds=0)
    >>> len(found.patches.faces), found.radiosity.values.shape
    (12, (12, 3))
    """

    patches: Patches
    radiosity: Radiosity


def adaptive(
    patches: Patches,
    emission: ArrayLike,
    reflectance: ArrayLike,
    *,
    sky: ArrayLike | None = None,
    contrast: float = 0.1,
    rounds: int = 3,
    crease: float = 30.0,
    rtol: float = 1e-6,
    factors: Callable[[Mesh], ViewFactors] | None = None,
) -> Adapted:
    """Solve for radiosity, cut patches where it changes, and solve again.

    Parameters
    ----------
    patches : Patches
        As `patches` returns: those to begin with.
    emission, reflectance : array_like
        As for `radiosity`, with a row for each face of the mesh that was cut into patches.
    sky : float or array_like, shape (3,), optional
        As for `radiosity`.
    contrast : float, default 0.1
        The change that is still too small to cut, > 0; see Notes.
    rounds : int, default 3
        How often patches are cut at most; 0 only solves.
    crease : float, default 30
        In degrees. What changes at a sharper edge is no reason to cut.
    rtol : float, default 1e-6
        As for `radiosity`.
    factors : callable, optional
        Takes a mesh and returns its `ViewFactors`. By default those of ``view_factors(Octree.from_mesh(mesh))``.

    Returns
    -------
    Adapted
        ``patches`` and ``radiosity``. The patches are cut from the same mesh.

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row.

    Notes
    -----
    Two patches are cut at their common edge if the change of B over it, in the channel that changes most, times the
    length of the edge is more than

        contrast * (mean of the reflected B - E, by area) * (the longest edge of the patches to begin with)

    Where B is smooth, half the edge has a quarter of that product, and at the edge of a shadow half of it. So cuts end
    everywhere, at shadows later. Only patches with one emission and one reflectance are compared.

    References
    ----------
    Cohen, Greenberg, Immel, Brock, An efficient radiosity approach for realistic image synthesis, 1986, on patches that
    are cut where radiosity changes.

    Examples
    --------
    >>> import numpy as np
    >>> from renderer import Mesh
    >>> from renderer.mesh.shapes import box
    >>> from renderer.radiosity import adaptive, patches
    >>> room = box()
    >>> room = Mesh(room.vertices, room.faces[:, ::-1])
    >>> lamp = np.repeat([0.0, 1.0], [10, 2])
    >>> found = adaptive(patches(room, 1.0), lamp, 0.5, rounds=1)
    >>> len(found.patches.faces) == len(found.radiosity.values)
    True
    """
    expect(isinstance(patches, Patches), "patches", "Patches", type(patches).__name__)
    count = int(patches.faces.max(initial=-1)) + 1
    emitted, rho = (
        np.array(np.broadcast_to(check_channels(name, values, count), (count, 3)))
        for name, values in (("emission", emission), ("reflectance", reflectance))
    )
    limit = real_argument("contrast", contrast)
    expect(limit.ndim == 0 and bool(0.0 < limit < np.inf), "contrast", "a finite number > 0", repr(contrast))
    left = count_argument("rounds", rounds, 0)
    factors_of = _factors_of if factors is None else factors
    longest = float(_lengths(patches.mesh).max(initial=0.0))
    while True:
        own, share = emitted[patches.faces], rho[patches.faces]
        found = radiosity(factors_of(patches.mesh), own, share, sky=sky, rtol=rtol)
        marked = _marked(patches, found, own, share, float(limit) * longest, crease)
        if left == 0 or not marked.any():
            return Adapted(patches, found)
        patches, left = refined(patches, marked), left - 1


def _factors_of(mesh: Mesh) -> ViewFactors:
    return view_factors(Octree.from_mesh(mesh))


def _lengths(mesh: Mesh) -> Floats:
    """The lengths of the sides of faces, (F, 3): that from each corner to the next."""
    corners = mesh.triangles
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def _marked(
    patches: Patches, found: Radiosity, emitted: Floats, rho: Floats, limit: float, crease: float
) -> NDArray[np.bool_]:
    """The patches at an edge over which radiosity changes too much; ``limit`` is that times a length."""
    mesh, areas = patches.mesh, areas_of(patches.mesh)
    one, other, _ = smooth_edges(mesh, crease)
    sides = _lengths(mesh).reshape(-1)[one]
    one, other = one // 3, other // 3
    alike = (emitted[one] == emitted[other]).all(axis=1) & (rho[one] == rho[other]).all(axis=1)
    change = np.abs(found.values[one] - found.values[other]).max(axis=1)
    mean = float((areas[:, None] * (found.values - emitted)).sum() / (3.0 * areas.sum()))
    due = alike & (change * sides > limit * mean)
    marked = np.zeros(len(patches.faces), np.bool_)
    marked[one[due]] = marked[other[due]] = True
    return marked
