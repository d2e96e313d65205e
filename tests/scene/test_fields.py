"""Each field of a scene's tables: what it is where it is left out, what it takes, and what it refuses, by hand."""

import math
import re
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from cases import cases

from renderer import (
    Dielectric,
    DirectionalLight,
    EquirectangularCamera,
    FisheyeCamera,
    Floor,
    Mirror,
    OpenCVCamera,
    OpenCVFisheyeCamera,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    PinholeCamera,
    PointLight,
    RenderSettings,
    Scene,
    SceneError,
    SceneObject,
    Sky,
    Texture,
    ThinLensCamera,
    load_scene,
)
from renderer.mesh.shapes import box

# Colours above 1 are allowed.
pytestmark = [pytest.mark.filterwarnings("ignore::renderer.SceneWarning"), pytest.mark.judges(
    "EquirectangularCamera", "FisheyeCamera", "Floor", "OpenCVFisheyeCamera", "OrthographicCamera", "PinholeCamera",
    "ThinLensCamera", "scene.camera.equirectangular.eye", "scene.camera.equirectangular.target",
    "scene.camera.equirectangular.type", "scene.camera.equirectangular.up", "scene.camera.fisheye.eye",
    "scene.camera.fisheye.fov", "scene.camera.fisheye.target", "scene.camera.fisheye.type",
    "scene.camera.fisheye.up", "scene.camera.opencv.cx", "scene.camera.opencv.cy", "scene.camera.opencv.eye",
    "scene.camera.opencv.fx",
    "scene.camera.opencv.fy", "scene.camera.opencv.height", "scene.camera.opencv.k1", "scene.camera.opencv.k2",
    "scene.camera.opencv.k3", "scene.camera.opencv.p1", "scene.camera.opencv.p2", "scene.camera.opencv.skew",
    "scene.camera.opencv.target", "scene.camera.opencv.type", "scene.camera.opencv.up", "scene.camera.opencv.width",
    "scene.camera.opencv_fisheye.cx", "scene.camera.opencv_fisheye.cy",
    "scene.camera.opencv_fisheye.eye", "scene.camera.opencv_fisheye.fx", "scene.camera.opencv_fisheye.fy",
    "scene.camera.opencv_fisheye.height", "scene.camera.opencv_fisheye.k1", "scene.camera.opencv_fisheye.k2",
    "scene.camera.opencv_fisheye.k3", "scene.camera.opencv_fisheye.k4", "scene.camera.opencv_fisheye.skew",
    "scene.camera.opencv_fisheye.target", "scene.camera.opencv_fisheye.type", "scene.camera.opencv_fisheye.up",
    "scene.camera.opencv_fisheye.width", "scene.camera.pinhole.cx", "scene.camera.pinhole.cy",
    "scene.camera.pinhole.eye", "scene.camera.pinhole.fx", "scene.camera.pinhole.fy", "scene.camera.pinhole.height",
    "scene.camera.pinhole.skew", "scene.camera.pinhole.target", "scene.camera.pinhole.type",
    "scene.camera.pinhole.up", "scene.camera.pinhole.width", "scene.camera.thin_lens.aperture",
    "scene.camera.thin_lens.eye", "scene.camera.thin_lens.focus", "scene.camera.thin_lens.fov",
    "scene.camera.thin_lens.target", "scene.camera.thin_lens.type", "scene.camera.thin_lens.up",
    "RenderSettings", "Scene", "scene.ambient", "scene.background", "scene.camera",
    "scene.camera.orthographic.eye", "scene.camera.orthographic.height", "scene.camera.orthographic.target",
    "scene.camera.orthographic.type", "scene.camera.orthographic.up", "scene.camera.perspective.eye",
    "scene.camera.perspective.fov", "scene.camera.perspective.target", "scene.camera.perspective.type",
    "scene.camera.perspective.up", "scene.floor", "scene.floor.materials", "scene.floor.max", "scene.floor.min",
    "scene.floor.squares", "scene.lights", "scene.lights.directional.direction", "scene.lights.directional.irradiance",
    "scene.lights.directional.type", "scene.lights.point.intensity", "scene.lights.point.position",
    "scene.lights.point.type", "scene.materials", "scene.materials.dielectric.ior",
    "scene.materials.dielectric.reflectance", "scene.materials.dielectric.transmittance",
    "scene.materials.dielectric.type", "scene.materials.mirror.reflectance", "scene.materials.mirror.type",
    "scene.materials.phong.ambient", "scene.materials.phong.diffuse", "scene.materials.phong.ior",
    "scene.materials.phong.reflectance", "scene.materials.phong.shininess", "scene.materials.phong.specular",
    "scene.materials.phong.transmittance", "scene.materials.phong.type", "scene.materials.phong.emission",
    "scene.materials.phong.opacity", "scene.materials.phong.cutoff", "scene.materials.phong.diffuse_map",
    "scene.materials.phong.ambient_map",
    "scene.materials.phong.specular_map", "scene.materials.phong.reflectance_map",
    "scene.materials.phong.transmittance_map", "scene.materials.phong.emission_map",
    "scene.materials.phong.opacity_map", "scene.materials.phong.normal_map",
    "scene.materials.phong.vertex_colors", "scene.objects", "scene.objects.material",
    "scene.objects.mesh", "scene.objects.normals", "scene.objects.rotate", "scene.objects.scale",
    "scene.objects.translate", "scene.render", "scene.render.filter", "scene.render.max_depth", "scene.render.max_rays",
    "scene.render.min_weight", "scene.render.resolution", "scene.render.samples", "scene.render.shadows",
    "scene.render.glass_shadows", "scene.render.terminator",
    "scene.sky", "scene.sky.ground", "scene.sky.horizon", "scene.sky.lights", "scene.sky.sun", "scene.sky.sun_angle",
    "scene.sky.sun_irradiance", "scene.sky.sun_lights", "scene.sky.zenith", "scene.objects.crease", "scene.up",
)]  # fmt: skip


