"""Work on a scene in the viewer's page: materials, lights, objects, cameras, and the view in its address."""

import json
import re
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlencode

import numpy as np
import pytest
from cases import cases
from viewer_client import seen_by
from viewer_page import MODELS, SCENE, Viewer, served

from renderer import Mirror, Phong, PointLight, Sky, load_scene
from renderer.scene.hide import without

RED = "#materials details[data-name=red]"


def settled(viewer: Viewer, mode: str = "octree") -> None:
    """Once what was asked for has reached the page's next picture."""
    viewer.page.wait_for_timeout(50)
    viewer.settled(mode)


def shows(viewer: Viewer, scene: Any) -> None:
    """The command line's picture for the page's camera and bounces."""
    expected = seen_by(viewer.camera, scene, max_depth=int(viewer.page.input_value("[name=max_depth]")))
    np.testing.assert_array_equal(viewer.pixels("picture")[..., :3], expected.srgb)


def unfold(viewer: Viewer, entry: str) -> None:
    if viewer.page.locator(entry).get_attribute("open") is None:
        viewer.page.click(f"{entry} > summary")


def test_a_material_is_changed_live_and_taken_back(viewer: Viewer, scenes: Path) -> None:
    scene = load_scene(scenes / "blocks.toml")
    before = viewer.pixels("picture")
    unfold(viewer, RED)
    viewer.page.locator(f"{RED} [aria-label='diffuse, green']").fill("0.625")
    viewer.page.locator(f"{RED} >> text=shininess").locator("..").locator("input").fill("7")
    settled(viewer)
    red = scene.materials["red"].model_copy(update={"diffuse": (0.7, 0.625, 0.1), "shininess": 7.0})
    shows(viewer, scene.model_copy(update={"materials": {**scene.materials, "red": red}}))
    assert viewer.page.inner_text(f"{RED} summary output") == "phong, changed"
    viewer.page.select_option("[aria-label='Type of red']", "mirror")
    settled(viewer)
    shows(viewer, scene.model_copy(update={"materials": {**scene.materials, "red": Mirror()}}))
    viewer.page.click(f"{RED} .undo")
    settled(viewer)
    np.testing.assert_array_equal(viewer.pixels("picture"), before)
    assert viewer.page.is_disabled(f"{RED} .undo")


def test_a_colour_is_picked(viewer: Viewer, scenes: Path) -> None:
    scene = load_scene(scenes / "blocks.toml")
    unfold(viewer, RED)
    viewer.page.locator(f"{RED} input[type=color]").first.fill("#3366ff")
    settled(viewer)
    edited = viewer.page.evaluate("() => viewer.panel.settings.edits.materials.red")
    # IEC 61966-2-1, to the four digits that are kept.
    assert edited["diffuse"] == [0.03310, 0.1329, 1.0]
    shows(viewer, scene.model_copy(update={"materials": {**scene.materials, "red": Phong(**edited)}}))


def test_what_is_no_number_changes_nothing(viewer: Viewer) -> None:
    before = viewer.page.evaluate("() => viewer.traced.seq")
    unfold(viewer, RED)
    for wrong in ("", "-1"):
        viewer.page.locator(f"{RED} [aria-label='diffuse, green']").fill(wrong)
        assert viewer.page.evaluate("() => viewer.panel.settings.edits ?? null") is None
    assert viewer.page.evaluate("() => viewer.traced.seq") == before


def test_webgl_and_the_card_show_the_materials_as_they_are(viewer: Viewer) -> None:
    viewer.choose("gl")
    before, glass = (
        viewer.pixels("gl"),
        "() => viewer.layer.model.runs.glass.reduce((sum, [, count]) => sum + count, 0)",
    )
    few = viewer.page.evaluate(glass)
    unfold(viewer, RED)
    viewer.page.select_option("[aria-label='Type of red']", "dielectric")
    viewer.page.wait_for_timeout(50)
    viewer.settled("gl")
    assert (viewer.pixels("gl") != before).any()
    assert viewer.page.evaluate(glass) > few > 0
    viewer.choose("octree")
    found = [
        viewer.page.evaluate(f"() => viewer.{scene}.materials.map((m) => m.type)") for scene in ("dressed", "scene")
    ]
    assert found == [["dielectric", "dielectric", "phong"], ["phong", "dielectric", "phong"]]


