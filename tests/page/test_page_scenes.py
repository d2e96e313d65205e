"""Scenes in the viewer's page: of another server, edited, of another tab, orthographic, and on their way."""

import re
import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from viewer_page import MODELS, SCENE, Viewer, served

from renderer import load_scene, render
from renderer.picture.image import srgb

SKY, ORANGE = "[0.45, 0.62, 0.82]", "[0.9, 0.5, 0.1]"
# Fewer faces, another background and another camera.
OTHER = SCENE.replace(SKY, ORANGE).replace(str(MODELS / "stairs.ply"), str(MODELS / "block.ply"))
OTHER = OTHER.replace("eye = [0.5, 2.6, 5.5]", "eye = [-1.5, 2.6, 5.5]")
PARALLEL = SCENE.replace("fov = 38", 'type = "orthographic"\nheight = 3.5')
NEVER = """const fetch = window.fetch;
    window.fetch = (address, ...rest) =>
        window.held && String(address).includes("/mesh") ? new Promise(() => {}) : fetch(address, ...rest);
"""


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def shows_only(page: Viewer, file: Path) -> None:
    """Title, list, camera, model and picture are all of that scene."""
    page.shows(file.name)
    page.page.wait_for_function("() => viewer.layer.loaded")
    page.settled("octree")
    scene = load_scene(file)
    faces = sum(len(instance.mesh.faces) for instance in scene.instances)
    assert page.page.inner_text("#name").lower() == file.stem and file.name in page.page.title()
    assert page.page.input_value("[name=file]") == file.name
    assert page.page.evaluate("() => [viewer.layer.model.faces, viewer.scene.faces]") == [faces, faces]
    assert np.allclose(page.camera["m"][12:15], scene.camera.eye, rtol=1e-9)  # made again from angles
    assert np.array_equal(page.pixels("picture")[0, 0, :3], srgb(scene.background))


@pytest.mark.parametrize("name", ["b/blocks.toml", "a/other.toml"])
def test_a_page_shows_the_scene_of_a_server_that_restarts(browser: Any, tmp_path: Path, name: str) -> None:
    """It kept the boxes, the depths and the camera of the scene before, under the new pictures."""
    port = free_port()
    files = [tmp_path / "a/blocks.toml", tmp_path / name]
    for file, text in zip(files, (SCENE, OTHER), strict=True):
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
    with served(files[0], port) as address:
        page = Viewer(browser, address).open()
    try:
        page.page.wait_for_selector("body[data-connected=false]")
        with served(files[1], port):
            page.page.wait_for_selector("body[data-connected=true]")
            page.page.wait_for_function("(sky) => String(viewer.scene.background) === sky", arg="0.9,0.5,0.1")
            shows_only(page, files[1])
            page.context.close()  # before its server, or what it still fetches fails
        Viewer.faults[:] = [fault for fault in Viewer.faults if "ERR_CONNECTION" not in fault]  # the browser's own
    finally:
        page.context.close()


@pytest.mark.parametrize("how", ["button", "F5"])
def test_an_edited_scene_is_loaded_again_and_its_camera_stays(browser: Any, tmp_path: Path, how: str) -> None:
    file = tmp_path / "blocks.toml"
    file.write_text(SCENE)
    with served(file) as address, Viewer(browser, address).open() as page:
        page.drag(60, 20)
        page.page.wait_for_timeout(50)
        page.settled("octree")
        camera = page.camera
        for background in (ORANGE, SKY):
            file.write_text(SCENE.replace(SKY, background))
            page.page.click("#reload") if how == "button" else page.page.reload()
            sky = background.strip("[]").replace(" ", "")
            page.page.wait_for_function("(sky) => String(window.viewer?.scene?.background) === sky", arg=sky)
            page.settled("octree")
            assert page.camera == camera
            assert np.array_equal(page.pixels("picture")[0, 0, :3], srgb(load_scene(file).background))
        # A camera that the file itself has changed is the one to see.
        file.write_text(OTHER)
        page.page.click("#reload") if how == "button" else page.page.reload()
        page.page.wait_for_function("() => String(window.viewer?.scene?.background) === '0.9,0.5,0.1'")
        shows_only(page, file)


