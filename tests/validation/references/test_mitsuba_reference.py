"""The two picture references against values that follow from the shading model by hand."""

from typing import Any

import numpy as np
import pytest
from cases import cases
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, torus
from renderer.scene.camera import primary_rays
from renderer.scene.scene import Scene
from validation.references.mitsuba.path import can_judge, path
from validation.references.mitsuba.scene import Rays
from validation.references.mitsuba.whitted import aovs, whitted

# Mitsuba computes in float32 (rounding 6e-8); a radiance is some tens of operations on numbers near 1.
FLOAT32 = 1e-5

CAMERA = {"eye": (0.0, 4.0, 3.0), "target": (0.0, 0.0, 0.0)}
GREY = {"diffuse": 0.5}
FLOOR = {"min": (-50.0, -50.0), "max": (50.0, 50.0), "materials": ("grey",)}
DOWN = {"type": "directional", "direction": (0.0, -1.0, 0.0)}


def scene(**tables: Any) -> Scene:
    """A scene with a camera and a grey material, which the tables may replace."""
    materials = {"grey": GREY} | tables.pop("materials", {})
    return Scene.model_validate({"camera": CAMERA, "materials": materials} | tables)


def one_ray(origin: tuple[float, ...], direction: tuple[float, ...]) -> Rays:
    unit = np.array([direction], dtype=np.float64)
    return np.array([origin], dtype=np.float64), unit / np.linalg.norm(unit)


def radiance(
    of: Scene, origin: tuple[float, ...], direction: tuple[float, ...], max_depth: int = 6
) -> NDArray[np.float64]:
    """Reference B along one ray, (3,)."""
    return whitted(of, 1, 1, max_depth=max_depth, rays=one_ray(origin, direction))[0, 0]


def floor_points(of: Scene, width: int, height: int) -> NDArray[np.float64]:
    """Where the primary rays meet the plane y = 0, (height, width, 3)."""
    origins, directions = primary_rays(of.camera, width, height)
    points = origins - directions * (origins[:, 1:2] / directions[:, 1:2])
    return points.reshape(height, width, 3)


def plate(x: float, normal: float) -> Mesh:
    """A large square in the plane x = const whose face normal is (normal, 0, 0)."""
    corners = [[x, -9.0, -9.0], [x, 9.0, -9.0], [x, 9.0, 9.0], [x, -9.0, 9.0]]
    return Mesh(corners, [[0, 1, 2], [0, 2, 3]] if normal > 0 else [[0, 2, 1], [0, 3, 2]], name="plate")


# Lights and the Phong model


@cases("picture", [whitted, path])
@cases("angle", [0.0, 30.0, 80.0])
def test_directional_light_falls_with_the_cosine(picture: Any, angle: float) -> None:
    direction = (np.sin(np.radians(angle)), -np.cos(np.radians(angle)), 0.0)
    light = {"type": "directional", "direction": direction, "irradiance": (1.0, 2.0, 3.0)}
    image = picture(scene(floor=FLOOR, lights=[light]), 3, 2, max_depth=0)
    expected = 0.5 * np.cos(np.radians(angle)) * np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), rtol=FLOAT32)


@pytest.mark.parametrize("picture", [whitted, path])
def test_point_light_falls_with_the_square_of_the_distance(picture: Any) -> None:
    position = np.array([1.0, 2.0, 0.5])
    lit = scene(floor=FLOOR, lights=[{"type": "point", "position": tuple(position), "intensity": 7.0}])
    towards = position - floor_points(lit, 8, 6)
    distance = np.linalg.norm(towards, axis=-1)
    expected = 0.5 * 7.0 * towards[..., 1] / distance**3
    image = picture(lit, 8, 6, max_depth=0)
    np.testing.assert_allclose(image, np.repeat(expected[..., None], 3, axis=-1), rtol=FLOAT32)


@cases("shininess", [0.0, 1.0, 20.0, 500.0])
def test_phong_highlight(shininess: float) -> None:
    shiny = {"diffuse": 0.25, "specular": (0.5, 0.25, 0.0), "shininess": shininess}
    slanting = np.array([0.0, -4.0, 3.0]) / 5.0  # reflected near the eye
    lit = scene(
        floor=FLOOR,
        materials={"grey": shiny},
        lights=[{"type": "directional", "direction": tuple(slanting), "irradiance": 2.0}],
    )
    to_eye = np.asarray(CAMERA["eye"]) - floor_points(lit, 16, 12)
    to_eye /= np.linalg.norm(to_eye, axis=-1, keepdims=True)
    reflected = slanting * np.array([1.0, -1.0, 1.0])
    highlight = np.maximum(to_eye @ reflected, 0.0) ** shininess
    expected = 2.0 * (0.25 * 0.8 + highlight[..., None] * np.array([0.5, 0.25, 0.0]))
    assert shininess == 0.0 or np.ptp(highlight) > 0.1
    # The exponent multiplies the rounding of R.V.
    tolerance = FLOAT32 + 6e-7 * shininess
    np.testing.assert_allclose(whitted(lit, 16, 12, max_depth=0), expected, rtol=tolerance)


