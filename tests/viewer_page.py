"""The viewer in a browser, as its tests use it: the server's command, Chromium, and what a person does there."""

import base64
import json
import os
import re
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, Self
from urllib.parse import urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# What Playwright turns off, whose list this one replaces, and two popups of an address bar that nobody sees: without
# them the tests of a page take a sixth less time.
UNUSED = [
    "WebUIOmniboxPopup", "WebUIOmniboxAimPopup", "AvoidUnnecessaryBeforeUnloadCheckSync",
    "DestroyProfileOnBrowserClose", "HttpsUpgrades", "LensOverlay", "MediaRouter", "PaintHolding",
    "ThirdPartyStoragePartitioning", "OptimizationHints", "NetworkTimeServiceQuerying",
]  # fmt: skip
# Software GL, so that the tests need no graphics card; the last but one keeps Chromium from calling home.
FLAGS = [
    "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking",
    f"--disable-features={','.join(UNUSED)}",
]  # fmt: skip
MODELS = Path(__file__).parent.parent / "scenes" / "models"
# Milliseconds. A first picture of another kind may compile its kernels, on a machine with much other work.
PATIENCE = 240_000


@contextmanager
def chromium() -> Iterator[Any]:
    """Chromium, without a window; the test is skipped where it cannot start."""
    playwright = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("no Chromium: apt-get install chromium")
    with playwright.sync_playwright() as engine:
        started = engine.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield started
        started.close()


SCENE = f"""
ambient = 0.1
background = [0.45, 0.62, 0.82]
[render]
resolution = [320, 240]
max_depth = 3
[camera]
eye = [0.5, 2.6, 5.5]
target = [0.0, 0.5, 0.0]
fov = 38
[materials.red]
diffuse = [0.7, 0.1, 0.1]
specular = 0.4
shininess = 40
[materials.glass]
type = "dielectric"
[materials.stone]
diffuse = 0.6
reflectance = 0.2
[[lights]]
type = "directional"
direction = [-0.6, -1.4, -0.8]
irradiance = 0.8
[[objects]]
mesh = "{MODELS / "stairs.ply"}"
material = "red"
scale = 0.5
translate = [-0.8, 0.0, -0.3]
[[objects]]
mesh = "{MODELS / "block.ply"}"
material = "glass"
rotate = [0, 30, 0]
translate = [0.8, 0.01, 0.6]
[floor]
min = [-2.0, -2.0]
max = [2.0, 2.0]
squares = [4, 4]
materials = ["stone"]
"""


@contextmanager
def served(scene: Path, port: int = 0) -> Iterator[str]:
    """Where `octree-render view` serves ``scene``, as long as the context lasts."""
    command = [sys.executable, "-m", "renderer.cli.main", "view", str(scene), "--port", str(port), "--no-browser"]
    root = str(Path(__file__).parent.parent)
    environment = {**os.environ, "PYTHONPATH": root, "PYTHONUNBUFFERED": "1"}
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment)
    assert server.stdout is not None
    try:
        yield _printed_url(server)
    finally:
        server.terminate()
        server.wait(10)
        server.stdout.close()


def _printed_url(server: "subprocess.Popen[bytes]") -> str:
    printed, end = "", time.monotonic() + PATIENCE / 1e3
    while time.monotonic() < end and server.poll() is None:
        if select.select([server.stdout], [], [], 0.2)[0]:
            printed += os.read(server.stdout.fileno(), 65536).decode()  # type: ignore[union-attr]
            if found := re.search(r"http://\S+", printed):
                return found[0]
    raise AssertionError(f"the server printed no address: {printed}")


# Before the page's own scripts: pictures at rest stay as they are, so that a test sees the one it waited for.
STAYS = """document.addEventListener("readystatechange", () => {
    const refine = document.querySelector("[name=refine]");
    if (refine) for (const option of refine.options) option.defaultSelected = option.selected = option.value === "1";
}, { once: true });"""


# The panel and all of its parts are open, as a user leaves them who changes settings.
OPEN = """try {
    const parts = ["scene", "camera", "traced", "octree", "light", "around", "materials", "objects", "readings"];
    const open = Object.fromEntries(parts.map((part) => [`fold-${part}`, true]));
    localStorage.setItem("octree-render-folds", JSON.stringify({ panel: true, ...open }));
} catch {}"""


