"""Pixels that differ have a reason, and a fault of ours never gets one."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import (
    Dielectric,
    DirectionalLight,
    Mirror,
    PerspectiveCamera,
    Phong,
    PointLight,
    Scene,
    SceneObject,
    prepare,
    render,
)
from renderer.diagnostics.ray_step import Aim, Ray, Steps
from renderer.mesh.shapes import box, icosphere, torus
from renderer.scene.instance import Instance
from renderer.scene.scene import Floor, RenderSettings
from validation.pictures.explain.pixels import Explainer
from validation.pictures.verdict import Pictures, differs, gates, judge
from validation.references.mitsuba import whitted as mitsuba_whitted
from validation.references.mitsuba.recorded import Trees
from validation.references.mitsuba.scene import camera_rays, in_float32

SIZE = (72, 54)


def thing(mesh: Any, material: str, x: float, z: float, **more: Any) -> SceneObject:
    return SceneObject(mesh=mesh, material=material, scale=0.6, translate=(x, 0.62, z), **more)


@cache
def scene() -> Scene:
    """Glass, a mirror and clear and dull bodies under two lights: each kind of ray, and edges of each."""
    return in_float32(
        Scene(
            camera=PerspectiveCamera(eye=(0.3, 1.9, 4.0), target=(0.1, 0.5, 0.0), fov=45.0),
            materials={
                "glass": Dielectric(ior=1.5, transmittance=(0.9, 1.0, 0.8)),
                "mirror": Mirror(reflectance=0.9),
                "clear": Phong(diffuse=0.2, transmittance=0.6, ior=1.2, reflectance=0.1),
                "red": Phong(diffuse=(0.6, 0.1, 0.1), specular=0.5, shininess=20.0),
                "floor": Phong(diffuse=(0.5, 0.5, 0.4)),
            },
            lights=(
                DirectionalLight(direction=(0.5, -1.3, -0.6), irradiance=0.6),
                PointLight(position=(-2.0, 3.0, 2.5), intensity=5.0),
            ),
            objects=(
                thing(icosphere(2), "glass", -0.4, 1.0),
                thing(torus(), "mirror", -1.2, -0.6, normals="smooth"),
                thing(box(), "clear", 0.6, 0.9),
                thing(icosphere(2), "red", 1.0, -0.8, normals="smooth"),
            ),
            floor=Floor(min=(-3.0, -3.0), max=(3.0, 3.0), materials=("floor",)),
            ambient=0.1,
            background=(0.4, 0.5, 0.6),
            render=RenderSettings(max_depth=5, resolution=SIZE),
        )
    )


@cache
def reference() -> Any:
    return mitsuba_whitted.whitted(scene(), *SIZE, max_depth=5)


def drawn(what: Scene, **more: Any) -> Any:
    return render(what, samples=1, min_weight=0.0, **more).radiance


def verdict(what: Scene, theirs: Any) -> dict[str, Any]:
    """The verdict on our pictures of a scene beside a reference's picture."""
    ours: Any = {
        rule: drawn(what, offset=offset, media="normal")
        for rule, offset in (("matched", "mitsuba"), ("own", "bounded"))
    }
    return judge(what, Pictures(ours, drawn(what), theirs))


def red(record: dict[str, Any]) -> set[str]:
    return {gate.quantity for gate in gates("here", record) if not gate.passed}


def test_the_recorded_rays_make_the_references_picture() -> None:
    trees = Trees(scene(), 5)
    origins, directions = camera_rays(scene(), *SIZE, 1)[0]
    rows = range(0, SIZE[0] * SIZE[1], 97)
    made = [trees.tree(origins[row], directions[row]).radiance() for row in rows]
    # Sums in float32 there, in float64 here.
    np.testing.assert_allclose(made, reference().reshape(-1, 3)[rows], rtol=1e-5, atol=1e-6)


def test_each_pixel_that_differs_has_a_reason() -> None:
    record = verdict(scene(), reference())
    counts = record["offsets"]["own"]
    assert red(record) == set()
    assert counts["offset"] + counts["rounding"] == differs(drawn(scene(), media="normal"), reference()).sum() > 0
    assert (record["map"] > 0).sum() == sum(counts.values())
    told = record["pixels"][0]
    assert told["ours"][0]["kind"] == told["theirs"][0]["kind"] == "camera"
    assert record["sample"]["pixels"] == 64


SOUND: dict[str, Any] = {name: getattr(Steps, name) for name in ("aims", "bounce", "ambient", "meet", "background")}


