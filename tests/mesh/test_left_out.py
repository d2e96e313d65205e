"""Files as others write them: the geometry is whole and loads, and one warning names what was left out."""

import gzip
import io
import struct
from pathlib import Path

import numpy as np
import pytest
from cases import cases

from renderer import MeshError, RepairWarning, load_mesh
from renderer.mesh.ply import format_ply
from renderer.mesh.shapes import box

pytestmark = pytest.mark.judges("load_mesh")

CUBE = box()
CORNERS = CUBE.vertices.astype(int).tolist()
FACES = CUBE.faces.tolist()

V = "".join("v {} {} {}\n".format(*corner) for corner in CORNERS)
F = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES)
OBJ = {
    "an unknown statement": (f"call x\n{V}vw 1\n{F}", "left out: unknown statements call, vw"),
    "free-form curves": (
        f"{V}{F}cstype bezier\ndeg 3\ncurv 0 1 1 2 3 4\nend\n", "left out: free-form curves and surfaces",
    ),
    "materials": (
        f"mtllib a.mtl\n{V}usemtl red\n{F}",
        "left out: material files that are not there: a.mtl; left out: materials that no file describes: red",
    ),
    "maps of its own": (f"maplib a\n{V}usemap b\n{F}", "left out: texture maps of the OBJ file itself"),
    "a face of two corners": (f"{V}f 1 2\n{F}f 3\n", "left out: faces of fewer than three corners"),
    "a normal that is not there": (V + F.replace("f 1 ", "f 1//7 "), "left out: normal indices that name nothing"),
    "texture index 0": (V + F.replace("f 1 ", "f 1/0 "), "left out: texture indices that name nothing"),
    "colours that are no numbers": (V.replace("\n", " nan 0 0\n") + F, "left out: vertex colours that are not numbers"),
    "some colours": (V.replace("\n", " 1 0 0\n", 1) + F, "left out: vertex colours, which only some vertices have"),
    "UTF-16": ((V + F).encode("utf-16"), None),
    "a carriage return alone": ((V + F).replace("\n", "\r"), None),
}  # fmt: skip

ROWS = "".join("{} {} {}\n".format(*corner) for corner in CORNERS)
LISTS = "".join("3 {} {} {}\n".format(*face) for face in FACES)
HEAD = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
LIST = "element face 12\nproperty list uchar int vertex_indices\n"
PLAIN = f"{HEAD}{LIST}end_header\n{ROWS}{LISTS}"
RED = "".join(f"property int {name}\n" for name in ("red", "green", "blue"))
COLOURED = "".join("{} {} {} 0 51 255\n".format(*corner) for corner in CORNERS)
PLY = {
    "bytes behind": (format_ply(CUBE) + b"by an editor", "left out: what stands behind the last element"),
    "rows behind": (PLAIN + "1 2 3\n", "left out: what stands behind the last element"),
    "64 bits": (PLAIN.replace("float x", "int64 x").replace("int vertex", "uint64 vertex"), None),
    "colours of any number": (f"{HEAD}{RED}{LIST}end_header\n{COLOURED}{LISTS}", None),
    "an alpha of opaque colours": (
        f"{HEAD}{RED}property uchar alpha\n{LIST}end_header\n" + COLOURED.replace("\n", " 255\n") + LISTS, None,
    ),
    "an alpha of which one is not opaque": (
        f"{HEAD}{RED}property uchar alpha\n{LIST}end_header\n"
        + COLOURED.replace("\n", " 255\n").replace("255 255", "255 254", 1) + LISTS,
        "left out of element vertex: alpha",
    ),
    "colours that fit nothing": (
        f"{HEAD}{RED}{LIST}end_header\n{COLOURED.replace('255', '256')}{LISTS}",
        "left out: vertex colours that do not fit their type or 0 to 255",
    ),
    "faces of 0, 1 and 2": (
        PLAIN.replace("face 12", "face 15").replace(LISTS, "0\n" + LISTS + "1 0\n2 0 1\n"),
        "left out: faces of fewer than three corners",
    ),
    "a header line": (
        PLAIN.replace("element v", "Created by x\nelement v"), "left out: header lines that begin with Created",
    ),
    "version 1.00": (PLAIN.replace("1.0", "1.00"), None),
    "face colours": (
        PLAIN.replace("end_h", "property uchar red\nend_h").replace(LISTS, LISTS.replace("\n", " 9\n")),
        "left out of element face: red",
    ),
    "corners' texture coordinates": (
        PLAIN.replace("end_h", "property list uchar float texcoord\nend_h")
        .replace(LISTS, LISTS.replace("\n", " 6 0 0 1 0 1 1\n")),
        "left out of element face: texcoord",
    ),
    "another element": (
        PLAIN.replace("element face", "element edge 1\nproperty int a\nelement face").replace(LISTS, "7\n" + LISTS),
        "left out: element edge",
    ),
}  # fmt: skip

