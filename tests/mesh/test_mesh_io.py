"""Mesh files: every format and fault, each from a fixture that the test writes itself."""

import itertools
import re
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from ply_bytes import FORMATS, Rows, ply

from renderer.errors import MeshError
from renderer.mesh import obj
from renderer.mesh.load import load_mesh, save_ply
from renderer.mesh.mesh import Mesh, RepairWarning
from renderer.mesh.reading import Reading
from renderer.mesh.shapes import torus

pytestmark = pytest.mark.judges("Mesh", "Mesh.triangles", "MeshError", "load_mesh")


SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
XYZ = ["float x", "float y", "float z"]
INDICES = ["list uchar int vertex_indices"]


def load_bytes(folder: Path, content: bytes, name: str = "model.ply") -> Mesh:
    path = folder / name
    path.write_bytes(content)
    return load_mesh(path)


def fault(folder: Path, content: bytes, name: str = "model.ply") -> str:
    """The one line that loading this content fails with, checked to name the file."""
    with pytest.raises(MeshError) as caught:
        load_bytes(folder, content, name)
    message = str(caught.value)
    assert message.startswith(f"{folder / name}: ") and "\n" not in message and len(message) < 400
    return message.removeprefix(f"{folder / name}: ")


# --- PLY that is right ----------------------------------------------------------------------------------------


# An L that no fan from its first corner covers, in a slanted plane, between two triangles.
NOTCHED = [[2, 1, 2], [1, 1, 1], [1, 2, 1], [0, 2, 0], [0, 0, 0], [2, 0, 2]]


def assert_notched(mesh: Mesh) -> None:
    """The L's area once, wound as it is, between the triangles before and after it."""
    assert mesh.faces[0].tolist() == [0, 1, 2] and mesh.faces[5:].tolist() == [[3, 4, 5]]
    a, b, c = np.moveaxis(mesh.triangles[1:5], 1, 0)
    along = np.cross(b - a, c - a)
    assert np.array_equal(along[:, 0], -along[:, 2]) and not along[:, 1].any()
    assert (along[:, 2] > 0).all() and along[:, 2].sum() / 2 == 3


@pytest.mark.parametrize("form", FORMATS)
def test_ply_notched_polygons_are_cut_right(tmp_path: Path, form: str) -> None:
    faces: Rows = [[[0, 1, 2]], [[0, 1, 2, 3, 4, 5]], [[3, 4, 5]]]
    assert_notched(load_bytes(tmp_path, ply(form, ("vertex", XYZ, NOTCHED), ("face", INDICES, faces))))


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_ply_line_ends_and_blanks(tmp_path: Path, newline: str) -> None:
    content = ply("ascii", ("vertex", XYZ, SQUARE), ("face", INDICES, [[[0, 1, 2]]])).decode()
    content = content.replace("ply\n", "ply \n").replace("element vertex", "obj_info x y\n\nelement  vertex") + "\n \n"
    assert load_bytes(tmp_path, content.replace("\n", newline).encode()).faces.tolist() == [[0, 1, 2]]


def test_ply_binary_body_may_begin_with_a_newline_byte(tmp_path: Path) -> None:
    """After 'end_header\\r\\n' the body starts; after 'end_header\\n' a body byte 10 or 13 is data."""
    content = ply(
        "binary_little_endian",
        ("tag", ["uchar a"], [[10], [13]]),
        ("vertex", XYZ, SQUARE),
        ("face", INDICES, [[[0, 1, 2]]]),
    )
    with pytest.warns(RepairWarning, match="left out: element tag$"):
        assert load_bytes(tmp_path, content).vertices.tolist() == SQUARE


def test_ply_binary_may_be_padded(tmp_path: Path) -> None:
    elements = (("vertex", XYZ, SQUARE), ("face", INDICES, [[[0, 1, 2]]]))
    assert load_bytes(tmp_path, ply("binary_little_endian", *elements, trailing=b"\n\0\0\0")).faces.tolist() == [
        [0, 1, 2]
    ]


def test_many_faces_load_without_a_step_a_face(tmp_path: Path) -> None:
    """Quiet, it takes 0.03 s; the rest is room for a loaded machine. A step of Python a face takes longer."""
    path = tmp_path / "large.ply"
    save_ply(torus(around=500, across=200), path)
    start = time.process_time()
    mesh = load_mesh(path)
    assert time.process_time() - start < 0.4
    assert len(mesh.faces) == 200_000


