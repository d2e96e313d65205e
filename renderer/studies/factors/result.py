"""View factors as they are returned: of surfaces, and of points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array
else:
    csr_array = Any

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ViewFactors:
    """View factors between n surfaces, and from them to the sky.

    Attributes
    ----------
    areas : ndarray of float64, shape (n,)
        The area A that each surface sends from: of both sides where both send, times 1 minus the transmittance.
    exchange : scipy.sparse.csr_array of float64, shape (n, n)
        A_i F_ij. Exactly symmetric, nowhere negative; the diagonal of a plane surface is 0. With ``form="rays"`` an
        operator that multiplies vectors by ``@``.
    sky : ndarray of float64, shape (n,)
        The share of what each surface sends that meets nothing.
    backs : ndarray of float64, shape (n,)
        The share that ends on backs of faces, which do not receive. It is 0 in a sound model.
    errors : scipy.sparse.csr_array of float64, shape (n, n), or None
        The standard error of each entry of `matrix`; an entry that is exact has none. None with ``form="rays"``.
    rays : ndarray of int64, shape (n,)
        The rays that left each surface.

    See Also
    --------
    view_factors

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import view_factors
    >>> factors = view_factors(Octree.from_mesh(box()))
    >>> factors.sky.tolist()[:3], factors.exchange.nnz
    ([1.0, 1.0, 1.0], 0)
    """

    areas: Floats
    exchange: csr_array
    sky: Floats
    backs: Floats
    errors: csr_array | None
    rays: NDArray[np.int64]

    @property
    def matrix(self) -> csr_array:
        """The view factors F, (n, n) csr_array: F_ij is the share of what surface i sends that arrives at surface j.

        Each row has the sum 1 with `sky` and `backs`, and A_i F_ij = A_j F_ji. Raises ``ValueError`` with
        ``form="rays"``.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> from renderer.studies import view_factors
        >>> room = box()
        >>> inside = Octree(room.vertices, room.faces[:, ::-1])
        >>> walls = [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
        >>> view_factors(inside, walls).matrix.toarray()[0].round(4)
        array([0.    , 0.1998, 0.2   , 0.2   , 0.2   , 0.2   ])
        """
        if self.errors is None:
            raise ValueError("matrix: expected view factors with form='matrix', got form='rays', which has none")
        factors = self.exchange.copy()
        factors.data /= np.repeat(self.areas, np.diff(factors.indptr))
        return factors


@dataclass(frozen=True, eq=False)
class PointFactors:
    """View factors from m points to n surfaces and to the sky.

    Attributes
    ----------
    matrix : scipy.sparse.csr_array of float64, shape (m, n)
        The share of what the plane of each point sees, by the cosine law, that each surface fills.
    sky : ndarray of float64, shape (m,)
    backs : ndarray of float64, shape (m,)
        As of `ViewFactors`. Each row of `matrix` has the sum 1 with both.
    errors : scipy.sparse.csr_array of float64, shape (m, n)
        The standard error of each entry of `matrix`.
    rays : ndarray of int64, shape (m,)
        The rays that left each point.

    See Also
    --------
    view_factors_from
    """

    matrix: csr_array
    sky: Floats
    backs: Floats
    errors: csr_array
    rays: NDArray[np.int64]