def test_a_fault_of_an_edited_file_is_told_until_it_is_mended(browser: Any, tmp_path: Path) -> None:
    """It went after eight seconds, and the picture of the file before stood there without a word."""
    file = tmp_path / "blocks.toml"
    file.write_text(SCENE)
    with served(file) as address, Viewer(browser, address).open() as page:
        notice = page.page.locator("#notices [data-name=edited]")
        for fault in ("fov = 400", "fov = 500"):  # the newer one takes the other's place
            file.write_text(SCENE.replace("fov = 38", fault))
            notice.filter(has_text=fault.removeprefix("fov = ")).wait_for()
            assert notice.count() == 1
        file.write_text(SCENE)
        notice.wait_for(state="detached")
        shows_only(page, file)


def test_a_scene_is_opened_in_the_tab_that_asked_and_stays_when_it_is_loaded_again(browser: Any, url: str) -> None:
    with Viewer(browser, url).open() as one, Viewer(browser, url).open() as two:
        before = two.pixels("picture")
        one.page.select_option("[name=file]", "other.toml")
        one.shows("other.toml")
        one.settled("octree")
        two.drag(30, 0)
        two.page.wait_for_timeout(50)
        two.page.locator("#stage").press("r")
        two.settled("octree")
        assert two.page.inner_text("#name") == "Blocks" and np.array_equal(two.pixels("picture"), before)
        one.page.reload()
        one.shows("other.toml")
        one.settled("octree")
        assert np.array_equal(one.pixels("picture")[0, 0, :3], srgb([0.9, 0.5, 0.1]))


def test_nothing_of_the_scene_before_stands_under_the_name_of_the_next(browser: Any, url: str) -> None:
    with Viewer(browser, url) as page:
        page.page.add_init_script(NEVER)
        page.open().choose("gl")
        page.page.evaluate("() => { window.held = true; }")
        page.page.select_option("[name=file]", "other.toml")
        page.page.wait_for_function("() => document.querySelector('#name').textContent === 'other'")
        page.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert np.array_equal(np.unique(page.pixels("gl")[..., :3].reshape(-1, 3), axis=0), [srgb([0.9, 0.5, 0.1])])
        assert "Loading the model" in page.page.inner_text("#busy")


def test_pictures_are_traced_before_the_model_is_there(browser: Any, url: str) -> None:
    with Viewer(browser, url) as page:
        page.page.add_init_script(f"window.held = true; {NEVER}")
        page.open()
        before = page.pixels("picture")
        page.drag(60, 20)
        page.page.wait_for_timeout(600)
        page.settled("octree")
        assert not np.array_equal(page.pixels("picture"), before)
        assert page.page.evaluate("() => !viewer.layer.loaded && viewer.traced.finished")


def test_a_model_of_very_many_faces_is_fetched_when_it_is_to_be_seen(browser: Any, url: str) -> None:
    page, asked = Viewer(browser, url), []
    page.page.on("request", lambda request: asked.append("/mesh" in request.url))

    def many(route: Any) -> None:
        answer = route.fetch()
        route.fulfill(response=answer, json=answer.json() | {"faces": 1_000_001})

    page.page.route(re.compile(r"/scene\?"), many)
    try:
        page.open()
        assert not any(asked)
        page.choose("gl")
        assert sum(asked) == 1 and len(np.unique(page.pixels("gl").reshape(-1, 4), axis=0)) > 15
    finally:
        page.context.close()


@pytest.fixture
def parallel(browser: Any, tmp_path: Path) -> Any:
    (tmp_path / "parallel.toml").write_text(PARALLEL)
    with served(tmp_path / "parallel.toml") as address, Viewer(browser, address).open() as page:
        yield page


