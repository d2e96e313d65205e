"""The camera that a study's picture has by default: all of the mesh is seen, and fills the picture."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer import Mesh, PerspectiveCamera
from renderer.arguments.up import turn_to
from renderer.mesh.shapes import box
from renderer.scene.overview import from_above

FAR = [(0.0, 0.0, 0.0), (691_000.0, 5_335_000.0, 519.0)]


def places(camera: PerspectiveCamera, vertices: np.ndarray, resolution: tuple[int, int]) -> np.ndarray:
    """Where vertices are in the picture, from -1 to 1 in both axes."""
    towards = np.array(camera.eye) - camera.target
    towards /= np.linalg.norm(towards)
    right = np.cross(camera.up, towards)
    right /= np.linalg.norm(right)
    seen = vertices - np.array(camera.eye)
    tall = np.tan(np.radians(camera.fov) / 2)
    sides = np.stack([seen @ right / (tall * resolution[0] / resolution[1]), seen @ np.cross(towards, right) / tall], 1)
    assert (seen @ towards < 0).all()
    return sides / -(seen @ towards)[:, None]


@pytest.mark.parametrize("moved", FAR)
@pytest.mark.parametrize("resolution", [(960, 720), (200, 600)])
@given(seed=st.integers(0, 2**32 - 1))
def test_all_vertices_are_in_the_picture_and_reach_two_of_its_sides(
    moved: tuple[float, float, float], resolution: tuple[int, int], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.uniform(-1, 1, (9, 3)) * rng.uniform(0.1, 500, 3) + moved
    mesh = Mesh(vertices, [[0, 1, 2]])
    found = places(from_above(mesh, resolution), vertices, resolution)
    # A margin of 2 %, and what rounding of the coordinates does: 1e-9 m over a decimetre.
    edge = 1 / 1.02
    assert np.abs(found).max() == pytest.approx(edge, abs=1e-6)
    ends = np.stack([found.min(axis=0), found.max(axis=0)])
    full = np.abs(np.abs(ends) - edge).max(axis=0)
    assert full.min() < 1e-6 or np.abs(ends.sum(axis=0)).min() < 1e-6


@pytest.mark.parametrize(("up", "axis"), [("x", 0), ("y", 1), ("z", 2)])
def test_a_mesh_that_is_turned_to_another_axis_is_seen_from_the_same_side(up: str, axis: int) -> None:
    mesh, size, turn = box((0, 0, 0), (3, 2, 1)), (40, 30), turn_to(up) @ turn_to("z").T
    turned = Mesh(mesh.vertices @ turn.T, mesh.faces)
    found = places(from_above(turned, size, up), turned.vertices, size)
    np.testing.assert_allclose(found, places(from_above(mesh, size), mesh.vertices, size), rtol=0, atol=1e-12)
    assert from_above(turned, size, up).up == tuple(np.eye(3)[axis])


def test_one_point_is_in_the_middle() -> None:
    mesh = Mesh([[1, 2, 3]], [])
    np.testing.assert_allclose(places(from_above(mesh, (9, 9)), mesh.vertices, (9, 9)), 0, atol=1e-12)
    assert from_above(box(), (9, 9)).up == (0, 0, 1)
