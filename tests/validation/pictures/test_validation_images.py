"""The picture section on small scenes: they pass as they are, and fail for each defect that the gates are there for."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow

from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.shapes import icosphere
from renderer.picture.image import Image
from renderer.picture.render import render
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.scene import Floor, RenderSettings, Scene, SceneObject, load_scene
from validation.gates import Gate
from validation.job import Job
from validation.pictures import ladder, monte_carlo, one_ray, plan, verdict
from validation.pictures import section as images
from validation.pictures.explain import pixels
from validation.pictures.plan import WHITTED, PictureEffort, Reference, plan_pictures
from validation.pictures.shifted_film import shifted
from validation.references.mitsuba import path as mitsuba_path
from validation.references.mitsuba.whitted import whitted
from validation.scenes import SCENES
from validation.thresholds import Thresholds

SMALL = PictureEffort(64, paths=False)
pytestmark = pytest.mark.usefixtures("built_once")


@cache
def stairs() -> Scene:
    return load_scene(SCENES / "stairs.toml")


def _ball(material: str, x: float, z: float) -> SceneObject:
    # Flat glass: where smooth normals hide coarse faces, the offset decides too many of so few pixels.
    normals: Any = "flat" if material == "glass" else "smooth"
    return SceneObject(mesh=icosphere(4), material=material, normals=normals, scale=0.6, translate=(x, 0.62, z))


@cache
def balls() -> Scene:
    """A ball for every rung before a floor, few faces, two lights and ambient light."""
    return Scene(
        camera=PerspectiveCamera(eye=(0.3, 1.9, 4.0), target=(0.1, 0.5, 0.0), fov=40.0),
        materials={
            "glass": Dielectric(type="dielectric", ior=1.5),
            "mirror": Mirror(type="mirror"),
            "red": Phong(diffuse=(0.6, 0.1, 0.1), specular=(0.5,) * 3, shininess=20.0),
            "floor": Phong(diffuse=(0.5, 0.5, 0.4)),
        },
        lights=(
            DirectionalLight(direction=(0.5, -1.3, -0.6), irradiance=(0.6,) * 3),
            PointLight(type="point", position=(-2.0, 3.0, 2.5), intensity=(5.0,) * 3),
        ),
        objects=(_ball("glass", -0.3, 0.9), _ball("mirror", -1.0, -0.6), _ball("red", 1.0, 0.0)),
        floor=Floor(min=(-2.0, -2.0), max=(2.0, 2.0), materials=("floor",)),
        ambient=(0.1,) * 3,
        background=(0.4, 0.5, 0.6),
        render=RenderSettings(max_depth=6),
    )


@cache
def reference_balls() -> Any:
    return whitted(balls(), 64, 64, max_depth=6)


def check(folder: Path, scene: Scene, effort: PictureEffort = SMALL) -> tuple[dict[str, Any], list[Gate]]:
    said: list[str] = []
    job = Job(True, Thresholds(), folder, said.append)
    result = images.check_scene("small", "a test", scene, effort, job)
    assert len(said) == plan_pictures(scene, effort).steps
    json.dumps(result[0], allow_nan=False)
    return result


def failing(gates: list[Gate]) -> list[str]:
    return [f"{gate.subject}: {gate.quantity} is {gate.value}" for gate in gates if not gate.passed]


def test_the_whole_ladder_passes_and_leaves_what_the_report_shows(tmp_path: Path) -> None:
    record, gates = check(tmp_path, balls(), PictureEffort(64, 32))
    assert failing(gates) == []
    judged = {rung["name"]: {c["reference"] for c in rung["comparisons"]} for rung in record["rungs"]}
    of_glass = ("glass", "everything")
    names = [name for name in ladder.NAMES if name != "textures"]
    assert judged == {name: {"whitted"} if name in of_glass else {"whitted", "path"} for name in names}
    assert "dielectric" in record["rungs"][-1]["left_out"][mitsuba_path.NAME]
    shown = [c["files"] for rung in record["rungs"] for c in rung["comparisons"] if "files" in c]
    assert len(shown) == 6 and not (tmp_path / "failed").exists()
    maps = {rung["verdict"]["file"] for rung in record["rungs"]}
    assert {p.name for p in tmp_path.iterdir()} == {name for files in shown for name in files.values()} | maps
    with Pillow.open(tmp_path / shown[0]["difference"]) as difference:
        assert difference.mode == "L"
    assert record["paths"]["paths"] and any("random paths" in gate.subject for gate in gates)
    costs = images.costs_of([record])
    assert costs[WHITTED] > 0.0 and costs[monte_carlo.PATHS] == record["paths"]["seconds"]


def test_a_scene_without_shadows_is_judged_by_who_can(tmp_path: Path) -> None:
    bright = balls().altered(render=balls().render.model_copy(update={"shadows": False}))
    record, gates = check(tmp_path, bright)
    assert failing(gates) == []
    assert "shadows" in record["rungs"][-1]["left_out"][mitsuba_path.NAME]
    assert "shadows" in (monte_carlo.can_judge(bright) or "")
    # And the reference has none: with them it is another picture.
    assert not np.array_equal(whitted(bright, 32, 32, max_depth=2), whitted(balls(), 32, 32, max_depth=2))


def _radiance(change: Callable[[Any], Any]) -> Callable[..., Image]:
    def rendered(scene: Scene, **options: Any) -> Image:
        image = render(scene, **options)
        image.radiance[:] = change(image.radiance)
        return image

    return rendered


def _scene(change: Callable[[Scene], Scene]) -> Callable[..., Image]:
    return lambda scene, **options: render(change(scene), **options)


def _moved(scene: Scene) -> Scene:
    return scene if hasattr(scene.camera, "shift") else shifted(scene, (0.5, 0.0))


def _without_highlights(scene: Scene) -> Scene:
    dull = scene.materials["red"].model_copy(update={"specular": (0.0,) * 3})
    return scene.altered(materials=scene.materials | {"red": dull})


def _swapped_ior(scene: Scene) -> Scene:
    swapped = scene.materials["glass"].model_copy(update={"ior": 1.0 / 1.5})
    return scene.altered(materials=scene.materials | {"glass": swapped})


def _geometry(name: str, change: Callable[[Any], Any]) -> Callable[..., Image]:
    def rendered(scene: Scene, **options: Any) -> Image:
        image = render(scene, **options)
        getattr(image, name)[:] = change(getattr(image, name))
        return image

    return rendered


# What is wrong, and a gate that must see it.
DEFECTS = {
    "gain of 1.001": (_radiance(lambda r: r * 1.001), "mean_error"),
    "half a pixel": (_scene(_moved), "pixels whose position is off"),
    "n1 and n2 swapped": (_scene(_swapped_ior), "ssim"),
    "a light missing": (_scene(lambda s: s.altered(lights=s.lights[:1])), "mean_error"),
    "no highlights": (_scene(_without_highlights), "ssim_foreground"),
    "depth 2 for 6": (lambda scene, **o: render(scene, **o | {"max_depth": 2}), "pixel_share"),
    "one pixel black": (
        _radiance(lambda r: np.where(np.arange(r.size).reshape(r.shape) // 3 == 2400, 0, r)),
        "max_error",
    ),
    "distances": (_geometry("depth", lambda d: d * 1.0001), "pixels whose distance is off"),
    "shading normals": (_geometry("normal", lambda n: -n), "pixels whose shading normal is off"),
    "another face": (_geometry("face", lambda f: np.where(f >= 0, 0, f)), "pixels whose geometric normal is off"),
}


@cases("defect", DEFECTS)
def test_every_defect_turns_a_gate_red(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, defect: str) -> None:
    known = Reference("whitted", WHITTED, lambda _: None, lambda *_, **__: reference_balls())
    monkeypatch.setattr(plan, "REFERENCES", (known,))
    # Reasons of single pixels are judged elsewhere.
    monkeypatch.setattr(verdict, "_SAMPLE", 1)
    monkeypatch.setattr(verdict, "_RULED", 1)
    monkeypatch.setattr(pixels, "_AT_ONCE", 1)
    monkeypatch.setattr(pixels, "SETTLED", 1)
    wrong, seen_by = DEFECTS[defect]
    monkeypatch.setattr(one_ray, "render", wrong)
    record, gates = check(tmp_path, balls())
    assert seen_by in {gate.quantity for gate in gates if not gate.passed}
    for comparison in record["rungs"][-1]["comparisons"]:
        left = comparison.get("failed", [])
        assert bool(left) is not comparison["passed"]
        assert sorted(Path(name).suffix for name in left) == ([".exr"] * 3 + [".png"] * 4 if left else [])
        assert all((tmp_path / name).stat().st_size > 0 for name in left)


def test_srgb_applied_twice_is_seen_in_what_is_saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from renderer.picture import image as module

    right = module.srgb
    monkeypatch.setattr(module, "srgb", lambda linear: right(right(linear) / 255.0))
    _, gates = check(tmp_path, stairs(), PictureEffort(24, paths=False))
    assert {gate.quantity for gate in gates if not gate.passed} == {"8-bit steps from the formula"}


def test_a_rung_that_nobody_judges_is_not_passed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nobody = Reference("path", mitsuba_path.NAME, lambda _: "no reason", whitted)
    monkeypatch.setattr(plan, "REFERENCES", (nobody,))
    record, gates = check(tmp_path, stairs(), PictureEffort(24, paths=False))
    assert failing(gates) == ["small, everything: references is 0"]
    assert record["rungs"][0]["left_out"] == {mitsuba_path.NAME: "no reason"}


def test_a_mesh_that_mitsuba_cannot_hold_is_not_passed(tmp_path: Path) -> None:
    far = tuple(thing.model_copy(update={"translate": (1e7, 0.1, 0.0)}) for thing in balls().objects)
    moved = balls().model_copy(update={"objects": far})
    # They were placed already if a test before this one asked.
    moved.__dict__.pop("instances", None)
    record, gates = check(tmp_path, moved)
    assert "float32" in record["fault"] and failing(gates) and "aovs" not in record
