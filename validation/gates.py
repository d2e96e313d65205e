"""Gates: a measured value, its threshold, and why the threshold stands where it does."""

import math
from dataclasses import asdict, dataclass
from typing import Literal


@dataclass(frozen=True)
class Gate:
    """Passes when ``value`` is at most, or at least, ``threshold``; a nan never passes."""

    section: str
    subject: str
    quantity: str
    value: float
    bound: Literal["at most", "at least"]
    threshold: float
    reason: str

    @property
    def passed(self) -> bool:
        """Whether the value keeps to its side of the threshold, which belongs to that side."""
        return self.value <= self.threshold if self.bound == "at most" else self.value >= self.threshold

    @property
    def margin(self) -> float:
        """How far the value is on the right side of the threshold; negative when it fails."""
        return self.threshold - self.value if self.bound == "at most" else self.value - self.threshold

    def record(self) -> dict[str, object]:
        """For JSON, which has no nan: a value that is not a number is None."""
        finite = math.isfinite(self.value)
        numbers = {"value": self.value if finite else None, "margin": self.margin if finite else None}
        return asdict(self) | numbers | {"passed": self.passed}
