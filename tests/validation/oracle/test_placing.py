"""The oracle's placed corners: rounded after each product and sum, with the corners of mirrored faces exchanged."""

from fractions import Fraction

import numpy as np

from validation.oracle.placing import Body, mirrors, placed


def test_each_product_and_sum_is_rounded_by_itself() -> None:
    """A fused product and sum, and sums in another order, give other bits at some of these corners."""
    rng = np.random.default_rng(3)
    corners, matrices = rng.normal(size=(60, 3)) + 1e4, rng.normal(size=(4, 3, 4))
    matrices[:, :, 3] -= 1e4 * matrices[:, :, :3].sum(axis=2)
    vertices, _ = placed([Body(corners, np.array([[0, 1, 2]]), matrices)])

    def product(x: float, a: float) -> float:
        return float(Fraction(x) * Fraction(a))

    def total(x: float, y: float) -> float:
        return float(Fraction(x) + Fraction(y))

    slow = [
        [total(total(total(product(x, a), product(y, b)), product(z, c)), d) for a, b, c, d in matrix.tolist()]
        for matrix in matrices
        for x, y, z in corners.tolist()
    ]
    assert vertices.tolist() == slow
    other = np.concatenate([corners @ matrix[:, :3].T + matrix[:, 3] for matrix in matrices[:, :, [2, 1, 0, 3]]])
    assert (other != vertices).any()


def test_bodies_come_one_after_the_other_and_mirrored_faces_are_turned_round() -> None:
    flip = np.diag([1.0, -1.0, 1.0, 1.0])[:3]
    one = Body(np.eye(3), np.array([[0, 1, 2]]), np.stack([np.eye(4)[:3], flip]))
    vertices, faces = placed([one, one._replace(matrices=flip[None])])
    assert faces.tolist() == [[0, 1, 2], [3, 5, 4], [6, 8, 7]]
    assert vertices.tolist() == [*np.eye(3).tolist(), *2 * np.diag([1.0, -1.0, 1.0]).tolist()]
    assert [array.shape for array in placed([])] == [(0, 3), (0, 3)]


def test_a_determinant_that_float64_rounds_to_0_has_a_sign() -> None:
    thin = np.eye(3, 4)
    thin[0] = 1.0, 1.0, 1.0, 0.0
    thin[1] = 1.0, 1.0 + 2.0**-52, 1.0, 0.0
    thin[2] = 1.0, 1.0, 1.0 - 2.0**-53, 0.0
    assert mirrors(thin) and not mirrors(thin[[1, 0, 2]])
