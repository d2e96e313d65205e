"""The process that has a defect: inject it, run the checks, print what they say. Imports no renderer before."""

import json
from importlib import import_module
from typing import TYPE_CHECKING

from validation.defects.inject import Replacement, inject

if TYPE_CHECKING:
    from validation.gates import Gate

# What the one line of the answer begins with.
MARK = "gates: "


def answer(asked: str) -> None:
    """The other end of ``defects.ask``: inject, check, print the gates as one line of JSON."""
    replacement, groups, checks = json.loads(asked)
    if replacement is not None:
        inject(Replacement(**replacement))
    # It loads the renderer, so not before.
    found = import_module(checks).run(tuple(groups))
    names = [_name(gate) for gate in found]
    red = [name for name, gate in zip(names, found, strict=True) if not gate.passed]
    print(MARK + json.dumps({"gates": names, "red": red}))


def _name(gate: "Gate") -> str:
    return f"{gate.section}: {gate.subject}: {gate.quantity}"
