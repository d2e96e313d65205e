"""Materials of OBJ files: the values in MTL files beside trimesh's reading of them, and files as others write them."""

from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import numpy as np
import PIL.Image
import pytest
import trimesh.exchange.obj
from cases import cases
from hypothesis import given, settings

from renderer import Mesh, MeshError, MeshMaterial, RepairWarning, TextureImage, load_mesh
from renderer.mesh.mtl import parse_mtl

pytestmark = pytest.mark.judges("load_mesh")

IMAGE = TextureImage([[0.0, 1.0]])
V = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
QUAD, FIRST, LAST = "f 1 2 3 4\n", "f 1 2 3\n", "f 1 3 4\n"


def one(statements: str) -> tuple[MeshMaterial, list[str]]:
    found, left_out = parse_mtl(f"newmtl m\n{statements}\n".encode(), lambda name: IMAGE)
    return found["m"], left_out


shares = st.lists(st.floats(0, 1).map(lambda x: round(x, 4)), min_size=3, max_size=3)


@settings(deadline=None)
@given(
    st.dictionaries(
        st.text("ab_.-", min_size=1), st.tuples(shares, shares, shares, st.integers(0, 999)), min_size=1, max_size=3
    )
)
def test_values_are_those_that_trimesh_reads(written: dict[str, Any]) -> None:
    lines = [
        f"newmtl {name}\nKd {' '.join(map(str, kd))}\nKs {' '.join(map(str, ks))}\nKa {' '.join(map(str, ka))}\nNs {ns}"
        for name, (kd, ks, ka, ns) in written.items()
    ]
    content = "\n".join(lines)
    found, left_out = parse_mtl(content.encode(), lambda name: None)
    theirs = trimesh.exchange.obj.parse_mtl(content)
    assert left_out == [] and list(found) == list(theirs)
    for name, mine in found.items():
        for key, value in (
            ("Kd", mine.base_color),
            ("Ks", mine.specular),
            ("Ka", mine.ambient),
            ("Ns", mine.shininess),
        ):
            assert np.array_equal(theirs[name][key.lower()], np.array(value)), (name, key)


@cases(
    ("statements", "fields"),
    [
        ("Kd .5", {"base_color": (0.5, 0.5, 0.5)}),
        ("KE 1 2 3\nPr 0.25\nPm 1\nNi 1.33", {"emissive": (1, 2, 3), "roughness": 0.25, "metallic": 1, "ior": 1.33}),
        ("d 0.25\nTr 0.5", {"alpha": 0.25, "alpha_mode": "blend"}),
        ("Tr 0.25 # of glass", {"alpha": 0.75, "alpha_mode": "blend"}),
        ("illum 0", {"unlit": True}),
        ("illum 3", {"mirror": True}),
        ("illum 4\nd 1", {"mirror": True}),
        ("illum 9\nd 0.25\nTf 1 0 0", {"transmission": 0.75, "transmission_color": (1, 0, 0)}),
        ("illum 7", {"mirror": True, "transmission": 1.0}),
        ("illum 6", {"mirror": True, "transmission": 1.0}),
        ("illum 8", {"mirror": True}),
        *((f"illum {n}\nd 0.5", {"mirror": True, "transmission": 0.5}) for n in (4, 6, 7)),
        ("illum 5\nd 0.5", {"mirror": True, "alpha": 0.5, "alpha_mode": "blend"}),
        ("Ps 0\nPcr 0.0\naniso 0", {}),
    ],
)
def test_statements_mean_what_the_format_says(statements: str, fields: dict[str, Any]) -> None:
    assert one(statements) == (MeshMaterial("m", double_sided=True, **fields), [])


@cases(
    ("statement", "field", "expected"),
    [
        ("map_Kd a b.png", "base_color_texture", {}),
        ("map_Ks\t-clamp on a.png", "specular_texture", {"wrap": ("clamp", "clamp")}),
        ("map_ke -s 2 3 1 a.png", "emissive_texture", {"transform": ((2, 0, 0), (0, 3, 0))}),
        ("map_d -o 0.5 -s 2 4.png", "alpha_texture", {"transform": ((2, 0, 0.5), (0, 1, 0))}),
        ("norm -o 1 2 3 4", "normal_texture", {"transform": ((1, 0, 1), (0, 1, 2))}),
        ("map_kd -clamp 4", "base_color_texture", {}),
        ("bump -bm 0.3 a.png", "bump_texture", {"strength": 0.3}),
        ("map_Bump -clamp off -bm 2 -s 1 1 1 a.png", "bump_texture", {"strength": 2}),
    ],
)
def test_options_of_maps_are_read_and_are_no_part_of_the_name(statement: str, field: str, expected: Any) -> None:
    names: list[str] = []
    found, left_out = parse_mtl(f"newmtl m\n{statement}\n".encode(), lambda name: (names.append(name), IMAGE)[1])
    (texture,) = found["m"].textures.values()
    assert list(found["m"].textures) == [field] and left_out == [] and len(names) == 1
    assert names[0] == statement.rpartition(" ")[2] or names == ["a b.png"]
    for key, value in {"wrap": ("repeat", "repeat"), "strength": 1.0, "filter": "mipmap", **expected}.items():
        assert getattr(texture, key) == value


