"""The picture section on a small scene: it passes as it is and fails for each defect the gates are there for."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer.image import Image
from renderer.render import render
from validation import images
from validation.cases import Case
from validation.gates import Gate


def checked(folder: Path, name: str = "glass", size: int = 64) -> list[Gate]:
    return images._check_scene(Case(name, "a test"), size, folder, lambda _: None)[1]


@pytest.mark.parametrize("name", ["three_models", "mirrors", "glass", "stairs"])
def test_every_scene_passes(tmp_path: Path, name: str) -> None:
    assert [g for g in checked(tmp_path, name) if not g.passed] == []
    assert len(list(tmp_path.glob("*.png"))) >= 6


def _with_radiance(change: Any) -> Any:
    def render_changed(scene: Any, **options: Any) -> Image:
        image = render(scene, **options)
        image.radiance[:] = change(image.radiance)
        return image

    return render_changed


def _with_camera(dx: float) -> Any:
    def render_changed(scene: Any, **options: Any) -> Image:
        shifted = hasattr(scene.camera, "shift")
        return render(scene if shifted else images._shifted(scene, (dx, 0.0)), **options)

    return render_changed


def _with_scene(**update: Any) -> Any:
    def render_changed(scene: Any, **options: Any) -> Image:
        return render(scene.model_copy(update={k: v(scene) for k, v in update.items()}), **options)

    return render_changed


def _swapped_ior(scene: Any) -> dict[str, Any]:
    return {
        k: m.model_copy(update={"ior": 1 / m.ior}) if m.type == "dielectric" else m for k, m in scene.materials.items()
    }


DEFECTS = {
    "gain of 1.10": _with_radiance(lambda r: r * 1.1),
    "half a pixel": _with_camera(0.5),
    "n1 and n2 swapped": _with_scene(materials=_swapped_ior),
    "a light missing": _with_scene(lights=lambda s: s.lights[:1]),
    "depth 2 for 6": lambda scene, **o: render(scene, **o, max_depth=2),
    "one pixel black": _with_radiance(lambda r: np.where(np.arange(r.size).reshape(r.shape) // 3 == 3000, 0, r)),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_every_defect_turns_a_gate_red(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, defect: str) -> None:
    monkeypatch.setattr(images, "render", DEFECTS[defect])
    assert not all(g.passed for g in checked(tmp_path))


def test_the_shifted_camera_moves_the_film(tmp_path: Path) -> None:
    from renderer.scene import load_scene

    scene = load_scene(Case("stairs", "").path)
    still = render(scene, resolution=(40, 40)).radiance
    moved = render(images._shifted(scene, (1.0, 2.0)), resolution=(40, 40)).radiance
    assert np.array_equal(moved[:-2, :-1], still[2:, 1:])
