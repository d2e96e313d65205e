"""Materials of meshes: each face keeps its own through all that makes a mesh of another."""

import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import Mesh, MeshError, MeshMaterial, Texture, TextureImage
from renderer.mesh.cutting import cut
from renderer.mesh.shapes import box

pytestmark = pytest.mark.judges("Mesh", "MeshMaterial", "MeshMaterial.textures", "Texture")

IMAGE = TextureImage([[0.0, 1.0]])
RED, WOOD = MeshMaterial("red", base_color=(1, 0, 0)), MeshMaterial("wood", base_color_texture=Texture(IMAGE))
CUBE = box()
# The material of a face follows from where it is: none, red or wood at z = 0, between and at 1.
HEIGHTS = CUBE.triangles[..., 2].mean(axis=1)
ROWS = np.where(HEIGHTS == 0.0, -1, np.where(HEIGHTS == 1.0, 1, 0))
DRESSED = Mesh(CUBE.vertices, CUBE.faces, materials=[RED, WOOD], face_materials=ROWS)
TURN = np.diag([1.0, -1.0, 1.0, 1.0])
BAD = CUBE.vertices.copy()
BAD[0] = np.nan

MAKERS: dict[str, Callable[[], Mesh]] = {
    "transformed": lambda: DRESSED.transformed(TURN),
    "creased": lambda: DRESSED.creased(),
    "welded": lambda: DRESSED.creased().welded()[0],
    "without duplicates": lambda: Mesh.concatenate(DRESSED, DRESSED).without_duplicates()[0],
    "repaired": lambda: Mesh.repaired(BAD, CUBE.faces, materials=[RED, WOOD], face_materials=ROWS)[0],
    "concatenated": lambda: Mesh.concatenate(CUBE.transformed(np.diag([1, 1, 0, 1])), DRESSED),
    "concatenated in another order": lambda: Mesh.concatenate(
        replace(DRESSED, materials=[WOOD], face_materials=ROWS * 0 - 1), DRESSED
    ),
    "cut": lambda: cut(DRESSED, 0, 0.5, below=True),
    "pickled": lambda: pickle.loads(pickle.dumps(DRESSED)),
    "replaced": lambda: replace(DRESSED, name="other"),
}  # fmt: skip


@cases("name", MAKERS)
def test_each_face_keeps_its_material(name: str) -> None:
    made = MAKERS[name]()
    assert made.face_materials is not None and made.face_materials.dtype == np.int32
    assert not made.face_materials.flags.writeable and made.face_materials.shape == (len(made.faces),)
    found = [made.materials[row].name if row >= 0 else "" for row in made.face_materials]
    heights = made.triangles[..., 2].mean(axis=1).tolist()
    expected = [{0.0: "", 1.0: "wood"}.get(height, "red") for height in heights]
    if name.startswith("concatenated in"):  # the first has none
        expected[: len(CUBE.faces)] = [""] * len(CUBE.faces)
    assert found == expected and {material.name for material in made.materials} <= {"red", "wood"}
    assert len(made.materials) == len(set(made.materials))


def test_meshes_without_have_none_and_one_material_is_that_of_all_faces() -> None:
    assert CUBE.materials == () and CUBE.face_materials is None
    assert Mesh.concatenate(CUBE, CUBE).face_materials is None
    one = replace(CUBE, materials=[RED])
    assert one.face_materials is not None and one.face_materials.tolist() == [0] * 12
    assert replace(CUBE, face_materials=[-1] * 12).face_materials is None  # type: ignore[arg-type]


@cases(
    ("materials", "rows", "message"),
    [
        (RED, None, "cube: materials: expected a sequence of MeshMaterial, got MeshMaterial"),
        ([RED, "red"], None, "cube: materials: expected a sequence of MeshMaterial, got str in row 1"),
        ([RED], [0] * 11, "cube: face_materials: expected shape (12,), a row a face, got (11,)"),
        ([RED], [0.0] * 12, "cube: face_materials: expected integers, got dtype float64"),
        ([RED], [0] * 11 + [1], "cube: face_materials: expected -1 to 0, got 1 in row 11"),
        ([], [0] * 12, "cube: face_materials: expected -1 to -1, got 0 in row 0"),
        ([RED], [-2] * 12, "cube: face_materials: expected -1 to 0, got -2 in row 0"),
    ],
)
def test_bad_rows_are_named(materials: Any, rows: Any, message: str) -> None:
    for make in (Mesh, Mesh.repaired):
        with pytest.raises(MeshError) as refused:
            make(CUBE.vertices, CUBE.faces, name="cube", materials=materials, face_materials=rows)
        assert str(refused.value) == message


@cases(
    ("fields", "message"),
    [
        ({"name": 3}, "name: expected a string, got int"),
        ({"name": "m", "base_color": (1, 2, 0)}, "material 'm': base_color: expected 3 finite numbers from 0 to 1"),
        ({"base_color": (1, 1)}, "base_color: expected 3 finite numbers from 0 to 1, got (1, 1)"),
        ({"emissive": (0, -1, 0)}, "emissive: expected 3 finite numbers of at least 0, got (0, -1, 0)"),
        ({"alpha": np.nan}, "alpha: expected a finite number from 0 to 1, got nan"),
        ({"ior": 0.5}, "ior: expected a finite number of at least 1, got 0.5"),
        ({"shininess": "much"}, "shininess: expected real numbers, got dtype"),
        ({"alpha_mode": "glass"}, "alpha_mode: expected one of opaque, mask, blend, got 'glass'"),
        ({"unlit": 1}, "unlit: expected True or False, got 1"),
        ({"bump_texture": "a.png"}, "bump_texture: expected a Texture or None, got 'a.png'"),
    ],
)
def test_bad_fields_of_a_material_are_named(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(MeshError) as refused:
        MeshMaterial(**fields)
    assert str(refused.value).startswith(message)


@cases(
    ("fields", "message"),
    [
        ({"transform": [[1, 0], [0, 1]]}, "transform: expected 2x3 finite numbers, got"),
        ({"transform": [[1, 0, np.inf], [0, 1, 0]]}, "transform: expected 2x3 finite numbers, got"),
        ({"wrap": "repeat"}, "wrap: expected two of repeat, mirror, clamp, got 'repeat'"),
        ({"wrap": ("repeat", "tile")}, "wrap: expected two of repeat, mirror, clamp, got"),
        ({"filter": "cubic"}, "filter: expected 'mipmap', 'linear' or 'nearest', got 'cubic'"),
        ({"strength": None}, "strength: expected real numbers, got"),
    ],
)
def test_bad_fields_of_a_texture_are_named(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(MeshError) as refused:
        Texture(IMAGE, **fields)
    assert str(refused.value).startswith(message)


def test_materials_hash_by_value_and_list_their_textures() -> None:
    same = MeshMaterial("wood", base_color=np.ones(3), base_color_texture=Texture(IMAGE))  # type: ignore[arg-type]
    assert same == WOOD and hash(same) == hash(WOOD) and same.base_color == (1.0, 1.0, 1.0)
    assert RED.textures == {} and WOOD.textures == {"base_color_texture": Texture(IMAGE)}