BOX, WOOD = box(), Texture("w.png")
NEEDED = object()
FILM = {"eye": (0, 0, 5), "target": (0, 0, 0), "width": 64, "height": 48, "fx": 50, "fy": 50}
# For each class the fields without which it cannot be.
LEAST: dict[type, dict[str, Any]] = {
    PerspectiveCamera: {"eye": (0, 0, 5), "target": (0, 0, 0)},
    OrthographicCamera: {"eye": (0, 0, 5), "target": (0, 0, 0), "height": 2},
    FisheyeCamera: {"eye": (0, 0, 5), "target": (0, 0, 0)},
    EquirectangularCamera: {"eye": (0, 0, 5), "target": (0, 0, 0)},
    ThinLensCamera: {"eye": (0, 0, 5), "target": (0, 0, 0), "aperture": 0.1},
    PinholeCamera: FILM,
    OpenCVCamera: FILM,
    OpenCVFisheyeCamera: FILM,
    DirectionalLight: {"direction": (0, -1, 0)},
    PointLight: {"position": (0, 1, 0)},
    Phong: {},
    Mirror: {},
    Dielectric: {},
    SceneObject: {"mesh": BOX},
    Floor: {"min": (-1, -1), "max": (1, 1), "materials": ("m",)},
    RenderSettings: {},
    Sky: {},
    Scene: {"camera": {"eye": (3, 4, 5), "target": (0, 0, 0)}, "materials": {"m": {}, "n": {}}},
}


class Field(NamedTuple):
    """A field: its value where it is left out, values taken with those that come of them, and values refused."""

    default: Any
    takes: list[tuple[Any, Any]]
    refuses: list[Any]


def same(*values: Any) -> list[tuple[Any, Any]]:
    return [(value, value) for value in values]


NO_NUMBERS = [True, "1", None, [1.0], math.nan]
HUGE, BEYOND = 1e308, math.inf
TINY = 5e-324


def triple(default: Any, *refused: Any) -> Field:
    """Three finite numbers of any size."""
    wrong = [1.0, (1, 2), (1, 2, 3, 4), (1, "2", 3), (True, 1, 1), (math.nan, 0, 0), (0, BEYOND, 0), (0, 0, -BEYOND)]
    return Field(
        default, [*same((1.0, -2.0, 3.5), (-1.0, TINY, 1.0)), ([1, 2, 4], (1.0, 2.0, 4.0))], [*wrong, *refused]
    )


def colour(default: Any) -> Field:
    """Three numbers from 0, or one for all of them."""
    taken = [*same((0.0, 0.5, HUGE)), (0.25, (0.25,) * 3), (2, (2.0,) * 3), ([0, 1, 7], (0.0, 1.0, 7.0))]
    wrong = [-TINY, (0, 0, -1), (0, BEYOND, 0), BEYOND, math.nan, (math.nan, 0, 0), (1, 2), (1, 2, 3, 4), True, "1"]
    return Field(default, taken, wrong)


def number(default: Any, least: float, most: float, *, refused: tuple[float, ...]) -> Field:
    """One number from ``least`` to ``most``."""
    return Field(default, [*same(least, most, 1.0 if least <= 1.0 <= most else least)], [*NO_NUMBERS, *refused])


