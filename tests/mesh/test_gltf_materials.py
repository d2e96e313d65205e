"""Materials of glTF: beside trimesh's reading, by hand, and what of a document cannot be read."""

import base64
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest
import trimesh
from cases import cases
from glb_bytes import Glb

from renderer import Mesh, MeshError, MeshMaterial, RepairWarning, Texture, load_mesh
from renderer.mesh.load import load_placed

pytestmark = pytest.mark.judges("load_mesh")

TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
UV = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
SCENE = {"scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}]}


def png(color: int = 0) -> bytes:
    out = io.BytesIO()
    PIL.Image.new("RGB", (3, 2), color).save(out, "PNG")
    return out.getvalue()


URI = "data:image/png;base64," + base64.b64encode(png()).decode()


def glb(materials: Any, rows: tuple[Any, ...] = (0,), **document: Any) -> bytes:
    """A triangle for each row, of that material, or of none for None."""
    file = Glb()
    given = {"POSITION": file.add(TRIANGLE, "f", 5126, "VEC3", 0), "TEXCOORD_0": file.add(UV, "f", 5126, "VEC2", 0)}
    primitives = [{"attributes": given} | ({} if row is None else {"material": row}) for row in rows]
    return file.file(**{**SCENE, "meshes": [{"primitives": primitives}], "materials": materials, **document})


def read(entry: dict[str, Any], **document: Any) -> MeshMaterial:
    return load_mesh(glb([entry], **document), strict=True).materials[0]


def textured(info: dict[str, Any], sampler: dict[str, Any] | None = None) -> Texture:
    document: dict[str, Any] = {"textures": [{"source": 0}], "images": [{"uri": URI}]}
    if sampler is not None:
        document = {**document, "textures": [{"source": 0, "sampler": 0}], "samplers": [sampler]}
    found = read({"normalTexture": {"index": 0, **info}}, **document).normal_texture
    assert found is not None
    return found


def test_a_material_that_trimesh_wrote_has_its_values_and_pixels() -> None:
    """An image in a buffer; factors; the mode of alpha."""
    pixels = np.random.default_rng(3).integers(0, 256, (4, 5, 3), np.uint8)
    given = trimesh.visual.material.PBRMaterial(
        name="bricks", baseColorFactor=[0.2, 0.4, 0.6, 0.8], metallicFactor=0.25, roughnessFactor=0.75,
        emissiveFactor=[0.1, 0.2, 0.3], alphaMode="MASK", alphaCutoff=0.25, doubleSided=True,
        baseColorTexture=PIL.Image.fromarray(pixels), normalTexture=PIL.Image.fromarray(pixels[::-1]),
    )  # fmt: skip
    visual = trimesh.visual.TextureVisuals(uv=np.array(UV), material=given)
    content = trimesh.Trimesh(TRIANGLE, [[0, 1, 2]], visual=visual, process=False).export(file_type="glb")
    theirs = trimesh.load(io.BytesIO(content), file_type="glb", force="mesh").visual.material
    (mine,) = load_mesh(content, strict=True).materials
    np.testing.assert_allclose([*mine.base_color, mine.alpha], np.array(theirs.baseColorFactor) / 255.0, atol=1e-12)
    assert (mine.name, mine.metallic, mine.roughness) == (theirs.name, theirs.metallicFactor, theirs.roughnessFactor)
    assert list(mine.emissive) == list(theirs.emissiveFactor) and mine.double_sided is theirs.doubleSided
    assert (mine.alpha_mode, mine.alpha_cutoff) == (theirs.alphaMode.lower(), theirs.alphaCutoff)
    assert mine.base_color_texture is not None and mine.normal_texture is not None
    np.testing.assert_array_equal(mine.base_color_texture.image.pixels, np.asarray(theirs.baseColorTexture))
    np.testing.assert_array_equal(mine.normal_texture.image.pixels, np.asarray(theirs.normalTexture))


@cases(
    ("entry", "fields"),
    [
        ({}, {}),
        ({"pbrMetallicRoughness": {}, "alphaMode": "BLEND"}, {"alpha_mode": "blend"}),
        ({"extensions": {"KHR_materials_unlit": {}}}, {"unlit": True}),
        ({"extensions": {"KHR_materials_ior": {"ior": 1.33}}}, {"ior": 1.33}),
        ({"emissiveFactor": [1, 0.5, 0], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}},
         {"emissive": (4, 2, 0)}),
        ({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 1]},
          "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.75}}},
         {"base_color": (0.5, 1, 1), "transmission": 0.75, "transmission_color": (0.5, 1, 1)}),
    ],
)  # fmt: skip
def test_fields_and_defaults_are_those_of_the_format(entry: dict[str, Any], fields: dict[str, Any]) -> None:
    assert read(entry) == MeshMaterial(**{"metallic": 1.0, **fields})