def test_a_map_of_alpha_is_a_mask_and_black_beside_a_map_of_colour_is_white() -> None:
    assert one("map_d a.png")[0].alpha_mode == "mask"
    assert one("map_d a.png\nd 0.5")[0].alpha_mode == "blend"
    assert one("Kd 0 0 0\nmap_Kd a.png")[0].base_color == (1, 1, 1)
    assert one("Kd 0 0 0")[0].base_color == (0, 0, 0)


@cases(
    ("statement", "left_out"),
    [
        ("refl -type sphere a.png", "refl"), ("map_Kd -mm 0 1 a.png", "map_kd -mm"), ("Kd 2 0 0", "Kd 2 0 0"),
        ("Kd 1 1", "Kd 1 1"), ("Kd spectral a.rfl", "Kd spectral a.rfl"), ("Ns nan", "Ns nan"), ("d 1_0", "d 1_0"),
        ("d -halo 1", "d -halo"), ("Ni 0", "Ni 0"), ("illum x", "illum x"), ("illum 12", "illum 12"),
        ("map_Kd", "map_Kd "), ("Ps 0.5", "ps"), ("Kd", "Kd "), ("map_bump -bm x a.png", "map_bump -bm x a.png"),
    ],
)  # fmt: skip
def test_what_has_no_place_or_is_no_value_is_named(statement: str, left_out: str) -> None:
    assert one(statement)[1] == [left_out]


def load(folder: Path, obj: str, mtl: str | bytes = "", note: str | None = None, name: str = "a.mtl") -> Mesh:
    (folder / "a.obj").write_text(obj)
    if mtl:
        (folder / name).write_bytes(mtl if isinstance(mtl, bytes) else mtl.encode())
    if note is None:
        return load_mesh(folder / "a.obj", strict=True)
    with pytest.raises(MeshError) as refused:
        load_mesh(folder / "a.obj", strict=True)
    assert str(refused.value) == f"{folder / 'a.obj'}: {note}"
    with pytest.warns(RepairWarning):
        return load_mesh(folder / "a.obj")


def names(mesh: Mesh) -> list[str]:
    rows = [-1] * len(mesh.faces) if mesh.face_materials is None else mesh.face_materials.tolist()
    return [mesh.materials[row].name if row >= 0 else "" for row in rows]


@pytest.mark.parametrize("begin", ["", "  v 9 9 9\n"])  # of the common shape, and of any
def test_each_face_has_the_material_before_it_and_polygons_keep_theirs(begin: str, tmp_path: Path) -> None:
    obj = f"mtllib a.mtl\n{V}{FIRST}usemtl red #2\nusemtl b#lue # rest\n{QUAD}g x\n{LAST}usemtl red\n{LAST}{begin}"
    mesh = load(tmp_path, obj, "newmtl unused\nnewmtl red\nKd 1 0 0\nnewmtl b#lue\nnewmtl red\nKd 0 1 0\n")
    assert names(mesh) == ["", "b#lue", "b#lue", "b#lue", "red"]
    assert [material.name for material in mesh.materials] == ["b#lue", "red"]
    assert mesh.materials[1].base_color == (1, 0, 0)  # the first of two


