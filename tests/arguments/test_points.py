"""Points as queries take them: what is too far away is named by its row."""

import numpy as np
import pytest

from renderer.arguments.points import check_points


def test_a_coordinate_at_the_limit_is_near_enough_and_one_beyond_is_named() -> None:
    rows, shape = check_points("points", [[2.0, -2.0, 0.0]], 2.0)
    assert rows.tolist() == [[2.0, -2.0, 0.0]] and shape == (1,)
    beyond = float(np.nextafter(2.0, 3.0))
    for sign in (1.0, -1.0):
        with pytest.raises(ValueError, match=r"^points: expected finite numbers within 2, got .* in row 1$"):
            check_points("points", [[2.0, -2.0, 0.0], [0.0, sign * beyond, 0.0]], 2.0)
