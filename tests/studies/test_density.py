"""Points count as dense by the faces where they lie, not by those of the whole mesh."""

import numpy as np
import pytest

from renderer import Octree
from renderer.mesh.shapes import box
from renderer.ordering.morton import order_along_curve
from renderer.studies import density, face_points, occlusion, tregenza
from validation.benchmark.measures.meshes import named


@pytest.fixture(scope="module")
def city():
    octree = Octree.from_mesh(named("city_20000"))
    points, normals, faces = face_points(octree.mesh)
    order = order_along_curve(points)[0]
    return octree, points[order], normals[order], faces[order]


@pytest.mark.parametrize("share", [2, 8, 32])
def test_a_part_along_the_curve_is_as_dense_as_all_and_points_all_over_are_not(city, share):
    octree, points = city[:2]
    size = len(points) // share
    assert density.are_dense(points, octree.mesh)
    dense = [density.are_dense(points[first : first + size], octree.mesh) for first in range(0, share * size, size)]
    # Some parts of 630 points lie in two places, with a box around them that is mostly of others.
    assert all(dense) if size > 2000 else np.mean(dense) > 0.8
    # One of sixteen where they lie is not: 16 faces a point.
    if share > 2:
        assert not density.are_dense(points[:size:16], octree.mesh)
        assert not density.are_dense(points[::16], octree.mesh)


def test_few_points_and_those_of_one_place_are_not_dense(city):
    octree, points = city[:2]
    assert not density.are_dense(points[:1], octree.mesh)
    assert not density.are_dense(np.repeat(points[:1], 500, axis=0), octree.mesh)
    apart = np.array([[-1e308, 0.0, 0.0], [1e308, 0.0, 0.0]] * 200)
    assert not density.are_dense(apart, octree.mesh)
    # Far from all faces: as a sample may have missed some, one that is looked at stands for those.
    assert density.are_dense(points[:500] + 1e6, octree.mesh)
    assert density.are_dense(points[:6], box())


@pytest.mark.parametrize("dense", [False, True])
def test_bits_do_not_depend_on_it(city, dense, monkeypatch):
    octree, points, normals, faces = (value[:700] if isinstance(value, np.ndarray) else value for value in city)
    ways = tregenza().directions
    expected = occlusion(octree, points, normals, ways, leaving=faces, packed=True)
    monkeypatch.setattr("renderer.studies.share.are_dense", lambda points, mesh: dense)
    assert occlusion(octree, points, normals, ways, leaving=faces, packed=True).tobytes() == expected.tobytes()
