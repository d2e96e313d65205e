"""Corners joined and faces left out on request, and meshes that have no inside because their faces cancel."""

from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer import Mesh, Octree
from renderer.mesh.shapes import box, icosphere

BALL = icosphere(2)
TURNED = Mesh(box().vertices, box().faces[:, ::-1])


def apart(mesh: Mesh, noise: float = 0.0) -> Mesh:
    """The faces without shared vertices, each corner up to ``noise`` off on each axis."""
    corners = mesh.triangles.reshape(-1, 3)
    moved = corners + np.random.default_rng(4).uniform(-noise, noise, corners.shape)
    return Mesh(moved, np.arange(len(corners)).reshape(-1, 3), colors=np.abs(corners).clip(0, 1))


@pytest.mark.judges("Mesh.welded")
@pytest.mark.parametrize("noise", [0.0, 1e-7])
def test_corners_at_one_place_are_joined(noise: float) -> None:
    loose = apart(BALL, noise)
    mesh, left_out = loose.welded(4e-7 if noise else 0)
    assert len(mesh.vertices) == len(BALL.vertices) and left_out == len(loose.vertices) - len(BALL.vertices)
    assert mesh.is_closed() and loose.welded()[0].is_closed() == (noise == 0.0)
    assert np.abs(mesh.triangles - loose.triangles).max() <= 2 * noise
    assert mesh.colors is not None and np.abs(mesh.colors - np.abs(mesh.vertices).clip(0, 1)).max() < 1e-6


@pytest.mark.judges("Mesh.welded")
@settings(max_examples=100)
@given(
    st.integers(1, 40), st.integers(0, 10**6), st.sampled_from([1e-30, 0.05, 0.2, 1.0]), st.sampled_from([-700, 0, 900])
)
def test_points_are_joined_as_chains_of_close_pairs(count: int, seed: int, reach: float, power: int) -> None:
    """As a search over all pairs joins them; a mesh of any size alike, though squares of lengths are no float64."""
    points = np.random.default_rng(seed).random((count, 3))
    number = np.arange(count)
    close = np.linalg.norm(points[:, None] - points[None], axis=2) <= reach
    for _ in range(count):
        number = np.array([number[row].min() for row in close])
    scaled = np.ldexp(points, power)
    mesh, left_out = Mesh(scaled, np.zeros((0, 3), int)).welded(float(np.ldexp(reach, power)))
    assert mesh.vertices.tolist() == scaled[np.unique(number)].tolist() and left_out == count - len(mesh.vertices)


@pytest.mark.judges("Mesh.welded")
def test_minus_zero_is_the_place_of_zero_and_parts_stay() -> None:
    two = Mesh.concatenate(Mesh([[0, 0, -0.0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], name="a"),
                           Mesh([[0, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2]], name="b"))  # fmt: skip
    mesh, left_out = two.welded()
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]] and left_out == 2
    assert [(part.name, part.faces) for part in mesh.parts] == [("a", slice(0, 1)), ("b", slice(1, 2))]


@pytest.mark.judges("Mesh.welded")
@cases("tolerance", [-1.0, np.inf, np.nan, "1", True, None])
def test_a_tolerance_that_is_none_is_refused(tolerance: Any) -> None:
    with pytest.raises(ValueError, match="tolerance: expected"):
        box().welded(tolerance)


@pytest.mark.judges("Mesh.without_duplicates")
@pytest.mark.parametrize("turn", [[0, 1, 2], [1, 2, 0], [2, 1, 0], [0, 2, 1]])
@pytest.mark.parametrize("shared", [True, False])
def test_the_first_of_faces_with_the_same_corners_stays(turn: list[int], shared: bool) -> None:
    again = Mesh(BALL.vertices, BALL.faces[::-1, turn])
    twice = Mesh.concatenate(BALL, again)
    if shared:
        twice = Mesh(BALL.vertices, np.concatenate([BALL.faces, again.faces]))
    mesh, left_out = twice.without_duplicates()
    assert left_out == len(BALL.faces) and mesh.triangles.tolist() == BALL.triangles.tolist()
    assert BALL.without_duplicates()[1] == 0


@pytest.mark.judges("Mesh.without_duplicates")
def test_parts_lose_their_own_faces() -> None:
    faces = [[0, 1, 2], [0, 1, 3]]
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    two = Mesh.concatenate(Mesh(points, faces, name="a"), Mesh(points, [faces[1][::-1], [1, 2, 3]], name="b"))
    mesh, left_out = two.without_duplicates()
    assert left_out == 1
    assert [(part.name, part.faces) for part in mesh.parts] == [("a", slice(0, 2)), ("b", slice(2, 3))]


@pytest.mark.judges("Octree.contains")
def test_faces_that_cancel_bound_nothing_and_it_is_said() -> None:
    """A box whose faces are there twice, turned, had no point inside, in silence."""
    both = Octree(Mesh.concatenate(box(), TURNED))
    message = r"Mesh\.without_duplicates\(\) mends it, got 24 faces, each as often one way round as the other"
    with pytest.raises(ValueError, match=message):
        both.contains([0.5, 0.5, 0.5])
    assert not both.contains([0.5, 0.5, 0.5], rule="even-odd")
    needle = Mesh(both.mesh.vertices, np.vstack([both.mesh.faces, [[0, 0, 1]]]))  # which bounds nothing
    with pytest.raises(ValueError, match=r"Mesh\.without_duplicates\(\)"):
        Octree(needle).contains([0.5, 0.5, 0.5])
    # A body beside them has an inside, as has one that is there twice the same way round.
    beside = Mesh.concatenate(box(), TURNED, box((3, 0, 0), (4, 1, 1)))
    assert Octree(beside).contains([[3.5, 0.5, 0.5], [0.5, 0.5, 0.5]]).tolist() == [True, False]
    assert Octree(Mesh.concatenate(box(), box())).contains([0.5, 0.5, 0.5])


@pytest.mark.judges("Octree.contains")
def test_a_mesh_that_is_turned_inside_out_is_said() -> None:
    with pytest.warns(UserWarning, match="the mesh is turned inside out") as said:
        assert not Octree(TURNED).contains([0.5, 0.5, 0.5], winding=True)
    assert said[0].filename == __file__
    assert Octree(box()).contains([0.5, 0.5, 0.5], winding=True)
