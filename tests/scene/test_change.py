"""Changes of a scene by a few lines of TOML."""

import pytest

from renderer import DirectionalLight, OrthographicCamera, Scene
from renderer.scene.change import changed

SCENE = Scene(
    camera={"eye": (0, 0, 1), "target": (0, 0, 0)}, materials={}, lights=[{"type": "point", "position": (0, 1, 0)}]
)


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


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("render.samples = ", "expected TOML, got a syntax error"),
        ("a" * 9 + " = " + "[" * 9999, "expected TOML, got a syntax error"),
        ("materials = {}", "change: expected keys among .*'camera', 'lights', 'render'.*, got 'materials'"),
        ("render.samples = 3", "samples"),
        ("render.colour = 3", "colour"),
        ("camera = {eye = [0, 0, 1]}", "camera"),
        ("lights = [{type = 'sun'}]", "lights"),
        ("camera = 3", "camera"),
    ],
)
def test_what_is_wrong_is_said_on_one_line(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said) as told:
        changed(SCENE, text)
    assert "\n" not in str(told.value)
