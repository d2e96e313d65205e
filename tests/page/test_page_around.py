"""What is around the scene in the viewer's page: ambient light, and a background or a sky in its place."""

from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from viewer_client import seen_by
from viewer_page import SCENE, Viewer, served

from renderer import Scene, Sky, load_scene, srgb

EDITS = "() => viewer.panel.settings.edits ?? null"
UNDER_SKY = SCENE.replace("background = [0.45, 0.62, 0.82]", "[sky]\nhorizon = [0.5, 0.25, 0.125]\nlights = 8", 1)
SUN = ("Direction of the sun's light, x", "Direction of the sun's light, y", "Direction of the sun's light, z")


def settled(viewer: Viewer, mode: str = "octree") -> None:
    """Once what was asked for has reached the page's next picture."""
    viewer.page.wait_for_timeout(50)
    viewer.settled(mode)


def shows(viewer: Viewer, scene: Scene) -> None:
    settled(viewer)
    expected = seen_by(viewer.camera, scene, max_depth=scene.render.max_depth)
    np.testing.assert_array_equal(viewer.pixels("picture")[..., :3], expected.srgb)


def field(viewer: Viewer, label: str) -> Any:
    return viewer.page.locator(f'#around [aria-label="{label}"]')


def switch(viewer: Viewer, label: str) -> Any:
    return viewer.page.get_by_role("switch", name=label, exact=True)


@pytest.fixture(scope="module")
def scene(scenes: Path) -> Scene:
    return load_scene(scenes / "blocks.toml")


def test_ambient_light_and_background_are_changed_live_and_taken_back(viewer: Viewer, scene: Scene) -> None:
    before = viewer.pixels("picture")
    field(viewer, "Ambient light, red").fill("0.5")
    field(viewer, "Background, blue").fill("0.25")
    around = {"ambient": (0.5, 0.1, 0.1), "background": (0.45, 0.62, 0.25)}
    shows(viewer, scene.altered(**around))
    assert viewer.page.inner_text("#fold-around > summary output") == "changed"
    assert viewer.page.inner_text("#fold-materials > summary output") == "3"
    viewer.choose("gl")
    assert np.array_equal(viewer.pixels("gl")[0, 0, :3], srgb(around["background"]))
    viewer.choose("octree")
    viewer.page.click("#around .undo")
    settled(viewer)
    np.testing.assert_array_equal(viewer.pixels("picture"), before)
    assert viewer.page.is_disabled("#around .undo") and viewer.page.evaluate(EDITS) is None


def test_a_sky_takes_the_place_of_the_background_and_goes_again(viewer: Viewer, scene: Scene) -> None:
    switch(viewer, "Sky").click()
    assert field(viewer, "Background, red").count() == 0
    for label in ("Ground of its own", "Sun"):
        switch(viewer, label).click()
    field(viewer, "Lights of the sky").fill("9")
    field(viewer, "Ground, red").fill("0.25")
    sky = Sky(ground=(0.25, 0.9, 0.95), lights=9, sun=(-0.5, -1, -0.5))
    shows(viewer, scene.altered(background=0, sky=sky))
    viewer.page.click("#save-scene")
    viewer.page.wait_for_selector("#changes[open]")
    added = viewer.page.locator("#changes .added").all_inner_texts()
    assert "+[sky]\n" in added and "+lights = 9\n" in added
    viewer.page.click("#close-changes")
    for label in ("Ground of its own", "Sun"):
        switch(viewer, label).click()
    assert viewer.page.evaluate(EDITS)["sky"].keys() == Sky.model_fields.keys() - {"ground", "sun"}
    switch(viewer, "Sky").click()
    assert viewer.page.evaluate(EDITS) is None
    shows(viewer, scene)
    switch(viewer, "Sky").click()
    assert viewer.page.evaluate(EDITS)["sky"]["lights"] == 9  # as it was left


def test_the_strength_scales_all_colours_of_the_sky(viewer: Viewer, scene: Scene) -> None:
    """And takes them back to the bit, whatever was typed in between."""
    switch(viewer, "Sky").click()
    field(viewer, "Zenith, red").fill("2.123456")
    strength = field(viewer, "Strength")
    assert strength.input_value() == "2.123456"
    strength.fill("0.7")
    sky = Sky(**viewer.page.evaluate(EDITS)["sky"])
    np.testing.assert_allclose(sky.horizon, np.multiply((0.85, 0.9, 0.95), 0.7 / 2.123456), rtol=1e-3)
    assert float(field(viewer, "Zenith, red").input_value()) == 0.7
    shows(viewer, scene.altered(background=0, sky=sky))
    strength.fill("2.123456")
    assert viewer.page.evaluate(EDITS)["sky"]["horizon"] == [0.85, 0.9, 0.95]


