"""The section on numerical stability: extreme cases, the watertight sweep, the error curves."""

from functools import partial
from itertools import chain, islice

from validation.gates import Gate
from validation.hits import watertight
from validation.job import Job, Task
from validation.stability import sweeps
from validation.stability.cases import hits, shading
from validation.stability.cases.case import ExtremeCase

CASES = (*hits.CASES, *shading.CASES)

# The judges of this section. Each works within a case or sweep, so its seconds are not measured apart.
JUDGES = ("exact arithmetic", "closed form", "Embree robust", "Embree default", "brute force")


def steps(job: Job) -> int:
    """Number of calls of ``job.step`` in ``run``: one for each case, closed mesh and sweep, and one for the leaks."""
    return sum(map(len, _tasks(job.quick)))


def run(job: Job) -> tuple[dict[str, object], list[Gate]]:
    """Run all cases and sweeps; returns a record for JSON and the gates, one for each case among them."""
    tasks = _tasks(job.quick)
    results = iter(job.each([*chain(*tasks)]))
    cases, meshes, curves, leaks = ([*islice(results, len(some))] for some in tasks)
    sweep, sweep_gates = watertight.summary(meshes)
    curve_record, curve_gates = sweeps.summary(curves, leaks[0], job.quick)
    record: dict[str, object] = {
        "cases": [row for row, _ in cases],
        "watertight": sweep,
        "curves": curve_record,
        "costs": dict.fromkeys(JUDGES),
    }
    return record, [*(gate for _, gate in cases), *sweep_gates, *curve_gates]


def _tasks(quick: bool) -> tuple[list[Task], list[Task], list[Task], list[Task]]:
    """Cases, closed meshes, sweeps, and the leaks; none of the last takes long, so that no process waits long for
    another at the end.
    """
    return (
        [Task(_subject(case), partial(_case, index, quick)) for index, case in enumerate(CASES)],
        [Task(f"watertight: {closed.name}", partial(watertight.sweep, index, quick))
         for index, closed in enumerate(watertight.closed_meshes())],
        [Task(f"stability: error against {sweep.name}", partial(sweeps.curve, index, quick))
         for index, sweep in enumerate(sweeps.SWEEPS)],
        [Task("stability: leaks", partial(sweeps.leak_rows, quick))],
    )  # fmt: skip


def _case(index: int, quick: bool) -> tuple[dict[str, object], Gate]:
    """A case by its place: functions within one cannot all be sent to another process."""
    return check_case(CASES[index], quick)


def check_case(case: ExtremeCase, quick: bool) -> tuple[dict[str, object], Gate]:
    """Run one case; returns its record for JSON and its gate."""
    record = case.record(quick)
    return record, Gate(
        "stability", _subject(case), "holds", float(bool(record["holds"])), "at least", 1.0, case.tolerance
    )


def _subject(case: ExtremeCase) -> str:
    return f"extreme case {case.number}: {case.construct}"
