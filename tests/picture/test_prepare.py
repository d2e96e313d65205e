"""A prepared scene: its pictures are those of the scene itself, and its tree is built once."""

import numpy as np
import pytest

import renderer
from renderer import OrthographicCamera, PerspectiveCamera, load_scene, prepare, render
from renderer.picture.prepare import Octree

SCENES = ("glass", "stairs", "mirrors")
CAMERAS = (
    None,
    PerspectiveCamera(eye=(2, 3, 4), target=(0, 0.5, 0), fov=60.0),
    PerspectiveCamera(eye=(0.0, 0.4, 0.0), target=(1, 0.5, 0.2)),  # within the objects, perhaps in glass
    OrthographicCamera(eye=(1, 4, 2), target=(0, 0, 0), height=5.0),
)


def same(a, b):
    names = ("radiance", "depth", "normal", "face", "rays")
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in names)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("accelerator", ["octree", "brute"])
def test_pictures_have_the_bits_of_the_scenes_own(name, accelerator):
    scene = load_scene(f"scenes/{name}.toml")
    ready = prepare(scene, accelerator=accelerator)
    for camera in CAMERAS:
        for settings in ({"max_depth": 0}, {"max_depth": 5, "samples": 4}, {"shadows": False, "min_weight": 0.3}):
            options = {"resolution": (12, 9), **settings}
            own = scene if camera is None else scene.model_copy(update={"camera": camera})
            expected = render(own, accelerator=accelerator, **options)
            assert same(render(ready, camera=camera, **options), expected)
            assert same(render(scene, camera=camera, accelerator=accelerator, **options), expected)


def test_a_scene_that_asks_for_no_bounce_is_ready_for_some():
    scene = load_scene("scenes/glass.toml")
    still = scene.altered(render=scene.render.model_copy(update={"max_depth": 0}))
    options = {"resolution": (16, 12), "max_depth": 6}
    assert same(render(prepare(still), **options), render(scene, **options))


def test_the_tree_is_built_once(monkeypatch):
    built = []
    monkeypatch.setattr(Octree, "_build", lambda *a, sound=Octree._build: (built.append(1), sound(*a)))
    ready = prepare(load_scene("scenes/stairs.toml"), accelerator="octree")
    for x in range(3):
        render(ready, camera=PerspectiveCamera(eye=(x, 3, 4), target=(0, 0, 0)), resolution=(4, 4))
    assert built == [1]


def test_the_pictures_codes_are_those_of_the_file(tmp_path):
    from PIL import Image

    picture = render(load_scene("scenes/stairs.toml"), resolution=(20, 10))
    picture.save(tmp_path / "a.png")
    assert picture.srgb.dtype == np.uint8 and picture.srgb.shape == (10, 20, 3)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.png")), picture.srgb)
    np.testing.assert_array_equal(renderer.srgb(picture.radiance), picture.srgb)
