"""Files of view factors: ``.npz`` with all arrays, and ``.csv`` for a spreadsheet."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable
from io import TextIOWrapper
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.studies.factors.result import ViewFactors
from renderer.studies.factors.sparse import scipy_sparse
from renderer.system.files import as_path, write_atomically

# Columns of a spreadsheet, 2^14, without those that are no surface.
MOST_COLUMNS = (1 << 14) - 4
_VECTORS = ("areas", "sky", "backs", "rays")
_MATRICES = ("exchange", "errors")


def save_factors(factors: ViewFactors, path: str | os.PathLike[str]) -> None:
    """``ViewFactors.save``."""
    target, count = as_path("path", path), len(factors.areas)
    check_factors_path("path", target, count)
    expect(factors.errors is not None, "form", "view factors with form='matrix'", "form='rays', which has no file")
    write = _WRITERS[target.suffix.lower()]
    write_atomically(target, lambda file: write(factors, file))


def check_factors_path(argument: str, path: Path, surfaces: int = 0) -> None:
    """Raise ``ValueError`` for a file that view factors of so many surfaces cannot be written to."""
    suffix = path.suffix.lower()
    expect(suffix in _WRITERS, argument, f"a file that ends in {' or '.join(_WRITERS)}", repr(str(path)))
    few = suffix != ".csv" or surfaces <= MOST_COLUMNS
    expect(few, argument, f"an .npz for more than {MOST_COLUMNS:,} surfaces", f"{path} for {surfaces:,}")


def load_factors(path: str | os.PathLike[str]) -> ViewFactors:
    """``ViewFactors.load``."""
    scipy_sparse()
    source = as_path("path", path)
    wrong = f"{source}: expected view factors that ViewFactors.save wrote"
    try:
        with np.load(source) as file:
            arrays = {name: file[name] for name in file.files}
    except (ValueError, EOFError, TypeError, AttributeError, BadZipFile) as error:
        raise ValueError(f"{wrong}, got no .npz file: {error}") from None
    missing = {*_VECTORS, *(f"{m}_{part}" for m in _MATRICES for part in ("data", "indices", "indptr"))} - arrays.keys()
    if missing:
        raise ValueError(f"{wrong}, got a file without {min(missing)}")
    number = len(arrays["areas"])
    try:
        exchange, errors = (_matrix(arrays, name, number) for name in _MATRICES)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{wrong}: {error}") from None
    names = tuple(map(str, arrays["names"])) if "names" in arrays else None
    return ViewFactors(arrays["areas"], exchange, arrays["sky"], arrays["backs"], errors, arrays["rays"], names)


def names_of(factors: ViewFactors) -> tuple[str, ...]:
    """The names of the surfaces; their numbers where they have none."""
    return tuple(map(str, range(len(factors.areas)))) if factors.names is None else factors.names


def _matrix(arrays: dict[str, NDArray[Any]], name: str, number: int) -> Any:
    parts = tuple(arrays[f"{name}_{part}"] for part in ("data", "indices", "indptr"))
    matrix = scipy_sparse().csr_array(parts, shape=(number, number))
    # Else an index beyond the columns would be read from any memory.
    matrix.check_format(full_check=True)
    return matrix


def _write_npz(factors: ViewFactors, file: BinaryIO) -> None:
    arrays = {name: getattr(factors, name) for name in _VECTORS}
    for name in _MATRICES:
        matrix = getattr(factors, name)
        arrays |= {f"{name}_{part}": getattr(matrix, part) for part in ("data", "indices", "indptr")}
    arrays["matrix_data"] = factors.matrix.data
    if factors.names is not None:
        arrays["names"] = np.array(factors.names, np.str_)
    np.savez(file, **arrays)


def _write_csv(factors: ViewFactors, file: BinaryIO) -> None:
    names, matrix, errors = names_of(factors), factors.matrix, factors.errors
    assert errors is not None
    text = TextIOWrapper(file, encoding="utf-8", newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["surface", "area", *names, "sky", "backs", "error"])
    for row, name in enumerate(names):
        entries, spreads = (slice(m.indptr[row], m.indptr[row + 1]) for m in (matrix, errors))
        shares = np.zeros(len(names))
        shares[matrix.indices[entries]] = matrix.data[entries]
        worst = errors.data[spreads].max(initial=0.0)
        ends = factors.sky[row], factors.backs[row], worst
        table.writerow([name, float(factors.areas[row]), *shares.tolist(), *map(float, ends)])
    text.detach()


_WRITERS: dict[str, Callable[[ViewFactors, BinaryIO], None]] = {".npz": _write_npz, ".csv": _write_csv}
