"""What is easily mistaken: radians, colours of 8 bits, positional arguments, one number for a square picture."""

import inspect
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

import renderer
from renderer import (
    Dielectric,
    DirectionalLight,
    Floor,
    Mirror,
    Octree,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    PointLight,
    RenderSettings,
    Scene,
    SceneObject,
    SceneWarning,
    load_scene,
    render,
    shapes,
)
from renderer.cli.main import main
from renderer.scene.camera import primary_rays
from renderer.scene.change import changed
from renderer.viewer.viewpoint import camera_of

AT: dict[str, Any] = {"eye": (0, 0, 5), "target": (0, 0, 0)}
EIGHT_BITS = "diffuse: expected numbers from 0 to 1, got (255.0, 0.0, 0.0), used as given. Divide 8-bit colours by 255."
RECORDS = (
    Dielectric, DirectionalLight, Floor, Mirror, OrthographicCamera, PerspectiveCamera, Phong, PointLight,
    RenderSettings, Scene, SceneObject,
)  # fmt: skip


def slips(make: Any) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        make()
    assert all(issubclass(warning.category, SceneWarning) for warning in caught)
    assert all(warning.filename == __file__ for warning in caught)
    return [str(warning.message) for warning in caught]


@pytest.mark.judges("PerspectiveCamera", "SceneWarning")
@cases("degrees", [20.0, 45.0, 60.0, 90.0, 110.0])
def test_an_angle_in_radians_is_a_slip(degrees: float) -> None:
    (said,) = slips(lambda: PerspectiveCamera(**AT, fov=math.radians(degrees)))
    assert said.startswith("PerspectiveCamera: fov: expected degrees, got ") and f"write fov={degrees:g}." in said
    assert slips(lambda: PerspectiveCamera(**AT, fov=degrees)) == []


@pytest.mark.judges("Dielectric", "Mirror", "Phong", "SceneWarning")
@cases(
    ("kind", "name"),
    [(Phong, name) for name in ("diffuse", "specular", "reflectance", "transmittance")]
    + [(Mirror, "reflectance"), (Dielectric, "reflectance"), (Dielectric, "transmittance")],
)
def test_a_colour_of_8_bits_is_a_slip(kind: Any, name: str) -> None:
    (said,) = slips(lambda: kind(**{name: (255, 0, 0)}))
    assert said.startswith(f"{kind.__name__}: {name}: expected numbers from 0 to 1, got (255.0, 0.0, 0.0)")
    assert slips(lambda: kind(**{name: 1.0})) == []


@pytest.mark.judges("SceneObject", "SceneWarning", "scene.objects.scale")
def test_a_scale_that_leaves_no_area_is_a_slip(tmp_path: Path) -> None:
    for scale in (0, (1, 0, 0)):
        (said,) = slips(lambda scale=scale: SceneObject(mesh=shapes.box(), scale=scale))
        assert said.startswith("SceneObject: scale: expected") and "nothing to see" in said
    assert slips(lambda: SceneObject(mesh=shapes.box(), scale=(1, 1, 0))) == []  # flat, and seen
    shapes.box().save(tmp_path / "a.ply")
    path = tmp_path / "s.toml"
    path.write_text("camera = {eye = [0, 0, 5], target = [0, 0, 0]}\nmaterials.m = {}\n"
                    "objects = [{mesh = 'a.ply', material = 'm', scale = 0}]\n")  # fmt: skip
    (said,) = slips(lambda: load_scene(path))
    assert said.startswith(f"{path}: objects.0.scale: expected")


def test_slips_in_files_and_changes_are_told_once_and_with_their_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\nfov = 0.785\n[materials.red]\ndiffuse = [255, 0, 0]\n"
    path = tmp_path / "s.toml"
    path.write_text(text)
    expected = [
        f"{path}: camera.fov: expected degrees, got 0.785. If these are radians, write fov=44.9772.",
        f"{path}: materials.red.{EIGHT_BITS}",
    ]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = load_scene(path)
    assert [str(warning.message) for warning in caught] == expected
    assert slips(lambda: changed(scene, "render.samples = 4")) == []
    (said,) = slips(lambda: changed(scene, "camera = {eye = [0, 0, 5], target = [0, 0, 0], fov = 1.0}"))
    assert said.startswith("camera.fov: expected degrees, got 1.")
    # The command has a line for each.
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        assert main(["render", str(path), "-o", str(tmp_path / "o.png"), "--resolution", "4", "--quiet"]) == 0
    assert capsys.readouterr().err.splitlines() == [f"octree-render: {line}" for line in expected]


def test_a_page_that_zooms_in_is_no_slip() -> None:
    m = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]
    assert slips(lambda: camera_of(m, math.radians(0.785))) == []
    with pytest.raises(ValueError, match=r"^PerspectiveCamera: eye"):
        camera_of([*m[:12], math.inf, 0, 0, 1], 0.5)


