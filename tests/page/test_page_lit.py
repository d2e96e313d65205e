"""A lit scene on the page, and in the file that it makes of it: the model has the colours of the picture."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from numpy.typing import NDArray
from PIL import Image as Pillow
from viewer_page import Viewer, served

from renderer import Mesh, PerspectiveCamera, Phong, Scene, SceneObject, shapes
from renderer.radiosity import lit_scene, save_lit

SIZE = (320, 240)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room with walls of two colours and a lamp, lit, in a file."""
    box = shapes.box()
    faces = box.faces[box.face_normals()[:, 2] < 0.5][:, ::-1].reshape(-1, 2, 3)
    walls = [SceneObject(mesh=Mesh(box.vertices, two), material=f"wall {n % 2}") for n, two in enumerate(faces)]
    lamp = SceneObject(mesh=shapes.box((0.4, 0.85, 0.4), (0.6, 0.9, 0.6)), material="lamp")
    materials = {
        "wall 0": Phong(diffuse=(0.7, 0.6, 0.3)), "wall 1": Phong(diffuse=(0.2, 0.3, 0.7)),
        "lamp": Phong(diffuse=0.2, emission=2.0),
    }  # fmt: skip
    eye = PerspectiveCamera(eye=(0.5, 0.5, 2.4), target=(0.5, 0.5, 0), fov=40)
    made = Scene(camera=eye, materials=materials, objects=[*walls, lamp], render={"resolution": SIZE})
    path = tmp_path_factory.mktemp("lit") / "room.toml"
    save_lit(lit_scene(made, 0.25), path)
    return path


class Saved(Viewer):
    """A saved file in the browser, without a network."""

    def _check_request(self, request: Any) -> None:
        assert request.url == self.url or request.url.startswith("data:")


def off(model: NDArray[np.uint8], picture: NDArray[np.uint8]) -> NDArray[np.int64]:
    """How many codes of sRGB pixels differ by."""
    small = np.asarray(Pillow.fromarray(picture).resize(model.shape[1::-1], Pillow.Resampling.NEAREST))
    return np.abs(model[..., :3].astype(int) - small[..., :3]).max(axis=2)


@cases("exposure", [0, -1])
def test_the_model_has_the_colours_of_the_picture(browser: Any, scene: Path, tmp_path: Path, exposure: int) -> None:
    with served(scene) as url, Viewer(browser, url).open() as viewer:
        viewer.page.evaluate(f"() => (viewer.panel.fields.exposure.value = '{exposure}', viewer.changed('exposure'))")
        viewer.settled("octree")
        viewer.page.wait_for_function("() => window.viewer.layer.loaded")
        picture = viewer.pixels("picture")
        with viewer.page.expect_download() as download:
            viewer.page.evaluate("() => (document.querySelector('#share').open = true)")
            viewer.page.click("#share-file")
        path = tmp_path / "room.html"
        download.value.save_as(path)
    assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 500
    with Saved(browser, path.as_uri(), offline=True) as file:
        file.page.goto(path.as_uri())
        file.page.wait_for_selector("body[data-ready]")
        file.page.locator("#stage").press("2")
        file.page.wait_for_selector("#stage[data-shows=model]")
        file.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        model = file.pixels("gl")
    found = off(model, picture)
    # Colours of corners have 8 bits; edges of faces lie between other pixels.
    assert np.quantile(found, 0.9) <= 3 and (found > 40).mean() < 0.02