def test_alpha_of_colours_of_vertices_is_named() -> None:
    file = Glb()
    given = {
        "POSITION": file.add(TRIANGLE, "f", 5126, "VEC3", 0),
        "COLOR_0": file.add([[1, 1, 1, 0.5]] * 3, "f", 5126, "VEC4", 0),
    }
    with pytest.warns(RepairWarning, match="the alpha of colours of vertices"):
        load_mesh(file.file(**SCENE, meshes=[{"primitives": [{"attributes": given}]}]))


def test_a_texture_of_transmission_is_read() -> None:
    entry = {"extensions": {"KHR_materials_transmission": {"transmissionTexture": {"index": 0}}}}
    found = read(entry, textures=[{"source": 0}], images=[{"uri": URI}])
    assert list(found.textures) == ["transmission_texture"]


def test_faces_have_the_material_of_their_primitive_and_equal_ones_are_one() -> None:
    mesh = load_mesh(glb([{"name": "a"}, {"name": "b"}, {"name": "a"}], rows=(1, None, 2, 0)))
    assert mesh.face_materials is not None
    assert [mesh.materials[row].name if row >= 0 else "" for row in mesh.face_materials] == ["b", "", "a", "a"]
    assert len(mesh.materials) == 2
    two = load_mesh(glb([{}], nodes=[{"mesh": 0}, {"mesh": 0}], scenes=[{"nodes": [0, 1]}]))
    assert two.face_materials is not None and two.face_materials.tolist() == [0, 0] and len(two.materials) == 1


