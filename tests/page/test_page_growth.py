"""Pictures that grow at rest, on the page."""

from pathlib import Path
from typing import Any

import numpy as np
from viewer_client import seen_by
from viewer_page import Viewer

from renderer import load_scene


def test_the_page_grows_its_picture_and_says_so(browser: Any, url: str, scenes: Path) -> None:
    with Viewer(browser, url, refine=True).open() as page:
        page.page.wait_for_function(
            "() => document.querySelector('#hud').textContent.startsWith('16 samples a pixel, within')"
        )
        expected = seen_by(page.camera, load_scene(scenes / "blocks.toml"), samples=16)
        assert np.array_equal(page.pixels("picture")[..., :3], expected.srgb)


def test_what_is_copied_and_saved_has_the_samples_of_the_picture_that_is_seen(viewer: Viewer) -> None:
    """It had the one that the picture began with."""
    viewer.page.evaluate("() => { viewer.panel.fields.refine.value = '4'; viewer.changed('refine'); }")
    viewer.page.wait_for_function("() => document.querySelector('#hud').textContent.startsWith('4 samples')")
    asked = viewer.page.evaluate(
        """() => {
            const { connection } = viewer, samples = [];
            connection.send = ({ settings }) => samples.push(settings.samples);
            const press = () => ["copy-command", "save-camera"].map((id) => document.getElementById(id).click());
            press();
            viewer.camera.orbit(0.1, 0);
            viewer.moved(); // after which another picture is to come
            press();
            delete connection.send;
            return samples;
        }"""
    )
    assert asked == [4, 4, 1, 1]


def test_what_is_left_of_an_error_is_read_only_of_the_picture_that_is_seen(viewer: Viewer) -> None:
    """It stayed in other modes and for other scenes."""
    read = viewer.page.evaluate(
        """() => {
            const { readings, scene } = viewer, picture = { kind: 1, step: 1, last: true, w: 8, h: 8, ms: 5, rate: 1 };
            const later = [
                () => readings.ofPicture({ ...picture, seq: 7 }, 6, 1, { w: 8, h: 8 }),
                () => readings.ofPicture({ ...picture, seq: 8 }, 6, 1, { w: 8, h: 8 }),
                () => readings.ofGl({ w: 8, h: 8 }), () => readings.ofScene(scene),
            ];
            return later.map((happens) => {
                readings.refined({ seq: 7, samples: 16, error: 0.5 });
                happens();
                return readings.values.refined.textContent;
            });
        }"""
    )
    assert read == ["16 samples a pixel, within about 0.50 of 255", "–", "–", "–"]