@cases("kind", RECORDS)
def test_arguments_need_their_names_and_the_signature_has_the_defaults_of_the_fields(kind: Any) -> None:
    with pytest.raises(TypeError, match=rf"^expected keywords, as in {kind.__name__}\(.*=\.\.\..*\), got \(1, 2, 3\) "):
        kind((1, 2, 3), (4, 5, 6))
    stated = inspect.signature(kind).parameters
    assert set(stated) == set(kind.model_fields)
    for name, parameter in stated.items():
        field = kind.model_fields[name]
        assert (
            parameter.kind is parameter.KEYWORD_ONLY and (parameter.default is parameter.empty) == field.is_required()
        )
        if not field.is_required():
            assert np.array_equal(np.broadcast_to(parameter.default, np.shape(field.default)), field.default)


@pytest.mark.judges("RenderSettings", "octree-render render --resolution", "render", "scene.render.resolution")
def test_one_number_is_a_square_picture() -> None:
    scene = Scene(camera=AT, materials={}, render={"resolution": 3})
    assert scene.render.resolution == (3, 3) and render(scene).depth.shape == (3, 3)
    assert render(scene, resolution=np.int64(5)).depth.shape == render(scene, resolution=5).depth.shape == (5, 5)


@pytest.mark.judges("OrthographicCamera.primary_rays", "PerspectiveCamera.primary_rays")
@cases("camera", [PerspectiveCamera(eye=(3, 2, 4), target=(0, 0, 0)), OrthographicCamera(**AT, height=3)])
def test_primary_rays_are_those_of_the_picture(camera: Any) -> None:
    ball = SceneObject(mesh=shapes.icosphere(2), material="m")
    scene = Scene(camera=camera, materials={"m": Phong()}, objects=[ball])
    image = render(scene, resolution=(9, 7))
    origins, directions = camera.primary_rays((9, 7))
    assert origins.shape == directions.shape == (7, 9, 3)
    hits = Octree.from_mesh(ball.mesh).closest_hit(origins, directions)
    assert np.array_equal(hits.face, image.face) and np.allclose(hits.t, image.depth)
    moved = camera.primary_rays((9, 7), offset=(0.25, 0.75))
    for found, expected in zip(moved, primary_rays(camera, 9, 7, (0.25, 0.75)), strict=True):
        assert np.array_equal(found.reshape(-1, 3), expected)
    assert camera.primary_rays(4)[0].shape == (4, 4, 3)


@cases("bad", [(4,), (4, 0), (4, 4, 4), (4.5, 4), "4", None, (-1, 2), 0, True])
def test_primary_rays_refuse_other_resolutions(bad: Any) -> None:
    with pytest.raises(ValueError, match=r"^resolution: expected one or two integers above 0, got "):
        PerspectiveCamera(**AT).primary_rays(bad)
    with pytest.raises(ValueError, match=r"^offset: "):
        PerspectiveCamera(**AT).primary_rays(4, offset=(math.nan, 0))


@pytest.mark.judges("shapes")
def test_shapes_are_a_public_module_whose_bodies_are_closed() -> None:
    assert renderer.shapes is shapes and shapes.__all__ == ["box", "grid", "icosphere", "torus"]
    bodies = {name: getattr(shapes, name)() for name in shapes.__all__}
    assert {name: mesh.is_closed() for name, mesh in bodies.items()} == {
        "box": True, "grid": False, "icosphere": True, "torus": True,
    }  # fmt: skip
    inside = {"box": 0.5, "icosphere": 0.0, "torus": (1, 0, 0)}
    for name, at in inside.items():
        point = np.broadcast_to(at, (3,)).astype(float)
        assert Octree.from_mesh(bodies[name]).contains(point) and not Octree.from_mesh(bodies[name]).contains([9, 9, 9])


GREY = {"camera": AT, "materials": {"m": {}}}
BALL = SceneObject(mesh=shapes.icosphere(1), material="m")


@cases(
    ("make", "said"),
    [
        (lambda: Scene(**GREY, objects=BALL), "Scene: objects: expected a list, got one SceneObject"),
        (lambda: Scene(**GREY, objects=[BALL.mesh]), "Scene: objects.0: expected a table or a SceneObject, got Mesh"),
        (lambda: Scene(**GREY, lights=[3]), "Scene: lights.0: expected a table or an object of its class, got 3"),
        (lambda: PerspectiveCamera(eye=(0, 0, 5)), "PerspectiveCamera: target: expected a value, got none"),
        (lambda: Scene(**GREY, ambient=[0.1] * 999), "Scene: ambient: expected at most 3 items, got [0.1, "),
    ],
)  # fmt: skip
def test_a_fault_is_told_on_a_short_line(make: Any, said: str) -> None:
    with pytest.raises(renderer.SceneError) as caught:
        make()
    assert said in str(caught.value) and len(str(caught.value)) < 320 and "\n" not in str(caught.value)
