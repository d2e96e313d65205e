"""The dispatcher that Python calls has the types of Numba's own, and loads less."""

import subprocess
import sys
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.core import entrypoints

from renderer.jit.decorators import kernel
from renderer.jit.entry import Entry

GRID = np.zeros((4, 6))
FIXED = np.zeros(3)
FIXED.flags.writeable = False


class Record(NamedTuple):
    """Arrays and numbers, as kernels get them."""

    grid: np.ndarray
    count: int


VALUES = {
    "array": GRID,
    "columns": np.asfortranarray(GRID),
    "slice": GRID[:, ::2],
    "no dimension": np.zeros(()),
    "read-only": FIXED,
    "of records": np.zeros(2, [("a", np.int32), ("b", np.float64)]),
    "of another class": GRID.view(np.recarray),
    "of objects": np.array([None]),
    "record": Record(GRID, 2),
    "tuple": (1, (True, None), FIXED),
    "pair": (1.0, 2.0),
    "tuple of what is not typed": (1, object()),
    "empty": (),
    "int": -(2**63) + 1,
    "unsigned": 2**63,
    "too large": 2**64,
    "float": 0.5,
    "NumPy's number": np.float32(0.5),
    "text": "text",
}


@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES)
def test_an_argument_has_the_type_that_numba_gives_it(value):
    def function(x):
        return x

    assert Entry(function).typeof_pyval(value) == numba.njit(function).typeof_pyval(value)


def test_what_numba_cannot_type_is_an_error_that_names_it():
    @kernel
    def same(x):
        return x

    with pytest.raises(numba.TypingError, match="Unsupported array type"):
        same(np.ma.masked_array(GRID))


def test_extensions_of_numba_are_there_when_a_kernel_is_compiled(monkeypatch):
    monkeypatch.setattr(entrypoints, "_already_initialized", False)

    @kernel
    def same(x):
        return x

    assert same(1) == 1 and entrypoints._already_initialized


def test_a_kernel_is_loaded_without_what_only_compiling_needs():
    script = """
import sys
import numpy as np
from numba.core import entrypoints
from renderer import Octree, shapes
box = shapes.box()
Octree(box.vertices, box.faces).closest_hit(np.zeros((1, 3)), np.eye(3)[:1])
print("numpy.ma" in sys.modules, entrypoints._already_initialized)
"""
    for _ in range(2):  # the first may compile
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
    assert done.stdout == "False False\n"
