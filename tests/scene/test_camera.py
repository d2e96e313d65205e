"""Cameras: rays worked out by trigonometry, and the kernel's own rays as the depth and face that they see."""

import math
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st

from renderer.materials.phong import Phong
from renderer.mesh.shapes import icosphere, torus
from renderer.octree import Octree
from renderer.picture.pack import pack
from renderer.picture.render import render
from renderer.scene.camera import OrthographicCamera, PerspectiveCamera, primary_rays, sample_offsets
from renderer.scene.scene import Scene, SceneObject

pytestmark = pytest.mark.judges(
    "OrthographicCamera", "OrthographicCamera.frame", "OrthographicCamera.rows", "PerspectiveCamera",
    "PerspectiveCamera.frame", "PerspectiveCamera.rows", "scene.camera.orthographic.eye",
    "scene.camera.orthographic.height", "scene.camera.orthographic.target", "scene.camera.orthographic.up",
    "scene.camera.perspective.eye", "scene.camera.perspective.fov", "scene.camera.perspective.target",
    "scene.camera.perspective.up",
)  # fmt: skip


U = 2.0**-53


def perspective(**changes: Any) -> PerspectiveCamera:
    return PerspectiveCamera(**{"eye": (0, 0, 5), "target": (0, 0, 0), "fov": 90, **changes})


def test_one_pixel_looks_at_the_target() -> None:
    camera = perspective(eye=(1, 2, 3), target=(-2, 1, 5), fov=33)
    origins, directions = primary_rays(camera, 1, 1)
    assert origins.tolist() == [[1, 2, 3]]
    # sqrt(14) and three divisions, and as many roundings of the film's corner and centre.
    np.testing.assert_allclose(directions[0], np.array([-3, -1, 2]) / math.sqrt(14), atol=8 * U)


def test_row_zero_is_the_top_and_column_zero_the_left() -> None:
    _, directions = primary_rays(perspective(), 2, 2)
    top_left, top_right, bottom_left, bottom_right = directions
    # A field of view of 90 degrees spans -1 to 1 at distance 1; pixel centres lie at -1/2 and 1/2.
    for ray, (x, y) in zip(
        (top_left, top_right, bottom_left, bottom_right), ((-1, 1), (1, 1), (-1, -1), (1, -1)), strict=True
    ):
        np.testing.assert_allclose(ray, np.array([x / 2, y / 2, -1]) / math.sqrt(1.5), atol=4 * U)


@pytest.mark.filterwarnings("ignore:.*radians")
@cases("fov", [1.0, 45.0, 90.0, 170.0])
@cases(("width", "height"), [(8, 8), (16, 4), (3, 9)])
def test_fov_is_vertical_whatever_the_aspect(fov: float, width: int, height: int) -> None:
    """Rays through the middle of the film's upper and lower edge enclose the field of view."""
    rows = perspective(fov=fov).rows(width, height)
    top = rows[3] + width / 2 * rows[4]
    bottom = top + height * rows[5]
    left = rows[3] + height / 2 * rows[5]
    right = left + width * rows[4]

    def angle(a: Any, b: Any) -> float:
        return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))

    assert math.degrees(angle(top, bottom)) == pytest.approx(fov, rel=1e-12)  # some ten roundings of tan and atan
    # Pixels are square.
    half = math.tan(math.radians(fov) / 2) * width / height
    assert angle(left, right) == pytest.approx(2 * math.atan(half), rel=1e-12)
    assert np.linalg.norm(rows[4]) == pytest.approx(np.linalg.norm(rows[5]), rel=8 * U)


@given(st.integers(0, 2**32 - 1))
def test_frame_is_orthonormal_right_handed_and_upright(seed: int) -> None:
    eye, target, up = np.random.default_rng(seed).normal(size=(3, 3))
    right, above, forward = perspective(eye=tuple(eye), target=tuple(target), up=tuple(up)).frame()
    # Cross products of nearly parallel vectors lose the digits that their angle is short of one.
    lost = 64 * U / float(np.linalg.norm(np.cross(forward, up / np.linalg.norm(up))))
    gram = np.array([right, above, forward]) @ np.array([right, above, forward]).T
    np.testing.assert_allclose(gram, np.eye(3), atol=lost)
    np.testing.assert_allclose(np.cross(forward, right), -above, atol=lost)
    assert above @ up > 0 and forward @ (target - eye) > 0