def kind(name: str) -> Field:
    return Field(name, same(name), ["other", "", None, 1])


MAPS = (
    "ambient_map",
    "diffuse_map",
    "specular_map",
    "reflectance_map",
    "transmittance_map",
    "emission_map",
    "opacity_map",
    "normal_map",
)
MAP = Field(
    None, [(None, None), (WOOD, WOOD), ("w.png", WOOD), ({"image": "w.png"}, WOOD)],
    [3, True, {"image": "w.png", "filter": "cubic"}, {"filter": "linear"}],
)  # fmt: skip
IOR = number(1.5, TINY, HUGE, refused=(0.0, -1.0, BEYOND))
ANY_EYE = triple(NEEDED, (0, 0, math.nextafter(2.0**126, BEYOND)))
CAMERA = {
    "eye": ANY_EYE._replace(takes=[*ANY_EYE.takes, *same((0.0, 0.0, 2.0**126))]), "target": triple(NEEDED),
    "up": triple((0.0, 1.0, 0.0))._replace(takes=[*same((1.0, 2.0, 3.0)), ([0, 1, 1], (0.0, 1.0, 1.0))]),
}  # fmt: skip
PIXELS = Field(NEEDED, same(1, 65536), [0, -1, 65537, 4.0, True, "4"])
CALIBRATED = {
    **CAMERA, "width": PIXELS, "height": PIXELS,
    **dict.fromkeys(("fx", "fy"), number(NEEDED, 1e-9, 1e9, refused=(0.0, -1.0, 1.1e9, BEYOND))),
    **{
        name: number(middle, -1e9, 1e9, refused=(BEYOND,))._replace(refuses=[True, "1", [1.0], math.nan, BEYOND])
        for name, middle in (("cx", 32.0), ("cy", 24.0))
    },
    "skew": number(0.0, -1e9, 1e9, refused=(-1.1e9, BEYOND)),
}  # fmt: skip
FIELDS: dict[type, dict[str, Field]] = {
    PerspectiveCamera: {
        "type": kind("perspective"), **CAMERA,
        "fov": number(45.0, TINY, math.nextafter(180, 0), refused=(0.0, -1.0, 180.0, BEYOND)),
    },
    OrthographicCamera: {
        "type": kind("orthographic"), **CAMERA,
        "height": number(NEEDED, TINY, 2.0**126, refused=(0.0, -1.0, math.nextafter(2.0**126, BEYOND), BEYOND)),
    },
    FisheyeCamera: {
        "type": kind("fisheye"), **CAMERA,
        "fov": number(180.0, TINY, 360.0, refused=(0.0, -1.0, math.nextafter(360, BEYOND), BEYOND)),
    },
    EquirectangularCamera: {"type": kind("equirectangular"), **CAMERA},
    ThinLensCamera: {
        "type": kind("thin_lens"), **CAMERA,
        "fov": number(45.0, TINY, math.nextafter(180, 0), refused=(0.0, -1.0, 180.0, BEYOND)),
        "aperture": number(NEEDED, 0.0, 2.0**126, refused=(-TINY, math.nextafter(2.0**126, BEYOND), BEYOND)),
        "focus": Field(
            None, [(None, None), *same(TINY, 4.0, 2.0**126)], [True, "1", [1.0], math.nan, 0.0, -1.0, BEYOND]
        ),
    },
    PinholeCamera: {"type": kind("pinhole"), **CALIBRATED},
    OpenCVCamera: {
        "type": kind("opencv"), **CALIBRATED,
        **dict.fromkeys(("k1", "k2", "p1", "p2", "k3"), number(0.0, -1e9, 1e9, refused=(1.1e9, BEYOND))),
    },
    OpenCVFisheyeCamera: {
        "type": kind("opencv_fisheye"), **CALIBRATED,
        **dict.fromkeys(("k1", "k2", "k3", "k4"), number(0.0, -1e9, 1e9, refused=(1.1e9, BEYOND))),
    },
    DirectionalLight: {
        "type": kind("directional"), "direction": triple(NEEDED, (0, 0, 0), (0.0, -0.0, 0.0)),
        "irradiance": colour((1.0, 1.0, 1.0)),
    },
    PointLight: {"type": kind("point"), "position": triple(NEEDED), "intensity": colour((1.0, 1.0, 1.0))},
    Phong: {
        "type": kind("phong"), "diffuse": colour((0.8, 0.8, 0.8)), "specular": colour((0.0, 0.0, 0.0)),
        "ambient": colour(None)._replace(takes=[*colour(None).takes, (None, None)]),
        "shininess": number(32.0, 0.0, HUGE, refused=(-TINY, BEYOND)), "ior": IOR,
        "reflectance": colour((0.0, 0.0, 0.0)), "transmittance": colour((0.0, 0.0, 0.0)),
        "emission": colour((0.0, 0.0, 0.0)), "opacity": number(1.0, 0.0, 1.0, refused=(-TINY, 1.1)),
        "cutoff": number(0.0, 0.0, 1.0, refused=(-TINY, 1.1)), **dict.fromkeys(MAPS, MAP),
        "vertex_colors": Field(None, same(None, "linear", "srgb"), ["sRGB", True, 3]),
    },
    Mirror: {"type": kind("mirror"), "reflectance": colour((1.0, 1.0, 1.0))},
    Dielectric: {
        "type": kind("dielectric"), "ior": IOR,
        "reflectance": colour((1.0, 1.0, 1.0)), "transmittance": colour((1.0, 1.0, 1.0)),
    },
    SceneObject: {
        "mesh": Field(NEEDED, [(BOX, BOX), ("a.ply", Path("a.ply")), (Path("b.stl"), Path("b.stl"))], [3, None, [BOX]]),
        "material": Field(None, same("m", "ü b", None), [3, ["m"]]),
        "crease": number(180.0, 0.0, 180.0, refused=(-TINY, math.nextafter(180, BEYOND), BEYOND)),
        "normals": Field("flat", same("flat", "smooth"), ["Flat", "", None, True]),
        "scale": triple((1.0, 1.0, 1.0))._replace(
            takes=[*same((1.0, -2.0, 0.5)), (2, (2.0, 2.0, 2.0)), (-0.5, (-0.5, -0.5, -0.5))],
            refuses=[True, "1", None, math.nan, BEYOND, (1, 2), (1, 2, 3, 4), (1, 2, math.nan)],
        ),
        "rotate": triple((0.0, 0.0, 0.0)), "translate": triple((0.0, 0.0, 0.0)),
    },
    Floor: {
        "min": Field(
            NEEDED, [((-3, -2.5), (-3.0, -2.5))], [1, (-1,), (-3, -2, -1), ("a", 0), (1, -1), (-1, 1), (math.nan, 0)]
        ),
        "max": Field(NEEDED, [((3, 2.5), (3.0, 2.5))], [1, (1,), (3, 2, 1), (True, 2), (-1, 1), (1, -1), (BEYOND, 1)]),
        "materials": Field(
            NEEDED, [*same(("m",), ("m", "n")), (["n"], ("n",))], ["m", (), ("m", "n", "m"), (1,), None]
        ),
        "squares": Field((1, 1), same((1, 1000), (7, 3)), [2, (1,), (0, 1), (1, 1001), (1.5, 1), (True, 1), (1, 2, 3)]),
    },
    RenderSettings: {
        "resolution": Field(
            (512, 512), [*same((1, 16384), (640, 480)), (8, (8, 8))],
            [0, 8.0, True, (0, 1), (1, 16385), (8.5, 1), (True, 1), (1, 2, 3)]
        ),
        "samples": Field(1, same(1, 4, 9, 256**2), [0, -1, 2, 3, 257**2, 1.0, True, "4", None]),
        "filter": Field("box", same("box", "tent", "gaussian", "mitchell"), ["Box", "lanczos", "", None, True]),
        "max_depth": Field(6, same(0, 64), [-1, 65, 1.0, True, "3", None]),
        "min_weight": number(0.0, 0.0, math.nextafter(1, 0), refused=(-TINY, 1.0, BEYOND)),
        "max_rays": Field(16384, same(1, 2**62 - 1), [0, -1, 2**62, 1.5, True, "3", None]),
        "shadows": Field(True, same(True, False), [0, 1, "yes", None]),
        "glass_shadows": Field("opaque", same("opaque", "clear"), ["Clear", "", None, True]),
        "terminator": Field("hard", same("hard", "soft"), ["Hard", "", None, True]),
    },
    Sky: {
        "zenith": colour((0.35, 0.55, 0.9)), "horizon": colour((0.85, 0.9, 0.95)),
        "ground": colour(None)._replace(takes=[*colour(None).takes, (None, None)]),
        "lights": Field(96, same(0, 1, 4096), [-1, 4097, 1.0, True, "3", None]),
        "sun": triple(None, (0, 0, 0))._replace(takes=[*triple(None).takes, (None, None)]),
        "sun_irradiance": colour((1.0, 1.0, 1.0)),
        "sun_angle": number(8.0, 0.0, 45.0, refused=(-TINY, math.nextafter(45, BEYOND), BEYOND)),
        "sun_lights": Field(16, same(1, 4096), [0, 4097, 1.0, True, "3", None]),
    },
    Scene: {
        "camera": Field(NEEDED, [
            (LEAST[PerspectiveCamera], PerspectiveCamera(**LEAST[PerspectiveCamera])),
            ({"type": "orthographic", **LEAST[OrthographicCamera]}, OrthographicCamera(**LEAST[OrthographicCamera])),
        ], [3, None, {}, {"type": "plenoptic", **LEAST[PerspectiveCamera]}, Phong()]),
        "materials": Field(NEEDED, [
            ({}, {}), ({"a": {}}, {"a": Phong()}), ({"a": {"type": "dielectric"}}, {"a": Dielectric()}),
            ({"a": {"type": "mirror"}, "b": Phong()}, {"a": Mirror(), "b": Phong()}),
        ], [3, None, [Phong()], {"a": 3}, {"a": {"type": "gold"}}, {"a": PointLight(position=(0, 1, 0))}]),
        "lights": Field((), [
            ([], ()), ([{"type": "point", "position": (0, 1, 0)}], (PointLight(position=(0, 1, 0)),)),
            ([{"type": "directional", "direction": (1, 0, 0)}], (DirectionalLight(direction=(1, 0, 0)),)),
        ], [3, None, {}, [3], [{"position": (0, 1, 0)}], [{"type": "spot", "position": (0, 1, 0)}], [Phong()]]),
        "objects": Field((), [
            ([], ()), ([{"mesh": BOX, "material": "n"}], (SceneObject(mesh=BOX, material="n"),)),
        ], [3, None, {}, [3], [{"material": "n"}], [{"mesh": BOX, "material": "gold"}]]),
        "floor": Field(None, [
            (None, None), (LEAST[Floor], Floor(**LEAST[Floor])),
        ], [3, [], {}, {**LEAST[Floor], "materials": ["gold"]}]),
        "ambient": colour((0.0, 0.0, 0.0)), "background": colour((0.0, 0.0, 0.0)),
        "sky": Field(None, [(None, None), ({}, Sky()), ({"lights": 3}, Sky(lights=3))], [3, [], {"lights": -1}]),
        "up": Field("y", same("x", "y", "z"), ["w", "Y", "", 1, None, ["y"]]),
        "render": Field(RenderSettings(), [
            ({}, RenderSettings()), ({"samples": 9}, RenderSettings(samples=9)),
        ], [3, None, [], {"samples": 3}]),
    },
}  # fmt: skip


