"""Checked arguments: the emission and reflectance of surfaces, as columns of channels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.studies.factors.free import RayExchange
from renderer.studies.factors.result import ViewFactors, csr_array

Floats = NDArray[np.float64]
# A surface of which no more is left sees nothing but backs: some roundings of sums that are 1.
_WHOLE = 1e-9

# Rows of rays that are counted together: NumPy makes int64 of them, some dozens of megabytes.
_BLOCK = 1 << 14


class Exchange(NamedTuple):
    """View factors as a system of equations reads them.

    areas   (n,), those that are not behind backs of faces; of a surface that is there whole, its whole area
    powers  (n,), the same, but 0 for such a surface, which neither sends nor receives
    matrix  (n, n), A_i F_ij, symmetric: anything that multiplies (n, c) by @
    sky     (n,), the share of each row that the sky fills
    rows    (n,), the sum of each row of F, and slack, the share of it by which rounding may have moved a product
    """

    areas: Floats
    powers: Floats
    matrix: csr_array | RayExchange
    sky: Floats
    rows: Floats
    slack: float


def check_factors(factors: object) -> Exchange:
    """View factors, checked for what a solution relies on. Raises ``ValueError`` naming the surface."""
    if not isinstance(factors, ViewFactors):
        expect(False, "factors", "ViewFactors, as renderer.studies.view_factors returns", type(factors).__name__)
    assert isinstance(factors, ViewFactors)
    areas, matrix, sky = factors.areas, factors.exchange, factors.sky
    n = len(areas)
    expect(n > 0, "factors", "at least one surface", "none")
    expect(matrix.shape == (n, n), "factors", f"an exchange of shape ({n}, {n})", f"shape {matrix.shape}")
    expect(sky.shape == (n,), "factors", f"a share of sky for each surface, shape ({n},)", f"shape {sky.shape}")
    reject_rows("factors", "areas that are finite and > 0", areas, ~((areas > 0.0) & (areas < np.inf)))
    reject_rows("factors", "shares of sky >= 0", sky, ~((sky >= 0.0) & (sky < np.inf)))
    # rule: area-behind-backs
    powers = np.where(factors.backs < 1.0 - _WHOLE, areas * (1.0 - factors.backs), 0.0)
    areas = np.where(powers > 0.0, powers, areas)
    sky = sky * (factors.areas / areas)
    if hasattr(matrix, "indptr"):
        least = float(matrix.data.min(initial=0.0))
        expect(least >= 0.0 and bool(np.isfinite(matrix.data).all()), "factors", "exchanges >= 0, finite", f"{least}")
    # A sum of k numbers >= 0, with the operations around it, errs by a share of at most k + 12 roundings (Higham,
    # Accuracy and Stability of Numerical Algorithms, 2002, section 4.2).
    slack = (_terms_of(matrix, n) + 12) * float(np.finfo(np.float64).eps)
    rows = np.asarray(matrix @ np.ones((n, 1)))[:, 0] / areas
    return Exchange(areas, powers, matrix, sky, rows, slack)


def _terms_of(matrix: csr_array | RayExchange, n: int) -> int:
    """The most terms of a row of its product."""
    if hasattr(matrix, "indptr"):
        return int(np.diff(matrix.indptr).max(initial=0))
    if not isinstance(matrix, RayExchange):
        return n
    # The rays that leave a surface, and those that end on it.
    arriving = np.zeros(n, np.int64)
    for begin in range(0, n, _BLOCK):
        arriving += np.bincount(matrix.targets[begin : begin + _BLOCK].ravel(), minlength=n + 2)[:n]
    return matrix.targets.shape[1] + int(arriving.max(initial=0))


def check_channels(argument: str, values: ArrayLike, n: int) -> Floats:
    """A scalar, (n,) or (n, 3), as (n, 1) or (n, 3) of finite numbers >= 0. Raises ``ValueError`` naming the row."""
    given = real_argument(argument, values)
    fits = given.ndim == 0 or given.shape in ((n,), (n, 3))
    expect(fits, argument, f"one number, shape ({n},) or ({n}, 3), a row a surface", f"shape {given.shape}")
    rows: Floats = np.array(given, np.float64)
    rows = np.broadcast_to(rows, (n,))[:, None] if rows.ndim < 2 else rows
    reject_rows(argument, "finite numbers >= 0", rows, ~((rows >= 0.0) & (rows < np.inf)))
    return rows


def check_sky(argument: str, sky: ArrayLike | None) -> Floats:
    """One number or three for the sky, as (1,) or (3,); 0 for None."""
    given = real_argument(argument, 0.0 if sky is None else sky)
    good = given.shape in ((), (3,)) and bool(((given >= 0.0) & (given < np.inf)).all())
    expect(good, argument, "a finite number >= 0, three of them, or None", repr(sky))
    return np.array(given, np.float64).reshape(-1)


def reject_rows(argument: str, expected: str, values: NDArray[np.generic], bad: NDArray[np.bool_]) -> None:
    """Raise ``ValueError`` naming the argument and its first bad row, if there is one."""
    if bad.any():
        row = int(bad.reshape(len(bad), -1).any(axis=1).argmax())
        expect(False, argument, expected, f"{values[row].tolist()} in row {row}")