def test_webgl_has_the_materials_in_the_order_of_the_scene_whatever_their_names(viewer: Viewer) -> None:
    """Those with names like integers came first, and faces had the colours of others."""
    found = viewer.page.evaluate(
        """async () => {
            const { Edits } = await import("./static/edits.js");
            const [materials, lights, around] = ["div", "div", "div"].map((tag) => document.createElement(tag));
            const edits = new Edits({ materials, lights, around, changed() {} });
            const names = ["z9", "7", "1"];
            const own = viewer.scene.materials.map((material, i) => ({ ...material, name: names[i] }));
            edits.load({ ...viewer.scene, materials: own });
            const listed = [...materials.querySelectorAll("details")];
            const types = listed.map((entry) => entry.querySelector("summary output").textContent);
            return [edits.dressed.materials.map((m) => m.name), listed.map((entry) => entry.dataset.name), types];
        }"""
    )
    assert found == [["z9", "7", "1"], ["z9", "7", "1"], ["phong", "dielectric", "phong"]]


def test_lights_come_and_go(viewer: Viewer, scenes: Path) -> None:
    scene = load_scene(scenes / "blocks.toml")
    viewer.page.click("text=Add point light")
    settled(viewer)
    point = viewer.page.evaluate("() => viewer.panel.settings.edits.lights[1]")
    shows(viewer, scene.model_copy(update={"lights": (*scene.lights, PointLight(**point))}))
    viewer.page.locator("#lights details").first.locator("summary").click()
    viewer.page.locator("#lights details").first.locator("text=Remove").click()
    settled(viewer)
    shows(viewer, scene.model_copy(update={"lights": (PointLight(**point),)}))
    assert viewer.page.is_disabled("[name=azimuth]")  # there is no directional light to turn any more
    viewer.page.click("text=Add directional light")
    settled(viewer)
    assert not viewer.page.is_disabled("[name=azimuth]")


def test_sliders_and_fields_of_a_light_are_one_direction(viewer: Viewer, scenes: Path) -> None:
    """Once a slider had moved, what was typed changed nothing, and was what Reset light went back to."""
    scene, first = load_scene(scenes / "blocks.toml"), "#lights details:nth-of-type(1)"
    before = viewer.pixels("picture")
    unfold(viewer, first)
    fields = [viewer.page.locator(f"{first} [aria-label='direction, {axis}']") for axis in "xyz"]
    viewer.page.locator("[name=azimuth]").fill("90")
    settled(viewer)
    turned = [float(field.input_value()) for field in fields]
    assert turned[0] < -0.5 and abs(turned[2]) < 1e-9 and viewer.page.inner_text("#light-note") == "Moved"
    shows(viewer, scene.model_copy(update={"lights": (scene.lights[0].model_copy(update={"direction": turned}),)}))
    fields[2].fill("-2")
    settled(viewer)
    typed = (turned[0], turned[1], -2.0)
    shows(viewer, scene.model_copy(update={"lights": (scene.lights[0].model_copy(update={"direction": typed}),)}))
    assert float(viewer.page.input_value("[name=azimuth]")) == round(np.degrees(np.arctan2(-turned[0], 2.0)))
    viewer.page.click("#reset-light")
    settled(viewer)
    np.testing.assert_array_equal(viewer.pixels("picture"), before)
    assert [float(field.input_value()) for field in fields] == [-0.6, -1.4, -0.8]
    assert viewer.page.inner_text("#light-note") == "As the scene has it" and viewer.page.is_disabled("#reset-light")


