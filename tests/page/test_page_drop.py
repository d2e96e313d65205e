"""A user's own files on the viewer's page: dropped, chosen, and what is said where they cannot be shown."""

import base64
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from viewer_page import MODELS, SCENE, Viewer

MESHES = [MODELS / "stairs.ply", MODELS / "block.ply"]
UPLOAD = re.compile(r"/drop\?")
# What a browser does where files are dragged over its page, and let go.
DRAG = """([kind, files]) => {
    const transfer = new DataTransfer();
    for (const [name, text] of files) {
        transfer.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    }
    const event = new DragEvent(kind, { dataTransfer: transfer, bubbles: true, cancelable: true });
    document.querySelector("#stage").dispatchEvent(event);
    return event.defaultPrevented;
}"""


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A user's scene, which looks for its meshes in a folder beside it."""
    (tmp_path / "mine.toml").write_text(SCENE.replace(f"{MODELS}/", "models/"))
    return tmp_path / "mine.toml"


@pytest.fixture
def page(browser: Any, url: str) -> Iterator[Viewer]:
    with Viewer(browser, url).open() as page:
        yield page


def drag(page: Viewer, kind: str, files: list[Path]) -> bool:
    """Whether the page takes what is dragged."""
    given = [[path.name, base64.b64encode(path.read_bytes()).decode()] for path in files]
    return page.page.evaluate(DRAG, [kind, given])


def offered(page: Viewer) -> list[str]:
    return page.page.evaluate("() => [...document.querySelectorAll('[name=file] option')].map(({ value }) => value)")


def test_files_that_are_dropped_are_shown_and_those_that_are_not_needed_named(page: Viewer, mine: Path) -> None:
    before, target = page.pixels("picture"), page.page.locator("#drop")
    image = mine.with_name("photo.jpg")
    image.write_bytes(b"a picture")
    for kind, seen in (("dragover", True), ("dragleave", False), ("dragover", True)):
        assert (drag(page, kind, [mine]), target.is_visible()) == (kind == "dragover", seen)
    assert drag(page, "drop", [image, *MESHES, mine]) and target.is_hidden()
    page.shows("mine.toml")
    page.settled("octree")
    assert page.page.input_value("[name=file]") == "mine.toml" and page.page.inner_text("#name") == "Mine"
    assert page.page.inner_text("#notices") == "Left out, as no mesh is in them: photo.jpg"
    assert np.array_equal(page.pixels("picture"), before)  # of the same scene by another name
    assert page.page.is_hidden("#busy")


def chosen_by_keys(page: Viewer) -> Any:
    """The browser's dialog for files. A browser on a busy machine may drop one before it opens; then the keys again."""
    timed_out = pytest.importorskip("playwright.sync_api").TimeoutError
    for patience in (10_000, 20_000, None):
        page.page.focus("[name=file]")
        try:
            with page.page.expect_file_chooser(timeout=patience) as chooser:
                page.page.keyboard.press("Tab")
                page.page.keyboard.press("Enter")
            return chooser.value
        except timed_out:
            if patience is None:
                raise
    raise AssertionError


def test_a_file_is_chosen_by_keys_and_stays_when_the_page_is_loaded_again(page: Viewer) -> None:
    """And Back leads to the scene before, with what was changed there."""
    page.page.select_option("[name=aov]", "normal")
    page.settled("octree")
    page.page.wait_for_timeout(500)  # a view that has rested is a step
    before, view = page.pixels("picture"), page.page.evaluate("() => location.hash")
    held: list[Any] = []
    page.page.route(UPLOAD, lambda route: held.append(route))
    chooser = chosen_by_keys(page)
    assert chooser.is_multiple()
    chooser.set_files(MODELS / "torus_knot.ply")
    page.wait_until(lambda: bool(held))
    assert "torus_knot.ply" in page.page.inner_text("#busy")
    held[0].continue_()
    page.shows("torus_knot.ply")
    page.settled("octree")
    shown = page.pixels("picture")
    page.page.reload()
    page.page.wait_for_selector("body[data-ready]")
    page.settled("octree")
    assert page.page.inner_text("#name") == "torus_knot.ply" and "torus_knot.ply" in offered(page)
    assert np.array_equal(page.pixels("picture"), shown)
    page.page.click("#undo")
    page.page.wait_for_function("(view) => location.hash === view && viewer.scene.name === 'blocks.toml'", arg=view)
    page.settled("octree")
    assert np.array_equal(page.pixels("picture"), before)
    page.page.click("#redo")
    page.shows("torus_knot.ply")


def nothing(page: Viewer) -> None:
    """As the page is."""


def smaller(page: Viewer) -> None:
    page.page.evaluate("() => { viewer.scene.drop.most = 1 << 20; }")


def cut_off(page: Viewer) -> None:
    page.page.route(UPLOAD, lambda route: route.abort())


BAD: list[tuple[dict[str, bytes], Callable[[Viewer], None], str]] = [
    ({"bad.ply": b"ply\nformat ascii 1.0\n"}, nothing, "bad.ply: "),
    ({"a.toml": b"[camera"}, nothing, "a.toml: expected TOML, got a syntax error"),
    ({"a.txt": b"", "b.jpg": b""}, nothing, "a.txt, b.jpg: expected a scene or a mesh (.ply.gz "),
    ({"a.stl": bytes(1 << 20), "b.stl": b"x"}, smaller, "a.stl, b.stl: expected at most 1 MiB, got 2 MiB"),
    ({"a.stl": b"x"}, cut_off, "a.stl: cannot be read or sent"),
]


@pytest.mark.parametrize(("files", "prepare", "says"), BAD)
def test_what_cannot_be_shown_is_said_and_all_stays(
    page: Viewer, tmp_path: Path, files: dict[str, bytes], prepare: Callable[[Viewer], None], says: str
) -> None:
    before, scene, names = page.pixels("picture"), page.page.evaluate("() => viewer.scene.id"), offered(page)
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    prepare(page)
    page.page.set_input_files("#files", [tmp_path / name for name in files])
    page.page.locator("#notices p").wait_for()
    assert page.page.inner_text("#notices").startswith(says) and str(tmp_path) not in page.page.inner_text("#notices")
    assert page.page.is_hidden("#busy")
    page.settled("octree")
    assert (page.page.evaluate("() => viewer.scene.id"), offered(page)) == (scene, names)
    assert np.array_equal(page.pixels("picture"), before)
    # The browser itself tells of the server's no.
    Viewer.faults[:] = [fault for fault in Viewer.faults if "400" not in fault and "ERR_FAILED" not in fault]
