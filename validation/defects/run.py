"""Seeded defects: each is injected into its own process, where at least one gate must fail.

First the sound renderer runs the same way, and no gate may fail. Each defect starts from its compiled kernels, in a
separate folder, so this checkout's kernels stay unchanged.
"""

import json
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from renderer.system import child
from validation.defects.answer import MARK
from validation.defects.inject import Replacement
from validation.defects.list import DEFECTS, Defect
from validation.gates import Gate

# Ten times the time of the slowest defect on two busy cores: beyond it a kernel does not terminate.
_PATIENCE = 600.0
# In place of a red gate, of checks that did not end in that time.
HANGS = "defects: the checks: do not end"
# Each process compiles on one core.
_AT_ONCE = 2
_CHECKS = "validation.defects.checks"

_PATHS = "checks the other reference, whose recursion is like ours: a rule that both have wrong shows on paths alone"
# Quantities that measure the same as another: over other pixels, or the same verdict on other rays.
_VIEWS = {
    "ssim_foreground": "ssim",
    "fragile share of the glass": "fragile_share",
    "pixels whose position is off": "pixels whose distance is off",
    "of the exact sample, rays on which we are wrong": "rays on which we are wrong",
    "wrong verdicts": "rays on which we are wrong",
    "t beyond its bound": "rays on which we are wrong",
}
# Kinds of gates that are kept though they catch no defect alone, by the beginning of their names, with the reasons.
KEPT = {
    "extreme case": "each is a promise for one construct, and says in words what broke",
    "ssim": "others publish it, and it tells broken structure from wrong brightness; FLIP and the maximum see more",
    "asked a few at a time": "few rays go by a kernel of their own, which other gates ask by chance only",
    "references that judge it": "guards the others: without it a rung that nobody judges would pass",
    "rays on which we are wrong": "judges all families by the thousand; extreme cases see the same faults on few rays",
    "differ from a new build": "asks every mesh again after it moved, of which extreme cases have two",
    "rays within float64 rounding": "guards the count of wrong rays, which excuses what float64 cannot decide",
    "rays stopped at once, or not, against the law": "judges each ray by exact signs; sees what others see on few rays",
    "rays that name no face, stopped against the law": "the same rays where they leave nothing: ties at t = 0",
    "rays from inside that are lost": "counts all rays where the exact sample has a few",
    "of the exact sample, rays from a surface with a wrong hit": "judges what is hit beyond the start, to its t",
    "rays that go through other faces than all": "asks faces that coincide, one after the other, as users go through",
    "pixels that see what they cannot": "what users see of the law, through all that pictures do with it",
    "reflected rays": "what users see of the law: each reflection starts where the one before ended, fifty times",
    "points with another sky where their face is named": "asks all points, of which exact arithmetic judges some",
    "slope of log RMSE": _PATHS,
    "p-value of the largest z": _PATHS,
}


@dataclass(frozen=True)
class Answer:
    """Results of the checks in one process: names of all gates and of the failing ones, its error, its seconds.

    A gate's name is its section, subject and quantity; checks that do not end count as one red, ``HANGS``. An error is
    not a verdict of any gate.
    """

    gates: tuple[str, ...]
    red: tuple[str, ...]
    error: str | None
    seconds: float


def run(
    quick: bool, step: Callable[[str], None], defects: Iterable[Defect] = DEFECTS, checks: str = _CHECKS
) -> tuple[dict[str, Any], list[Gate]]:
    """Inject every defect, with ``quick`` only those without recompilation; returns a record for JSON and the gates.

    checks : the module whose ``run(groups)`` gives the gates that judge a defect.

    One gate requires that no gate fails for the sound renderer, and one for each defect that some gate fails. A run of
    the whole list has one more, ``idle``.
    """
    chosen = [d for d in defects if not (quick and d.kernel)]
    with tempfile.TemporaryDirectory(prefix="defects-") as folder:
        sound_cache = Path(folder) / "sound"
        step("defects: none, as the control")
        groups = tuple(dict.fromkeys(d.group for d in chosen))
        control = run_checks(None, groups, sound_cache, checks)

        def answer(numbered: tuple[int, Defect]) -> Answer:
            number, defect = numbered
            step(f"defects: {defect.name}")
            cache = Path(folder) / str(number)
            shutil.copytree(sound_cache, cache)
            try:
                return run_checks(defect.replacement, (defect.group,), cache, checks)
            finally:
                shutil.rmtree(cache, ignore_errors=True)

        with ThreadPoolExecutor(_AT_ONCE) as pool:
            answers = list(pool.map(answer, enumerate(chosen)))
    found, judged = record(chosen, control, answers), gates(chosen, control, answers)
    return found, [*judged, idle(found)] if set(chosen) >= set(DEFECTS) else judged