# --- PLY that is wrong ----------------------------------------------------------------------------------------

VERTEX = ("vertex", XYZ, SQUARE)
FACE = ("face", INDICES, [[[0, 1, 2]]])
STRIPS = ["list int int vertex_indices"]
FLOAT_INDICES = ["list uchar float vertex_indices"]
NAN = float("nan")


def colored(type_: str, value: float) -> tuple[str, list[str], Rows]:
    return "vertex", [*XYZ, f"{type_} red", f"{type_} green", f"{type_} blue"], [[*p, *[value] * 3] for p in SQUARE]


@cases("form", FORMATS)
@cases(
    ("elements", "message"),
    [
        ([VERTEX], "holds no faces"),
        ([VERTEX, ("tristrips", STRIPS, [[[]], [[-1, -1]]])], "holds no faces"),
        ([], "expected an element 'vertex', got no element"),
        ([FACE], "expected an element 'vertex', got face"),
        ([("vertex", [], []), FACE], "expected properties x, y and z, got none"),
        ([("vertex", ["float x", "float z"], [[0, 0]]), FACE], "expected properties x, y and z, got x, z"),
        ([("vertex", ["float x", "float y", "list uchar float z"], [[0, 0, [1]]]), FACE], "expected properties x, y"),
        ([VERTEX, ("face", ["int vertex_indices"], [[0]])], "expected a list vertex_indices or vertex_index"),
        ([VERTEX, ("face", ["list uchar int corners"], [[[0, 1, 2]]])], "vertex_index, got corners"),
        ([VERTEX, ("face", [], [])], "expected a list vertex_indices or vertex_index, got none"),
        ([VERTEX, ("face", INDICES, [[[0, 1, 4]]])], "faces: expected indices from 0 to 3, got 4 in row 0"),
        ([VERTEX, ("face", INDICES, [[[0, 1, 2]], [[0, -1, 2]]])], "indices from 0 to 3, got -1 in row 1"),
        ([VERTEX, ("face", FLOAT_INDICES, [[[0, 1.5, 2]]])], "expected whole vertex indices, got 1.5"),
        ([VERTEX, ("face", FLOAT_INDICES, [[[0, NAN, 2]]])], "expected whole vertex indices, got nan"),
        ([VERTEX, ("face", FLOAT_INDICES, [[[0, 2.0**60, 2]]])], "expected whole vertex indices, got 1.15"),
        ([VERTEX, ("tristrips", STRIPS, [[[0, 1, 2, -2]]])], "faces: expected indices from 0 to 3, got -2"),
        ([VERTEX, ("tristrips", STRIPS, [[[0, 1, 2, -1, 3]]])], "expected at least 3 vertices in each strip"),
        ([("vertex", XYZ, [*SQUARE[:3], [0, NAN, 0]]), FACE], "expected finite values, got [0.0, nan, 0.0] in row 3"),
        ([colored("float", 9), FACE], "colors: expected values in [0, 1], got [9.0, 9.0, 9.0] in row 0"),
    ],
)
def test_ply_content_faults(tmp_path: Path, form: str, elements: Any, message: str) -> None:
    assert message in fault(tmp_path, ply(form, *elements))


GOOD = ply("ascii", VERTEX, FACE).decode()


