"""The protocol of the clock: contenders take turns, the first round is not seen, and a ratio is of rounds."""

from collections.abc import Callable

import pytest

from validation import timing
from validation.timing import interleaved, ratio


def test_contenders_take_turns_after_a_rest_and_the_first_round_is_not_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    rests: list[tuple[float, int]] = []
    monkeypatch.setattr(timing, "REST", 0.25)
    monkeypatch.setattr(timing.time, "sleep", lambda seconds: rests.append((seconds, len(order))))

    def call(name: str) -> Callable[[], float]:
        def seconds() -> float:
            order.append(name)
            return float(len(order))

        return seconds

    seconds = interleaved({name: call(name) for name in "abc"}, runs=2)
    assert "".join(order) == "abcabcabc" and rests == [(0.25, i) for i in range(9)]
    assert seconds == {"a": [4.0, 7.0], "b": [5.0, 8.0], "c": [6.0, 9.0]}


def test_the_ratio_is_the_median_of_the_rounds() -> None:
    # The ratio of the medians would be 4 / 2.
    assert ratio([3.0, 4.0, 9.0], [3.0, 2.0, 1.0]) == 2.0
    assert ratio([2.0, 4.0, 30.0], [2.0, 1.0, 10.0]) == 3.0
