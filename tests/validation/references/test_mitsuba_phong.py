"""Whitted's surfaces under Mitsuba's path integrator: their BSDFs by hand, and their pictures by reference B."""

from math import pi
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from renderer.materials.dielectric import Dielectric
from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, torus
from renderer.scene.light import DirectionalLight
from renderer.scene.scene import Scene
from validation.references.mitsuba.path import can_judge, path, random_paths
from validation.references.mitsuba.phong import Glass, PhongMirror
from validation.references.mitsuba.whitted import whitted

# Mitsuba computes in float32 (rounding 6e-8); a radiance is some tens of operations on numbers near 1.
FLOAT32 = 1e-5

SHINY = Phong(diffuse=(0.2, 0.4, 0.6), specular=(0.5, 0.25, 0.0), shininess=20.0, reflectance=(0.3, 0.2, 0.1))


def interaction(wi: tuple[float, float, float]) -> Any:
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(*wi)
    return si


def context(component: int) -> Any:
    result = mi.BSDFContext()
    result.component = component
    return result


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_smooth_component_is_diffuse_and_phong_on_both_sides(side: float) -> None:
    wi, wo = (0.6, 0.0, 0.8 * side), (-0.5, 0.1, np.sqrt(0.74) * side)
    reflected = np.array([0.5, -0.1, np.sqrt(0.74) * side])
    highlight = float(reflected @ wi) ** 20
    expected = (np.array([0.2, 0.4, 0.6]) * abs(wo[2]) + np.array([0.5, 0.25, 0.0]) * highlight) / pi
    bsdf, si = PhongMirror(SHINY), interaction(wi)
    assert highlight > 0.5
    np.testing.assert_allclose(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*wo)), expected, rtol=FLOAT32)
    np.testing.assert_allclose(bsdf.eval(context(0), si, mi.Vector3f(*wo)), expected, rtol=FLOAT32)
    behind = mi.Vector3f(wo[0], wo[1], -wo[2])
    assert max(bsdf.eval(mi.BSDFContext(), si, behind)) == 0.0
    assert max(bsdf.eval(context(1), si, mi.Vector3f(*wo))) == 0.0


def test_glass_draws_one_branch_or_the_one_that_is_asked_for() -> None:
    glass, si = Glass(Dielectric(type="dielectric")), interaction((0.0, 0.0, 1.0))
    drawn = [glass.sample(mi.BSDFContext(), si, u, mi.Point2f(0.5, 0.5))[0].wo.z for u in (0.039, 0.041)]
    assert drawn[0] > 0.0 > drawn[1]  # Fresnel's 4 % are reflected
    for component, share in ((0, 0.04), (1, 0.96)):
        weight = glass.sample(context(component), si, 0.5, mi.Point2f(0.5, 0.5))[1]
        np.testing.assert_allclose(weight, share, rtol=FLOAT32)


def everything_but_glass(**of_tile: Any) -> Scene:
    """Highlights, a surface both diffuse and mirroring, ambient light, two lights, and a plate seen from behind."""
    back = Mesh([[-2.5, 0, -2], [2.5, 0, -2], [2.5, 3, -2], [-2.5, 3, -2]], [[0, 2, 1], [0, 3, 2]])
    return Scene.model_validate(
        {
            "camera": {"eye": (0.0, 3.0, 6.0), "target": (0.0, 0.7, 0.0), "fov": 40.0},
            "materials": {
                "tile": {"diffuse": 0.6, "reflectance": (0.3, 0.2, 0.1)} | of_tile,
                "wall": {"diffuse": (0.2, 0.5, 0.3), "ambient": (0.9, 0.1, 0.4)},
                "shiny": {"diffuse": 0.3, "specular": 0.7, "shininess": 12.0, "reflectance": 0.2},
                "mirror": {"type": "mirror", "reflectance": (0.9, 0.8, 0.7)},
            },
            "floor": {"min": (-5, -5), "max": (5, 5), "materials": ("tile",)},
            "objects": [
                {"mesh": icosphere(2), "material": "shiny", "normals": "smooth", "translate": (-1.3, 1.0, 0.0)},
                {"mesh": torus(), "material": "mirror", "normals": "smooth", "translate": (1.3, 0.5, 0.5)},
                {"mesh": back, "material": "wall"},
            ],
            "lights": [
                {"type": "point", "position": (2.0, 5.0, 3.0), "intensity": (20.0, 18.0, 15.0)},
                {"type": "directional", "direction": (1.0, -2.0, -1.0), "irradiance": 0.5},
            ],
            "ambient": (0.3, 0.2, 0.1),
            "background": (0.2, 0.3, 0.5),
        }
    )


def test_path_and_recursion_agree_on_everything_but_glass() -> None:
    scene = everything_but_glass()
    assert can_judge(scene) is None
    a, b = (picture(scene, 32, 24, max_depth=4) for picture in (path, whitted))
    np.testing.assert_allclose(a, b, rtol=FLOAT32, atol=FLOAT32)
    # What they agree in holds every part of the light.
    for part in ({"diffuse": 0.5}, {"ambient": 0.5}, {"specular": 0.1}, {"reflectance": 0.2}):
        assert np.abs(path(everything_but_glass(**part), 32, 24, max_depth=4) - b).max() > 0.01
    assert np.abs(path(scene, 32, 24, max_depth=1) - b).max() > 0.01


def inside_glass() -> tuple[Scene, Any]:
    """A block of glass under a background of 1, and a ray from inside straight out of it."""
    scene = Scene.model_validate(
        {
            "camera": {"eye": (0.0, 4.0, 3.0), "target": (0.0, 0.0, 0.0)},
            "materials": {"glass": {"type": "dielectric"}},
            "objects": [{"mesh": box((-9.0, 1.0, -9.0), (9.0, 2.0, 9.0)), "material": "glass"}],
            "background": 1.0,
        }
    )
    return scene, (np.array([[0.0, 1.5, 0.0]]), np.array([[0.0, 1.0, 0.0]]))


def test_radiance_is_not_compressed_inside_glass_and_paths_repeat() -> None:
    scene, ray = inside_glass()
    paths = random_paths(scene, ray, 400, max_depth=1)
    # 1 on the way out, 2.25 or 1 / 2.25 were it compressed; a reflected path ends inside.
    np.testing.assert_allclose(paths, np.round(paths), atol=FLOAT32)
    # 96 % go out: five deviations of a binomial share of 400.
    assert abs(paths.mean() - 0.96) < 5.0 * np.sqrt(0.96 * 0.04 / 400)
    assert np.array_equal(paths[:100], random_paths(scene, ray, 100, max_depth=1))


def test_passes_draw_their_own_branches() -> None:
    scene, ray = inside_glass()
    light = DirectionalLight(direction=(0.0, -1.0, 0.0))  # lights nothing, but its pass comes before the background's
    second = scene.altered(lights=(light,))
    first, other = (random_paths(of, ray, 200, max_depth=1) for of in (scene, second))
    assert not np.array_equal(first, other)


def test_random_paths_refuse_a_constant_transmission() -> None:
    scene, ray = inside_glass()
    odd = scene.model_copy(update={"materials": {"glass": Phong(transmittance=0.5)}})
    with pytest.raises(ValueError, match=r"got materials\.glass: Mitsuba has no surface that transmits"):
        random_paths(odd, ray, 1, max_depth=1)
