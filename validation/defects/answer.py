"""Entry point of a process with a defect: inject it, run the checks, print the results.

It must not import the renderer before the injection.
"""

import json
from importlib import import_module
from typing import TYPE_CHECKING

from validation.defects.inject import Replacement, inject

if TYPE_CHECKING:
    from validation.gates import Gate

# Prefix of the one line of results.
MARK = "gates: "


def answer(task: str) -> None:
    """Counterpart of ``run.run_checks`` in the child process: inject, check, print the gates as a line of JSON."""
    replacement, groups, checks = json.loads(task)
    if replacement is not None:
        inject(Replacement(**replacement))
    # Imported only now, because it loads the renderer.
    found = import_module(checks).run(tuple(groups))
    names = [name_of(gate) for gate in found]
    red = [name for name, gate in zip(names, found, strict=True) if not gate.passed]
    print(MARK + json.dumps({"gates": names, "red": red}))


def name_of(gate: "Gate") -> str:
    """The gate's section, subject and quantity."""
    return f"{gate.section}: {gate.subject}: {gate.quantity}"
