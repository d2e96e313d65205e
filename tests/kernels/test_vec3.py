"""Short vectors of any size keep their direction and length."""

import math

import numpy as np
import pytest
from cases import cases

from renderer.numerics.vec3 import length, normalized


@cases("size", [5e-324, 1e-310, 1e-308, 1e-300, 1e-160, 1.0, 1e160, 1e300])
def test_any_size_has_a_direction_and_a_length(size):
    """1 over a denormal number had made infinities, and NaN of them."""
    for vector in ((0.0, 0.0, size), (size, 0.0, -size)):
        root = math.sqrt(sum(x != 0.0 for x in vector))
        np.testing.assert_allclose(normalized(vector), np.sign(vector) / root, rtol=1e-15)
        assert length(vector) == pytest.approx(size * root, rel=1e-15, abs=5e-324)
    assert normalized((0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0) and length((0.0, 0.0, 0.0)) == 0.0
