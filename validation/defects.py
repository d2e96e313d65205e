"""Seeded defects: each is injected into a process of its own, and must turn at least one gate red there.

First the sound renderer goes the same way and must turn none red. Its compiled kernels are what each defect starts
from, in a folder of its own, so the kernels of this checkout stay as they are.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from validation.defects_list import DEFECTS, Defect
from validation.defects_seam import Replacement, inject
from validation.gates import Gate

_ROOT = Path(__file__).resolve().parent.parent
# Six times what the slowest defect takes on two busy cores: beyond it a kernel does not end.
_PATIENCE = 600.0
_MARK = "gates: "
# Each compiles on one core.
_AT_ONCE = 2


@dataclass(frozen=True)
class Answer:
    """What the checks said in one process: names of all gates, of the red ones, the error that ended it, seconds.

    A gate's name is its section, subject and quantity. An error is no verdict of any gate.
    """

    gates: tuple[str, ...]
    red: tuple[str, ...]
    error: str | None
    seconds: float


def run(
    quick: bool, step: Callable[[str], None], defects: Iterable[Defect] = DEFECTS
) -> tuple[dict[str, Any], list[Gate]]:
    """Inject every defect, with ``quick`` only those that need no compiler; returns a record for JSON and the gates.

    One gate says that the sound renderer turns no gate red, and one for each defect that it turns some red.
    """
    chosen = [d for d in defects if not (quick and d.kernel)]
    with tempfile.TemporaryDirectory(prefix="defects-") as folder:
        sound_cache = Path(folder) / "sound"
        step("defects: none, as the control")
        groups = tuple(dict.fromkeys(d.group for d in chosen))
        control = ask(None, groups, sound_cache)

        def answer(numbered: tuple[int, Defect]) -> Answer:
            number, defect = numbered
            step(f"defects: {defect.name}")
            cache = Path(folder) / str(number)
            shutil.copytree(sound_cache, cache)
            try:
                return ask(defect.replacement, (defect.group,), cache)
            finally:
                shutil.rmtree(cache, ignore_errors=True)

        with ThreadPoolExecutor(_AT_ONCE) as pool:
            answers = list(pool.map(answer, enumerate(chosen)))
    return record(chosen, control, answers), gates(chosen, control, answers)


def ask(replacement: Replacement | None, groups: tuple[str, ...], cache: Path) -> Answer:
    """Run the checks of ``groups`` in a new process with one replacement, or none; its kernels go to ``cache``."""
    began = time.perf_counter()
    cache.mkdir(parents=True, exist_ok=True)
    asked = json.dumps([None if replacement is None else vars(replacement), groups])
    command = [sys.executable, "-c", "import sys; from validation.defects import answer; answer(sys.argv[1])", asked]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    try:
        done = subprocess.run(
            command, cwd=_ROOT, env=environment, capture_output=True, text=True, timeout=_PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        return Answer((), (), f"did not end within {_PATIENCE:.0f} s", time.perf_counter() - began)
    seconds = time.perf_counter() - began
    said = [line for line in done.stdout.splitlines() if line.startswith(_MARK)]
    if done.returncode or not said:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        return Answer((), (), last, seconds)
    found = json.loads(said[-1].removeprefix(_MARK))
    return Answer(tuple(found["gates"]), tuple(found["red"]), None, seconds)


def answer(asked: str) -> None:
    """The other end of ``ask``: inject, check, print the gates as one line of JSON."""
    replacement, groups = json.loads(asked)
    if replacement is not None:
        inject(Replacement(**replacement))
    from validation import defects_checks  # loads the renderer, so not before

    found = defects_checks.run(tuple(groups))
    names = {_name(gate): gate.passed for gate in found}
    print(_MARK + json.dumps({"gates": list(names), "red": [name for name, passed in names.items() if not passed]}))


def record(chosen: list[Defect], control: Answer, answers: list[Answer]) -> dict[str, Any]:
    """For JSON: a row for each defect with the gates that it turned red, and what each gate caught.

    A gate's ``alone`` lists the defects that no other kind of gate caught. Kinds leave out the mesh and the rays: what
    may be dropped is a measure, not one place where it is taken.
    """
    rows: list[dict[str, Any]] = [
        {
            "name": defect.name,
            "file": f"renderer/{defect.replacement.module}.py",
            "rule": defect.replacement.rule.strip(),
            "broken": defect.replacement.broken.strip(),
            "group": defect.group,
            "caught": bool(answer.red),
            "red": list(answer.red),
            "kinds": sorted({_kind(name) for name in answer.red}),
            "error": answer.error,
            "seconds": answer.seconds,
        }
        for defect, answer in zip(chosen, answers, strict=True)
    ]
    caught = Counter(kind for row in rows for kind in row["kinds"])
    kinds = list(dict.fromkeys(_kind(name) for name in control.gates))
    return {
        "control": {"gates": len(control.gates), "red": list(control.red), "error": control.error,
                    "seconds": control.seconds},
        "defects": rows,
        "caught": sum(row["caught"] for row in rows),
        "gates": [
            {
                "gate": kind,
                "caught": caught[kind],
                "alone": [row["name"] for row in rows if row["kinds"] == [kind]],
            }
            for kind in kinds
        ],
    }  # fmt: skip


def gates(chosen: list[Defect], control: Answer, answers: list[Answer]) -> list[Gate]:
    """The control turns no gate red; each defect at least one. A process that ended with an error says neither."""
    red = float("nan") if control.error else float(len(control.red))
    found = [Gate("defects", "no defect", "gates turned red", red, "at most", 0.0, "what is sound must pass")]
    for defect, answer in zip(chosen, answers, strict=True):
        count = float("nan") if answer.error else float(len(answer.red))
        reason = "a suite that lets a defect through proves nothing"
        found.append(Gate("defects", defect.name, "gates turned red", count, "at least", 1.0, reason))
    return found


def _name(gate: Gate) -> str:
    return f"{gate.section}: {gate.subject}: {gate.quantity}"


def _kind(name: str) -> str:
    """A gate's name without the mesh and rays of its subject: of hits and curves the quantity is the measure."""
    section, subject, quantity = name.split(": ", 2)
    keeps = section == "images" or subject.startswith("extreme case")
    return name if keeps else f"{section}: {quantity}"
