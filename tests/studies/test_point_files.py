"""Files of points for studies: the same rows from each format, and what is none."""

from pathlib import Path

import numpy as np
import pytest
from cases import cases
from ply_bytes import ply

from renderer import Octree
from renderer.mesh.shapes import box
from renderer.studies.points import of_file

pytestmark = pytest.mark.judges("octree-render study --points")

OCTREE = Octree(box())
ROWS = np.random.default_rng(3).normal(size=(4, 6)).round(3)
AXES = [f"double {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]


def text(separator: str, columns: int) -> bytes:
    return "\n".join(separator.join(map(repr, row[:columns])) for row in ROWS.tolist()).encode()


@pytest.mark.parametrize("columns", [3, 6])
@cases("suffix", ["npy", "csv", "names.csv", "semicolons.csv", "xyz", "ply"])
def test_each_format_has_the_same_points(suffix: str, columns: int, tmp_path: Path) -> None:
    path = tmp_path / f"points.{suffix}"
    content = {
        "csv": text(",", columns), "names.csv": b"x,y,z,a,b,c\n" + text(", ", columns),
        "semicolons.csv": text(";", columns), "xyz": b"# a scan\n\n" + text(" ", columns),
        "ply": ply("binary_little_endian", ("vertex", AXES[:columns], ROWS[:, :columns].tolist())),
    }  # fmt: skip
    if suffix == "npy":
        np.save(path, ROWS[:, :columns])
    else:
        path.write_bytes(content[suffix])
    found = of_file(OCTREE, path, "z").points
    np.testing.assert_array_equal(found.points, ROWS[:, :3])
    np.testing.assert_array_equal(found.normals, ROWS[:, 3:] if columns == 6 else np.tile([0.0, 0.0, 1.0], (4, 1)))


@cases(
    ("name", "content", "says"),
    [
        ("a.txt", b"1 2 3", r"--points: expected an \.npy, \.csv, \.xyz or \.ply file, got .*a\.txt"),
        ("a.csv", b"1,2,3\n1,2", "--points: expected rows of 3 or 6 numbers, got .*a\\.csv: "),
        ("a.csv", b"1,2,x", "--points: expected rows of 3 or 6 numbers, got .*a\\.csv: could not convert"),
        ("a.csv", b"1,2", r"--points: expected an array \(n, 3\), .* got shape \(1, 2\)"),
        ("a.xyz", b"", "--points: expected"),
        ("a.ply", b"ply\n", "--points: expected rows of 3 or 6 numbers, got .*a\\.ply: header: "),
    ],
)
def test_what_has_no_points_is_said(name: str, content: bytes, says: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=says):
        of_file(OCTREE, tmp_path / name, "z")
