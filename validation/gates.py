"""Gates: a measured value, its threshold and the reason for the threshold."""

import math
from dataclasses import asdict, dataclass
from typing import Literal


@dataclass(frozen=True)
class Gate:
    """Passes when ``value`` is at most, or at least, ``threshold``; a NaN never passes.

    ``judged`` are the public names, see ``validation/promises/names.py``, that the gate would notice broken.
    """

    section: str
    subject: str
    quantity: str
    value: float
    bound: Literal["at most", "at least"]
    threshold: float
    reason: str
    judged: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the value is on the passing side of the threshold; a value equal to the threshold passes."""
        return self.value <= self.threshold if self.bound == "at most" else self.value >= self.threshold

    @property
    def margin(self) -> float:
        """Distance from the value to the threshold, positive on the passing side and negative when the gate fails."""
        return self.threshold - self.value if self.bound == "at most" else self.value - self.threshold

    def record(self) -> dict[str, object]:
        """The gate as a table for JSON. JSON has no NaN or infinity, so a value that is not finite becomes None."""
        finite = math.isfinite(self.value)
        numbers = {"value": self.value if finite else None, "margin": self.margin if finite else None}
        return asdict(self) | numbers | {"judged": list(self.judged), "passed": self.passed}
