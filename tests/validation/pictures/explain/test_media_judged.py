"""Where the rule for media decides a pixel, geometry says so; a stack that breaks the rule is seen."""

from typing import Any

import numpy as np
import pytest

from renderer import Dielectric, PerspectiveCamera, Phong, Scene, SceneObject, prepare, render
from renderer.diagnostics.ray_step import Steps
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere
from validation.pictures.explain import media
from validation.pictures.explain.media import COINCIDING, OPEN, OVERLAPPING, MediaJudge
from validation.pictures.verdict import differs

SIZE = (40, 30)
GLASS, WATER = Dielectric(ior=1.5), Dielectric(ior=1.33)
LIDLESS = Mesh(icosphere(2).vertices, icosphere(2).faces[::2])


def scene_of(*parts: tuple[Mesh, Any, tuple[float, float, float]], eye: Any = (0.0, 1.0, 4.0)) -> Scene:
    objects = [
        SceneObject(mesh=mesh, material=f"m{k}", translate=place, normals="flat")
        for k, (mesh, _, place) in enumerate(parts)
    ]
    return Scene(
        camera=PerspectiveCamera(eye=eye, target=(0.0, 0.0, 0.0)),
        materials={f"m{k}": material for k, (_, material, _) in enumerate(parts)} | {"back": Phong(ambient=0.7)},
        objects=[*objects, SceneObject(mesh=box((-9, -9, -9), (9, 9, -8)), material="back")],
        background=(0.2, 0.4, 0.9),
        ambient=(1.0, 0.5, 0.2),
    )


SCENES = {
    OPEN: scene_of((LIDLESS, GLASS, (0.0, 0.0, 0.0)), (icosphere(2), WATER, (0.0, 0.0, -3.0))),
    OVERLAPPING: scene_of((icosphere(2), GLASS, (-0.4, 0.0, 0.0)), (icosphere(2), WATER, (0.4, 0.0, 0.0))),
    COINCIDING: scene_of((box(), GLASS, (-1.0, -0.5, 0.0)), (box(), WATER, (0.0, -0.5, 0.0)), eye=(0.6, 1.0, 4.0)),
}


def judged(scene: Scene) -> list[Any]:
    stack, normal = (render(scene, resolution=SIZE, media=media).radiance for media in ("stack", "normal"))
    pixels = [(row, column) for row, column in np.argwhere(differs(stack, normal)).tolist()]
    return MediaJudge(prepare(scene), SIZE).judge(stack, pixels)


@pytest.mark.judges("render")
@pytest.mark.parametrize("why", SCENES)
def test_geometry_says_why_the_rules_differ(why: str) -> None:
    found = judged(SCENES[why])
    assert len(found) > 20 and [one for one in found if one.wrong is not None or one.why is None] == []
    assert np.mean([one.why == why for one in found]) > 0.9


def test_where_the_rules_may_not_differ_nothing_lets_them() -> None:
    apart = scene_of((icosphere(2), GLASS, (0.0, 0.0, 0.0)))
    assert judged(apart) == []
    (one,) = MediaJudge(prepare(apart), SIZE).judge(render(apart, resolution=SIZE).radiance, [(15, 20)])
    assert (one.why, one.wrong) == (None, None)


@pytest.mark.parametrize("why", [OPEN, OVERLAPPING])
def test_a_stack_that_forgets_is_seen(monkeypatch: pytest.MonkeyPatch, why: str) -> None:
    """Rays take the media of the ray before along, as if no surface changed them."""
    bounce = Steps.bounce

    def forgetful(self: Steps, ray: Any, met: Any) -> Any:
        return [child._replace(media=ray.media) for child in bounce(self, ray, met)]

    monkeypatch.setattr(Steps, "bounce", forgetful)
    # The picture is sound, and is not compared here.
    monkeypatch.setattr(media, "wrong_sum", lambda *_: [])
    assert any("by the rule the indices are" in (one.wrong or "") for one in judged(SCENES[why]))
