"""A prepared scene: its pictures are those of the scene itself, and its tree is built once."""

import functools
import subprocess
import sys
from pathlib import Path

import pytest
from cases import cases
from hypothesis import given
from hypothesis import settings as limits
from hypothesis import strategies as st

from renderer import FisheyeCamera, OrthographicCamera, PerspectiveCamera, ThinLensCamera, load_scene, prepare, render
from renderer.picture.image import PLANES
from renderer.picture.prepare import Octree
from renderer.scene.scene import checked_settings
from renderer.trace.spawn import BOUNDED

pytestmark = pytest.mark.judges("Image.srgb", "PreparedScene", "PreparedScene.picture", "prepare", "render")


SCENES = ("glass", "stairs", "mirrors")
CAMERAS = (
    None,
    PerspectiveCamera(eye=(2, 3, 4), target=(0, 0.5, 0), fov=60.0),
    PerspectiveCamera(eye=(0.0, 0.4, 0.0), target=(1, 0.5, 0.2)),  # within the objects, perhaps in glass
    OrthographicCamera(eye=(1, 4, 2), target=(0, 0, 0), height=5.0),
)


@functools.cache
def prepared(name):
    """A scene of ours, prepared once for the tests of parts of its pictures."""
    return prepare(load_scene(f"scenes/{name}.toml"))


def same(a, b):
    names = ("radiance", "depth", "normal", "face", "rays")
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in names)


@cases("name, accelerator", [*((name, "octree") for name in SCENES), ("stairs", "brute")])
def test_pictures_have_the_bits_of_the_scenes_own(name, accelerator):
    scene = load_scene(f"scenes/{name}.toml")
    ready = prepare(scene, accelerator=accelerator)
    size = (12, 9) if accelerator == "octree" else (5, 3)  # brute force tests all faces for each ray
    for camera in CAMERAS:
        for settings in ({"max_depth": 0}, {"max_depth": 5, "samples": 4}, {"shadows": False, "min_weight": 0.3}):
            options = {"resolution": size, **settings}
            own = scene if camera is None else scene.model_copy(update={"camera": camera})
            expected = render(own, accelerator=accelerator, **options)
            assert same(render(ready, camera=camera, **options), expected)
            if camera is not None:
                assert same(render(scene, camera=camera, accelerator=accelerator, **options), expected)


def test_a_scene_that_asks_for_no_bounce_is_ready_for_some():
    scene = load_scene("scenes/glass.toml")
    still = scene.altered(render=scene.render.model_copy(update={"max_depth": 0}))
    options = {"resolution": (16, 12), "max_depth": 6}
    assert same(render(prepare(still), **options), render(scene, **options))


@pytest.mark.parametrize("name", SCENES)
@given(data=st.data())
@limits(max_examples=8)
def test_a_band_of_rows_has_the_bits_that_it_has_in_the_picture(name, data):
    height = data.draw(st.integers(1, 90))
    first = data.draw(st.integers(0, height - 1))
    end = data.draw(st.integers(first + 1, height))
    ready = prepared(name)
    chosen = checked_settings(ready.scene.render, {"resolution": (41, height), "samples": 4, "max_depth": 3})
    whole, band = (ready.picture(ready.scene.camera, chosen, BOUNDED, 2, band=rows) for rows in (None, (first, end)))
    for plane in PLANES:
        assert getattr(band, plane).tobytes() == getattr(whole, plane)[first:end].tobytes(), plane


LENSES = {
    "perspective": None,
    "fisheye": FisheyeCamera(eye=(0.5, 2.0, 5.0), target=(0.0, 0.8, 0.0), fov=150),
    "thin lens": ThinLensCamera(eye=(0.5, 2.0, 5.0), target=(0.0, 0.8, 0.0), aperture=0.3),
}


@functools.cache
def seen_through(lens, **options):
    """A whole picture, for the tests of its windows."""
    return render(prepared("three_models"), camera=LENSES[lens], **options, threads=1)


@pytest.mark.judges("render")
@cases("lens", sorted(LENSES))
@cases("window", [(0, 0, 75, 50), (33, 9, 34, 10), (1, 32, 74, 50), (40, 0, 75, 7)])
def test_a_window_has_the_bits_that_it_has_in_the_picture(lens, window):
    options = {"resolution": (75, 50), "samples": 4, "max_depth": 2}
    whole = seen_through(lens, **options)
    part = render(prepared("three_models"), camera=LENSES[lens], **options, window=window, threads=2)
    left, top, right, bottom = window
    for plane in PLANES:
        assert getattr(part, plane).tobytes() == getattr(whole, plane)[top:bottom, left:right].tobytes(), plane


@pytest.mark.judges("render")
@cases("window", [(0, 0, 76, 50), (-1, 0, 5, 5), (5, 0, 5, 5), (0, 9, 5, 3), (0, 0, 5), (0.0, 0.0, 5.0, 5.0), "all"])
def test_a_window_that_is_none_is_refused(window):
    ready = prepare(load_scene("scenes/stairs.toml"))
    with pytest.raises(ValueError, match=r"window: expected (left < right.* within 75 x 50 pixels, got|real numbers)"):
        render(ready, resolution=(75, 50), window=window)


def test_a_band_takes_little_more_memory_than_its_own_rows():
    """The last rows of a tall picture, in a process of its own: a film of them all would take 335 MB."""
    script = """
from renderer import load_scene, prepare
from renderer.scene.scene import checked_settings
from renderer.trace.spawn import BOUNDED
def resident():
    return int(open("/proc/self/statm").read().split()[1]) * 4096
ready = prepare(load_scene("scenes/stairs.toml"))
def band(height):
    chosen = checked_settings(ready.scene.render, {"resolution": (512, height)})
    return ready.picture(ready.scene.camera, chosen, BOUNDED, 1, band=(height - 8, height))
small = band(16)
before = resident()
tall = band(16384)
assert tall.depth.shape == (8, 512)
print(resident() - before)
"""
    if not Path("/proc/self/statm").exists():
        pytest.skip("no /proc to read the memory from")
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert int(told.stdout) < 335e6 / 10


def test_a_prepared_scene_prints_on_one_line():
    assert repr(prepared("stairs")) == "<PreparedScene of 46 faces>"


def test_the_tree_is_built_once(monkeypatch):
    built = []
    monkeypatch.setattr(Octree, "_build", lambda *a, sound=Octree._build: (built.append(1), sound(*a)))
    ready = prepare(load_scene("scenes/stairs.toml"), accelerator="octree")
    for x in range(3):
        render(ready, camera=PerspectiveCamera(eye=(x, 3, 4), target=(0, 0, 0)), resolution=(4, 4))
    assert built == [1]
