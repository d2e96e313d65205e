"""Meshes cut off at a plane: what is left, and that the two halves are the whole."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer import Mesh, Octree
from renderer.mesh.cutting import cut
from renderer.mesh.shapes import box, icosphere


def area(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


def test_a_box_is_cut_to_a_smaller_one_without_its_lid() -> None:
    left = cut(box((0, 0, 0), (4, 2, 1)), 0, 1.0, below=True)
    assert left.bounds[0].tolist() == [0, 0, 0] and left.bounds[1].tolist() == [1, 2, 1]
    assert area(left) == 2 * (2 + 1) + 2
    right = cut(box((0, 0, 0), (4, 2, 1)), 0, 1.0, below=False)
    assert right.bounds[0].tolist() == [1, 0, 0] and area(right) == 2 * (6 + 3) + 2


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2), st.integers(-9, 9), st.integers(0, 10**6))
def test_the_halves_are_the_whole_and_close_each_other(axis: int, step: int, seed: int) -> None:
    """Also where corners lie on the plane; each half has its edge there and nothing beyond."""
    points = np.random.default_rng(seed).integers(-8, 9, (30, 3)) / 8.0
    soup = Mesh(points, np.arange(30).reshape(-1, 3))
    for mesh in (icosphere(2), soup, box((-1, -1, -1), (1, 1, 1))):
        at = step / 8.0
        halves = [cut(mesh, axis, at, below) for below in (True, False)]
        assert halves[0].vertices[:, axis].max(initial=at) <= at <= halves[1].vertices[:, axis].min(initial=at)
        flat = (mesh.triangles[:, :, axis] == at).all(axis=1)  # which both have
        once = area(mesh) + area(Mesh(mesh.vertices, mesh.faces[flat]))
        assert area(halves[0]) + area(halves[1]) == pytest.approx(once, rel=1e-12)
        if mesh is not soup and not flat.any():
            assert len(Mesh.concatenate(halves).open_edges) == 0
            for half in halves:  # faces share their new corners, and none is without area
                assert len(np.unique(half.vertices, axis=0)) == len(half.vertices)
                assert (half.face_normals() != 0).any(axis=1).all()


def test_what_vertices_carry_is_interpolated_and_parts_stay() -> None:
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
    one = Mesh(corners, [[0, 1, 2]], colors=corners / 4, texcoords=corners[:, :2], normals=corners + 1, name="one")
    both = Mesh.concatenate(one, one.transformed(np.diag([1, 1, 1, 1]) + np.eye(4, k=3) * 2))
    left = cut(both, 0, 1.0, below=True)
    assert [part.faces for part in left.parts] == [slice(0, 2), slice(2, 2)]
    assert left.colors is not None and left.texcoords is not None
    np.testing.assert_allclose(left.colors * 4, left.vertices, atol=1e-6)
    assert left.texcoords.tolist() == left.vertices[:, :2].tolist()


def test_rays_see_the_half_alone() -> None:
    half = Octree(cut(icosphere(3), 2, 0.0, below=True))
    hits = half.closest_hit([[0, 0, 5.0], [2, 0, 0.1]], [[0, 0, -1.0], [-1, 0, 0]])
    assert hits.t[0] > 5.9 and not hits.hit[1]