def test_materials_stay_with_the_faces_that_a_repair_keeps(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl r\nnewmtl s\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{V}usemtl r\nf 1 2 9\n{FIRST}usemtl s\n{LAST}")
    with pytest.warns(RepairWarning, match="dropped 1 of 3 faces"):
        assert names(load_mesh(tmp_path / "a.obj", repair=True)) == ["r", "s"]


@cases(
    ("library", "on_disk"),
    [("my file.mtl", "my file.mtl"), ("b.mtl a.mtl", "a.mtl"), ("x\\a.mtl", "a.mtl"), ("sub\\a.mtl", "sub/a.mtl"),
     ("/gone/a.mtl", "a.mtl")],
)  # fmt: skip
def test_material_files_are_found(library: str, on_disk: str, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "b.mtl").write_text("newmtl other\n")
    assert names(load(tmp_path, f"mtllib {library}\n{V}usemtl r\n{FIRST}", "newmtl r\n", name=on_disk)) == ["r"]


@cases(
    ("name", "on_disk"),
    [("sub/t x.png", "sub/t x.png"), ("sub\\t x.png", "sub/t x.png"), ("C:\\maps\\t x.png", "t x.png"),
     ("t x.png", "sub/t x.png")],
)  # fmt: skip
def test_images_are_found_beside_the_material_file_or_the_mesh(name: str, on_disk: str, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    PIL.Image.new("RGB", (3, 2)).save(tmp_path / on_disk)
    mtl = f"newmtl r\nmap_Kd {name}\nmap_Ks {name}\n"
    mesh = load(tmp_path, f"mtllib sub/a.mtl\n{V}usemtl r\n{FIRST}", mtl, name="sub/a.mtl")
    first, second = mesh.materials[0].textures.values()
    assert first.image is second.image and first.image.size == (3, 2)
    assert first.image.source == tmp_path / on_disk


@cases(
    ("obj", "mtl", "note"),
    [
        ("mtllib a.mtl\n", "", "left out: material files that are not there: a.mtl"),
        ("usemtl x\n", "", "left out: materials that no file describes: x"),
        ("mtllib a.mtl\nusemtl\n", "newmtl y\n", "left out: materials that no file describes: without a name"),
        ("mtllib a.mtl\n", "newmtl y\nmap_Kd z.png", "left out: images that are not there: z.png"),
        ("mtllib a.mtl\n", "junk\nnewmtl y\nKd 9\nbad 1\n", "left out of a.mtl: junk, Kd 9, bad"),
        ("mtllib a.mtl\n", "newmtl y\nmap_Kd a.mtl\n",
         "left out: image {}/a.mtl: cannot be read as an image: of no known format"),
    ],
)  # fmt: skip
def test_what_is_missing_is_named_and_the_mesh_loads(obj: str, mtl: str, note: str, tmp_path: Path) -> None:
    mesh = load(tmp_path, f"{obj}{V}{FIRST}", mtl, note.format(tmp_path))
    assert mesh.faces.tolist() == [[0, 1, 2]]


def test_utf16_and_bytes(tmp_path: Path) -> None:
    obj = f"mtllib a.mtl\n{V}usemtl \u00e9\n{FIRST}"
    (tmp_path / "a.mtl").write_bytes("newmtl \u00e9\r\nKd 1 0 0\r\n".encode("utf-16"))
    (tmp_path / "a.obj").write_text(obj, encoding="utf-8")
    assert names(load_mesh(tmp_path / "a.obj")) == ["\u00e9"]
    with pytest.warns(RepairWarning, match="material files that are not there: a.mtl"):
        load_mesh(obj.encode())


def test_corners_of_one_vertex_keep_their_texture_coordinates_at_a_seam(tmp_path: Path) -> None:
    obj = f"{V}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\nf 1/1 2/2 3/3\nf 1/5 3/3 4/4\n"
    mesh = load(tmp_path, obj)
    assert mesh.texcoords is not None
    assert mesh.texcoords[mesh.faces].tolist() == [[[0, 0], [1, 0], [1, 1]], [[0.5, 0.5], [1, 1], [0, 1]]]


PLY = (
    "ply\nformat ascii 1.0\ncomment TextureFile {}\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\n{}element face 1\nproperty list uchar int vertex_indices\nend_header\n{}3 0 1 2\n"
)


def test_the_texture_file_of_a_ply_is_a_material(tmp_path: Path) -> None:
    PIL.Image.new("RGB", (3, 2)).save(tmp_path / "t x.png")
    uv, rows = "property float s\nproperty float t\n", "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n"
    (tmp_path / "a.ply").write_text(PLY.format("t x.png", uv, rows))
    mesh = load_mesh(tmp_path / "a.ply", strict=True)
    (texture,) = mesh.materials[0].textures.values()
    assert texture.image.source == tmp_path / "t x.png" and mesh.face_materials is not None
    assert mesh.face_materials.tolist() == [0]
    for name, uvs, corners, note in (
        ("no.png", uv, rows, "left out: images that are not there: no.png"),
        ("t x.png", "", "0 0 0\n1 0 0\n0 1 0\n", "left out, as vertices have no texture coordinates in one image"),
    ):
        (tmp_path / "a.ply").write_text(PLY.format(name, uvs, corners))
        with pytest.warns(RepairWarning, match=note):
            assert load_mesh(tmp_path / "a.ply").materials == ()
