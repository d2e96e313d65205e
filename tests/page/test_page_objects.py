"""What the card offers for the object that was clicked: its material, and to hide, isolate or frame it."""

from itertools import product
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from viewer_page import Viewer

STAIRS = (-70, 20)  # pixels from the middle, where the scene's stairs are seen


def click(viewer: Viewer, name: str) -> None:
    viewer.page.click(f'#card button:text-is("{name}")')


def pick_stairs(viewer: Viewer) -> None:
    x, y = viewer.centre()
    viewer.pick(x + STAIRS[0], y + STAIRS[1])
    assert viewer.page.inner_text("#card dd >> nth=0") == "stairs"


def hidden(viewer: Viewer, names: list[str]) -> None:
    """Wait until these objects are hidden, and the picture and the address have come."""
    viewer.page.wait_for_function("(names) => String(viewer.objects.hidden) === names", arg=",".join(names))
    viewer.settled("octree")
    viewer.page.wait_for_function("() => viewer.past.timer === null")
    assert parse_qs(urlsplit(viewer.page.url).fragment).get("hidden", [""]) == [",".join(names)]


def test_an_object_is_hidden_from_its_card_and_undo_brings_it_back(viewer: Viewer) -> None:
    before = viewer.camera
    pick_stairs(viewer)
    viewer.page.evaluate("() => viewer.past.write()")
    click(viewer, "Hide")
    hidden(viewer, ["objects.0"])
    assert viewer.page.is_hidden("#card") and viewer.camera == before
    assert "stairs" in viewer.page.inner_text("#notices")
    viewer.page.click("#undo")
    hidden(viewer, [])
    assert "stairs" not in viewer.page.inner_text("#notices")


def test_an_object_is_isolated_and_its_card_shows_all_again(viewer: Viewer) -> None:
    """By keyboard, which goes on from the button; and what was changed stays changed."""
    viewer.page.select_option("[name=samples]", "4")
    pick_stairs(viewer)
    for pressed, names in (("true", ["objects.1", "floor"]), ("false", [])):
        viewer.page.focus('#card button:text-is("Isolate")')
        viewer.page.keyboard.press("Enter")
        hidden(viewer, names)
        viewer.page.wait_for_function("() => document.activeElement.textContent === 'Isolate'")
        assert viewer.page.get_attribute("#card button[aria-pressed]", "aria-pressed") == pressed
        assert viewer.page.is_disabled('#card button:text-is("Hide")') == (pressed == "true")
    assert viewer.page.input_value("[name=samples]") == "4"


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_an_object_is_framed_beside_its_card(viewer: Viewer, projection: str) -> None:
    viewer.page.click("#toggle-panel")
    viewer.page.select_option("[name=projection]", projection, force=True)
    viewer.settled("octree")
    pick_stairs(viewer)
    click(viewer, "Frame")
    viewer.settled("octree")
    lower, upper = viewer.page.evaluate("() => viewer.scene.objects[0].bounds")
    corners = np.array([(*corner, 1.0) for corner in product(*zip(lower, upper, strict=True))])
    camera, (card, frame) = viewer.camera, (viewer.page.locator(id).bounding_box() for id in ("#card", "#frame"))
    x, y, z, _ = np.linalg.inv(np.reshape(camera["m"], (4, 4)).T) @ corners.T
    half = camera["height"] / 2 if "height" in camera else np.tan(camera["fovy"] / 2) * -z
    across, down = (frame["height"] / 2 * side / half for side in (x, -y))
    free = frame["width"] / 2 - (frame["x"] + frame["width"] - card["x"])
    assert np.abs(across).max() <= free and np.abs(down).max() <= frame["height"] / 2
    assert max(np.abs(across).max() / free, np.abs(down).max() / (frame["height"] / 2)) > 0.9
    viewer.page.click("#toggle-panel")


def test_the_material_of_an_object_is_found_in_the_panel(viewer: Viewer) -> None:
    viewer.page.evaluate("() => { for (const fold of document.querySelectorAll('aside details')) fold.open = false; }")
    viewer.page.click("#toggle-panel")
    pick_stairs(viewer)
    viewer.page.focus('#card button:text-is("Material")')
    viewer.page.keyboard.press("Enter")
    entry = viewer.page.locator("#materials [data-name=red]")
    assert "found" in entry.get_attribute("class")
    assert entry.locator("summary").evaluate("(summary) => document.activeElement === summary")
    panel, field = viewer.page.locator("#panel").bounding_box(), entry.locator("summary").bounding_box()
    assert panel["y"] <= field["y"] and field["y"] + field["height"] <= panel["y"] + panel["height"]
    viewer.page.wait_for_function("() => !document.querySelector('.found')")


def test_of_a_ray_into_the_open_the_card_says_little(viewer: Viewer) -> None:
    x, _ = viewer.centre()
    viewer.pick(x, 140)
    assert viewer.page.locator("#card button").count() == 1  # which closes it
    assert viewer.page.locator("#card").bounding_box()["height"] < 130


def test_what_is_alone_in_its_scene_is_neither_hidden_nor_isolated(viewer: Viewer) -> None:
    texts: Any = viewer.page.evaluate(
        """async () => {
            const { ObjectCard } = await import("./static/objectcard.js");
            const objects = viewer.scene.objects.slice(0, 1);
            const card = new ObjectCard({ ...viewer, picking: {}, scene: { objects } });
            return card.part({ object: objects[0].name, material: "red" }).buttons.map((one) => one.textContent);
        }"""
    )
    assert texts == ["Material", "Frame"]


FITTED = """({ objects, bounds }) => viewer.objects.constructor.prototype.fitted.call({ objects }, bounds)"""


def test_fit_leaves_out_a_floor_that_is_much_larger_than_what_stands_on_it(viewer: Viewer) -> None:
    """Of a mesh without a scene it made a dot. What a section or a switch hides does not count."""
    thing, other = ({"name": f"objects.{k}", "shown": not k, "bounds": [[k, 0, 0], [k + 1, 1, 1]]} for k in (0, 4))
    for size, expected in ((9, [[0, 0, 0], [0.5, 1, 1]]), (1, [[-1, 0, -1], [0.5, 1, 1]])):
        floor = {"name": "floor", "shown": True, "bounds": [[-size, 0, -size], [size, 0, size]]}
        given = {"objects": [thing, other, floor], "bounds": [[-size, 0, -size], [0.5, 1, max(size, 1)]]}
        assert viewer.page.evaluate(FITTED, given) == expected
    assert viewer.page.evaluate(FITTED, {"objects": [floor], "bounds": given["bounds"]}) == given["bounds"]


def test_from_below_it_is_said_that_the_floor_hides_the_scene(viewer: Viewer) -> None:
    viewer.page.evaluate("() => viewer.look(viewer.camera.sides.bottom)")
    viewer.page.locator("#notices p", has_text="The floor hides").wait_for()
