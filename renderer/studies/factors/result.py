"""View factors as they are returned: of surfaces, and of points."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array as csr_array
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
    names : tuple of str, optional
        The name of each surface, which files have; None if they have none.

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
    names: tuple[str, ...] | None = None

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

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file, which appears whole or not at all.

        Parameters
        ----------
        path : str or path
            ``.npz``: all of it, as `ViewFactors.load` reads it and ``numpy.load`` too: the arrays by their names,
            without `names` if there are none, and of each matrix the three of ``scipy.sparse.csr_array``, such as
            ``exchange_data``, ``exchange_indices`` and ``exchange_indptr``. Of `matrix` there is ``matrix_data``; the
            other two are those of `exchange`.

            ``.csv``: a row for each surface: its name, its area, a column with the view factor to each surface, the
            sky, backs, and the largest standard error of the row.

        Raises
        ------
        OSError
            If the file cannot be written.
        ValueError
            If the name ends otherwise, with ``form="rays"``, or for a ``.csv`` of more than 16,380 surfaces, which is
            what a spreadsheet has columns for.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> from renderer import Octree
        >>> from renderer.studies import view_factors
        >>> factors = view_factors(Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     factors.save(f"{folder}/factors.csv")
        ...     print(Path(folder, "factors.csv").read_text(), end="")
        surface,area,0,sky,backs,error
        0,0.5,0.0,1.0,0.0,0.0
        """
        from renderer.studies.factors.saved import save_factors  # which imports this module

        save_factors(self, path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ViewFactors:
        """Read an ``.npz`` file that `save` wrote.

        Parameters
        ----------
        path : str or path

        Returns
        -------
        ViewFactors

        Raises
        ------
        OSError
            If the file cannot be read.
        ValueError
            If it is none of these files.
        ImportError
            If SciPy is not installed.

        Examples
        --------
        >>> import tempfile
        >>> from renderer import Octree
        >>> from renderer.studies import ViewFactors, view_factors
        >>> factors = view_factors(Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     factors.save(f"{folder}/factors.npz")
        ...     ViewFactors.load(f"{folder}/factors.npz").sky
        array([1.])
        """
        from renderer.studies.factors.saved import load_factors

        return load_factors(path)


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

    Examples
    --------
    A point below a roof sees the roof and the sky beside it.

    >>> from renderer import Octree
    >>> from renderer.studies import view_factors_from
    >>> roof = Octree([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], [[0, 2, 1], [0, 3, 2]])
    >>> factors = view_factors_from(roof, [[0, 0, 0]], [0, 0, 1], [0, 0], rtol=0.002)
    >>> factors.matrix.toarray().round(2), factors.sky.round(2)
    (array([[0.55]]), array([0.45]))
    """

    matrix: csr_array
    sky: Floats
    backs: Floats
    errors: csr_array
    rays: NDArray[np.int64]
