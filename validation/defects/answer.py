"""Entry point of a process with a defect: inject it, run the checks, print the results.

It must not import the renderer before the injection.
"""

import json
from importlib import import_module
from typing import TYPE_CHECKING

from validation.defects.inject import inject

if TYPE_CHECKING:
    from validation.gates import Gate

# Prefix of the one line of results.
MARK = "gates: "


def answer(task: str) -> None:
    """Counterpart of ``run.run_checks`` in the child process: inject, check, print the gates as a line of JSON.

    The task names a defect, or None, the modules that have ``DEFECTS`` and ``run(group)``, and the group.
    """
    name, defects, checks, group = json.loads(task)
    if name is not None:
        inject(next(defect.change for defect in import_module(defects).DEFECTS if defect.name == name))
    # Imported only now, because it loads the renderer.
    found = import_module(checks).run(group)
    names = [name_of(gate) for gate in found]
    red = [name for name, gate in zip(names, found, strict=True) if not gate.passed]
    print(MARK + json.dumps({"gates": names, "red": red}))


def name_of(gate: "Gate") -> str:
    """The gate's section, subject and quantity."""
    return f"{gate.section}: {gate.subject}: {gate.quantity}"