@cases(
    ("old", "new", "message"),
    [
        ("ply\n", "plx\n", "expected a first line 'ply', got b'plx"),
        ("format ascii 1.0\n", "", "expected a line 'format', found none"),
        ("format ascii 1.0\n", "format ascii 1.0\nformat ascii 1.0\n", "header line 3"),
        ("format ascii 1.0", "format ascii 2.0", "header line 2: expected a PLY header line, got 'format ascii 2.0'"),
        ("end_header\n", "", "expected a line 'end_header', found none"),
        ("element vertex 4", "element vertex -4", "header line 4: expected a PLY header line, got 'element vertex -4'"),
        ("element vertex 4", "element vertex 999999999999999999", "too short for the 999999999999999999 rows"),
        ("element vertex 4", "element vertex " + "9" * 5000, "header line 4"),
        ("element vertex 4", "element vertex 3", "holds no good faces: left out: what stands behind the last element"),
        ("element face 1", "element vertex 1", "element 'vertex' stands twice"),
        ("float y", "float x", "property 'x' stands twice"),
        ("float y", "floot y", "header line 6: expected a type of PLY, got 'floot'"),
        ("list uchar int", "list float int", "header line 9"),
        ("element vertex 4\n", "", "header line 4: expected a PLY header line, got 'property float x'"),
        ("1 0 0", "1 0 O", "malformed number"),
        ("1 0 0", "1_0 0 0", "malformed number"),
        ("1 0 0", "1e999 0 0", "vertices: expected finite values, got [inf, 0.0, 0.0] in row 1"),
        ("3 0 1 2", "3 0 1", "truncated"),
        ("3 0 1 2", "2.5 0 1 2", "element face: list length 2.5 in row 0"),
        ("3 0 1 2", "-3 0 1 2", "element face: list length -3.0 in row 0"),
        ("3 0 1 2", "inf 0 1 2", "element face: list length inf in row 0"),
        ("3 0 1 2", "4294967296 0 1 2", "element face: list length 4294967296.0 in row 0"),
        ("3 0 1 2", "3 0 1.5 2", "expected whole vertex indices, got 1.5"),
    ],
)
def test_ply_text_faults(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in GOOD
    start = time.process_time()
    assert message in fault(tmp_path, GOOD.replace(old, new, 1).encode())
    assert time.process_time() - start < 1.0


@pytest.mark.parametrize("count", [-1, 2**31 - 1])
def test_ply_binary_list_length_faults(tmp_path: Path, count: int) -> None:
    content = ply(
        "binary_little_endian", VERTEX, ("face", ["list int int vertex_indices"], [[[0, 1, 2]], [[0, 2, 3, 1]]])
    )
    for length in (3, 4):
        broken = content.replace(struct.pack("<i", length) + struct.pack("<i", 0), struct.pack("<ii", count, 0))
        assert broken != content
        assert ("list length -1" if count < 0 else "truncated") in fault(tmp_path, broken)


RICH = [
    ("vertex", [*XYZ, *(f"uchar {c}" for c in ("red", "green", "blue"))], [[*p, 1, 2, 3] for p in SQUARE]),
    ("face", INDICES, [[[0, 1, 2]], [[0, 1, 2, 3]]]),
    ("tristrips", STRIPS, [[[0, 1, 2, -1, 3, 2, 1]]]),
]


@pytest.mark.parametrize("form", FORMATS)
def test_ply_truncated_at_every_byte(tmp_path: Path, form: str) -> None:
    content = ply(form, *RICH).rstrip(b"\n")
    assert len(load_bytes(tmp_path, content).faces) == 5
    for length in range(len(content)):
        fault(tmp_path, content[:length])


SIGNALLING_NAN = b"\x00\x00\xa0\x7f"


@pytest.mark.parametrize("place", ["vertex", "index", "stl"])
def test_signalling_nan_fails_like_any_other(tmp_path: Path, place: str) -> None:
    """Regression: casting one to float64 raised NumPy's warning before the check that names the row."""
    if place == "stl":
        content = foreign_box().export(file_type="stl")
        message = fault(tmp_path, content[:96] + SIGNALLING_NAN + content[100:], "a.stl")
        assert "vertices: expected finite values, got [nan" in message
        return
    face = ("face", ["list uchar float vertex_indices"], [[[0, 1, 2]]])
    content = ply("binary_little_endian", VERTEX, face)
    if place == "vertex":
        start = content.index(b"end_header\n") + len(b"end_header\n")
        assert "got [nan, 0.0, 0.0] in row 0" in fault(
            tmp_path, content[:start] + SIGNALLING_NAN + content[start + 4 :]
        )
    else:
        assert "whole vertex indices, got nan" in fault(tmp_path, content[:-4] + SIGNALLING_NAN)


# --- other formats --------------------------------------------------------------------------------------------

V = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@cases(
    ("text", "faces"),
    [
        (V + "f 1 2 3\nf 1 3 4\n", [[0, 1, 2], [0, 2, 3]]),
        (V + "f 1 2 3 4", [[0, 1, 2], [0, 2, 3]]),
        (V + "f 1 2 \\\n3 \\\n4\n", [[0, 1, 2], [0, 2, 3]]),
        (V + "f -4 -3 -2\n", [[0, 1, 2]]),
        ("v 9 9 9\n" + V + "# note\no a\ng b\ns 1\nl 1 2\np 1\nf 2 3 4\r\n", [[1, 2, 3]]),
        (V + "g a\nf 1 2 3\ng b\nf 1 3 4\ng a\nf 2 3 4\n", [[0, 1, 2], [0, 2, 3], [1, 2, 3]]),
    ],
)
def test_obj_faces(tmp_path: Path, text: str, faces: Any) -> None:
    mesh = load_bytes(tmp_path, text.encode(), "a.obj")
    assert mesh.faces.tolist() == faces and mesh.name == "a"
    assert mesh.vertices.tolist()[-4:] == SQUARE


@cases(
    ("text", "message"),
    [
        ("", "holds no faces"),
        (V + "f 1 2 5\n", "line 5: vertex index out of range: expected 1 to 4 or -4 to -1, got 'f 1 2 5'"),
        (V + "f 1 2 x\n", "line 5: "),
        (V + "f 1/1/1/1 2 3\n", "line 5: expected a corner like"),
        ("v 0\n" + V + "f 1 2 3\n", "line 1: expected at least 2 numbers, got 'v 0'"),
        ("v 0 0 nan\n" + V + "f 2 3 4\n", "vertices: expected finite values, got [0.0, 0.0, nan] in row 0"),
        ("v 0 0 x\n" + V, "line 1: could not convert"),
        ("v 0 0 1_0\n" + V, "line 1: malformed number '1_0'"),
        (V + "f 1 2 0_3\n", "line 5: malformed number '0_3'"),
        (V + "surf 0 1 0 1 1 2 3 4\n", "holds no good faces: left out: free-form curves and surfaces"),
        ("\xff\xfe\0garbage", "holds no good faces: left out: unknown statements"),
    ],
)
def test_obj_faults(tmp_path: Path, text: str, message: str) -> None:
    assert message in fault(tmp_path, text.encode("latin-1"), "a.obj")


@pytest.mark.parametrize("face", ["f 1 2 3 4 5 6", "f 1/1 2/2 3/3 4/4 5/5 6/6", "f -6 -5 -4 -3 -2 -1"])
def test_obj_notched_polygons_are_cut_right(tmp_path: Path, face: str) -> None:
    lines = ["v {} {} {}".format(*p) for p in NOTCHED] + [f"vt {p[0]} {p[1]}" for p in NOTCHED]
    short = ("f 1/1 2/2 3/3", "f 4/4 5/5 6/6") if "/" in face else ("f 1 2 3", "f 4 5 6")
    mesh = load_bytes(tmp_path, "\n".join([*lines, short[0], face, short[1]]).encode(), "a.obj")
    assert_notched(mesh)
    if mesh.texcoords is not None:
        assert np.array_equal(mesh.texcoords, mesh.vertices[:, :2])
    assert (mesh.texcoords is not None) == ("/" in face)


@cases("indent", ["", " "])  # a blank before a keyword is read line by line
@cases(
    ("text", "faces"),
    [
        ("f 1 2 3\n" + V + "f 1 3 4\n", [[0, 1, 2], [0, 2, 3]]),
        ("f 2 3 4 1\n" + V, [[1, 2, 3], [1, 3, 0]]),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 4 -1 -3\nv 0 1 0\n", [[3, 2, 0]]),
    ],
)
def test_obj_faces_may_stand_before_their_vertices(tmp_path: Path, text: str, faces: Any, indent: str) -> None:
    mesh = load_bytes(tmp_path, text.replace("f", indent + "f").encode(), "a.obj")
    assert mesh.vertices.tolist() == SQUARE and mesh.faces.tolist() == faces


def test_obj_vertex_colors(tmp_path: Path) -> None:
    mesh = load_bytes(tmp_path, b"v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 0.5\nf 1 2 3\n", "a.obj")
    assert mesh.colors is not None and mesh.colors.tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 0.5]]
    with pytest.warns(RepairWarning, match="left out: vertex colours, which only some vertices have"):
        mixed = load_bytes(tmp_path, b"v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj")
    assert mixed.colors is None


