"""Defects of view factors."""

from typing import Any

from validation.defects.changes import Change, Rule, Wrapped
from validation.defects.edits import compare, drop, element, value, without
from validation.defects.seeded.defect import Defect


def _unbalanced(sound: Any, exchanges: Any, areas: Any) -> Any:
    return exchanges


_CHANGES: dict[str, Change] = {
    # The height h of a direction becomes that of one with any angle as likely: level / height = sqrt(2 - u) / (1 - u).
    "surfaces send all directions alike": Rule("cosine-of-exchange", element(1, "_ * _ / np.sqrt(1.0 + _ * _)")),
    "rays of both surfaces of a pair count twice": Rule("reciprocal-exchange", value("_ * 2.0")),
    "exchange is left as rays count it": Wrapped("assemble.balanced", _unbalanced),
    "rays to the sky end on the last surface": Rule("sky-of-row", value("_ - 1")),
    "backs of faces receive": Rule("backs-of-faces", value("_ or back")),
    "what is let through is stopped, the rest goes on": Rule("transmitted-share", compare(">=")),
    "errors are stated a third as large": Rule("error-of-replicates", value("_ / 9.0")),
    "rows of rays that are traced again are not balanced": Rule("balance-of-rays", drop),
    "what lies on others radiates": Rule("backs-on-faces", compare(">")),
    "what lies behind backs radiates": Rule("area-behind-backs", value("areas + 0.0 * _")),
    "surfaces let nothing through of what they send": Rule("area-that-sends", without("*", 2)),
}
FACTORS = tuple(Defect("factors", name, change) for name, change in _CHANGES.items())
