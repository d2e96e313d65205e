"""Milliseconds from a movement on the viewer's page to the pictures that answer it, in headless Chromium.

    python -m validation.benchmark.measures.viewing_page [SCENE] [--moves N]
    python -m validation.benchmark.measures.viewing_page --sphere 8 --moves 0

The clock starts at the movement's own time stamp and stops when the page has drawn. The page is 1280 x 800 large; its
graphics are software. ``--sphere`` takes a sphere of 20 x 4^N faces in place of a scene. Needs playwright (in the extra
dev) and Chromium (on Debian: apt-get install chromium).
"""

import argparse
import math
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from renderer.mesh.ply import format_ply
from renderer.mesh.shapes import icosphere
from validation.scenes import SCENES

_FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking"]
_WIDTH, _HEIGHT = 1280, 800
# Milliseconds between the movements of a drag: an unhurried hand, so that full pictures come on the way.
_PAUSE = 120
# Movements that are not timed: kernels load, the browser compiles the page's functions.
_UNSEEN = 5
# Milliseconds until a wait for a picture is given up: a first one may compile its kernels.
_PATIENCE = 240_000
# Notes the time stamps of movements, and when pictures have been drawn: of which view, and whether the last of it.
_RECORD = """() => {
    window.recorded = [];
    const stage = document.querySelector("#stage");
    stage.addEventListener("pointermove", ({ timeStamp }) => recorded.push({ kind: "move", at: timeStamp }), true);
    const note = viewer.note.bind(viewer);
    viewer.note = (picture, view) => {
        note(picture, view);
        const { seq, last, w } = picture;
        recorded.push({ kind: "picture", at: performance.now(), sent: viewer.sent.get(seq)?.at ?? 0, seq, last, w });
    };
}"""
_SETTLED = """() => {
    const { dataset } = document.querySelector("#stage");
    return dataset.last === "1" && Number(dataset.seq) === viewer.seq && !viewer.dirty;
}"""


def main() -> None:
    """Measure and print the results."""
    parser = argparse.ArgumentParser(description="Time the viewer's page.")
    parser.add_argument("scene", nargs="?", type=Path, default=SCENES / "three_models.toml")
    parser.add_argument("--moves", type=int, default=40)
    parser.add_argument("--sphere", type=int, metavar="N", help="show a sphere of 20 x 4^N faces")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scene = options.scene
        if options.sphere is not None:
            scene = Path(folder) / "sphere.ply"
            scene.write_bytes(format_ply(icosphere(options.sphere)))
        for label, values in measure(scene, options.moves).items():
            print(f"{label}: {_described(values)}")


def _described(values: Sequence[float]) -> str:
    if len(values) == 1:
        return f"{values[0]:.0f} ms"
    ordered = sorted(values)
    most = ordered[math.ceil(0.9 * len(ordered)) - 1]
    return f"median {statistics.median(values):.0f} ms, nine of ten within {most:.0f}, all within {ordered[-1]:.0f}"


def measure(scene: Path, moves: int) -> dict[str, list[float]]:
    """Milliseconds, by what they are: from the command to the first picture and the first that is whole; from
    movements out of rest, and from those of a drag, to the first picture that was asked for after them.
    """
    from playwright.sync_api import sync_playwright

    with sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=_chromium(), args=_FLAGS)
        page = browser.new_page(viewport={"width": _WIDTH, "height": _HEIGHT})
        page.set_default_timeout(_PATIENCE)
        began = time.perf_counter()
        with _served(scene) as url:
            page.goto(url)
            found = {"command to first picture": [_since(began, page, "#stage[data-seq]")],
                     "command to whole picture": [_since(began, page, "#stage[data-last='1']")]}  # fmt: skip
            if moves:
                page.evaluate("() => (viewer.panel.fields.refine.value = '1')")
                page.evaluate(_RECORD)
                found |= _from_rest(page, moves) | {"drag, to a picture": _dragged(page, moves)}
        browser.close()
    return found


def _since(began: float, page: Any, selector: str) -> float:
    page.wait_for_selector(selector)
    return 1e3 * (time.perf_counter() - began)


def _from_rest(page: Any, moves: int) -> dict[str, list[float]]:
    x, y = _pressed(page)
    first, whole = [], []
    for number in range(_UNSEEN + moves):
        page.evaluate("() => (recorded.length = 0)")
        page.mouse.move(x + 8 * (1 + number % 2), y + 5 * (1 + number % 3))
        page.wait_for_timeout(_PAUSE)
        page.wait_for_function(_SETTLED)
        events = page.evaluate("() => recorded")
        if number >= _UNSEEN and (answers := _answers(events)):
            first.append(answers[0])
            whole.append(next(e["at"] for e in events if e.get("last")) - events[0]["at"])
    page.mouse.up()
    return {"rest, to the first picture": first, "rest, to the whole picture": whole}


def _dragged(page: Any, moves: int) -> list[float]:
    x, y = _pressed(page)
    page.evaluate("() => (recorded.length = 0)")
    for number in range(_UNSEEN + moves):
        page.mouse.move(x + 4 * number, y + 3 * (number % 9))
        page.wait_for_timeout(_PAUSE)
    page.mouse.up()
    page.wait_for_function(_SETTLED)
    return _answers(page.evaluate("() => recorded"))[_UNSEEN:]


def _pressed(page: Any) -> tuple[float, float]:
    """Press the button in the middle of the picture, once it is whole."""
    page.wait_for_function(_SETTLED)
    box = page.locator("#frame").bounding_box()
    x, y = box["x"] + box["width"] / 3, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    return x, y


def _answers(events: list[dict[str, Any]]) -> list[float]:
    """Milliseconds from each movement to the first picture that was asked for at or after it."""
    pictures = [event for event in events if event["kind"] == "picture"]
    moves = [event["at"] for event in events if event["kind"] == "move"]
    found = ((move, next((p["at"] for p in pictures if p["sent"] >= move), None)) for move in moves)
    return [at - move for move, at in found if at is not None]


def _chromium() -> str:
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if found is None:
        raise SystemExit("viewing_page: no Chromium; on Debian: apt-get install chromium")
    return found


@contextmanager
def _served(scene: Path) -> Iterator[str]:
    """The address at which the command serves ``scene``."""
    command = [sys.executable, "-m", "renderer.cli.main", "view", str(scene), "--port", "0", "--no-browser"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"})
    assert server.stdout is not None
    try:
        yield next(match[0] for line in server.stdout if (match := re.search(r"http://\S+", line)))
    finally:
        server.terminate()
        server.wait(10)
        server.stdout.close()


if __name__ == "__main__":
    main()
