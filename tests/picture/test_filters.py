"""Reconstruction filters: their shapes, and pictures whose integrals are known."""

import math
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

pytestmark = pytest.mark.judges("scene.render.filter", "octree-render render --filter")

FILTERS = ["box", "tent", "gaussian", "mitchell"]


def shape(name: str, x: Any) -> Any:
    """The filters' formulas as published, with the radii and widths of Mitsuba's defaults, up to a factor."""
    x = np.abs(x)
    if name == "box":
        return np.where(x <= 0.5, 1.0, 0.0)
    if name == "tent":
        return np.maximum(1.0 - x, 0.0)
    if name == "gaussian":
        return np.maximum(np.exp(-(x**2) / (2.0 * 0.5**2)) - math.exp(-(2.0**2) / (2.0 * 0.5**2)), 0.0)
    b = c = 1.0 / 3.0
    near = (12 - 9 * b - 6 * c) * x**3 + (-18 + 12 * b + 6 * c) * x**2 + 6 - 2 * b
    far = (-b - 6 * c) * x**3 + (6 * b + 30 * c) * x**2 + (-12 * b - 48 * c) * x + 8 * b + 24 * c
    return np.where(x < 1.0, near, np.where(x < 2.0, far, 0.0)) / 6.0


GRID = np.linspace(-2.5, 2.5, 50001)


def up_to(name: str, x: Any) -> Any:
    """The integral of a filter from the left up to ``x``."""
    sums = np.cumsum(shape(name, 0.5 * (GRID[1:] + GRID[:-1])))
    return np.interp(x, GRID, np.append(0.0, sums / sums[-1]))


def strip(edge: float, **settings: Any) -> Any:
    """Eight pixels of radiance 1 left of a vertical edge, 0 right of it."""
    camera = OrthographicCamera(eye=(4.0, 0.5, 5.0), target=(4.0, 0.5, 0.0), height=1.0)
    wall = SceneObject(mesh=shapes.box(), material="lit", scale=(20.0 + edge, 20.0, 1.0), translate=(-20.0, -10.0, 0.0))
    scene = Scene(camera=camera, materials={"lit": Phong(diffuse=0, emission=1)}, objects=[wall])
    return render(scene, resolution=(8, 1), **settings)


@cases("name", FILTERS)
@cases("samples", [1, 4, 9, 16, 25, 256, 1024])
def test_places_and_weights_are_even_and_keep_a_constant(name: str, samples: int) -> None:
    places, weights = film_samples(name, samples)
    assert np.abs(places[::-1] + places - 1.0).max() < 1e-15 and np.array_equal(weights[::-1], weights)
    assert abs(weights.mean() - 1.0) < 1e-14
    assert (weights.min() < 0.0) == (name == "mitchell" and samples >= 16)
    assert samples % 2 == 0 or places[samples // 2].tolist() == [0.5, 0.5]


@cases("name", FILTERS)
def test_samples_are_spread_as_the_filter_is(name: str) -> None:
    """Along an axis, within the share of one sample."""
    places, weights = film_samples(name, 256**2)
    x, share = places[:256, 0] - 0.5, weights.reshape(256, 256).mean(axis=0)
    found = np.cumsum(share) / 256 - 0.5 * share / 256
    assert np.abs(found - up_to(name, x)).max() < 1e-6


@cases("name", FILTERS)
def test_shapes_are_mitsubas(name: str, mitsuba: Any) -> None:
    theirs = mitsuba.load_dict({"type": name})
    x = np.linspace(-2.5, 2.5, 1001) + 1e-4
    values = [float(theirs.eval(float(place))) if abs(place) < theirs.radius() else 0.0 for place in x]
    assert np.abs(values - shape(name, x)).max() < 5e-4  # their exponential is approximate


@cases("name", FILTERS)
@cases("edge", [4.0, 4.3, 4.5, 4.85])
def test_an_edge_has_the_filters_integral(name: str, edge: float) -> None:
    found = strip(edge, samples=4096, filter=name).radiance[0, :, 0]
    expected = up_to(name, edge - (np.arange(8) + 0.5))
    assert np.abs(found - expected).max() < 0.6 * film_samples(name, 4096)[1].max() / 64
    assert (found.min() < -0.01) == (name == "mitchell" and edge in (4.3, 4.5))


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
    """Infinite radiance of either sign has the largest number in its place."""
    camera = OrthographicCamera(eye=(0, 0, 5), target=(0, 0, 0), height=4.0)
    wall = SceneObject(mesh=shapes.box(), material="lit")
    scene = Scene(camera=camera, materials={"lit": Phong(diffuse=0, emission=1e308)}, objects=[wall], background=1e308)
    found = render(scene, resolution=8, samples=16, filter="mitchell").radiance
    assert np.isfinite(found).all()