FAULTS = [
    ({"Lights of the sky": "5000"}, "Expected at most 4096"), ({"Lights of the sky": "2.5"}, "Expected a whole number"),
    ({"Strength": "0"}, "Expected at least 0.001"), ({"Sun's radius, °": "46"}, "Expected at most 45"),
    ({"Lights of the sun": "0"}, "Expected at least 1"), (dict.fromkeys(SUN, "0"), "Expected a direction, not 0 0 0"),
    ({"Ambient light, red": "-1"}, "Expected at least 0"),
]  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault[1])
def test_what_the_server_would_refuse_is_said_beside_its_field(viewer: Viewer, fault: tuple[Any, str]) -> None:
    typed, says = fault
    for label in ("Sky", "Sun"):
        switch(viewer, label).click()
    *before, last = typed
    for label in before:
        field(viewer, label).fill(typed[label])
    edits = viewer.page.evaluate(EDITS)
    field(viewer, last).fill(typed[last])
    assert viewer.page.inner_text("#around .fault:not([hidden])") == says
    assert viewer.page.evaluate(EDITS) == edits


def test_the_address_has_the_sky_and_undo_takes_it_away(browser: Any, url: str, scene: Scene) -> None:
    written = "() => viewer.past.timer === null"
    with Viewer(browser, url).open() as one:
        one.page.wait_for_function(written)
        switch(one, "Sky").click()
        one.page.wait_for_function(written)  # a step of its own, however slow the machine is
        field(one, "Ambient light, green").fill("0.3")
        sky = {"sky": Sky(lights=32), "background": 0, "ambient": (0.1, 0.3, 0.1)}
        shows(one, scene.altered(**sky))
        one.page.wait_for_function(written)
        link = one.page.url
        for steps in (1, 0):
            one.page.locator("#stage").press("Control+z")
            one.page.wait_for_function("(steps) => viewer.past.steps === steps", arg=steps)
        one.page.wait_for_function("() => !viewer.panel.settings.edits")
        assert not switch(one, "Sky").is_checked() and field(one, "Ambient light, green").input_value() == "0.1"
        shows(one, scene)
        for steps in (1, 2):
            one.page.click("#redo")
            one.page.wait_for_function("(steps) => viewer.past.steps === steps", arg=steps)
        shows(one, scene.altered(**sky))
    assert "sky" in parse_qs(urlsplit(link).fragment)["edits"][0]
    with Viewer(browser, link).open() as two:
        shows(two, scene.altered(**sky))


def test_a_sky_of_the_file_is_turned_off_and_comes_back(browser: Any, tmp_path: Path) -> None:
    (tmp_path / "sky.toml").write_text(UNDER_SKY)
    scene = load_scene(tmp_path / "sky.toml")
    with served(tmp_path / "sky.toml") as address, Viewer(browser, address).open() as page:
        assert switch(page, "Sky").is_checked() and page.page.evaluate(EDITS) is None
        shows(page, scene)
        page.choose("gl")
        assert np.array_equal(page.pixels("gl")[0, 0, :3], srgb((0.5, 0.25, 0.125)))
        page.choose("octree")
        switch(page, "Sky").press("Space")
        shows(page, scene.altered(sky=None))
        assert page.page.evaluate("() => document.activeElement.checked") is False  # the keys stay on the switch
        page.choose("gl")
        assert np.array_equal(page.pixels("gl")[0, 0, :3], (0, 0, 0))
        page.choose("octree")
        switch(page, "Sky").press("Space")
        assert page.page.evaluate(EDITS) is None
        shows(page, scene)


@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_the_preview_has_a_few_of_the_skys_lights(viewer: Viewer, up: str) -> None:
    sky = Sky(zenith=(0.1, 0.5, 0.9), sun=(0.1, -0.3, -0.5), sun_irradiance=(0.2, 0.3, 0.4))
    few = "async ([sky, up]) => (await import('./static/skylights.js')).skylights(sky, up)"
    *found, sun = viewer.page.evaluate(few, [sky.model_dump(exclude_none=True), up])
    for light, expected in zip(found, sky.model_copy(update={"lights": 4, "sun": None}).directional(up), strict=True):
        np.testing.assert_allclose(light["direction"], expected.direction, atol=1e-12)
        np.testing.assert_allclose(light["color"], expected.irradiance, atol=1e-12)
    assert sun == {"type": "directional", "direction": list(sky.sun or ()), "color": list(sky.sun_irradiance)}
    assert viewer.page.evaluate(few, [sky.model_dump() | {"lights": 0, "sun": None}, up]) == []