def test_highlight_is_only_where_the_light_is_in_front_and_reflected_to_the_eye() -> None:
    shiny = {"diffuse": 0.0, "specular": 1.0, "shininess": 0.0}
    below = {"type": "directional", "direction": (-1.0, 0.1, 0.0)}  # its R lies under the floor, with R.V > 0
    grazing_away = {"type": "directional", "direction": (-1.0, -0.1, 0.0)}
    seen_from_the_left = ((-5.0, 0.5, 0.0), (5.0, -0.5, 0.0))
    with_both = scene(floor=FLOOR, materials={"grey": shiny}, lights=[below])
    assert radiance(with_both, *seen_from_the_left).tolist() == [0.0, 0.0, 0.0]
    towards_eye = scene(floor=FLOOR, materials={"grey": shiny}, lights=[grazing_away])
    np.testing.assert_allclose(radiance(towards_eye, *seen_from_the_left), 1.0, rtol=FLOAT32)
    assert radiance(towards_eye, (5.0, 0.5, 0.0), (-5.0, -0.5, 0.0)).tolist() == [0.0, 0.0, 0.0]


def test_ambient_light_and_both_sides_of_a_surface() -> None:
    material = {"diffuse": 0.5, "ambient": (0.1, 0.2, 0.4)}
    for normal in (1.0, -1.0):
        lit = scene(
            materials={"grey": material},
            ambient=(1.0, 0.5, 2.0),
            objects=[{"mesh": plate(0.0, normal), "material": "grey"}],
            lights=[{"type": "directional", "direction": (-1.0, 0.0, 0.0)}],
        )
        expected = np.array([0.1, 0.1, 0.8])
        np.testing.assert_allclose(radiance(lit, (5, 0, 0), (-1, 0, 0)), expected + 0.5, rtol=FLOAT32)
        np.testing.assert_allclose(radiance(lit, (-5, 0, 0), (1, 0, 0)), expected, rtol=FLOAT32)


# Shadows


@cases("occluder", ["grey", "glass"])
@cases("light", [DOWN, {"type": "point", "position": (0.0, 5.0, 0.0), "intensity": 25.0}])
def test_whatever_stands_before_a_light_throws_a_shadow(occluder: str, light: dict[str, Any]) -> None:
    lit = scene(
        floor=FLOOR,
        materials={"glass": {"type": "dielectric"}},
        objects=[{"mesh": box((-1.0, 2.0, -1.0), (1.0, 3.0, 1.0)), "material": occluder}],
        lights=[light],
    )
    assert radiance(lit, (0.9, 1.0, 0.9), (0.0, -1.0, 0.0)).tolist() == [0.0, 0.0, 0.0]
    assert radiance(lit, (3.0, 1.0, 0.0), (0.0, -1.0, 0.0)).min() > 0.2


# Reflection


@pytest.mark.parametrize(("reflectance", "expected"), [(0.9, 9.98939), (1.0, 65.0)])
def test_facing_mirrors(reflectance: float, expected: float) -> None:
    """Each gives light of its own (L = 1) and reflects: the sum of k_r^i for i = 0 ... 64 bounces."""
    glowing = {"diffuse": 0.0, "ambient": 1.0, "reflectance": reflectance}
    facing = scene(
        materials={"grey": glowing},
        ambient=1.0,
        objects=[
            {"mesh": plate(-2.0, 1.0), "material": "grey"},
            {"mesh": plate(2.0, -1.0), "material": "grey"},
        ],
    )
    np.testing.assert_allclose(radiance(facing, (0, 0, 0), (1, 0, 0), max_depth=64), expected, rtol=FLOAT32)


# Refraction


def glass_plate(material: dict[str, Any], **tables: Any) -> Scene:
    """A plate of thickness 1 between y = 1 and y = 2 under a background of 1."""
    slab = {"mesh": box((-40.0, 1.0, -40.0), (40.0, 2.0, 40.0)), "material": "glass"}
    return scene(materials={"glass": material}, objects=[slab], background=1.0, **tables)


@cases("depth", range(1, 7))
def test_dielectric_plate_at_normal_incidence(depth: int) -> None:
    """F, then (1-F)^2 F^j for j = 0 ... depth - 2 inner reflections; tints multiply at each event."""
    glass = {
        "type": "dielectric",
        "ior": 1.5,
        "transmittance": (1.0, 0.5, 0.0),
        "reflectance": (1.0, 0.5, 1.0),
    }
    fresnel = 0.04
    expected = [
        r * fresnel + sum((t * (1 - fresnel)) ** 2 * (r * fresnel) ** j for j in range(depth - 1))
        for t, r in zip(glass["transmittance"], glass["reflectance"], strict=True)
    ]
    got = radiance(glass_plate(glass), (0.1, 5.0, 0.2), (0.0, -1.0, 0.0), depth)
    np.testing.assert_allclose(got, expected, rtol=FLOAT32)