def test_opened_lights_stay_open_and_so_is_a_new_one(viewer: Viewer) -> None:
    def opened() -> list[bool]:
        return viewer.page.evaluate("() => [...document.querySelectorAll('#lights details')].map((one) => one.open)")

    viewer.page.click("text=Add point light")
    assert opened() == [False, True]
    unfold(viewer, "#lights details:nth-of-type(1)")
    viewer.page.click("text=Add directional light")
    assert opened() == [True, True, True]
    unfold(viewer, RED)
    viewer.page.select_option("[aria-label='Type of red']", "mirror")
    assert opened() == [True, True, True]
    viewer.page.click("#lights details:nth-of-type(2) > summary")
    viewer.page.click("#lights details:nth-of-type(1) >> text=Remove")
    assert opened() == [False, True]


def test_a_material_of_another_type_comes_back_as_it_was(viewer: Viewer) -> None:
    """Its colours were lost, because a mirror has none of them."""
    unfold(viewer, RED)
    viewer.page.locator(f"{RED} [aria-label='diffuse, green']").fill("0.625")
    before = viewer.page.evaluate("() => viewer.panel.settings.edits")
    for kind in ("mirror", "dielectric", "phong"):
        viewer.page.select_option("[aria-label='Type of red']", kind)
    assert viewer.page.evaluate("() => viewer.panel.settings.edits") == before
    viewer.page.select_option("[aria-label='Type of red']", "mirror")
    viewer.page.click(f"{RED} .undo")
    viewer.page.select_option("[aria-label='Type of red']", "mirror")
    viewer.page.select_option("[aria-label='Type of red']", "phong")
    assert viewer.page.evaluate("() => viewer.panel.settings.edits ?? null") is None


def test_objects_are_hidden_and_seen_again_with_all_else_as_it_was(viewer: Viewer, scenes: Path) -> None:
    scene = load_scene(scenes / "blocks.toml")
    viewer.page.locator("[name=max_depth]").fill("2")
    viewer.drag(40, 10)
    settled(viewer)
    camera = viewer.camera
    turns = [("objects.0", ["objects.0"]), ("floor", ["objects.0", "floor"]), ("objects.0", ["floor"]), ("floor", [])]
    for name, hidden in turns:
        before = viewer.page.evaluate("() => viewer.scene.id")
        viewer.page.click(f"#objects [data-name='{name}']")
        viewer.page.wait_for_function("(id) => viewer.scene.id !== id && viewer.layer.loaded", arg=before)
        settled(viewer)
        smaller = without(scene, hidden)
        shows(viewer, smaller)
        assert viewer.camera == camera and viewer.page.input_value("[name=max_depth]") == "2"
        assert viewer.page.evaluate("() => viewer.layer.model.faces") == sum(
            len(i.mesh.faces) for i in smaller.instances
        )
        assert viewer.page.evaluate("() => viewer.objects.hidden") == hidden


def test_the_scene_is_cut_open_and_turned(viewer: Viewer, scenes: Path) -> None:
    """And whole again by Undo; the camera stays, and so does what else is hidden."""
    scene, camera = load_scene(scenes / "blocks.toml"), viewer.camera
    viewer.page.evaluate("() => viewer.past.write()")
    lower, upper = (row[0] for row in viewer.page.evaluate("() => viewer.scene.bounds"))
    middle = viewer.page.evaluate("([a, b]) => Number(((a + b) / 2).toFixed(3))", [lower, upper])
    for act, wanted in (
        (lambda: viewer.page.select_option("#section select", "x"), [f"x > {middle:g}"]),
        (lambda: viewer.page.click("#section button"), [f"x < {middle:g}"]),
        (lambda: viewer.page.click("#objects [data-name=floor]"), ["floor", f"x < {middle:g}"]),
    ):
        act()
        viewer.page.wait_for_function("(names) => String(viewer.scenes.hidden) === names", arg=",".join(wanted))
        settled(viewer)
        shows(viewer, without(scene, wanted))
        assert viewer.camera == camera
    seen = "() => String(viewer.scenes.hidden)"
    viewer.page.evaluate("() => viewer.past.write()")
    while before := viewer.page.evaluate(seen):
        viewer.page.click("#undo")
        viewer.page.wait_for_function("(before) => String(viewer.scenes.hidden) !== before", arg=before)
    settled(viewer)
    shows(viewer, scene)


