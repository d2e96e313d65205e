"""Changes of a scene by a few lines of TOML."""

from pathlib import Path

import numpy as np
import pytest
from cases import cases

from renderer import DirectionalLight, Mirror, OrthographicCamera, Scene
from renderer.cli.main import main
from renderer.mesh.shapes import box, icosphere
from renderer.picture.image import srgb
from renderer.scene.change import changed

SCENE = Scene(
    camera={"eye": (0, 0, 1), "target": (0, 0, 0)},
    materials={"grey": {}, "glass": {"type": "dielectric"}},
    lights=[{"type": "point", "position": (0, 1, 0)}],
    objects=[{"mesh": box(), "material": "grey"}, {"mesh": icosphere(1), "material": "glass"}],
    floor={"min": (-1, -1), "max": (1, 1), "materials": ["grey", "glass"], "squares": (2, 2)},
)


@pytest.mark.judges("octree-render render --change")
def test_what_is_named_changes_and_nothing_else() -> None:
    new = changed(
        SCENE, "camera = {type = 'orthographic', eye = [0, 0, 2], target = [0, 0, 0], height = 2}\nrender.samples = 9"
    )
    assert isinstance(new.camera, OrthographicCamera) and new.camera.height == 2.0
    assert new.render.samples == 9 and new.render.shadows == SCENE.render.shadows and new.lights == SCENE.lights
    assert SCENE.render.samples == 1 or SCENE.render.samples != 9  # which stays as it was
    lit = changed(SCENE, "[[lights]]\ntype = 'directional'\ndirection = [0, -1, 0]")
    assert [type(light) for light in lit.lights] == [DirectionalLight] and lit.camera == SCENE.camera
    assert changed(SCENE, "lights = []").lights == () and changed(SCENE, "") == SCENE

    shiny = changed(SCENE, "materials.grey = {type = 'mirror', reflectance = 0.5}")
    assert shiny.materials == {"grey": Mirror(reflectance=0.5), "glass": SCENE.materials["glass"]}


@pytest.mark.judges("octree-render render --change")
@cases(
    ("hidden", "left"),
    [([], [0, 1, 2, 3]), (["objects.0"], [1, 2, 3]), (["floor"], [0, 1]), (["floor", "objects.1"], [0])],
)
def test_what_is_hidden_is_left_out_and_the_rest_is_not_placed_again(hidden: list[str], left: list[int]) -> None:
    new = changed(SCENE, f"hide = {hidden}")
    assert [id(part) for part in new.instances] == [id(SCENE.instances[i]) for i in left]
    assert new.objects == tuple(SCENE.objects[i] for i in left if i < 2) and (new.floor is None) == ("floor" in hidden)
    assert len(SCENE.instances) == 4 and len(SCENE.objects) == 2


@cases(
    ("text", "said"),
    [
        ("render.samples = ", "expected TOML, got a syntax error"),
        ("a" * 9 + " = " + "[" * 9999, "expected TOML, got a syntax error"),
        ("objects = []", "change: expected keys among .*'camera', 'lights', 'materials', 'render'.*, got 'objects'"),
        ("materials.gold = {}", "materials: expected names among .*'grey'.*, got 'gold'"),
        ("materials.grey = {shinyness = 3}", "materials.grey.shinyness: unknown key"),
        ("materials.grey = {type = 'wood'}", "materials.grey"),
        ("hide = ['objects.7']", "hide: expected objects among .*'objects.0', 'objects.1', 'floor'.*, got 'objects.7'"),
        ("hide = 'floor'", "hide: expected a list"),
        ("render.samples = 3", "samples"),
        ("render.colour = 3", "colour"),
        ("camera = {eye = [0, 0, 1]}", "camera"),
        ("lights = [{type = 'sun'}]", "lights"),
        ("camera = 3", "camera"),
        ("ambient = -1", "ambient.0: expected a number greater than or equal to 0"),
        ("background = [1, 2]", "background.2: expected a value"),
        ("sky.lights = 5000", "sky.lights: expected a number less than or equal to 4096, got 5000"),
        ("background = 1\nsky = {}", "background: expected none beside a sky"),
    ],
)
def test_what_is_wrong_is_said_on_one_line(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said) as told:
        changed(SCENE, text)
    assert "\n" not in str(told.value)


@pytest.mark.judges("octree-render render --change")
def test_the_command_renders_the_changed_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from PIL import Image as Pillow

    (tmp_path / "a.toml").write_text("[camera]\neye = [0, 0, 4]\ntarget = [0, 0, 0]\n[materials]\n")
    words = ["render", str(tmp_path / "a.toml"), "--quiet", "-o", str(tmp_path / "a.png")]
    assert main([*words, "--resolution", "9x9", "--change", "render.resolution = [4, 2]"]) == 0
    with Pillow.open(tmp_path / "a.png") as written:
        assert written.size == (9, 9)  # options go before changes
    assert main([*words, "--change", "render.samples = 4", "--change", "render.resolution = [4, 2]"]) == 0
    with Pillow.open(tmp_path / "a.png") as written:
        picture = np.asarray(written)[..., :3]
    assert picture.shape == (2, 4, 3) and (picture == srgb(np.zeros((2, 4, 3), np.float32))).all()
    capsys.readouterr()
    assert main([*words, "--change", "colour = 3"]) == 2
    said = capsys.readouterr().err
    assert "--change: change: expected keys among" in said and said.count("\n") == 1
