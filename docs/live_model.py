"""Make the start page's live model anew: ``python docs/live_model.py``; needs Playwright and Chromium.

It is the one file that the viewer's page saves of a mesh, compressed.
"""

import gzip
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from viewer_page import CHROMIUM, FLAGS, Viewer, served  # noqa: E402

MESH = ROOT / "scenes" / "models" / "teapot.ply"
MODEL = ROOT / "docs" / "samples" / "model.html.gz"


def saved() -> bytes:
    """The page that the viewer saves of the mesh."""
    with served(MESH) as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        with Viewer(browser, url, refine=True, viewport={"width": 1100, "height": 700}) as viewer:
            viewer.open()
            viewer.page.wait_for_function("() => window.viewer.traced.shown?.samples >= 16")
            viewer.page.evaluate("() => (document.querySelector('#share').open = true)")
            with viewer.page.expect_download() as download:
                viewer.page.click("#share-file")
            return Path(download.value.path()).read_bytes()


if __name__ == "__main__":
    MODEL.write_bytes(gzip.compress(saved(), mtime=0))
