"""The axes in the picture's corner, and the views from the scene's sides."""

import numpy as np
import pytest
from viewer_page import Viewer


def columns(viewer: Viewer) -> np.ndarray:
    """Right, up and back."""
    return np.reshape(viewer.camera["m"], (4, 4))[:3, :3]


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("sign", [1, -1])
def test_an_end_of_an_axis_sees_the_scene_from_there(viewer: Viewer, axis: str, sign: int) -> None:
    """With sides along the axes, also from above, and about the same point from as far."""
    kept = "() => [...viewer.camera.pivot, viewer.camera.distance]"
    before = viewer.page.evaluate(kept)
    viewer.page.click(f"#axes .{axis}{'.far' if sign < 0 else ':not(.far)'} circle", force=True)
    viewer.settled("octree")
    found = columns(viewer)
    np.testing.assert_allclose(found[2], sign * np.eye(3)["xyz".index(axis)], atol=1e-12)
    np.testing.assert_allclose(np.abs(found).max(axis=1), 1.0, atol=1e-12)
    assert viewer.page.evaluate(kept) == before


def test_the_axes_point_as_the_camera_sees_them(viewer: Viewer) -> None:
    viewer.page.evaluate("() => { viewer.camera.orbit(0.7, 0.3); viewer.moved(); }")
    viewer.settled("octree")
    right, up, back = columns(viewer)
    middle = "() => { const { x, y, width, height } = document.querySelector('#axes').getBoundingClientRect(); "
    x, y = viewer.page.evaluate(middle + "return [x + width / 2, y + height / 2]; }")
    for k, axis in enumerate("xyz"):
        knob = viewer.page.locator(f"#axes .{axis}:not(.far) circle").bounding_box()
        seen = np.array([knob["x"] + knob["width"] / 2 - x, y - knob["y"] - knob["height"] / 2])
        wanted = np.array([right[k], up[k]])
        np.testing.assert_allclose(seen / 33.12, wanted, atol=0.02)  # an arm is 36 hundredths of 92 pixels long
    drawn = viewer.page.evaluate("() => [...document.querySelectorAll('#axes g')].map((g) => g.getAttribute('class'))")
    nearness = [back["xyz".index(name[0])] * (-1 if "far" in name else 1) for name in drawn]
    assert nearness == sorted(nearness)


@pytest.mark.parametrize(("up", "front"), [([0, 1, 0], [0, 0, 1]), ([0, 0, 1], [0, -1, 0]), ([1, 0, 0], [0, 1, 0])])
def test_the_sides_follow_the_axis_that_points_up(viewer: Viewer, up: list[int], front: list[int]) -> None:
    """As drawings have them: what is to the right from the front is on the right side, and the top is above."""
    sides = viewer.page.evaluate(
        """(up) => {
            const { scene, camera } = viewer;
            return new camera.constructor({ ...scene, camera: { ...scene.camera, up } }).sides;
        }""",
        up,
    )
    assert sides["top"] == up and np.abs(np.subtract(sides["front"], front)).max() < 1e-12
    np.testing.assert_allclose(sides["right"], np.cross(up, front), atol=1e-12)
    for side, other in (("front", "back"), ("left", "right"), ("top", "bottom")):
        assert np.add(sides[side], sides[other]).tolist() == [0, 0, 0]


def test_the_buttons_of_the_sides_work_and_are_undone(viewer: Viewer) -> None:
    before = viewer.camera["m"]
    viewer.page.evaluate("() => viewer.past.write()")
    viewer.page.click("#sides >> text=Top")
    viewer.settled("octree")
    np.testing.assert_allclose(columns(viewer)[2], [0, 1, 0], atol=1e-12)
    viewer.page.evaluate("() => viewer.past.write()")
    viewer.page.click("#undo")
    viewer.wait_until(lambda: viewer.camera["m"] == before)
