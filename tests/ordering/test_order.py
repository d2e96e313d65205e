"""Answers do not depend on how many points are asked together: few are asked as they come, more in a grid's order."""

import numpy as np
import pytest

from renderer import Octree
from renderer.mesh.shapes import icosphere
from renderer.ordering import cells as order


@pytest.mark.parametrize("query", ["contains", "closest_point", "winding_number"])
def test_the_first_points_have_the_answers_that_they_have_among_all(query: str) -> None:
    octree = Octree.from_mesh(icosphere(2))
    points = np.random.default_rng(32).uniform(-1.2, 1.2, (400, 3))

    def answers(some: np.ndarray) -> np.ndarray:
        found = getattr(octree, query)(some)
        return found.distance if query == "closest_point" else found

    whole = answers(points)
    assert len(np.unique(whole)) > 1
    for count in (0, 1, order._FEW - 1, order._FEW, order._FEW + 1, 100):
        np.testing.assert_array_equal(answers(points[:count]), whole[:count])