def test_a_section_that_leaves_nothing_is_refused_and_the_controls_say_what_is_shown(viewer: Viewer) -> None:
    """And an address with one loses that alone; of two sections the panel changes the first."""
    viewer.page.select_option("#section select", "x")
    viewer.page.wait_for_function("() => viewer.section.hidden.length")
    settled(viewer)
    said, place = viewer.page.inner_text("#section output"), viewer.page.input_value("#section input")
    viewer.page.locator("#section input").fill("0")
    viewer.page.locator("#notices p", has_text="at least one face").wait_for()
    assert (viewer.page.inner_text("#section output"), viewer.page.input_value("#section input")) == (said, place)
    viewer.page.evaluate("() => viewer.scenes.goTo({ mode: 'gl', hidden: ['x > -1e9'], chosen: {} })")
    viewer.settled("gl")
    viewer.page.evaluate("() => viewer.scenes.goTo({ mode: 'octree', hidden: ['x > 0.1', 'y < 0.2'], chosen: {} })")
    viewer.page.wait_for_function("() => String(viewer.section.hidden) === 'x > 0.1,y < 0.2'")
    settled(viewer)
    viewer.page.select_option("#section select", "")
    viewer.page.wait_for_function("() => String(viewer.section.hidden) === 'y < 0.2'")
    viewer.page.evaluate("() => viewer.scenes.hide([])")
    viewer.page.wait_for_function("() => !viewer.section.hidden.length")


def test_the_last_object_cannot_be_hidden(viewer: Viewer) -> None:
    for name in ("objects.0", "objects.1"):
        before = viewer.page.evaluate("() => viewer.scene.id")
        viewer.page.click(f"#objects [data-name='{name}']")
        viewer.page.wait_for_function("(id) => viewer.scene.id !== id", arg=before)
        settled(viewer)
    assert viewer.page.is_disabled("#objects [data-name=floor]")
    viewer.page.evaluate("() => viewer.scenes.hide([])")
    viewer.page.wait_for_function("() => viewer.objects.hidden.length === 0")


def test_the_projection_changes_and_what_is_at_the_pivot_keeps_its_size(viewer: Viewer, scenes: Path) -> None:
    scene = load_scene(scenes / "blocks.toml")
    extent, before = viewer.page.evaluate("() => [viewer.camera.extent, viewer.camera.matrix()]")
    viewer.page.select_option("[name=projection]", "orthographic")
    settled(viewer)
    assert viewer.camera["height"] == extent and viewer.page.is_disabled("[name=focal]")
    shows(viewer, scene)
    viewer.page.select_option("[name=projection]", "perspective")
    settled(viewer)
    assert "height" not in viewer.camera
    np.testing.assert_allclose(viewer.camera["m"], before, rtol=1e-12, atol=1e-12)


def test_a_longer_lens_sees_less_from_the_same_eye(viewer: Viewer, scenes: Path) -> None:
    before = viewer.camera
    viewer.page.locator("[name=focal]").fill("2")
    settled(viewer)
    # 100 mm before a film that is 24 mm high.
    assert viewer.camera["fovy"] == pytest.approx(2 * np.arctan(0.12), rel=1e-12)
    assert viewer.camera["m"] == before["m"] and "100 mm" in viewer.page.inner_text("#fold-camera > summary")
    shows(viewer, load_scene(scenes / "blocks.toml"))


def address(viewer: Viewer) -> str:
    """The address once the page has written the view that it shows."""
    viewer.page.wait_for_function("() => viewer.past.timer === null")
    return viewer.page.url


