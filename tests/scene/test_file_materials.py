"""Meshes shown with the materials of their files."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

from renderer import (
    Dielectric,
    Mesh,
    MeshMaterial,
    PerspectiveCamera,
    Phong,
    Scene,
    SceneError,
    SceneObject,
    SceneWarning,
    Texture,
    load_scene,
    render,
)
from renderer.cli.main import main
from renderer.mesh.shapes import box, icosphere
from renderer.scene.file_material import material_of, parts_of_file
from renderer.scene.scene import write_scene

GREY = Texture(np.full((1, 1, 3), 0.5, np.float32))
pytestmark = pytest.mark.judges("load_scene", "scene.objects.material")


def test_smooth_metal_mirrors_and_rough_metal_scatters_in_its_colour() -> None:
    gold = (1.0, 0.8, 0.3)
    metal = material_of(MeshMaterial(base_color=gold, metallic=1.0, roughness=0.0))
    assert isinstance(metal, Phong)
    assert metal.diffuse == (0.0, 0.0, 0.0) and metal.reflectance == pytest.approx(gold)
    rough = material_of(MeshMaterial(base_color=gold, metallic=1.0, roughness=1.0))
    assert isinstance(rough, Phong)
    assert rough.shininess == 0.0 and rough.diffuse == pytest.approx(gold)
    assert not any(rough.specular) and not any(rough.reflectance)
    half = material_of(
        MeshMaterial(base_color=gold, metallic=1.0, roughness=0.5, base_color_texture=Texture(np.ones((1, 1, 3))))
    )
    assert isinstance(half, Phong) and half.specular_map == half.diffuse_map
    # Highlights whose height and exponent return what is not scattered.
    assert half.diffuse == pytest.approx(np.divide(gold, 2)) and half.shininess == 30.0
    halved = material_of(MeshMaterial(base_color=gold, metallic=1.0, roughness=0.5, metallic_roughness_texture=GREY))
    assert isinstance(halved, Phong) and halved.diffuse == pytest.approx(np.multiply(gold, 1 - 0.5 * 0.75))


def test_glass_unlit_and_highlights_of_mtl() -> None:
    glass = material_of(MeshMaterial(transmission=0.9, ior=1.3, transmission_color=(0.5, 1, 1)))
    assert isinstance(glass, Dielectric) and glass.ior == 1.3 and glass.transmittance == pytest.approx((0.45, 0.9, 0.9))
    stained = material_of(MeshMaterial(transmission=1.0, base_color_texture=GREY, emissive=(0, 1, 0)))
    assert isinstance(stained, Phong) and stained.transmittance_map == GREY and stained.emission == (0.0, 1.0, 0.0)
    partly = material_of(MeshMaterial(transmission=0.9, transmission_texture=GREY))
    assert isinstance(partly, Phong) and partly.transmittance == pytest.approx((0.45,) * 3)
    unlit = material_of(MeshMaterial(base_color=(0.1, 0.2, 0.3), unlit=True))
    assert isinstance(unlit, Phong) and unlit.emission == (0.1, 0.2, 0.3) and not unlit.receives_light
    shiny = material_of(MeshMaterial(specular=(0.3, 0.3, 0.3), shininess=70.0, mirror=True))
    assert isinstance(shiny, Phong) and (shiny.shininess, shiny.specular) == (70.0, shiny.reflectance)


def test_alpha_is_a_mask_or_a_share_of_the_image_that_has_it() -> None:
    rgba, rgb = np.zeros((2, 2, 4), np.uint8), np.zeros((2, 2, 3), np.uint8)
    mask = material_of(MeshMaterial(alpha_mode="mask", alpha_cutoff=0.3, base_color_texture=Texture(rgba)))
    assert isinstance(mask, Phong) and mask.cutoff == 0.3 and mask.opacity_map == mask.diffuse_map
    share = material_of(MeshMaterial(alpha_mode="blend", alpha=0.25, base_color_texture=Texture(rgb)))
    assert isinstance(share, Phong) and (share.opacity, share.opacity_map, share.cutoff) == (0.25, None, 0.0)
    grey = material_of(MeshMaterial(alpha_mode="mask", alpha_texture=Texture(np.full((1, 1, 3), 51, np.uint8))))
    assert isinstance(grey, Phong) and grey.opacity_map is not None
    assert grey.opacity_map.image.pixels.tolist() == [[[pytest.approx(0.2)]]]


def test_parts_keep_places_and_smooth_normals_of_the_whole() -> None:
    ball = icosphere(2)
    rows = np.arange(len(ball.faces)) % 3 - 1
    two = Mesh(ball.vertices, ball.faces, materials=[MeshMaterial("a"), MeshMaterial("b")], face_materials=rows)
    parts = parts_of_file(two, "srgb", smooth=True, crease=180.0)
    assert [part.name for part in parts] == ["mesh: plain", "mesh: a", "mesh: b"]
    whole = two.creased(180.0)
    for number, part in enumerate(parts):
        chosen = rows == number - 1
        np.testing.assert_array_equal(part.mesh.triangles, ball.triangles[chosen])
        assert part.mesh.normals is not None and whole.normals is not None
        np.testing.assert_array_equal(part.mesh.normals[part.mesh.faces], whole.normals[whole.faces[chosen]])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An OBJ file of a red and a textured square, beside its MTL file and image."""
    Pillow.new("RGB", (2, 2), (0, 255, 0)).save(tmp_path / "green.png")
    (tmp_path / "a.mtl").write_text(
        "newmtl red\nKd 1 0 0\nillum 0\nnewmtl green\nKd 1 1 1\nmap_Kd green.png\nillum 0\n"
    )
    corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    red, green = "usemtl red\nf 1/1 2/2 3/3 4/4\n", "usemtl green\nf 2/1 5/2 6/3 3/4\n"
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{corners}{red}{green}")
    return tmp_path


