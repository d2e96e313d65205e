"""Entry point of a process with a defect: inject it, run the checks, print the results.

It must not import the renderer before the injection.
"""

import json
import sys
from importlib import import_module
from typing import TYPE_CHECKING

from validation.defects.inject import inject

if sys.platform != "win32":
    import resource

if TYPE_CHECKING:
    from validation.gates import Gate

# Prefix of the one line of results.
MARK = "gates: "


def answer(task: str) -> None:
    """Counterpart of ``run.run_checks`` in the child process: inject, check, print the gates as a line of JSON.

    The task has a defect's name, or None; the modules that have ``DEFECTS`` and ``run(group)``; the group; and the
    seconds of computing after which the system ends this process.
    """
    name, defects, checks, group, patience = json.loads(task)
    if sys.platform != "win32":
        resource.setrlimit(resource.RLIMIT_CPU, (patience, patience + 10))
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
