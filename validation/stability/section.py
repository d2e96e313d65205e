"""The section on numerical stability: extreme cases, the watertight sweep, the error curves."""

from dataclasses import dataclass
from typing import Any, Literal

from validation.gates import Gate
from validation.hits import watertight
from validation.job import Job
from validation.stability import sweeps
from validation.stability.cases import hits, shading
from validation.stability.cases.case import ExtremeCase

CASES = (*hits.CASES, *shading.CASES)

# The judges of this section. Each works within a case or sweep, so its seconds are not measured apart.
JUDGES = ("exact arithmetic", "analytic", "Embree robust", "Embree default", "brute force")


@dataclass(frozen=True)
class Task:
    """One step of the section: a case, a closed mesh or a sweep by its place in its table, or the leaks."""

    kind: Literal["case", "mesh", "sweep", "leaks"]
    index: int
    quick: bool

    @property
    def name(self) -> str:
        """What a progress bar shows."""
        match self.kind:
            case "case":
                return _subject(CASES[self.index])
            case "mesh":
                return f"watertight: {watertight.closed_meshes()[self.index].name}"
            case "sweep":
                return f"stability: error against {sweeps.SWEEPS[self.index].name}"
        return "stability: leaks"

    def do(self) -> Any:
        """The task's result, which can be sent to another process."""
        match self.kind:
            case "case":
                return check_case(CASES[self.index], self.quick)
            case "mesh":
                return watertight.sweep(self.index, self.quick)
            case "sweep":
                return sweeps.curve(self.index, self.quick)
        return sweeps.leak_rows(self.quick)


def steps(job: Job) -> int:
    """Number of calls of ``job.step`` in ``run``: one for each case, closed mesh and sweep, and one for the leaks."""
    return len(_tasks(job.quick))


def run(job: Job) -> tuple[dict[str, object], list[Gate]]:
    """Run all cases and sweeps; returns a record for JSON and the gates, one for each case among them."""
    tasks = _tasks(job.quick)
    results = job.workers.each(Task.do, tasks, lambda task: job.step(task.name))
    of: dict[str, list[Any]] = {}
    for task, result in zip(tasks, results, strict=True):
        of.setdefault(task.kind, []).append(result)
    sweep, sweep_gates = watertight.summary(of["mesh"])
    curves, curve_gates = sweeps.summary(of["sweep"], of["leaks"][0], job.quick)
    record: dict[str, object] = {
        "cases": [row for row, _ in of["case"]],
        "watertight": sweep,
        "curves": curves,
        "costs": dict.fromkeys(JUDGES),
    }
    return record, [*(gate for _, gate in of["case"]), *sweep_gates, *curve_gates]


def _tasks(quick: bool) -> list[Task]:
    """All tasks; none of the last takes long, so that no process waits long for another at the end."""
    lengths: dict[Literal["case", "mesh", "sweep"], int] = {
        "case": len(CASES), "mesh": len(watertight.closed_meshes()), "sweep": len(sweeps.SWEEPS),
    }  # fmt: skip
    some = [Task(kind, index, quick) for kind, length in lengths.items() for index in range(length)]
    return [*some, Task("leaks", 0, quick)]


def check_case(case: ExtremeCase, quick: bool) -> tuple[dict[str, object], Gate]:
    """Run one case; returns its record for JSON and its gate."""
    record = case.record(quick)
    return record, Gate(
        "stability", _subject(case), "holds", float(bool(record["holds"])), "at least", 1.0, case.tolerance
    )


def _subject(case: ExtremeCase) -> str:
    return f"extreme case {case.number}: {case.construct}"
