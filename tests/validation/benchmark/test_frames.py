"""Mitsuba's ray lists draw our picture with our number of rays, or the frame's ratio compares two things."""

import numpy as np
import pytest

from renderer import Scene, load_scene, render
from renderer.scene.light import DirectionalLight
from validation.benchmark.peers import libllvm
from validation.benchmark.peers.mitsuba_variant import libllvm_path
from validation.pictures.compare import compare
from validation.references.mitsuba import scene as mitsuba_scene
from validation.scenes import SCENES

SIZE, DEPTH = 64, 6


@pytest.fixture(scope="module")
def scene() -> Scene:
    if libllvm_path() is None:
        pytest.skip(libllvm.HOW)
    return load_scene(SCENES / "checkered.toml")


def test_the_ray_lists_draw_our_picture_with_our_rays(scene: Scene) -> None:
    from validation.benchmark.peers.mitsuba_lists import RayLists

    lists = RayLists(scene, mitsuba_scene.camera_rays(scene, SIZE, SIZE, 1)[0], DEPTH)
    counts: dict[str, int] = {}
    theirs = lists.draw(counts).reshape(SIZE, SIZE, 3).astype(np.float64)
    ours = render(scene, resolution=(SIZE, SIZE), max_depth=DEPTH)
    compared = compare(ours.radiance, theirs)
    # Rays start elsewhere after a hit (float32, Mitsuba's rule): a few pixels at silhouettes and shadows' edges differ.
    assert compared.ssim > 0.995 and compared.mean_error < 1e-3
    total = counts["rays"] + counts["shadow_rays"]
    assert total == pytest.approx(int(ours.rays.sum()), rel=2e-3)
    # Drawn again, nothing is left of the first picture; sums of one pixel's rays may round in another order.
    assert np.allclose(lists.draw().reshape(SIZE, SIZE, 3), theirs, atol=1e-5)


def test_what_the_ray_lists_cannot_draw_is_refused(scene: Scene) -> None:
    from validation.benchmark.peers.mitsuba_lists import RayLists

    rays = mitsuba_scene.camera_rays(scene, 4, 4, 1)[0]
    sun = scene.model_copy(update={"lights": (DirectionalLight(type="directional", direction=(0, -1, 0)),)})
    with pytest.raises(ValueError, match="one point light"):
        RayLists(sun, rays, DEPTH)
    with pytest.raises(ValueError, match="clear glass"):
        RayLists(load_scene(SCENES / "three_models.toml"), rays, DEPTH)