class Viewer:
    """One page in the browser, and what it says about itself. With ``refine`` its pictures grow at rest; ``folded`` as
    at first sight.
    """

    faults: ClassVar[list[str]] = []  # of all pages

    def __init__(self, browser: Any, url: str, refine: bool = False, folded: bool = False, **options: Any) -> None:
        self.context = browser.new_context(**{"viewport": {"width": 800, "height": 420}, **options})
        if not refine:
            self.context.add_init_script(STAYS)
        if not folded:
            self.context.add_init_script(OPEN)
        self.page = self.context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self.page.on("console", lambda m: self.faults.append(m.text) if m.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("request", self._check_request)
        self.url = url

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.context.close()

    def _check_request(self, request: Any) -> None:
        address = urlsplit(request.url)
        if address.scheme not in ("blob", "data") and address.hostname != "127.0.0.1":
            self.faults.append(f"a request to {request.url}")

    def open(self) -> Self:
        self.page.goto(self.url)
        self.page.wait_for_selector("body[data-ready]")
        self.settled("octree")
        return self

    def shows(self, name: str) -> None:
        """Wait until the page shows the scene of that name."""
        self.page.wait_for_function("(name) => window.viewer.scene?.name === name", arg=name)

    def wait_until(self, seen: Callable[[], bool]) -> None:
        """Until it is seen; fails where that takes longer than PATIENCE."""
        end = time.monotonic() + PATIENCE / 1e3
        while not seen():
            assert time.monotonic() < end
            self.page.wait_for_timeout(50)

    def restart(self) -> None:
        """Everything as it was when the page opened."""
        if self.page.evaluate("() => viewer.objects.hidden.length && (viewer.scenes.hide([]), 1)"):
            self.page.wait_for_function("() => !viewer.objects.hidden.length")
        self.page.evaluate(
            """() => {
                const { viewer } = window;
                document.querySelector("#settings").reset();
                viewer.panel.load(viewer.scene);
                for (const fold of document.querySelectorAll("details.fold")) fold.open = true;
                viewer.changed("boxes");
                viewer.changed("walk");
                viewer.rays.close();
                viewer.measure.end();
                viewer.changed("edits");
                viewer.camera.reset();
                viewer.layout();
                viewer.setMode("octree");
                viewer.past.write();
            }"""
        )
        self.settled("octree")

    def settled(self, mode: str) -> dict[str, Any]:
        """Wait for the last picture of the newest view in ``mode``; returns the stage's data attributes."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        shown = """(mode) => {
            const { dataset } = document.querySelector("#stage");
            const { seq, dirty } = window.viewer.traced;
            return dataset.mode === mode && dataset.last === "1" && Number(dataset.seq) === seq && !dirty;
        }"""
        self.page.wait_for_function(shown, arg=mode)
        return self.page.evaluate("() => ({ ...document.querySelector('#stage').dataset })")

    def choose(self, mode: str) -> None:
        self.page.locator("#stage").press({"gl": "1", "phong": "2", "brute": "3", "octree": "4", "proof": "5"}[mode])
        self.settled(mode)

    @property
    def camera(self) -> dict[str, Any]:
        return json.loads(self.page.locator("#stage").get_attribute("data-camera"))

    def pixels(self, canvas: str) -> NDArray[np.uint8]:
        """The canvas of that id, (h, w, 4) uint8."""
        size, values = self.page.evaluate(
            """(id) => {
                const source = document.getElementById(id), copy = document.createElement("canvas");
                [copy.width, copy.height] = [source.width, source.height];
                const context = copy.getContext("2d");
                context.drawImage(source, 0, 0);
                const { data } = context.getImageData(0, 0, copy.width, copy.height);
                let text = "";
                for (let i = 0; i < data.length; i += 8192) text += String.fromCharCode(...data.subarray(i, i + 8192));
                return [[copy.height, copy.width], btoa(text)];
            }""",
            canvas,
        )
        return np.frombuffer(base64.b64decode(values), np.uint8).reshape(*size, 4)

    def centre(self) -> tuple[float, float]:
        box = self.page.locator("#frame").bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def pick(self, x: float, y: float) -> None:
        """Click on the picture, and wait for the card."""
        self.page.mouse.click(x, y)
        self.page.wait_for_function("() => viewer.rays.pick?.seq === viewer.rays.seq")

    def drag(self, x: float, y: float, button: str = "left") -> None:
        start = self.centre()
        self.page.mouse.move(*start)
        self.page.mouse.down(button=button)
        self.page.mouse.move(start[0] + x, start[1] + y, steps=4)
        self.page.mouse.up(button=button)

    def pinch(self) -> None:
        """Two fingers that part."""
        connection = self.context.new_cdp_session(self.page)
        x, y = self.centre()

        def touch(kind: str, *apart: float) -> None:
            points = [{"x": x + side * d, "y": y, "id": side} for d in apart for side in (0, 1)]
            connection.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        touch("touchStart", 40)
        for apart in (60, 80, 100):
            touch("touchMove", apart)
        touch("touchEnd")
