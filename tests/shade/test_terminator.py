"""The soft terminator: a smooth body hides no light from itself, and its outline has no dark dots."""

from typing import Literal

import numpy as np
import pytest

from renderer import (
    DirectionalLight,
    Mesh,
    OrthographicCamera,
    Phong,
    PointLight,
    Scene,
    SceneObject,
    Sky,
    render,
    shapes,
)

TURNED = (10, 20, 30)
FROM_THE_RIGHT = [DirectionalLight(direction=(-1, 0, -0.2))]
BALL = shapes.icosphere(1)


def scene_of(mesh: Mesh, **more: object) -> Scene:
    """A smooth body seen from in front."""
    thing = SceneObject(mesh=mesh, material="white", normals="smooth", rotate=TURNED)
    camera = OrthographicCamera(eye=(0, 0, 5), target=(0, 0, 0), height=2.2)
    materials = {"white": Phong(diffuse=1)}
    return Scene(camera=camera, materials=materials, objects=[thing], **{"lights": FROM_THE_RIGHT, **more})  # type: ignore[arg-type]


@pytest.mark.judges("scene.render.terminator")
@pytest.mark.parametrize("light", [*FROM_THE_RIGHT, PointLight(position=(4, 0, 1))])
@pytest.mark.parametrize("inwards", [False, True])
def test_a_convex_body_hides_no_light_from_itself(light: DirectionalLight | PointLight, inwards: bool) -> None:
    """Of few faces, whose normals a file may have turned inwards."""
    normals = BALL.vertex_normals()
    scene = scene_of(Mesh(BALL.vertices, BALL.faces, normals=-normals if inwards else normals), lights=[light])
    lit = render(scene, resolution=(80, 80), shadows=False, terminator="soft").radiance
    soft, hard = (render(scene, resolution=(80, 80), terminator=name).radiance for name in ("soft", "hard"))
    assert np.array_equal(soft, lit)
    assert (hard != lit).any(axis=-1).sum() > 20  # the teeth


def test_another_body_still_hides_the_light() -> None:
    """Half of a sphere in the shadow of a wall beside it."""
    wall = SceneObject(mesh=shapes.box((1.05, 0, -3), (1.1, 3, 3)), material="white")
    scene = scene_of(BALL, lights=[DirectionalLight(direction=(-1, 0, 0))])
    scene = Scene(
        camera=scene.camera, materials=scene.materials, objects=[*scene.objects, wall], lights=scene.lights
    )  # fmt: skip
    soft = render(scene, resolution=(80, 80), terminator="soft").radiance[..., 0]
    assert (soft[4:38, 42:70] == 0.0).all() and (soft[44:60, 50:60] > 0.2).all()


def test_an_outline_has_no_dots_of_the_far_side() -> None:
    """Where normals turn away from the eye, the right outline was as dark as the left one."""
    scene = scene_of(BALL)
    hard, soft = (render(scene, resolution=(200, 200), shadows=False, terminator=name) for name in ("hard", "soft"))
    right = hard.face >= 0
    right[:, :150] = False
    assert (hard.radiance[right] == 0.0).any()
    assert soft.radiance[right].min() > 0.4


@pytest.mark.parametrize("normals", ["flat", "smooth"])
@pytest.mark.parametrize("far", [0.0, 1e4])
def test_flat_surfaces_have_the_same_bits(normals: Literal["flat", "smooth"], far: float) -> None:
    """Also those with normals, which the faces of a smooth body of flat sides have: rounding raised the points of some,
    and black dots stood there.
    """
    box = shapes.box((-1, -1, -1), (1, 1, 1)).creased()
    cube = SceneObject(mesh=box, material="white", normals=normals, rotate=TURNED, translate=(far, 0, 0))
    camera = OrthographicCamera(eye=(far, 0, 5), target=(far, 0, 0), height=2.2)
    scene = Scene(camera=camera, materials=scene_of(BALL).materials, objects=[cube], sky=Sky(lights=9))
    hard, soft = (render(scene, resolution=(32, 32), terminator=name) for name in ("hard", "soft"))
    assert np.array_equal(soft.radiance, hard.radiance)
