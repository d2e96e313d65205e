"""Glass among random paths: the test is calibrated, and each defect of the glass turns gates red."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from remembered import remembered

from renderer.scene.scene import Scene, load_scene
from validation.gates import Gate
from validation.pictures import monte_carlo
from validation.pictures.monte_carlo import scatter_of
from validation.references.mitsuba import path as mitsuba_path
from validation.report import page
from validation.scenes import SCENES

TEMPLATES = Path(page.__file__).parent / "templates"
CHANCE, SLOPE = 0, 2
PIXELS = 256


def branches(rng: np.random.Generator, count: int, share: float = 0.04) -> Any:
    """Paths of 256 pixels that see 1 by Fresnel's share, else .2: the channels go together."""
    return np.where(rng.random((count, PIXELS, 1)) < share, [1.0, 0.5, 0.8], 0.2)


def expected(share: float = 0.04) -> Any:
    return np.tile(0.2 + share * np.array([0.8, 0.3, 0.6]), (PIXELS, 1))


def test_without_an_error_the_p_value_is_nearly_uniform() -> None:
    rng = np.random.default_rng(5)
    p = np.sort([scatter_of(expected(), branches(rng, 64), (4, 16, 64)).p_value for _ in range(200)])
    # Channels that are one make 3 tests out of 1: p lies above uniform, and exactly so: 1 - (1 - u)^(1 / 3) is uniform.
    single = 1.0 - (1.0 - p) ** (1.0 / 3.0)
    distance = np.abs(single - (np.arange(200) + 0.5) / 200).max()
    # Kolmogorov and Smirnov: 1.95 / sqrt(200) is exceeded by one sample in a thousand.
    assert distance < 1.95 / np.sqrt(200)


def test_a_bias_flattens_the_slope_and_leaves_no_chance() -> None:
    paths = branches(np.random.default_rng(6), 256)
    sound, biased = (scatter_of(expected() + bias, paths, (4, 16, 64, 256)) for bias in (0.0, 0.005))
    assert abs(sound.slope + 0.5) < 0.03 and sound.p_value > 0.01 and sound.groups == 8
    assert biased.slope > -0.47 and biased.p_value < 1e-4
    # The scatter's part is taken out of the error: .005 is left of .01.
    assert biased.rmse[-1] > 0.007 and abs(biased.bias - 0.005) < 0.002


def test_pixels_without_scatter_must_agree_to_float32() -> None:
    paths = np.full((64, 40, 3), 0.5)
    one = np.full((40, 3), 0.5)
    assert scatter_of(one + 2e-6, paths, (4, 16, 64)).p_value > 0.9
    one[35:] += 1e-3  # in the second, shorter group
    assert scatter_of(one, paths, (4, 16, 64)).p_value < 1e-4


# A picture of ours


GLASS = load_scene(SCENES / "glass.toml")


@pytest.fixture(scope="module", autouse=True)
def small() -> Iterator[None]:
    """A smaller picture and fewer pixels; the same paths are traced once, whatever our picture is."""
    once = remembered(
        mitsuba_path.random_paths, lambda scene, rays, count, *, max_depth: (rays[1].tobytes(), count, max_depth)
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(monte_carlo, "_SIZES", (64, 96))
        patch.setattr(monte_carlo, "_PIXELS", PIXELS)
        patch.setattr(mitsuba_path, "random_paths", once)
        yield


def with_glass(**values: Any) -> Scene:
    """The scene with other glass in the sphere."""
    return GLASS.altered(materials=GLASS.materials | {"glass": GLASS.materials["glass"].model_copy(update=values)})


def judged(patch: pytest.MonkeyPatch, ours: Scene) -> tuple[dict[str, Any], list[Gate]]:
    """The glass scene's verdict on the picture of ``ours``; which pixels are fragile is the sound scene's."""
    picture = monte_carlo._picture

    def other(scene: Scene, size: int, offset: Any = "mitsuba", media: Any = "stack") -> Any:
        return picture(ours if offset == "mitsuba" else scene, size, offset, media)

    patch.setattr(monte_carlo, "_picture", other)
    return monte_carlo.run(GLASS, "glass", True)


@pytest.mark.judges("Scene.altered")
@cases(
    ("ours", "red"),
    [
        (with_glass(ior=1.51), {SLOPE, CHANCE}),
        (with_glass(transmittance=(0.95, 0.95, 0.95)), {SLOPE, CHANCE}),
        (with_glass(transmittance=(1.0, 0.95, 1.0)), {CHANCE}),
        (GLASS.altered(render=GLASS.render.model_copy(update={"max_depth": 5})), {SLOPE, CHANCE}),
        (GLASS.altered(lights=GLASS.lights[:1]), {SLOPE, CHANCE}),
    ],
)
def test_a_defect_of_the_glass_turns_gates_red(monkeypatch: pytest.MonkeyPatch, ours: Scene, red: set[int]) -> None:
    _, gates = judged(monkeypatch, ours)
    assert red <= {i for i, gate in enumerate(gates) if not gate.passed}


def test_a_scene_without_glass_is_refused() -> None:
    mirrors = load_scene(SCENES / "mirrors.toml")
    assert monte_carlo.can_judge(GLASS) is None
    assert "nothing is random" in (monte_carlo.can_judge(mirrors) or "")
    with pytest.raises(ValueError, match="a: expected a scene with glass"):
        monte_carlo.run(mirrors, "a", True)