def test_the_address_brings_the_view_back(browser: Any, url: str, scenes: Path) -> None:
    with Viewer(browser, url).open() as one:
        one.drag(50, 20)
        one.page.select_option("[name=samples]", "4")
        one.page.click("[name=shadows]")
        one.page.locator("[name=focal]").fill("1.7")
        unfold(one, RED)
        one.page.locator(f"{RED} [aria-label='diffuse, blue']").fill("0.5")
        before = one.page.evaluate("() => viewer.scene.id")
        one.page.click("#objects [data-name=floor]")
        one.page.wait_for_function("(id) => viewer.scene.id !== id", arg=before)
        settled(one)
        link, camera, picture = address(one), one.camera, one.pixels("picture")
    with Viewer(browser, link) as two:
        two.page.goto(link)
        two.page.wait_for_function("() => window.viewer?.objects.hidden.length === 1")
        settled(two)
        assert two.camera == camera
        np.testing.assert_array_equal(two.pixels("picture"), picture)
        assert not two.page.is_checked("[name=shadows]") and two.page.input_value("[name=samples]") == "4"
        # Another address in the same tab is gone to; loading it again stays there.
        other = re.sub("#.*", f"#{urlencode({'file': 'other.toml', 'mode': 'phong'})}", link)
        two.page.evaluate("(hash) => (location.hash = hash)", other.split("#")[1])
        two.shows("other.toml")
        two.settled("phong")
        assert parse_qs(address(two).split("#")[1])["file"] == ["other.toml"]
        two.page.reload()
        two.shows("other.toml")
        two.settled("phong")


def told(viewer: Viewer) -> dict[str, list[str]]:
    return parse_qs(address(viewer).split("#")[1])


def test_the_address_keeps_the_settings_of_the_page_when_the_scene_is_loaded_again(viewer: Viewer) -> None:
    """They were left out from then on, as if they were the scene's own; and an address without them left them."""
    chosen = {"size": "0.25", "aov": "depth", "refine": "4"}
    for name, value in chosen.items():
        viewer.page.select_option(f"[name={name}]", value)
    before = viewer.page.evaluate("() => viewer.scene.id")
    viewer.page.click("#reload")
    viewer.page.wait_for_function("(id) => viewer.scene.id !== id", arg=before)
    settled(viewer)
    assert {name: told(viewer).get(name) for name in chosen} == {name: [value] for name, value in chosen.items()}
    viewer.page.evaluate("() => (location.hash = 'file=blocks.toml')")
    viewer.page.wait_for_function("() => viewer.panel.fields.size.value === '1'")
    assert viewer.page.evaluate("() => viewer.panel.chosen") == {}
    settled(viewer)


def test_the_address_has_the_mode_and_what_a_proof_compares(viewer: Viewer) -> None:
    """A change of mode was written with the next movement, and the pair never."""
    told(viewer)
    viewer.page.evaluate("() => viewer.setMode('proof')")
    assert told(viewer)["mode"] == ["proof"] and "pair" not in told(viewer)
    viewer.page.select_option("[name=pair]", "brute")
    link = address(viewer)
    assert parse_qs(link.split("#")[1])["pair"] == ["brute"]
    viewer.page.select_option("[name=pair]", "samples")
    address(viewer)
    viewer.page.evaluate("(hash) => (location.hash = hash)", link.split("#")[1])
    viewer.page.wait_for_function("() => viewer.panel.settings.pair === 'brute'")
    viewer.page.evaluate("() => viewer.setMode('octree')")
    settled(viewer)


