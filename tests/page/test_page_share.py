"""The file that the page makes of what it shows: opened from disk, without a server and without a network."""

import base64
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import pytest
from cases import cases
from numpy.typing import NDArray
from PIL import Image as Pillow
from viewer_page import SCENE, Viewer, served

# Names that would end the element that they stand in, or begin another, were they not escaped.
FILE = "<b>\"&'.toml"
MATERIAL = "</script><!--<script><img src=x onerror=alert(1)>"


class Saved(Viewer):
    """A saved file in the browser, without a network; ``asked`` has the addresses that it fetches, but for its own."""

    def __init__(self, browser: Any, path: Path, **options: Any) -> None:
        self.asked: list[str] = []
        super().__init__(browser, path.as_uri(), offline=True, **options)

    def _check_request(self, request: Any) -> None:
        if request.url != self.url and not request.url.startswith("data:"):
            self.asked.append(request.url)

    def open(self) -> Self:
        self.page.goto(self.url)
        self.page.wait_for_selector("body[data-ready]")
        self.drawn()
        return self

    def drawn(self) -> None:
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def show(self, what: str) -> None:
        self.page.locator("#stage").press({"picture": "1", "model": "2"}[what])
        self.page.wait_for_selector(f"#stage[data-shows={what}]")
        self.drawn()

    def switched(self, name: str, on: bool) -> NDArray[np.uint8]:
        """The layer's pixels with boxes or rays switched on or off."""
        self.page.set_checked(f"#{name}", on)
        self.drawn()
        return self.pixels("gl")

    @property
    def picture(self) -> NDArray[np.uint8]:
        """The picture as the browser shows it, (h, w, 4)."""
        self.page.evaluate(
            """() => {
                const image = document.querySelector("#picture");
                const copy = Object.assign(document.createElement("canvas"), { id: "copy" });
                [copy.width, copy.height] = [image.naturalWidth, image.naturalHeight];
                copy.getContext("2d").drawImage(image, 0, 0);
                document.querySelector("#copy")?.remove();
                document.body.append(copy);
                copy.hidden = true;
            }"""
        )
        return self.pixels("copy")


class Made(NamedTuple):
    """A file, and what the page showed when it was made."""

    path: Path
    picture: NDArray[np.uint8]
    camera: dict[str, Any]
    card: str


def saved(viewer: Viewer, path: Path) -> Path:
    with viewer.page.expect_download() as download:
        viewer.page.evaluate("() => (document.querySelector('#share').open = true)")
        viewer.page.click("#share-file")
    assert download.value.suggested_filename == "blocks.html"
    download.value.save_as(path)
    return path