def seen_through_the_plate(ior: float, border: float, kind: str) -> NDArray[np.float64]:
    """What a ray at 60 degrees sees on a floor that is dark before x = ``border`` and bright after it."""
    clear = {"type": kind, "ior": ior, "transmittance": 1.0} | ({"diffuse": 0.0} if kind == "phong" else {})
    dark = {"mesh": Mesh([[-90, 0, -9], [border, 0, 9], [border, 0, -9]], [[0, 1, 2]]), "material": "dark"}
    bright = {"mesh": Mesh([[border, 0, -9], [border, 0, 9], [90, 0, 0]], [[0, 1, 2]]), "material": "bright"}
    slab = {"mesh": box((-40.0, 1.0, -40.0), (40.0, 2.0, 40.0)), "material": "glass"}
    materials = {
        "glass": clear,
        "dark": {"diffuse": 0.0, "ambient": (0.0, 1.0, 0.0)},
        "bright": {"diffuse": 0.0, "ambient": (1.0, 0.0, 0.0)},
    }
    through = scene(materials=materials, objects=[dark, bright, slab], ambient=1.0)
    return radiance(through, (0.0, 3.0, 0.0), (np.sqrt(3.0), -1.0, 0.0), 2)


@pytest.mark.parametrize("kind", ["dielectric", "phong"])
def test_plate_shifts_a_slanting_ray_by_snells_law(kind: str) -> None:
    """60 degrees through 1 of glass: shifted by .51247 across the ray, twice that on the floor."""
    meets = 3.0 * np.sqrt(3.0) - 2.0 * 0.51247
    # Mitsuba lifts a spawned ray off the surface by (1 + max|p|) 8.94e-5 < 5e-4; at 60 degrees, twice, that
    # is 1.7e-3 of floor.
    near = 2e-3
    before, after = (seen_through_the_plate(1.5, meets + d, kind) for d in (-near, near))
    assert before[0] > 0.8 and before[1] == 0.0
    assert after[1] > 0.8 and after[0] == 0.0
    # Another index, or the inverse one, sees the same side twice.
    for wrong in (1.49, 1.51, 1.0 / 1.5):
        sides = [seen_through_the_plate(wrong, meets + d, kind) for d in (-near, near)]
        assert sides[0].argmax() == sides[1].argmax() or max(sides[0].max(), sides[1].max()) < 0.8


@pytest.mark.parametrize(
    "material",
    [
        {"type": "dielectric", "ior": 1.5, "reflectance": 0.0},
        {"type": "phong", "diffuse": 0.0, "transmittance": 1.0, "ior": 1.5},
    ],
)
def test_critical_angle(material: dict[str, Any]) -> None:
    plate_of = glass_plate(material)
    critical = np.degrees(np.arcsin(1.0 / 1.5))

    def outwards(degrees: float, of: Scene) -> float:
        direction = (np.sin(np.radians(degrees)), np.cos(np.radians(degrees)), 0.0)
        return float(radiance(of, (0.0, 1.5, 0.0), direction, 1)[0])

    assert outwards(critical - 0.01, plate_of) > 0.05
    assert outwards(critical + 0.01, plate_of) == 0.0
    # An index of 1.501 is critical .03 degrees earlier; an inverted one lets everything out.
    assert outwards(critical - 0.01, glass_plate(material | {"ior": 1.501})) == 0.0
    assert outwards(critical + 0.01, glass_plate(material | {"ior": 1.0 / 1.5})) > 0.05


# Both references, and what the primary rays meet


def diffuse_and_mirror(lights: int = 2) -> Scene:
    shown = [
        {"type": "point", "position": (2.0, 5.0, 3.0), "intensity": (20.0, 18.0, 15.0)},
        {"type": "directional", "direction": (1.0, -2.0, -1.0), "irradiance": 0.5},
    ]
    return Scene.model_validate(
        {
            "camera": {"eye": (0.0, 3.0, 6.0), "target": (0.0, 0.7, 0.0), "fov": 40.0},
            "materials": {
                "light": {"diffuse": 0.8},
                "dark": {"diffuse": (0.2, 0.1, 0.3)},
                "mirror": {"type": "mirror", "reflectance": (0.9, 0.8, 0.7)},
                "dull mirror": {"type": "phong", "diffuse": 0.0, "reflectance": 0.5},
            },
            "floor": {"min": (-5, -5), "max": (5, 5), "materials": ("light", "dark"), "squares": (6, 6)},
            "objects": [
                {
                    "mesh": icosphere(2),
                    "material": "dark",
                    "normals": "smooth",
                    "translate": (-1.3, 1.0, 0.0),
                },
                {"mesh": torus(), "material": "mirror", "normals": "smooth", "translate": (1.3, 0.5, 0.5)},
                {"mesh": icosphere(1), "material": "dull mirror", "scale": 0.4, "translate": (0.2, 0.4, 1.5)},
            ],
            "lights": shown[:lights],
            "background": (0.2, 0.3, 0.5),
        }
    )


