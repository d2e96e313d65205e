"""Files that are watched: an edited scene is shown anew, once, after its editor has written it whole."""

from pathlib import Path

import numpy as np
import pytest
from viewer_page import SCENE

pytest.importorskip("uvicorn", reason="the extra viewer is not installed")

from viewer_client import Client, rendered

import renderer
from renderer import load_scene
from renderer.picture.image import srgb
from renderer.viewer.shown import open_file
from renderer.viewer.watch import Watch


def test_an_edit_is_told_once_after_it_has_rested(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(SCENE)
    shown, watch = open_file(file), Watch()
    assert watch.edited([shown]) == set()
    file.write_text(SCENE + "\n")
    assert watch.edited([shown]) == set()  # which may be the half of it
    file.write_text(SCENE + "\n# and more")
    assert watch.edited([shown]) == set()
    assert watch.edited([shown, shown]) == {shown}
    assert watch.edited([shown]) == set()  # where it cannot be loaded, that is said once
    file.write_text(SCENE + "\n# and yet more")
    assert [watch.edited([shown]) for _ in range(3)] == [set(), {shown}, set()]
    file.unlink()
    assert [watch.edited([shown]) for _ in range(3)] == [set(), {shown}, set()]


def test_a_scene_that_is_not_shown_any_more_is_forgotten(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(SCENE)
    shown, watch = open_file(file), Watch()
    file.write_text(SCENE + "\n")
    watch.edited([shown])
    watch.edited([])
    assert watch.edited([shown]) == set() and watch.edited([shown]) == {shown}


def test_an_edited_scene_is_shown_by_itself(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(SCENE)
    with renderer.view(file, browser=False) as viewing, Client(viewing.url) as client:
        before = client.final()
        file.write_text(SCENE.replace("shininess = 40", "shininess = forty"))
        assert "a.toml" in client.told("error")["message"]
        assert client.told("scene")["id"]  # the one before stays
        assert client.final().payload == before.payload
        file.write_text(SCENE.replace("[0.7, 0.1, 0.1]", "[0.1, 0.1, 0.7]"))
        assert client.told("scene")["id"]
        after = client.final()
        assert np.array_equal(after.rgb, srgb(rendered(load_scene(file)).radiance))
        assert after.payload != before.payload