@cases("where", ["buffer", "data", "file", "webp"])
def test_images_are_in_buffers_texts_or_files(where: str, tmp_path: Path) -> None:
    PIL.Image.open(io.BytesIO(png())).save(tmp_path / "a b.webp", lossless=True)
    (tmp_path / "a b.png").write_bytes(png())
    document: dict[str, Any] = {"textures": [{"source": 0}], "materials": [{"occlusionTexture": {"index": 0}}]}
    file = Glb()
    attributes = {"POSITION": file.add(TRIANGLE, "f", 5126, "VEC3", 0)}
    document["meshes"] = [{"primitives": [{"attributes": attributes, "material": 0}]}]
    if where == "buffer":
        file.data += b"\0\0" + png()
        file.views.append({"buffer": 0, "byteOffset": len(file.data) - len(png()), "byteLength": len(png())})
        document |= {"images": [{"bufferView": 1, "mimeType": "image/png"}], "bufferViews": file.views}
    else:
        document["images"] = [{"uri": {"data": URI, "file": "a%20b.png", "webp": "a%20b.webp"}[where]}]
    if where == "webp":
        document["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
    (tmp_path / "a.glb").write_bytes(file.file(**SCENE, **document))
    for mesh in (load_mesh(tmp_path / "a.glb", strict=True), load_placed(tmp_path / "a.glb")[0].mesh):
        texture = mesh.materials[0].occlusion_texture
        assert texture is not None and texture.image.pixels.shape == (2, 3, 3)


@cases(
    ("sampler", "wrap", "filter"),
    [
        (None, ("repeat", "repeat"), "mipmap"),
        ({}, ("repeat", "repeat"), "mipmap"),
        ({"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}, ("clamp", "mirror"), "nearest"),
        ({"wrapS": 10497, "magFilter": 9729, "minFilter": 9987}, ("repeat", "repeat"), "mipmap"),
    ],
)
def test_samplers_say_what_is_beyond_and_between_pixels(sampler: Any, wrap: Any, filter: str) -> None:
    found = textured({"scale": 0.5}, sampler)
    assert (found.wrap, found.filter, found.strength) == (wrap, filter, 0.5)


@cases(
    ("moved", "at", "expected"),
    [
        ({}, (0.25, 0.75), (0.25, 0.75)),
        ({"offset": [0.5, 0.25]}, (0.0, 0.0), (0.5, 0.25)),
        ({"scale": [2, 3]}, (0.25, 0.5), (0.5, 1.5)),
        # Seen with v down, a positive angle turns u towards smaller v: counter-clockwise to the eye.
        ({"rotation": np.pi / 2}, (1.0, 0.0), (0.0, -1.0)),
        ({"rotation": np.pi / 2, "scale": [2, 1], "offset": [1, 1]}, (1.0, 3.0), (4.0, -1.0)),
    ],
)
def test_transforms_of_texture_coordinates_hold_with_v_up(moved: Any, at: Any, expected: Any) -> None:
    """Coordinates as a file has them, with v down; a mesh has 1 - v."""
    found = textured({"extensions": {"KHR_texture_transform": moved}})
    u, v = np.array(found.transform) @ [at[0], 1.0 - at[1], 1.0]
    assert (u, 1.0 - v) == pytest.approx(expected)


def test_primitives_without_colours_or_texture_coordinates_keep_those_of_others() -> None:
    file = Glb()
    position = file.add(TRIANGLE, "f", 5126, "VEC3", 0)
    rich = {"TEXCOORD_0": file.add(UV, "f", 5126, "VEC2", 0), "COLOR_0": file.add(TRIANGLE, "f", 5126, "VEC3", 0)}
    primitives = [{"attributes": {"POSITION": position}}, {"attributes": {"POSITION": position, **rich}}]
    mesh = load_mesh(file.file(**SCENE, meshes=[{"primitives": primitives}]), strict=True)
    assert mesh.texcoords is not None and mesh.colors is not None
    assert mesh.texcoords.tolist() == [[0, 0]] * 3 + [[u, 1 - v] for u, v in UV]
    assert mesh.colors.tolist() == [[1, 1, 1]] * 3 + TRIANGLE


BAD_IMAGE = {"textures": [{"source": 0}], "images": [{"uri": "data:,bm8=", "name": "no"}]}
USED = {"emissiveTexture": {"index": 0}}


@cases(
    ("entry", "document", "note"),
    [
        ({"alphaMode": "GLASS"}, {}, "material 0, malformed: alpha_mode: expected one of opaque, mask, blend"),
        ({"emissiveFactor": 3}, {}, "left out: material 0, malformed: TypeError"),
        ({"pbrMetallicRoughness": {"baseColorFactor": [2, 0, 0, 1]}}, {}, "malformed: base_color: expected 3 finite"),
        (USED, {}, "left out: material 0, malformed: KeyError: 'textures'"),
        (USED, BAD_IMAGE, "left out: image no: cannot be read as an image: of no known format"),
        (USED, {"textures": [{"source": 0}], "images": [{"uri": "x.png"}]}, "images that are not there: x.png"),
        (USED, {"textures": [{"source": 0}], "images": [{"bufferView": 0}]}, "image 0: cannot be read as an image"),
        (USED, {"textures": [{"source": 0}], "images": [{"bufferView": 9}]}, "material 0, malformed: IndexError"),
        (USED, {"textures": [{}]}, "left out: textures without an image that can be read: no source"),
        (USED, {"textures": [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]}, "read: KHR_texture_basisu"),
        ({"emissiveTexture": {"index": 0, "texCoord": 1}}, {}, "left out: textures on TEXCOORD_1, as a mesh has one"),
        ({"extensions": {"KHR_materials_sheen": {}}}, {}, "left out of materials: KHR_materials_sheen"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_named_and_the_mesh_loads(entry: Any, document: Any, note: str) -> None:
    content = glb([entry], **document)
    with pytest.warns(RepairWarning) as said:
        mesh = load_mesh(content)
    assert note in str(said[0].message) and len(said) == 1 and len(mesh.faces) == 1
    with pytest.raises(MeshError):
        load_mesh(content, strict=True)


def test_a_document_of_text_finds_images_beside_it(tmp_path: Path) -> None:
    content = glb([{"emissiveTexture": {"index": 0}}], textures=[{"source": 0}], images=[{"uri": "sub/a.png"}])
    length = int.from_bytes(content[12:16], "little")
    document = json.loads(content[20 : 20 + length])
    data = content[28 + length :]
    document["buffers"] = [{"byteLength": len(data), "uri": "a.bin"}]
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "a.png").write_bytes(png())
    (tmp_path / "a.bin").write_bytes(data)
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    mesh: Mesh = load_mesh(tmp_path / "a.gltf", strict=True)
    assert mesh.materials[0].emissive_texture is not None
    assert mesh.materials[0].emissive_texture.image.size == (3, 2)