def test_a_file_alone_and_in_a_scene_file_show_its_materials(folder: Path) -> None:
    write_scene(folder / "a.obj", folder / "a.toml")
    assert "material = " not in (folder / "a.toml").read_text()
    for scene in (load_scene(folder / "a.obj"), load_scene(folder / "a.toml")):
        assert {"a: red", "a: green"} <= set(scene.materials)
        seen = render(scene, resolution=40).radiance.reshape(-1, 3)
        for color in ((1, 0, 0), (0, 1, 0)):
            assert (seen == color).all(axis=1).sum() > 20


def test_no_picture_is_written_over_an_image_of_the_scene(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (folder / "green.png").read_bytes()
    assert main(["render", str(folder / "a.obj"), "-o", str(folder / "green.png"), "--resolution", "4"]) == 2
    assert "--output: expected another file than the scene's own" in capsys.readouterr().err
    assert (folder / "green.png").read_bytes() == before


def test_textures_without_coordinates_are_left_out_with_a_warning(folder: Path) -> None:
    (folder / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl green\nf 1 2 3\n")
    with pytest.warns(SceneWarning, match="do not show base_color of a"):
        scene = load_scene(folder / "a.obj")
    assert (render(scene, resolution=20).face == 0).any()


def test_paths_of_textures_are_beside_the_scene_file(folder: Path) -> None:
    head = '[camera]\neye = [0.5, 0.5, 3]\ntarget = [0.5, 0.5, 0]\n[[objects]]\nmesh = "a.obj"\nmaterial = "own"\n'
    for given in ('"green.png"', '{ image = "green.png", filter = "nearest" }'):
        (folder / "b.toml").write_text(f"{head}[materials.own]\ndiffuse = 0\nemission_map = {given}\n")
        assert render(load_scene(folder / "b.toml"), resolution=1).radiance.tolist() == [[[0.0, 1.0, 0.0]]]
    (folder / "b.toml").write_text(f'{head}[materials.own]\nemission_map = "no.png"\n')
    with pytest.raises(ValueError, match=r"no\.png: cannot be read"):
        render(load_scene(folder / "b.toml"), resolution=1)
    (folder / "b.toml").write_text(f'{head}[materials.own]\nemission_map = {{ image = "green.png", wrap = "x" }}\n')
    with pytest.raises(SceneError, match=r"b\.toml: materials\.own\.emission_map: .*wrap"):
        load_scene(folder / "b.toml")


def test_what_pictures_do_not_show_is_named_once(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Bump h.png\n")
    Pillow.new("L", (2, 2)).save(tmp_path / "h.png")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    with pytest.warns(SceneWarning, match="pictures do not show bump of a") as said:
        load_scene(tmp_path / "a.obj")
    assert len(said) == 1


def test_colours_of_vertices_are_shown_as_srgb(tmp_path: Path) -> None:
    cube = box()
    Mesh(cube.vertices, cube.faces, colors=np.full((8, 3), 0.5)).save(tmp_path / "a.ply")
    (material,) = (m for name, m in load_scene(tmp_path / "a.ply").materials.items() if name.startswith("a"))
    assert isinstance(material, Phong) and (material.vertex_colors, material.diffuse) == ("srgb", (1.0, 1.0, 1.0))


def test_objects_in_python_have_the_materials_of_their_meshes_which_share_no_names() -> None:
    red, blue = (
        Mesh(
            box().vertices,
            box().faces,
            materials=[MeshMaterial("paint", base_color=color)],
            face_materials=np.zeros(12, int),
        )
        for color in ((1, 0, 0), (0, 0, 1))
    )
    thrice = [SceneObject(mesh=red), SceneObject(mesh=blue, translate=(0, 0, 2)), SceneObject(mesh=red, scale=3)]
    scene = Scene(camera=PerspectiveCamera(eye=(0, 0, 9), target=(0, 0, 0)), materials={}, objects=thrice)
    assert [scene.materials[of.material].diffuse for of in scene.objects] == [(1, 0, 0), (0, 0, 1), (1, 0, 0)]
    assert scene.instances[0].source is scene.instances[2].source and scene.objects[2].scale == (3.0, 3.0, 3.0)