def test_an_orthographic_scene_is_the_command_lines_picture(parallel: Viewer, tmp_path: Path) -> None:
    """It was shown in a perspective of 20 degrees."""
    parallel.page.select_option("[name=size]", "scene")
    parallel.settled("octree")
    image = render(load_scene(tmp_path / "parallel.toml"))
    different = parallel.pixels("picture")[..., :3] != srgb(image.radiance)
    # The page makes the camera again from angles: another rounding may move an edge across a pixel's centre.
    assert different.any(axis=-1).mean() < 1e-3
    # In WebGL the same things are seen at the same places, and moved as well.
    parallel.choose("gl")
    seen = parallel.pixels("gl")
    by_gl = (seen[..., :3] != seen[0, 0, :3]).any(axis=-1)
    traced = image.face >= 0
    assert by_gl.shape == traced.shape and 0.1 < traced.mean() < 0.9
    # An edge that both draw to within a pixel.
    assert (by_gl != traced).mean() < 0.02


@pytest.mark.parametrize("name", ["wheel", "f", "drag"])
def test_an_orthographic_camera_moves(parallel: Viewer, name: str) -> None:
    before, seen = parallel.camera, parallel.pixels("picture")
    if name == "wheel":
        parallel.page.mouse.move(*parallel.centre())
        parallel.page.mouse.wheel(0, -300)
    elif name == "drag":
        parallel.drag(40, 10)
    else:
        parallel.page.locator("#stage").press(name)
    parallel.page.wait_for_timeout(50)
    parallel.settled("octree")
    assert (parallel.camera["height"] != before["height"]) == (name != "drag")
    if name != "wheel":  # which keeps what is under the pointer, wherever in its pixel that is
        assert parallel.camera["m"] != before["m"]
    assert not np.array_equal(parallel.pixels("picture"), seen)
    parallel.page.locator("#stage").press("Enter")
    parallel.page.wait_for_selector("#card:not([hidden])")
    parallel.settled("octree")
    assert parallel.pixels("gl")[..., 3].any()  # the ray's way over the traced picture


def test_the_page_says_what_it_waits_for_and_then_no_more(browser: Any, url: str) -> None:
    with Viewer(browser, url) as page:
        page.page.add_init_script("window.held = true; " + NEVER.replace('"/mesh"', '"/scene"'))
        page.page.goto(page.url)
        page.page.wait_for_selector("body[data-connected=true]")
        assert page.page.inner_text("#busy") == "Opening the scene …"
        page.page.evaluate("() => { window.held = false; }")
        page.page.evaluate("() => { viewer.connection.socket.close(); }")  # after which it asks again
        page.page.wait_for_selector("body[data-ready]")
        page.settled("octree")
        page.page.wait_for_function("() => viewer.layer.loaded")
        assert page.page.is_hidden("#busy")
        # Both at once: a quick server has answered before a second question.
        said = page.page.evaluate(
            "() => { viewer.scenes.open('none.toml'); return document.querySelector('#busy').textContent; }"
        )
        assert said == "Opening none.toml …"
        page.page.locator("#notices p", has_text="scene.file").wait_for()
        assert page.page.is_hidden("#busy")


def test_no_wait_is_said_for_what_no_longer_comes(viewer: Viewer) -> None:
    """The line stood for ever where a mode was chosen, or brute force cancelled, before the first picture came."""
    for end in ("viewer.setMode('gl')", "viewer.cancel()", "viewer.scenes.forget()"):
        viewer.page.evaluate("() => { viewer.busy.begin('tracing', 'x'); viewer.progress.show(0.5); }")
        viewer.page.evaluate(f"() => {{ {end}; }}")
        assert viewer.page.is_hidden("#busy")
    viewer.page.evaluate("() => { viewer.scenes.loadMesh(); }")
    viewer.page.wait_for_function("() => viewer.layer.loaded")