EACH = [(model, name, field) for model, fields in FIELDS.items() for name, field in fields.items()]


def made(model: Any, **changed: Any) -> Any:
    return model(**{**LEAST[model], **changed})


@cases("model", FIELDS)
def test_no_field_is_missing_here(model: Any) -> None:
    assert set(FIELDS[model]) == set(model.model_fields)


@cases(("model", "name", "field"), EACH)
def test_a_field_that_is_left_out_has_its_default_or_is_asked_for(model: Any, name: str, field: Field) -> None:
    given = {key: value for key, value in LEAST[model].items() if key != name}
    if field.default is NEEDED:
        with pytest.raises(SceneError, match=rf"\b{name}: expected a value, got none"):
            model(**given)
    else:
        found = getattr(model(**given), name)
        assert found == field.default and type(found) is type(field.default)


@cases(("model", "name", "field"), EACH)
def test_a_field_takes_values_to_the_ends_of_its_range(model: Any, name: str, field: Field) -> None:
    for given, expected in field.takes:
        found = getattr(made(model, **{name: given}), name)
        assert found == expected and type(found) is type(expected), given


@cases(("model", "name", "field"), EACH)
def test_a_field_refuses_other_values_and_its_error_names_it(model: Any, name: str, field: Field) -> None:
    for given in field.refuses:
        with pytest.raises(SceneError) as caught:
            made(model, **{name: given})
        said = str(caught.value)
        # Where a record is wrong as a whole, the error's words name what is.
        assert said.startswith(f"{model.__name__}: ") and re.search(rf"\b{name}\b", said), (given, said)
        assert "\n" not in said


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\0", b"a = 1\n"])
def test_a_file_of_another_kind_is_named_by_its_suffix(content: bytes, tmp_path: Path) -> None:
    """It was a scene without a camera."""
    (tmp_path / "a.fbx").write_bytes(content)
    with pytest.raises(SceneError, match=r"a\.fbx: expected a scene file \(\.toml\) or a mesh file .*, got '\.fbx'"):
        load_scene(tmp_path / "a.fbx")