def run_checks(replacement: Replacement | None, groups: tuple[str, ...], cache: Path, checks: str = _CHECKS) -> Answer:
    """Run the checks of ``groups`` in a new process with one replacement, or none; its kernels go to ``cache``."""
    began = time.perf_counter()
    cache.mkdir(parents=True, exist_ok=True)
    task = json.dumps([None if replacement is None else asdict(replacement), groups, checks])
    command = child.command("validation.defects.answer:answer", task)
    environment = child.environment(NUMBA_CACHE_DIR=str(cache))
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=_PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        # A kernel that runs for ever is noticed by whoever waits for the report.
        return Answer((), (HANGS,), None, time.perf_counter() - began)
    seconds = time.perf_counter() - began
    said = [line for line in done.stdout.splitlines() if line.startswith(MARK)]
    if done.returncode or not said:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        return Answer((), (), last, seconds)
    found = json.loads(said[-1].removeprefix(MARK))
    return Answer(tuple(found["gates"]), tuple(found["red"]), None, seconds)


def record(chosen: list[Defect], control: Answer, answers: list[Answer]) -> dict[str, Any]:
    """For JSON: a row for each defect with the gates that failed, and the defects that each kind of gate caught.

    A kind is a measure: a gate's quantity without the place where it is measured, i.e. the section, mesh, rays, rung of
    the ladder, reference or offset rule. ``alone`` lists the defects that no other kind caught; ``kept`` says why a
    kind is kept though it catches none alone, None without a reason.
    """
    rows = [_row(defect, answer) for defect, answer in zip(chosen, answers, strict=True)]
    caught = Counter(kind for row in rows for kind in row["kinds"])
    alone = {kind: [row["name"] for row in rows if row["kinds"] == [kind]] for kind in caught}
    kinds = list(dict.fromkeys(kind_of(name) for name in control.gates))
    return {
        "control": {"gates": len(control.gates), "red": list(control.red), "error": control.error,
                    "seconds": control.seconds},
        "defects": rows,
        "caught": sum(row["caught"] for row in rows),
        "gates": [
            {"gate": kind, "caught": caught[kind], "alone": alone.get(kind, []), "kept": _kept(kind)} for kind in kinds
        ],
    }  # fmt: skip


def _row(defect: Defect, answer: Answer) -> dict[str, Any]:
    return {
        "name": defect.name,
        "place": f"{defect.replacement.module}: {defect.replacement.place}",
        "rule": defect.replacement.rule,
        "broken": defect.replacement.broken,
        "group": defect.group,
        "caught": bool(answer.red),
        "red": list(answer.red),
        "kinds": sorted({kind_of(name) for name in answer.red}, key=lambda kind: (kind.startswith("extreme"), kind)),
        "error": answer.error,
        "seconds": answer.seconds,
    }


def gates(chosen: list[Defect], control: Answer, answers: list[Answer]) -> list[Gate]:
    """The control must fail no gate; each defect at least one. A process that ended with an error proves neither."""
    red = float("nan") if control.error else float(len(control.red))
    found = [Gate("defects", "no defect", "gates turned red", red, "at most", 0.0, "what is sound must pass")]
    for defect, answer in zip(chosen, answers, strict=True):
        count = float("nan") if answer.error else float(len(answer.red))
        reason = "a suite that lets a defect through proves nothing"
        found.append(Gate("defects", defect.name, "gates turned red", count, "at least", 1.0, reason))
    return found


def idle(found: dict[str, Any]) -> Gate:
    """Gate on a record of the whole list: each kind of gate caught a defect alone, or has a reason to be kept."""
    count = sum(not (row["alone"] or row["kept"]) for row in found["gates"])
    quantity, reason = "that caught no defect alone and are not kept", "a measure that tells nothing new is dropped"
    return Gate("defects", "kinds of gates", quantity, float(count), "at most", 0.0, reason)


def kind_of(name: str) -> str:
    """The measure in a gate's name, see ``record``; an extreme case has no quantity and is its own kind."""
    _, _, measured = name.partition(": ")
    subject, _, quantity = measured.rpartition(": ")
    if subject.startswith("extreme case"):
        return subject.partition(":")[0]
    return _VIEWS.get(quantity, quantity)


def _kept(kind: str) -> str | None:
    return next((reason for begin, reason in KEPT.items() if kind.startswith(begin)), None)