def test_obj_statements_may_end_in_a_comment(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0 # a corner\nv 1 0 0\nv 0 1 0 #\nf 1 2 3 # 4 5_6\n#f 9\n")
    assert load_mesh(path).faces.tolist() == [[0, 1, 2]]


def test_obj_attributes_may_stand_after_their_faces(tmp_path: Path) -> None:
    for head in ("f 1/2/1 2/1/1 3/2/1\n", "f 1/2/1 2/1/1 \\\n3/2/1\n"):
        mesh = load_bytes(tmp_path, (head + V + "vt 1 2\nvt 3 4\nvn 0 0 1\n").encode(), "a.obj")
        assert mesh.texcoords is not None and mesh.texcoords[mesh.faces].tolist() == [[[3, 4], [1, 2], [3, 4]]]
        assert mesh.normals is not None and mesh.normals.tolist() == [[0, 0, 1]] * 3


@cases(
    ("text", "message"),
    [
        ("f 1 2 5\n" + V, "line 1: vertex index out of range: expected 1 to 4 or -0 to -1, got 'f 1 2 5'"),
        ("v 0 0 0\nf 1 2 -2\n" + V, "line 2: vertex index out of range: expected 1 to 5 or -1 to -1, got 'f 1 2 -2'"),
        (V + "f 1 2 99999999999999999999\n", "line 5: vertex index out of range: expected 1 to 4 or -4 to -1"),
        (V + "f 1 2 3 0x1\n", "line 5: "),
        ("v 0 0 0x10\n" + V + "f 1 2 3\n", "line 1: could not convert string to float: '0x10', got 'v 0 0 0x10'"),
    ],
)
def test_obj_index_faults(tmp_path: Path, text: str, message: str) -> None:
    assert message in fault(tmp_path, text.encode(), "a.obj")
    if "out of range" in message:
        (tmp_path / "a.obj").write_text(text + "f 1 2 3\n")
        with pytest.warns(RepairWarning, match="dropped 1 of 2 faces"):
            assert load_mesh(tmp_path / "a.obj", repair=True).faces.tolist() == [[0, 1, 2]]


# Statements of which most files made of them are of the common shape, and those that never are.
COMMON = ["v 0.1 -2e-3 +.5", "v 1 0 0", "v\t3  7 1.", "vt 0.25 1", "vt .5 .5", "vn 0 0 1", "f 1 2 3", "f 1\t2 3 1 ",
          "f 01 3 2", "# f 1 2", "g a b", "usemtl x", "usemtl a #1", "mtllib a  b#.mtl", "", "s off", "vp 1 2", "#",
          "l 1 2"]  # fmt: skip
SLASHED = ["f 1/1/1 2/2/1 3/1/1", "f 1/1/1 3/2/2 2/1/1 1/1/1", "f 2/1/1 3/1/1 1/2/1"]
ODD = [
    "f 1/1/1 2 3/1", "f 1 2/1/1 3/1", "f 1 2//1 3",
    "v 0 0 0 1 0.5 0", "v 1 1 1 1", "v nan 0 1", "v 1 -inf 0", "v 1 0", "v 1_0 0 0", "v 0x10 0 0",
    "v 1 0 0 # x", "v", "vt 1", "vt 1 2 3", "vt x", "vt 1 2 v", "vn 1 0", "vn 1 2 3 4", "f 1 2", "f",
    "f 1/1 2/1 3/1", "f 1//1 2//1 3//1", "f 1//1 2/1/1 3//1", "f 1/1/1 2 3", "f 1/ 2/ 3/", "f /1 /2 /3",
    "f 1-2 3", "f -1 -2 -3", "f 1/2/3/1 2 3", "f 0 1 2", "f 1 2 99", "f +1 2 3",
    "f 1 2 18446744073709551617", "f 1 f 2 3", "f 1 2 3_", "f /// 1 2", "f 1/-2/ 3/1/ 1/1/", "f 1 2 \\",
    "g a\\", "v 1 \\", "  v 1 2 3", "\tf 1 2 3", "   ", "junk", "surf", "vv 1 2 3", "fx", "v 1 2 3\r",
    "# \r f 1 2 3", "v 1 2\x0b3", "f 1 2\x0c3", "f 1 2 \x003", "v 1 2 3\x00", "v 1 2 \xa03", "v\u00a01 2 3",
    "v \u0661 2 3", "# \xe9", "g \u2028f", "f 1 2 \u0663", "v 1 2 3\x1c4",
]  # fmt: skip


def read_both(content: bytes) -> bool:
    """Whether the content has the common shape; then both readers say the same, bit for bit."""
    common = obj._read_common(content)
    if common is None:
        return False
    for name, value in vars(obj._read_any(content, Reading())).items():
        other = getattr(common, name)
        assert (value is None) == (other is None), name
        if name in ("groups", "looks", "left_out"):
            assert value == other
        elif value is not None:
            assert value.shape == other.shape and value.dtype == other.dtype, name
            assert np.ascontiguousarray(value).tobytes() == np.ascontiguousarray(other).tobytes(), name
    return True


@settings(deadline=None, max_examples=500)
@given(
    st.lists(st.sampled_from([*COMMON, *SLASHED]) | st.sampled_from(ODD), max_size=12),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.booleans(),
    st.booleans(),
)
def test_obj_both_readers_agree(statements: list[str], newline: str, ends: bool, leads: bool) -> None:
    head = ["v 1 2 3", "v 3 4 6", "v 7 1e1 -0.0", "f 3 1 2"] if leads else []
    content = (newline.join([*head, *statements]) + newline * ends).encode()
    read_both(content)


@cases("odd", ODD)
def test_obj_both_readers_agree_on_each_odd_statement(odd: str) -> None:
    """Wherever it stands among others; most are left to the reader of any file."""
    for face in ("f 1 2 3", SLASHED[0]):
        for newline in ("\n", "\r\n"):
            for lines in ([odd, "v 1 2 3", "v 3 4 6", "v 1 0 0", "vt 0 0", "vt 1 1", "vn 0 0 1", face],
                          ["v 1 2 3", "v 3 4 6", "v 1 0 0", "vt 0 0", "vt 1 1", "vn 0 0 1", odd, face],
                          ["v 1 2 3", "v 3 4 6", "v 1 0 0", "vt 0 0", "vt 1 1", "vn 0 0 1", face, odd],
                          ["v 1 2 3", "v 3 4 6", "v 1 0 0", "vt 0 0", "vt 1 1", "vn 0 0 1", odd],
                          [odd], [odd, "v 1 2 3", "f 1 1 1"], [face, odd, "v 1 2 3 4 5 6"]):  # fmt: skip
                try:
                    read_both(newline.join(lines).encode())
                except MeshError as error:
                    pytest.fail(f"taken by one, refused by the other: {error}")


@settings(deadline=None, max_examples=200)
@given(
    st.lists(st.sampled_from(COMMON), max_size=20),
    st.lists(st.sampled_from(SLASHED), max_size=3),
    st.sampled_from(["\n", "\r\n"]),
    st.booleans(),
)
def test_obj_files_of_the_common_shape_are_read_as_such(
    statements: list[str], slashed: list[str], newline: str, ends: bool
) -> None:
    faces = [s for s in statements if s.startswith("f")]
    if slashed:
        statements = [s for s in statements if not s.startswith("f")] + slashed
    lines = ["v 1 2 3", "v 3 4 6", "v 7 1e1 -0.0", "vt 1 2", "vt 3 4", "vn 1 2 3", "vn 1 0 0", *statements]
    content = (newline.join(lines) + newline * ends).encode()
    assert read_both(content) == bool(faces or slashed)


def foreign_box() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(1, 2, 4))


