"""Reconstruction filters: their shapes, and pictures whose integrals are known."""

from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import (
    EquirectangularCamera,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    PointLight,
    Scene,
    SceneObject,
    ThinLensCamera,
    prepare,
    render,
    shapes,
)
from renderer.scene.filters import film_samples
from validation.promises.pictures.reconstruction import FILTERS, published

pytestmark = pytest.mark.judges("scene.render.filter", "octree-render render --filter")


@cases("name", FILTERS)
@cases("samples", [1, 4, 9, 16, 25, 256, 1024])
def test_places_and_weights_are_even_and_keep_a_constant(name: str, samples: int) -> None:
    places, weights = film_samples(name, samples)
    assert np.abs(places[::-1] + places - 1.0).max() < 1e-15 and np.array_equal(weights[::-1], weights)
    assert abs(weights.mean() - 1.0) < 1e-14
    assert (weights.min() < 0.0) == (name == "mitchell" and samples >= 16)
    assert samples % 2 == 0 or places[samples // 2].tolist() == [0.5, 0.5]


@cases("name", FILTERS)
def test_shapes_are_mitsubas(name: str, mitsuba: Any) -> None:
    theirs = mitsuba.load_dict({"type": name})
    x = np.linspace(-2.5, 2.5, 1001) + 1e-4
    values = [float(theirs.eval(float(place))) if abs(place) < theirs.radius() else 0.0 for place in x]
    assert np.abs(values - published(name, x)).max() < 5e-4  # their exponential is approximate


@cases("name", FILTERS)
def test_pictures_are_mitsubas(name: str, mitsuba: Any) -> None:
    """A bright square, by 4,096 random samples of their own film and sensor."""
    film = {"type": "hdrfilm", "width": 6, "height": 6, "rfilter": {"type": name}, "sample_border": True}
    to_world = mitsuba.ScalarTransform4f
    theirs = mitsuba.load_dict({
        "type": "scene", "integrator": {"type": "direct"},
        "sensor": {"type": "orthographic", "film": film, "sampler": {"type": "independent", "sample_count": 4096},
                   "to_world": to_world().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]) @ to_world().scale([3, 3, 1])},
        "square": {"type": "rectangle", "to_world": to_world().scale([1, 2, 1]),
                   "emitter": {"type": "area", "radiance": 1.0}},
    })  # fmt: skip
    expected = np.array(mitsuba.render(theirs))[..., 0]
    camera = OrthographicCamera(eye=(0, 0, 5), target=(0, 0, 0), height=6.0)
    wall = SceneObject(mesh=shapes.box(), material="lit", scale=(2.0, 4.0, 1.0), translate=(-1.0, -2.0, -1.0))
    scene = Scene(camera=camera, materials={"lit": Phong(diffuse=0, emission=1)}, objects=[wall])
    found = render(scene, resolution=(6, 6), samples=1024, filter=name).radiance[..., 0]
    assert np.abs(found - expected).max() < 0.03
    box = render(scene, resolution=(6, 6), samples=1024).radiance[..., 0]
    assert name == "box" or np.abs(box - expected).max() > 0.1


@cases("name", FILTERS[1:])
@cases("camera", [
    PerspectiveCamera(eye=(0, 1, 4), target=(0, 0, 0)),
    EquirectangularCamera(eye=(0, 1, 4), target=(0, 0, 0)),
    ThinLensCamera(eye=(0, 1, 4), target=(0, 0, 0), aperture=0.2),
])  # fmt: skip
def test_a_part_of_a_picture_has_its_bits(name: str, camera: Any) -> None:
    """Also at the film's rim, beside which some samples lie; first hits are those of pixels' centres as ever."""
    ball = SceneObject(mesh=shapes.icosphere(2), material="red", normals="smooth")
    lamp = PointLight(position=(2, 3, 2), intensity=9)
    ready = prepare(Scene(camera=camera, materials={"red": Phong()}, objects=[ball], lights=[lamp], background=0.3))
    settings: Any = {"resolution": (45, 40), "samples": 16}
    whole = render(ready, filter=name, threads=2, **settings)
    part = render(ready, filter=name, window=(0, 3, 37, 20), threads=1, **settings)
    assert np.array_equal(part.radiance, whole.radiance[3:20, :37])
    plain = render(ready, **settings)
    assert np.array_equal(plain.face, whole.face) and np.array_equal(plain.depth, whole.depth)
    assert not np.array_equal(plain.radiance, whole.radiance)


def test_no_light_is_too_bright_for_negative_weights() -> None:
    """Infinities of either sign have large numbers in their place."""
    camera = OrthographicCamera(eye=(0.5, 0.5, 5), target=(0.5, 0.5, 0), height=4.0)
    wall = SceneObject(mesh=shapes.box(), material="white")
    lamp = PointLight(position=(0.5, 0.5, 1.01), intensity=1e308)
    scene = Scene(camera=camera, materials={"white": Phong()}, objects=[wall], lights=[lamp])
    found = render(scene, resolution=8, samples=16, filter="mitchell").radiance
    assert np.isfinite(found).all() and found.max() > 3e38
