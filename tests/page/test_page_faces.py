"""Preview's faces: smooth, flat, or with the edges of the triangles."""

from collections.abc import Iterator
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray
from viewer_page import Viewer, served

from renderer.mesh.load import save_ply
from renderer.mesh.shapes import icosphere

BALL = """
ambient = 0.1
background = [0.2, 0.4, 0.9]
[camera]
eye = [0.0, 0.0, 4.0]
target = [0.0, 0.0, 0.0]
fov = 40
[materials.grey]
diffuse = 0.7
[[lights]]
type = "directional"
direction = [-0.6, -1.4, -0.8]
irradiance = 0.8
[[objects]]
mesh = "ball.ply"
material = "grey"
normals = "smooth"
"""
MESH = icosphere(1)


@pytest.fixture(scope="module")
def page(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Viewer]:
    folder = tmp_path_factory.mktemp("ball")
    save_ply(MESH, folder / "ball.ply")
    (folder / "ball.toml").write_text(BALL)
    with served(folder / "ball.toml") as url, Viewer(browser, url).open() as page:
        page.choose("gl")
        page.page.wait_for_function("() => viewer.layer.loaded")
        yield page


def seen(page: Viewer, faces: str) -> NDArray[np.uint8]:
    page.page.select_option("[name=faces]", faces)
    page.settled("gl")
    return page.pixels("gl")[..., :3]


@pytest.mark.parametrize("faces", ["smooth", "flat", "wireframe"])
def test_faces_of_each_kind_are_exposed(page: Viewer, faces: str) -> None:
    """The exposure was that of smooth ones alone."""
    before = seen(page, faces).astype(int)
    page.page.locator("[name=exposure]").fill("1")
    page.settled("gl")
    after = page.pixels("gl")[..., :3].astype(int)
    page.page.locator("[name=exposure]").fill("0")
    page.settled("gl")
    assert after[0, 0].tolist() == [round(255 * (1.055 * (2 * c) ** (1 / 2.4) - 0.055)) for c in (0.2, 0.4, 0.5)]
    assert (after.reshape(-1, 3) >= before.reshape(-1, 3)).all(axis=1).mean() > 0.9
    middle = tuple(side // 2 for side in after.shape[:2])
    assert (after[middle] > before[middle]).all()


def test_flat_faces_have_one_colour_each(page: Viewer) -> None:
    """That of their own normals, but for pixels that two faces share."""
    corners = MESH.vertices[MESH.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    light = np.array([0.6, 1.4, 0.8]) / np.linalg.norm([0.6, 1.4, 0.8])
    cosines = np.maximum(normals @ light / np.linalg.norm(normals, axis=1), 0.0)
    codes = 255.0 * (1.055 * (0.7 * (0.1 + 0.8 * cosines)) ** (1 / 2.4) - 0.055)
    shares = []
    for faces in ("smooth", "flat"):
        colors = seen(page, faces).reshape(-1, 3)
        greys = colors[colors[:, 0] == colors[:, 2], 0]
        shares.append((np.abs(greys[:, None] - codes).min(axis=1) < 0.6).mean())
    assert shares[0] < 0.7 and shares[1] > 0.85


def test_a_wireframe_is_the_shaded_model_with_its_edges(page: Viewer) -> None:
    different = (seen(page, "wireframe") != seen(page, "smooth")).any(axis=-1)
    height, width = different.shape
    film = height / 2 / np.tan(np.radians(20.0))
    places = MESH.vertices[:, :2] / (4.0 - MESH.vertices[:, 2:]) * [film, -film] + [width / 2, height / 2]
    corners = MESH.vertices[MESH.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = np.einsum("ij,ij->i", normals, [0.0, 0.0, 4.0] - corners[:, 0]) > 0.0
    edges = np.concatenate([MESH.faces[front][:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
    start, end = places[edges[:, 0]], places[edges[:, 1]]
    across, along = np.round((start + end) / 2 - 0.5).astype(int).T
    assert different[along, across].mean() > 0.9  # but for some of the outline, which lies between two pixels
    at = np.argwhere(different)[:, ::-1] + 0.5
    share = np.clip(np.einsum("nek,ek->ne", at[:, None] - start, end - start) / ((end - start) ** 2).sum(axis=1), 0, 1)
    distance = np.linalg.norm(at[:, None] - start - share[..., None] * (end - start), axis=2).min(axis=1)
    assert distance.max() < 2.0 and 0.02 < different.mean() < 0.2


def test_the_choice_is_offered_in_preview_and_kept(page: Viewer) -> None:
    seen(page, "wireframe")
    page.page.wait_for_function("() => viewer.past.timer === null")
    assert parse_qs(urlsplit(page.page.url).fragment)["faces"] == ["wireframe"] and page.page.is_hidden("[name=aov]")
    page.choose("octree")
    assert page.page.is_hidden("[name=faces]") and page.page.is_visible("[name=aov]")
    page.page.reload()
    page.page.wait_for_selector("body[data-ready]")
    page.choose("gl")
    assert page.page.input_value("[name=faces]") == "wireframe"
    page.page.evaluate("() => (location.hash = 'mode=gl')")
    page.page.wait_for_function("() => viewer.panel.fields.faces.value === 'smooth'")
    page.settled("gl")