@pytest.mark.parametrize("hidden", ["floor,objects.0", "objects.0,objects.0"])
def test_an_address_hides_objects_once(viewer: Viewer, hidden: str) -> None:
    """In another order than the scene's, or one of them twice: the server built trees without end."""
    names = sorted(set(hidden.split(",")), reverse=True)
    viewer.page.evaluate(
        """(hidden) => {
            const { connection } = viewer, { send } = connection;
            window.hides = 0;
            connection.send = (message) => {
                window.hides += message.type === "hide";
                if (window.hides < 4) send.call(connection, message);
            };
            location.hash = `#hidden=${hidden}`;
        }""",
        hidden,
    )
    again = "(names) => window.hides > 1 || (String(viewer.objects.hidden) === names && viewer.traced.finished)"
    viewer.page.wait_for_function(again, arg=",".join(names))
    assert viewer.page.evaluate("() => { delete viewer.connection.send; return window.hides; }") == 1


def test_an_address_counts_though_the_page_writes_its_own(viewer: Viewer) -> None:
    """Before it was read, the view that was to be written soon took its place."""
    samples = viewer.page.evaluate(
        """() => new Promise((told) => {
            addEventListener("hashchange", () => setTimeout(() => told(viewer.panel.settings.samples)), { once: true });
            location.hash = "#samples=16";
            viewer.past.write();
        })"""
    )
    assert samples == 16


WRONG = [
    {"mode": "none", "camera": "1,2,3"},
    {"camera": "0,0,NaN,,0.5,0,0,0", "max_depth": "many", "samples": "7", "aov": "<b>"},
    {"camera": "0,0,-4,,0.5,0,0,0", "hidden": "objects.9,floor"},
    {"camera": "0,0,4,,4,0,0,0", "edits": "{"},
    {"camera": "0,0,4,0,1,0,0,0", "edits": json.dumps({"materials": {"red": {"type": "phong", "diffuse": "red"}}})},
    {"edits": json.dumps({"lights": [{"type": "point"}], "materials": {"glass": {"type": "dielectric", "ior": 0}}})},
    {"edits": json.dumps({"materials": {"__proto__": {"type": "phong"}, "gold": {"type": "mirror"}}, "lights": [3]})},
    {"edits": json.dumps({"sky": Sky(sun=(0, -1, 0)).model_dump() | {"lights": 2.5}, "ambient": [-1, 0, 0]})},
    {"edits": json.dumps({"sky": {"lights": 8}, "background": 0.5})},
    {"edits": "null", "file": "../secret.toml", "unknown": "1"},
]


@cases("wrong", WRONG)
def test_what_is_no_view_in_an_address_is_left_out(browser: Any, url: str, scenes: Path, wrong: dict[str, str]) -> None:
    with Viewer(browser, url) as page:
        page.page.goto(f"{url}#{urlencode(wrong)}")
        page.page.wait_for_selector("body[data-ready]")
        page.settled("octree")
        shows(page, load_scene(scenes / "blocks.toml"))
        np.testing.assert_allclose(page.camera["m"][12:15], (0.5, 2.6, 5.5), rtol=1e-9)
        assert page.page.evaluate("() => viewer.panel.settings.edits ?? null") is None
        assert page.page.locator("#notices p").count() == 0


def test_a_scene_is_saved_after_its_diff_was_seen(browser: Any, tmp_path: Path) -> None:
    file = tmp_path / "blocks.toml"
    file.write_text(f"# by hand\n{SCENE}")
    with served(file) as address, Viewer(browser, address).open() as page:
        page.page.click("#save-scene")
        page.page.wait_for_selector("#changes[open]")
        assert "Nothing" in page.page.inner_text("#changes pre") and page.page.is_disabled("#save-changes")
        page.page.keyboard.press("3")  # which is no shortcut here
        page.page.click("#close-changes")
        unfold(page, RED)
        page.page.locator(f"{RED} [aria-label='diffuse, green']").fill("0.5")
        page.page.click("#save-scene")
        page.page.wait_for_selector("#changes .added")
        assert page.page.locator("#changes .added").all_inner_texts() == ["+diffuse = [0.7, 0.5, 0.1]\n"]
        assert page.page.locator("#changes .removed").all_inner_texts() == ["-diffuse = [0.7, 0.1, 0.1]\n"]
        with page.page.expect_download() as download:
            page.page.click("#save-changes")
        assert download.value.suggested_filename == "blocks.toml"
        text = Path(download.value.path()).read_text()
        assert text == file.read_text().replace("[0.7, 0.1, 0.1]", "[0.7, 0.5, 0.1]")
        assert page.page.evaluate("() => viewer.mode") == "octree"
        # In the place of the file it is what the page shows, and nothing is changed any more.
        file.write_text(text)
        page.page.wait_for_function("() => viewer.scene.materials[0].fields.diffuse[1] === 0.5")
        settled(page)
        assert page.page.evaluate("() => viewer.panel.settings.edits ?? null") is None