def test_stl_text_of_two_solids_with_foreign_names(tmp_path: Path) -> None:
    one = "solid caf\xe9 {}\nfacet normal 0 0 1\nouter loop\nvertex 0 0 {}\nvertex 1 0 0\nvertex 0 1 0\n"
    one += "endloop\nendfacet\nendsolid\n"
    content = (one.format(1, 1) + one.format(2, 2)).encode("latin-1")
    assert load_bytes(tmp_path, content, "a.stl").vertices[:, 2].tolist() == [1, 0, 0, 2, 0, 0]
    assert "truncated" in fault(tmp_path, content[:-20], "a.stl")


def test_stl_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    """Text in any case; and binary, whose header is any bytes, lost its first three."""
    binary, text = foreign_box().export(file_type="stl"), foreign_box().export(file_type="stl_ascii").encode()
    for content in (text, text.upper(), b"solid".ljust(77) + binary[80:]):
        mesh = load_bytes(tmp_path, b"\xef\xbb\xbf" + content, "a.stl")
        assert np.array_equal(mesh.triangles, foreign_box().triangles)


def test_stl_faults(tmp_path: Path) -> None:
    binary, text = foreign_box().export(file_type="stl"), foreign_box().export(file_type="stl_ascii").encode()
    assert "expected text that starts with 'solid', or binary of 684 bytes" in fault(tmp_path, binary[:-1], "a.stl")
    assert "binary of at least 84 bytes, got 80" in fault(tmp_path, binary[:80], "a.stl")
    assert "holds no faces" in fault(tmp_path, b"\0" * 84, "a.stl")
    assert "holds no faces" in fault(tmp_path, b"solid x\nendsolid x\n", "a.stl")
    for old, new, message in [
        (b"outer loop", b"outer lop", "expected 'loop', got 'lop' in facet 0"),
        (b"vertex -0.5", b"vertex -0.O", "malformed number"),
        (b"vertex -0.5", b"vertex -0_5", "malformed number"),
        (b"vertex -0.5", b"vertex nan", "vertices: expected finite values"),
        (b"endsolid", b"facet normal\nendsolid", "expected 21 words, got 2 in facet 12"),
        (b"endsolid", b"facet\nsolid\nendsolid", "truncated: 2 solids begin, 1 end"),
    ]:
        assert old in text
        assert message in fault(tmp_path, text.replace(old, new, 1), "a.stl")
    nan = binary[:96] + struct.pack("<f", np.nan) + binary[100:]
    assert "vertices: expected finite values, got [nan" in fault(tmp_path, nan, "a.stl")
    for length in itertools.chain(range(0, len(binary), 7), range(0, 90)):
        fault(tmp_path, binary[:length], "a.stl")
    # Text that ends with a facet lacks only the line that would end the solid.
    whole = [m.end() for m in re.finditer(b"endfacet", text)]
    for length in sorted({*range(0, len(text.rstrip()), 7)} - {end for end in whole for end in range(end, end + 9)}):
        fault(tmp_path, text[:length], "a.stl")