@pytest.fixture(scope="module")
def made(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Made:
    """The file of a picture with boxes and a picked ray, from a server that has ended."""
    folder = tmp_path_factory.mktemp("shared")
    (folder / "blocks.toml").write_text(SCENE)
    with served(folder / "blocks.toml") as url:
        viewer = Viewer(browser, url).open()
        viewer.page.set_checked("[name=boxes]", True)
        viewer.page.wait_for_function("() => window.viewer.scenes.boxes.count > 0 && window.viewer.layer.loaded")
        viewer.page.mouse.click(*viewer.centre())
        viewer.page.wait_for_selector("#card:not([hidden])")
        card = viewer.page.inner_text("#card dl")
        path = saved(viewer, folder / "saved.html")
        seen = viewer.pixels("picture")
        camera = viewer.camera
        viewer.context.close()
    return Made(path, seen, camera, card)


@pytest.fixture
def file(browser: Any, made: Made) -> Iterator[Saved]:
    with Saved(browser, made.path).open() as page:
        yield page
        assert page.asked == []


def colors(rgba: NDArray[np.uint8]) -> int:
    return len(np.unique(rgba.reshape(-1, 4), axis=0))


def test_the_file_has_the_picture_to_the_pixel(file: Saved, made: Made) -> None:
    assert np.array_equal(file.picture, made.picture) and colors(made.picture) > 100
    box = file.page.locator("#picture").bounding_box()
    assert abs(box["width"] / box["height"] - made.picture.shape[1] / made.picture.shape[0]) < 0.01
    text = file.page.inner_text("#hud")
    assert text == f"Ray traced · {made.picture.shape[1]} × {made.picture.shape[0]}"


def test_boxes_and_the_ray_lie_over_the_picture_and_can_be_switched(file: Saved) -> None:
    both = file.switched("boxes", True)
    ray = file.switched("boxes", False)
    nothing = file.switched("rays", False)
    assert not nothing.any()
    assert colors(ray) > 20 and colors(both) > colors(ray)
    assert (both[..., 3] > 0).mean() > 0.9  # the veil under the boxes
    assert 0 < (ray[..., 3] > 0).mean() < 0.5


def test_the_model_is_drawn_and_turns(file: Saved, made: Made) -> None:
    file.switched("boxes", False)
    file.switched("rays", False)
    file.show("model")
    assert file.page.is_hidden("#picture")
    before = file.pixels("gl")
    assert colors(before) > 100 and (before[..., 3] == 255).all()
    # Where the picture has the background, so has the model from the picture's camera, and nowhere else.
    small = np.asarray(Pillow.fromarray(made.picture).resize(before.shape[1::-1], Pillow.Resampling.NEAREST))
    sky = [np.abs(seen[..., :3].astype(int) - made.picture[0, 0, :3]).max(axis=2) < 3 for seen in (before, small)]
    assert 0.05 < sky[0].mean() < 0.95 and (sky[0] == sky[1]).mean() > 0.99
    with_boxes = file.switched("boxes", True)
    assert (with_boxes != before).any(axis=2).mean() > 0.5
    file.switched("boxes", False)
    file.drag(120, 30)
    file.drawn()
    assert (file.pixels("gl") != before).any(axis=2).mean() > 0.1
    file.page.click("#reset")
    file.page.wait_for_selector("#stage[data-shows=picture]")
    file.show("model")
    assert np.array_equal(file.pixels("gl"), before)


def test_a_movement_over_the_picture_shows_the_model(file: Saved) -> None:
    for move in (lambda: file.drag(60, 0), lambda: file.page.mouse.wheel(0, -200)):
        file.show("picture")
        file.page.mouse.move(*file.centre())
        move()
        file.page.wait_for_selector("#stage[data-shows=model]")
    file.show("picture")
    file.page.locator("#stage").press("ArrowLeft")
    file.page.wait_for_selector("#stage[data-shows=model]")


def test_the_card_of_the_ray_comes_along(file: Saved, made: Made) -> None:
    assert file.page.inner_text("#card dl") == made.card and "face" in made.card
    with_nodes = file.switched("boxes", False)
    file.page.click("#card [role=switch]")
    file.drawn()
    assert (file.pixels("gl") != with_nodes).any()
    file.page.click("#card .close")
    file.drawn()
    assert file.page.is_hidden("#card") and not file.page.is_checked("#rays")
    assert not file.pixels("gl").any()


@cases("scheme", ["dark", "light"])
@cases("width", [390, 1280])
def test_it_fits_every_screen_in_both_themes(browser: Any, made: Made, scheme: str, width: int) -> None:
    with Saved(browser, made.path, viewport={"width": width, "height": 800}, color_scheme=scheme).open() as page:
        assert page.page.evaluate("() => document.documentElement.scrollWidth") == width
        for control in page.page.locator("button:visible, input:visible, #frame:visible, #card:visible").all():
            box = control.bounding_box()
            assert box["x"] >= 0 and box["x"] + box["width"] <= width, control.get_attribute("id")
        ground = page.page.evaluate("() => getComputedStyle(document.body).backgroundColor")
        assert (int(re.findall(r"\d+", ground)[0]) < 128) == (scheme == "dark")
        assert page.asked == []


def test_without_webgl_the_picture_is_there(browser: Any, made: Made) -> None:
    with Saved(browser, made.path) as page:
        page.page.add_init_script(
            """const context = HTMLCanvasElement.prototype.getContext;
            HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
                return kind.startsWith("webgl") ? null : context.call(this, kind, ...rest);
            };"""
        )
        page.open()
        assert np.array_equal(page.picture, made.picture)
        assert "WebGL2" in page.page.inner_text("#note")
        assert all(page.page.is_disabled(f) for f in ("[name=shows][value=model]", "#boxes", "#rays", "#fit"))
        page.drag(60, 0)
        assert page.page.locator("#stage").get_attribute("data-shows") == "picture"


def test_a_mesh_over_the_budget_is_left_out_and_that_is_said(viewer: Viewer, browser: Any, tmp_path: Path) -> None:
    viewer.page.evaluate("() => (window.viewer.sharing.share.mostFaces = 10)")
    path = saved(viewer, tmp_path / "small.html")
    viewer.page.evaluate("() => (window.viewer.sharing.share.mostFaces = 1e6)")
    assert "more than the 10 that a file holds" in viewer.page.inner_text("#notices")
    with Saved(browser, path).open() as page:
        assert np.array_equal(page.picture, viewer.pixels("picture"))
        assert "more than the 10 that a file holds" in page.page.inner_text("#note")
        assert page.page.is_disabled("[name=shows][value=model]")
        page.drag(60, 0)
        page.drawn()
        assert page.page.locator("#stage").get_attribute("data-shows") == "picture"
        assert page.asked == []


@pytest.mark.parametrize("mode", ["gl", "phong"])
def test_of_the_model_alone_its_drawing_is_the_picture(viewer: Viewer, browser: Any, tmp_path: Path, mode: str) -> None:
    viewer.choose(mode)
    drawn = viewer.pixels("gl")
    viewer.page.set_checked("[name=boxes]", True)
    viewer.page.wait_for_function("() => window.viewer.scenes.boxes.count > 0")
    path = saved(viewer, tmp_path / "model.html")
    with Saved(browser, path).open() as page:
        assert np.array_equal(page.picture, drawn)  # without the boxes, which are a layer of their own
        assert page.switched("boxes", True).any() and not page.switched("boxes", False).any()


def test_a_picture_under_way_is_waited_for(viewer: Viewer, browser: Any, tmp_path: Path) -> None:
    with viewer.page.expect_download() as download:
        viewer.page.evaluate(
            """() => {
                window.viewer.camera.orbit(0.3, 0.1);
                window.viewer.moved();
                document.querySelector("#share-file").click();
            }"""
        )
    path = tmp_path / "moved.html"
    download.value.save_as(path)
    viewer.settled("octree")
    found = re.search(r'id="picture" src="data:image/png;base64,([^"]+)"', path.read_text("utf-8"))
    assert found is not None
    held = np.asarray(Pillow.open(io.BytesIO(base64.b64decode(found[1]))).convert("RGBA"))
    assert np.array_equal(held, viewer.pixels("picture"))


def test_names_are_text_whatever_they_hold(browser: Any, tmp_path: Path) -> None:
    scene = SCENE.replace("[materials.red]", f'[materials."{MATERIAL}"]').replace('"red"', f'"{MATERIAL}"')
    (tmp_path / FILE).write_text(scene)
    with served(tmp_path / FILE) as url:
        viewer = Viewer(browser, url).open()
        viewer.page.evaluate("() => (document.querySelector('#share').open = true)")
        with viewer.page.expect_download() as download:
            viewer.page.click("#share-file")
        download.value.save_as(tmp_path / "saved.html")
        viewer.context.close()
    with Saved(browser, tmp_path / "saved.html").open() as page:
        assert page.page.title() == f"{FILE} · octree-render"
        assert page.page.text_content("#name") == "<b>\"&'" and page.page.locator("header b").count() == 0
        names = page.page.evaluate("() => window.standalone.known.scene.materials.map((m) => m.name)")
        assert MATERIAL in names and page.page.locator("[onerror]").count() == 0
        assert page.asked == []


def test_the_file_tells_of_no_server_and_no_other_file(made: Made) -> None:
    text = made.path.read_text("utf-8")
    known = re.search(r'<script type="application/json" id="known">(.*?)</script>', text)
    assert known is not None
    rest = known[1].replace('"name":"blocks.toml"', "")
    assert "127.0.0.1" not in text and "server" not in known[1] and "blocks.toml" not in rest
    assert "default-src 'none'" in text
