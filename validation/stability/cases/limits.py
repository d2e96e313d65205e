"""Extreme cases 47 and 48: eyes at and beyond the farthest traced distance, and endlessly branching rays."""

import warnings

import numpy as np

from renderer import CutWarning, Mesh, OrthographicCamera, PerspectiveCamera, Phong, SceneError, render
from renderer.arguments.limits import FARTHEST
from renderer.mesh.shapes import icosphere
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.scenes import close, eye_at, quad, scene_of

_DEPTH, _BUDGET = 16, 5000


def far_pictures() -> list[str]:
    """Failures with eyes at the limit, before a ball on the axis, and just beyond it."""
    wrong = []
    for kind in ("orthographic", "perspective"):
        for distance in (1e30, FARTHEST):
            ball = icosphere(3)
            scene = scene_of(_eye(kind, distance), (ball, Phong(diffuse=0.0, ambient=1.0)))
            ours, brute = (render(scene, resolution=(33, 33), accelerator=a) for a in ("octree", "brute"))
            if not (ours.depth.tobytes() == brute.depth.tobytes() and ours.face[16, 16] >= 0):
                wrong.append(f"{kind} from {distance:.3g}")
        try:
            _eye(kind, FARTHEST * (1 + 2.0**-52))
            wrong.append(f"{kind} beyond the limit taken")
        except SceneError as error:
            if "eye" not in str(error):
                wrong.append(f"{kind}: {error}")
    return wrong


def _eye(kind: str, distance: float) -> OrthographicCamera | PerspectiveCamera:
    if kind == "orthographic":
        return OrthographicCamera(eye=(0.0, 0.0, distance), target=(0.0, 0.0, 0.0), height=3.0)
    return PerspectiveCamera(eye=(0.0, 0.0, distance), target=(0.0, 0.0, 0.0), fov=1e-9)


def _far_eyes(quick: bool) -> Outcome:
    wrong = far_pictures()
    return Outcome(", ".join(wrong) or "as brute force; refused beyond", not wrong)


def branching(depth: int, budget: int) -> tuple[int, float]:
    """Rays and radiance of one pixel where each ray spawns two of half its weight, counted one by one."""
    rays, value, waiting = 0, 0.0, [(0, 1.0)]
    while waiting:
        bounces, weight = waiting.pop()
        rays, value = rays + 1, value + weight
        if bounces < depth and rays < budget:
            waiting += [(bounces + 1, weight / 2)] * 2
    return rays, value


def _budget(quick: bool) -> Outcome:
    panes = [quad((0.3, 0.1, z), (5, 0, 0), (0, 5, 0)) for z in range(-20, 20)]
    material = Phong(diffuse=0.0, ambient=1.0, reflectance=0.5, transmittance=0.5, ior=1.0)
    scene = scene_of(eye_at((0, 0, 0.5), (0, 0, 2)), (Mesh.concatenate(panes), material))
    told, holds = [], True
    for budget in (_BUDGET, 2 ** (_DEPTH + 1)):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            images = [render(scene, resolution=(1, 1), max_depth=_DEPTH, max_rays=budget, threads=t) for t in (1, 2)]
        rays, value = int(images[0].rays[0, 0]), float(images[0].radiance[0, 0, 0])
        expected, radiance = branching(_DEPTH, budget)
        cut = expected < 2 ** (_DEPTH + 1) - 1
        warned = [one.category is CutWarning for one in said]
        same = np.array_equal(images[0].radiance, images[1].radiance)
        holds &= rays == expected and close(value, radiance) and same and warned == [True] * (2 * cut)
        told.append(f"{rays} rays, {value:.6g} L, {images[0].cut} cut")
    return Outcome("; ".join(told), holds)


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        47,
        "eyes 1e30 and 2^126 from a ball, orthographic and perspective, and an ulp beyond",
        "as brute force; beyond, an error that names the eye",
        ("brute force", "rule"),
        "none: bit for bit",
        _far_eyes,
    ),
    ExtremeCase(
        48,
        f"k_r = k_t = .5 between 40 panes, depth {_DEPTH}, max_rays {_BUDGET} and enough",
        "rays and radiance as counted one by one; a warning of what was cut, and none where nothing was",
        ("closed form", "rule"),
        "rays: none; radiance as stored in float32",
        _budget,
    ),
)