def test_glb_faults(tmp_path: Path) -> None:
    content = trimesh.Scene(foreign_box()).export(file_type="glb")
    assert "expected a first word 'glTF', got b'glTX'" in fault(tmp_path, b"glTX" + content[4:], "a.glb")
    assert f"truncated: expected {len(content)} bytes, got {len(content) - 1}" in fault(tmp_path, content[:-1], "a.glb")
    assert "malformed glTF: its JSON: " in fault(tmp_path, content[:25] + b"\xff" + content[26:], "a.glb")
    assert "malformed glTF: its JSON: " in fault(tmp_path, content[:20] + b"[" + content[21:], "a.glb")
    assert "expected version 2, got version 1" in fault(tmp_path, content[:4] + b"\1" + content[5:], "a.glb")
    assert "glTF: expected an accessor of 0" in fault(
        tmp_path, content.replace(b'"accessors"', b'"accessorz"'), "a.glb"
    )
    cloud = trimesh.Scene(trimesh.PointCloud(np.eye(3))).export(file_type="glb")
    assert "holds no good faces: left out, as they have no surface: points and lines" in fault(tmp_path, cloud, "a.glb")
    for length in range(0, len(content) - 4, 13):
        fault(tmp_path, content[:length], "a.glb")


# --- any file -------------------------------------------------------------------------------------------------


def test_path_faults(tmp_path: Path) -> None:
    (tmp_path / "folder.ply").mkdir()
    for name, message in [
        ("missing.ply", "cannot be read: No such file or directory"),
        ("folder.ply", "cannot be read: Is a directory"),
        ("model.fbx", "expected a suffix of .ply, .obj, .stl, .glb, .gltf, got '.fbx'"),
        ("model", "got ''"),
        ("null\0.ply", "cannot be read: "),
    ]:
        with pytest.raises(MeshError, match=re.escape(f"{tmp_path / name}: ") + ".*" + re.escape(message)):
            load_mesh(tmp_path / name)