def children(change: Callable[[Ray], Ray]) -> tuple[str, Any]:
    return "bounce", lambda steps, ray, met: [change(child) for child in SOUND["bounce"](steps, ray, met)]


def lights(change: Callable[[Aim], Aim]) -> tuple[str, Any]:
    return "aims", lambda steps, ray, met: [change(aim) for aim in SOUND["aims"](steps, ray, met)]


def turned(vector: Any, by: float) -> Any:
    x, y, z = vector
    return x, y * np.cos(by) - z * np.sin(by), y * np.sin(by) + z * np.cos(by)


# What is wrong in a step of ours. Pictures are sound: what is judged is whether a fault in our rays gets a reason.
FAULTS: dict[str, tuple[str, Any]] = {
    "directions turned by 1e-4": children(lambda r: r._replace(direction=turned(r.direction, 1e-4))),
    "shares 1e-4 too large": children(lambda r: r._replace(weight=tuple(1.0001 * w for w in r.weight))),
    "starts 1e-3 off": children(lambda r: r._replace(origin=tuple(x + 1e-3 for x in r.origin))),
    "light 1e-4 too bright": lights(lambda a: a._replace(radiance=tuple(1.0001 * x for x in a.radiance))),
    "shadow rays too short": lights(lambda a: a._replace(t_max=0.9 * a.t_max)),
    "a light forgotten": ("aims", lambda steps, ray, met: SOUND["aims"](steps, ray, met)[:1]),
    "no refraction": ("bounce", lambda steps, ray, met: SOUND["bounce"](steps, ray, met)[:1]),
    "more ambient light": (
        "ambient",
        lambda steps, ray, met: tuple(x + 1e-3 for x in SOUND["ambient"](steps, ray, met)),
    ),
    "another sky": ("background", lambda steps, ray: tuple(0.99 * x for x in SOUND["background"](steps, ray))),
}


@cases("fault", FAULTS)
def test_a_fault_in_our_rays_gets_no_reason(monkeypatch: pytest.MonkeyPatch, fault: str) -> None:
    name, broken = FAULTS[fault]
    monkeypatch.setattr(Steps, name, broken)
    assert red(verdict(scene(), reference()))


@pytest.mark.parametrize("scale", [1.0, 1.001])
def test_a_picture_that_is_not_the_sum_of_its_rays_is_wrong(scale: float) -> None:
    """A gain of 1.001 shows in no pixel: those that agree are walked too."""
    ours = {
        rule: scale * drawn(scene(), offset=o, media="normal") for rule, o in (("matched", "mitsuba"), ("own", 1e-7))
    }
    ours["own"] = (scale * drawn(scene(), media="normal")).astype(np.float32)
    found = red(judge(scene(), Pictures(ours, ours["own"], reference())))  # type: ignore[arg-type]
    assert ("pixels whose rays differ at some step" in found) is (scale != 1.0)


def test_a_triangle_that_is_missing_is_seen() -> None:
    """Ours without a face of the mirror, against the reference of the whole scene."""
    whole = scene()
    part = whole.instances[1]
    mesh = replace(part.mesh, faces=np.delete(part.mesh.faces, slice(0, None, 3), axis=0))
    holed = Instance(mesh, part.material, part.smooth)
    without = whole.model_copy(update={"instances": (whole.instances[0], holed, *whole.instances[2:])})
    prepared, right = prepare(without), prepare(whole)
    pixels = [(int(r), int(c)) for r, c in np.argwhere(differs(drawn(without, media="normal"), reference()))]
    explainer = Explainer(right, SIZE)
    explainer._ours = Explainer(prepared, SIZE)._ours
    counts = explainer.explain("own", drawn(without, media="normal"), pixels).counts()
    assert len(pixels) > 20 and counts["ours wrong"] + counts["unexplained"] + counts["reference wrong"] > 0
    assert counts["ours wrong"] > 0


def test_a_reference_that_misses_a_face_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mitsuba's hits of one face are taken for misses: exact arithmetic says who is right."""
    trees, explainer = Trees(scene(), 5), Explainer(prepare(scene()), SIZE)
    sound = Trees.tree

    def blind(self: Trees, origin: Any, direction: Any) -> Any:
        node = sound(self, origin, direction)
        node.face, node.t, node.children, node.shadows = -1, np.inf, {}, {}
        node.own = np.array(scene().background)
        return node

    monkeypatch.setattr(Trees, "tree", blind)
    found = explainer.explain("own", drawn(scene(), media="normal"), [(40, 30)])
    assert found.counts()["reference wrong"] == 1 and trees