def test_scene_and_readings_are_open_at_first_and_parts_as_they_were_left_later(browser: Any, url: str) -> None:
    with Viewer(browser, url, folded=True, viewport={"width": 1280, "height": 800}) as page:
        page.open()
        opened = "() => [...document.querySelectorAll('aside details[open]')].map((one) => one.id)"
        assert page.page.evaluate(opened) == ["fold-scene", "fold-readings"] and page.page.is_visible("#panel")
        page.page.click("#fold-octree > summary")
        page.page.wait_for_function("() => JSON.parse(localStorage['octree-render-folds'] ?? '{}')['fold-octree']")
        page.page.click("#toggle-panel")
        assert page.page.is_hidden("#panel")
        page.page.reload()
        page.page.wait_for_selector("body[data-ready]")
        assert page.page.is_hidden("#panel")
        assert page.page.evaluate(opened) == ["fold-scene", "fold-octree", "fold-readings"]
        page.page.set_viewport_size({"width": 900, "height": 700})
    with Viewer(browser, url, folded=True, viewport={"width": 900, "height": 700}) as narrow:
        narrow.open()
        assert narrow.page.is_hidden("#panel")
        assert narrow.page.get_attribute("#toggle-panel", "aria-expanded") == "false"
        assert narrow.page.locator("#frame").bounding_box()["width"] == 900


def test_a_scene_has_its_name_and_a_mesh_that_of_its_file(browser: Any) -> None:
    """It was Block.Ply."""
    with served(MODELS / "block.ply") as url, Viewer(browser, url) as page:
        page.page.goto(url)
        page.page.wait_for_selector("body[data-ready]")
        assert page.page.inner_text("#name") == "block.ply"


def test_the_hint_goes_with_the_first_click(browser: Any, url: str) -> None:
    with Viewer(browser, url, folded=True).open() as page:
        assert page.page.is_visible("#hint")
        page.page.mouse.click(*page.centre())
        page.page.wait_for_selector("#card:not([hidden])")
        assert page.page.is_hidden("#hint")
        page.page.reload()
        page.page.wait_for_selector("body[data-ready]")
        assert page.page.is_hidden("#hint")


def test_the_sun_turns_about_the_axis_that_is_up(browser: Any, tmp_path: Path) -> None:
    """With z up a light that falls from above is high, whatever its y."""
    text = SCENE.replace("ambient = 0.1", 'ambient = 0.1\nup = "z"', 1).replace(
        "[-0.6, -1.4, -0.8]", "[0.0, 1.0, -1.0]"
    )
    (tmp_path / "z.toml").write_text(text)
    with served(tmp_path / "z.toml") as address, Viewer(browser, address).open() as page:
        assert page.page.input_value("[name=elevation]") == "45" and page.page.input_value("[name=azimuth]") == "0"
        page.page.locator("[name=elevation]").fill("90")
        settled(page)
        light = load_scene(tmp_path / "z.toml").lights[0].model_copy(update={"direction": (0.0, 0.0, -1.0)})
        fields = [page.page.locator(f"#lights details [aria-label='direction, {axis}']").first for axis in "xyz"]
        found = [float(field.input_value()) for field in fields]
        np.testing.assert_allclose(found, light.direction, atol=1e-12)


