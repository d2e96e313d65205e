"""Open3D's queries give the answers of a tetrahedron; they need the extra ``bench``."""

import numpy as np
import pytest

pytest.importorskip("open3d", reason="pip install open3d")

from validation.references.open3d_queries import Open3dQueries

CORNERS = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]]
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def test_a_tetrahedron():
    peer = Open3dQueries(CORNERS, FACES)
    assert peer.contains([[1, 1, 1], [3, 3, 3]]).tolist() == [True, False]
    assert peer.distance([[1, 1, -2], [-3, 1, 1]]).tolist() == [2.0, 3.0]
    assert peer.count_hits(np.array([[0.5, 0.75, -1], [5, 5, -1]]), np.array([[0, 0, 1.0]] * 2)).tolist() == [2, 0]