FACET = "facet normal 0 0 1\nouter loop\n" + "vertex {} {} {}\n" * 3 + "endloop\nendfacet\n"
FACETS = "".join(FACET.format(*np.ravel(triangle).tolist()) for triangle in CUBE.triangles)
RECORDS = b"".join(struct.pack("<12fH", 0, 0, 1, *np.ravel(triangle).tolist(), 0) for triangle in CUBE.triangles)
STL = {
    "end solid": (f"solid x\n{FACETS}end solid x\n", None),
    "no endsolid": (f"solid x\n{FACETS}", "1 solids begin, 0 end"),
    "no normal": (f"solid x\n{FACETS.replace(' normal 0 0 1', ' ')}endsolid\n", "facets without a normal"),
    "two bytes behind": (
        b" " * 80 + struct.pack("<I", 12) + RECORDS + b"\0\0", "left out: what stands behind the last face",
    ),
    "a count of 0": (b" " * 80 + struct.pack("<I", 0) + RECORDS, "the header counts 0 faces, the file holds 12"),
    "no count": (b" " * 80 + b"\xff" * 4 + RECORDS, "the header counts 4294967295 faces, the file holds 12"),
    "solid in a binary header": (b"solid x".ljust(80) + struct.pack("<I", 12) + RECORDS, None),
    "solid in one without a count": (
        b"solid x".ljust(80) + b"\0" * 4 + RECORDS, "the header counts 0 faces, the file holds 12",
    ),
}  # fmt: skip
KINDS = {f"{suffix} {name}": (suffix, *kind) for suffix, kinds in (("obj", OBJ), ("ply", PLY), ("stl", STL))
         for name, kind in kinds.items()}  # fmt: skip


@cases("name", KINDS)
def test_the_cube_is_whole_and_one_warning_says_what_is_not(name: str, tmp_path: Path) -> None:
    suffix, content, note = KINDS[name]
    path = tmp_path / f"cube.{suffix}"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    if note is None:
        mesh = load_mesh(path, strict=True)
    else:
        with pytest.warns(RepairWarning) as said:
            mesh = load_mesh(path)
        assert [str(one.message) for one in said] == [f"{path}: {note}"] and said[0].filename == __file__
        with pytest.raises(MeshError) as refused:
            load_mesh(path, strict=True)
        assert str(refused.value) == f"{path}: {note}"
    found = sorted(np.sort(triangle, axis=0).tolist() for triangle in mesh.triangles)
    assert found == sorted(np.sort(triangle, axis=0).tolist() for triangle in CUBE.triangles) and mesh.is_closed()
    if name == "ply colours of any number":
        assert mesh.colors is not None and mesh.colors[0].tolist() == pytest.approx([0.0, 0.2, 1.0])


def test_an_obj_of_two_dimensions_lies_in_z_0(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n")
    with pytest.warns(RepairWarning, match="vertices of two numbers have z = 0"):
        assert load_mesh(tmp_path / "a.obj").triangles.tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]


@pytest.mark.parametrize("suffix", ["obj", "ply"])
def test_a_polygon_that_crosses_itself_is_named(suffix: str, tmp_path: Path) -> None:
    ring = [(0, 0, 0), (2, 2, 0), (2, 0, 0), (0, 1, 0)]
    text = "".join("v {} {} {}\n".format(*p) for p in ring) + "f 1 2 3\nf 1 2 3 4\n"
    if suffix == "ply":
        rows = "".join("{} {} {}\n".format(*p) for p in ring)
        text = f"{HEAD.replace('8', '4')}{LIST.replace('12', '2')}end_header\n{rows}3 0 1 2\n4 0 1 2 3\n"
    (tmp_path / f"a.{suffix}").write_text(text)
    number = "the number of the face: 2" if suffix == "obj" else "the row of the face: 1"
    with pytest.warns(RepairWarning, match=f"cut as fans, by {number}$"):
        assert len(load_mesh(tmp_path / f"a.{suffix}").faces) == 3


@pytest.mark.parametrize("given", ["bytes", "file", "gzip", "gzip bytes"])
@pytest.mark.parametrize("suffix", ["obj", "ply", "stl"])
def test_bytes_open_files_and_gzip_are_read_like_files(given: str, suffix: str, tmp_path: Path) -> None:
    content = {"obj": (V + F).encode(), "ply": format_ply(CUBE), "stl": f"solid x\n{FACETS}endsolid\n".encode()}[suffix]
    packed = gzip.compress(content) if given.startswith("gzip") else content
    if given == "gzip":
        (tmp_path / f"cube.{suffix.upper()}.gz").write_bytes(packed)
        mesh = load_mesh(tmp_path / f"cube.{suffix.upper()}.gz")
        assert mesh.name == "cube"
    else:
        mesh = load_mesh(io.BytesIO(packed) if given == "file" else packed, "cube")
    assert mesh.is_closed() or suffix == "stl"
    assert len(mesh.faces) == 12 and mesh.name == "cube"


def test_what_is_no_gzip_or_no_binary_file_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.ply.gz").write_bytes(gzip.compress(format_ply(CUBE))[:-9])
    with pytest.raises(MeshError, match=r"a\.ply\.gz: malformed gzip"):
        load_mesh(tmp_path / "a.ply.gz")
    with pytest.raises(MeshError, match="path: expected a file opened as binary, got str from it"):
        load_mesh(io.StringIO(V + F))  # type: ignore[arg-type]
    with pytest.raises(MeshError, match=r"expected a suffix of .*, got '\.gz'"):
        load_mesh(tmp_path / "a.gz")
    with pytest.raises(MeshError, match="strict: expected True or False, got 1"):
        load_mesh(b"", strict=1)  # type: ignore[arg-type]


def test_an_index_error_says_of_what() -> None:
    with pytest.raises(
        MeshError, match=r"line 9: vertex index out of range: expected 1 to 8 or -8 to -1, got 'f 1 2 9'"
    ):
        load_mesh(f"{V}f 1 2 9\n".encode())