def test_a_change_right_after_the_page_opened_is_undone(browser: Any, url: str) -> None:
    with Viewer(browser, url) as page:
        page.page.goto(url)
        page.page.wait_for_function("() => window.viewer?.scene && (viewer.look([0, 0, 1]), 1)")
        page.page.wait_for_function("() => viewer.past.timer === null")
        assert page.page.is_enabled("#undo")


def test_each_change_is_undone_and_done_again(browser: Any, url: str) -> None:
    """A drag is one step, an edit another; the browser's Back is Undo, and the first view is the end of it."""
    with Viewer(browser, url) as page:
        page.open()
        told(page)
        assert page.page.is_disabled("#undo") and page.page.is_disabled("#redo")
        first = page.camera
        page.drag(60, 10)
        settled(page)
        told(page)
        turned = page.camera
        unfold(page, RED)
        green = page.page.locator(f"{RED} [aria-label='diffuse, green']")
        green.fill("0.5")
        settled(page)
        told(page)
        page.page.locator("#stage").press("Control+z")
        page.page.wait_for_function("() => !viewer.panel.settings.edits")
        settled(page)
        assert (
            page.camera == turned and page.page.locator(f"{RED} [aria-label='diffuse, green']").input_value() == "0.1"
        )
        page.page.go_back()
        page.page.wait_for_function(
            "(m) => String(viewer.camera.matrix()) === m", arg=page.page.evaluate("(m) => String(m)", first["m"])
        )
        settled(page)
        assert told(page) is not None and page.page.is_disabled("#undo")
        page.page.locator("#stage").press("Control+z")  # nothing before: the page stays
        for _ in range(2):
            page.page.click("#redo")
            page.page.wait_for_timeout(300)
        page.page.wait_for_function("() => viewer.panel.settings.edits?.materials.red.diffuse[1] === 0.5")
        page.page.wait_for_selector("#redo:disabled")
        settled(page)
        assert page.camera == turned


FAULTS = [
    ("diffuse, green", "", "Expected a number", "0.1"), ("diffuse, green", "-1", "Expected at least 0", "0.1"),
    ("shininess", "-3", "Expected at least 0", "40"),
]  # fmt: skip


@cases("fault", FAULTS)
def test_a_number_that_is_none_is_said_and_gives_way_to_the_last(viewer: Viewer, fault: tuple[str, ...]) -> None:
    label, typed, says, before = fault
    unfold(viewer, RED)
    field = viewer.page.locator(f"{RED} [aria-label='{label}']")
    field.fill(typed)
    assert viewer.page.inner_text(f"{RED} .fault:not([hidden])") == says
    assert field.get_attribute("aria-invalid") == "true"
    assert viewer.page.evaluate("() => viewer.panel.settings.edits ?? null") is None
    field.blur()
    assert field.input_value() == before and viewer.page.locator(f"{RED} .fault:not([hidden])").count() == 0


def test_a_light_has_a_direction(viewer: Viewer) -> None:
    viewer.page.evaluate("() => document.querySelectorAll('#lights details').forEach((one) => (one.open = true))")
    fields = [viewer.page.locator(f"#lights [aria-label='direction, {axis}']").first for axis in "xyz"]
    for field in fields:
        field.fill("0")
    assert "Expected a direction" in viewer.page.inner_text("#lights .fault:not([hidden])")


def test_lights_that_the_preview_leaves_out_are_counted(viewer: Viewer) -> None:
    for _ in range(8):
        viewer.page.click("#lights >> text=Add directional light")
    assert "first 8 of these" in viewer.page.inner_text("#lights .note:not([hidden])")


def test_another_type_of_material_begins_with_its_own_values(viewer: Viewer) -> None:
    """A mirror made of dark stone reflected a fifth."""
    stone = "#materials [data-name=stone]"
    unfold(viewer, stone)
    viewer.page.select_option(f"{stone} select", "mirror")
    fields = viewer.page.evaluate("() => viewer.panel.settings.edits.materials.stone")
    assert fields == {"type": "mirror", "reflectance": [1, 1, 1]}
