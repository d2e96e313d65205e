"""Gates: which side of a threshold passes, and that nothing undefined does."""

import math

import pytest
from cases import cases

from validation.gates import Gate


def gate(value: float, bound: str = "at most", threshold: float = 1.0) -> Gate:
    return Gate("s", "subject", "quantity", value, bound, threshold, "reason")  # type: ignore[arg-type]


@cases(
    ("value", "bound", "passed"),
    [
        (0.5, "at most", True),
        (1.0, "at most", True),
        (math.nextafter(1.0, 2.0), "at most", False),
        (1.5, "at least", True),
        (1.0, "at least", True),
        (math.nextafter(1.0, 0.0), "at least", False),
    ],
)
def test_the_threshold_belongs_to_the_good_side(value: float, bound: str, passed: bool) -> None:
    assert gate(value, bound).passed is passed
    assert (gate(value, bound).margin >= 0) is passed


@pytest.mark.parametrize("bound", ["at most", "at least"])
def test_nan_never_passes_and_is_null_in_json(bound: str) -> None:
    failed = gate(math.nan, bound)
    assert not failed.passed
    assert failed.record()["value"] is None
    assert failed.record()["passed"] is False