def test_the_references_agree_where_both_can_judge() -> None:
    both = diffuse_and_mirror()
    assert can_judge(both) is None
    a, b = (picture(both, 32, 24, max_depth=4) for picture in (path, whitted))
    # No pixel may fall to another surface.
    np.testing.assert_allclose(a, b, rtol=FLOAT32, atol=FLOAT32)
    assert np.ptp(b) > 0.3
    # What they agree in is not insensitive to a bounce or a light.
    for other in (
        whitted(both, 32, 24, max_depth=1),
        whitted(diffuse_and_mirror(lights=1), 32, 24, max_depth=4),
    ):
        assert np.abs(a - other).max() > 0.05


@pytest.mark.parametrize("picture", [path, whitted])
def test_a_second_run_gives_the_same_bits(picture: Any) -> None:
    first, second = (picture(diffuse_and_mirror(), 16, 12, max_depth=3, samples=4) for _ in range(2))
    assert np.array_equal(first, second)


def test_samples_are_the_mean_over_our_grid() -> None:
    both = diffuse_and_mirror()
    parts = [
        whitted(both, 12, 8, max_depth=2, rays=primary_rays(both.camera, 12, 8, (x, y)))
        for y in (0.25, 0.75)
        for x in (0.25, 0.75)
    ]
    np.testing.assert_allclose(whitted(both, 12, 8, max_depth=2, samples=4), sum(parts) / 4.0, rtol=1e-14)
    assert not np.array_equal(parts[0], parts[1])


@pytest.mark.parametrize(
    ("material", "reason"),
    [
        ({"type": "dielectric"}, "dielectric"),
        ({"diffuse": 0.0, "transmittance": 0.1}, "transmits"),
    ],
)
def test_path_says_what_it_cannot_judge(material: dict[str, Any], reason: str) -> None:
    unjudged = scene(materials={"odd": material}, floor=FLOOR | {"materials": ("odd",)})
    assert reason in (can_judge(unjudged) or "")
    with pytest.raises(ValueError, match=r"materials\.odd: .*" + reason):
        path(unjudged, 2, 2, max_depth=1)
    assert can_judge(scene(materials={"odd": material}, floor=FLOOR)) is None


def test_aovs_of_a_sphere_on_a_floor() -> None:
    objects = [
        {"mesh": icosphere(3), "material": "grey", "normals": "smooth", "translate": (-1.5, 1.0, 0.0)},
        {"mesh": icosphere(3), "material": "grey", "translate": (1.5, 1.0, 0.0)},
    ]
    camera = {"eye": (0.0, 3.0, 9.0), "target": (0.0, 1.0, 0.0), "fov": 40.0}
    small = {"min": (-3, -3), "max": (3, 3), "materials": ("grey",)}
    met = scene(camera=camera, floor=small, objects=objects)
    got = aovs(met, 40, 30)
    assert set(np.unique(got.instance)) == {-1, 0, 1, 2}
    missed, floor = got.instance == -1, got.instance == 2
    assert np.isinf(got.depth[missed]).all() and np.isnan(got.position[missed]).all()
    assert np.isnan(got.shading_normal[missed]).all() and np.isfinite(got.depth[~missed]).all()
    origins, directions = (a.reshape(30, 40, 3) for a in primary_rays(met.camera, 40, 30))
    reached = origins + got.depth[..., None] * directions
    np.testing.assert_allclose(got.position[~missed], reached[~missed], atol=FLOAT32)
    np.testing.assert_allclose(got.position[floor], floor_points(met, 40, 30)[floor], atol=FLOAT32)
    np.testing.assert_array_equal(got.geometric_normal[floor], [[0.0, 1.0, 0.0]] * floor.sum())
    # Interpolated normals of a sphere point away from its centre, to the square of an edge's angle (0.14
    # rad).
    smooth, flat = got.instance == 0, got.instance == 1
    np.testing.assert_allclose(got.shading_normal[smooth], got.position[smooth] - [-1.5, 1.0, 0.0], atol=0.02)
    assert np.abs(got.shading_normal[smooth] - got.geometric_normal[smooth]).max() > 0.03
    np.testing.assert_allclose(got.shading_normal[flat], got.geometric_normal[flat], atol=FLOAT32)
