"""STL files as other programs write them: what their bytes hold is what is read."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer.mesh.load import parse_mesh

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)
TRIANGLES = st.lists(st.lists(FLOATS, min_size=9, max_size=9), min_size=1, max_size=6)


@given(TRIANGLES, st.sampled_from([b"", b"solid of a program", b"facet normal", b"\xef\xbb\xbfsolid"]))
@settings(max_examples=30)
def test_binary_is_told_by_its_length_whatever_its_header_says(rows: list[list[float]], header: bytes) -> None:
    """With normals that are none, as some programs leave them, and bytes of colours behind each facet."""
    records = [struct.pack("<12fH", np.nan, 5.0, 0.0, *row, 40000 + k) for k, row in enumerate(rows)]
    mesh = parse_mesh(header.ljust(80, b" ") + struct.pack("<I", len(rows)) + b"".join(records), ".stl")
    np.testing.assert_array_equal(mesh.triangles, np.reshape(rows, (-1, 3, 3)))
    np.testing.assert_array_equal(mesh.faces.ravel(), np.arange(3 * len(rows)))


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@given(TRIANGLES, st.booleans(), st.sampled_from(["", "  ", "\t"]), st.sampled_from(["{!r}", "{:+.17e}"]))
@settings(max_examples=15)
def test_text_may_be_written_in_any_case_and_with_any_blanks(
    newline: str, rows: list[list[float]], loud: bool, indent: str, number: str
) -> None:
    lines = []
    for k, row in enumerate(rows):
        words = [number.format(x) for x in row]
        lines += [f"solid part {k}", "facet normal 0 0 1", "outer loop"]
        lines += [f"vertex   {' '.join(words[i : i + 3])}" for i in (0, 3, 6)] + ["endloop", "endfacet", "endsolid"]
    text = newline.join(indent + line for line in lines)
    mesh = parse_mesh((text.upper() if loud else text).encode(), ".stl")
    np.testing.assert_array_equal(mesh.triangles, np.reshape(rows, (-1, 3, 3)))