@cases("scale", [1e-300, 1e-160, 1e-6, 1e6, 1e160, 1e300])
def test_frame_does_not_depend_on_the_distance(scale: float) -> None:
    """Squares of such numbers overflow and vanish; the directions they stand for do neither."""
    camera = perspective(eye=(0, 0, 0), target=(0, 0, -scale), up=(0, 1 / scale, 0))
    assert np.array(camera.frame()).tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, -1]]


@cases("fault", [{"target": (0, 0, 5)}, {"up": (0, 0, 1)}, {"up": (0, 0, -2)}, {"up": (0, 0, 0)}])
def test_refuses_a_camera_without_a_view(fault: dict[str, Any]) -> None:
    for kind, lens in ((PerspectiveCamera, {}), (OrthographicCamera, {"height": 2.0})):
        with pytest.raises(ValueError, match=r"target != eye|up not parallel"):
            kind(**{"eye": (0, 0, 5), "target": (0, 0, 0), **lens, **fault})


def test_orthographic_rays_are_parallel_and_a_pixel_apart() -> None:
    camera = OrthographicCamera(type="orthographic", eye=(0, 0, 5), target=(0, 0, 0), height=2.0)
    origins, directions = primary_rays(camera, 4, 2)
    assert directions.tolist() == [[0, 0, -1]] * 8
    # Two rows over a film of height 2, as wide as its pixels are square.
    assert origins.tolist() == [[x, y, 5] for y in (0.5, -0.5) for x in (-1.5, -0.5, 0.5, 1.5)]


def test_offset_moves_right_and_down() -> None:
    camera = OrthographicCamera(type="orthographic", eye=(0, 0, 5), target=(0, 0, 0), height=1.0)
    assert primary_rays(camera, 1, 1, (0.25, 0.125))[0].tolist() == [[-0.25, 0.375, 5]]


def test_sample_offsets() -> None:
    assert sample_offsets(1).tolist() == [[0.5, 0.5]]
    assert sample_offsets(4).tolist() == [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]
    np.testing.assert_allclose(sample_offsets(9).mean(axis=0), 0.5, atol=4 * U)
    assert len({tuple(p) for p in sample_offsets(64).tolist()}) == 64


@cases("samples", [0, 2, 3, 5, 8])
def test_samples_must_be_square(samples: int) -> None:
    with pytest.raises(ValueError, match=f"samples: expected a square number.*got {samples}"):
        sample_offsets(samples)


@pytest.mark.parametrize(
    "camera",
    [
        perspective(eye=(1.1, 2.3, 3.7), target=(0.1, 0.2, 0), fov=40),
        perspective(eye=(0.2, -0.1, 0.3), target=(3, 1, 0.4), fov=120, up=(0.3, 1, 0.2)),
        OrthographicCamera(type="orthographic", eye=(1.1, 2.3, 3.7), target=(0, 0, 0), height=3.0),
    ],
)
def test_the_kernel_traces_the_same_primary_rays(camera: Any) -> None:
    objects = (
        SceneObject(mesh=icosphere(3), material="m", scale=0.6, translate=(0.3, 0, 0)),
        SceneObject(mesh=torus(1.4, 0.3), material="m", rotate=(20, 0, 30)),
    )
    scene = Scene(camera=camera, materials={"m": Phong()}, objects=objects)
    image = render(scene, resolution=(23, 17), threads=1, max_depth=0)
    hits = Octree.from_mesh(pack(scene)[0], threads=1).closest_hit(*primary_rays(camera, 23, 17))
    assert 0.2 < hits.hit.mean() < 1.0 or camera.eye[0] == 0.2
    # The two sums are ordered differently, so a ray may turn by a few u; only at an edge can that change the face.
    same = image.face.ravel() == hits.face
    assert same.mean() > 0.99
    slope = np.abs(np.einsum("ij,ij->i", hits.normals, primary_rays(camera, 23, 17)[1]))
    seen = same & hits.hit
    error = np.abs(image.depth.ravel()[seen] - hits.t[seen]) * slope[seen]
    assert error.max() <= 64 * U * 8  # coordinates of at most 8
