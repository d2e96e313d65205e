"""The section on numerical stability: extreme cases, the watertight sweep, the error curves."""

from validation.gates import Gate
from validation.hits import watertight
from validation.job import Job
from validation.stability import sweeps
from validation.stability.cases import hits, shading
from validation.stability.cases.case import ExtremeCase

CASES = (*hits.CASES, *shading.CASES)

# The judges of this section. Each works within a case or sweep, so its seconds are not measured apart.
JUDGES = ("exact arithmetic", "analytic", "Embree robust", "Embree default", "brute force")


def steps(job: Job) -> int:
    """Number of calls of ``job.step`` in ``run``: one for each case, closed mesh and sweep, and one for the leaks."""
    return len(CASES) + len(watertight.closed_meshes()) + len(sweeps.SWEEPS) + 1


def run(job: Job) -> tuple[dict[str, object], list[Gate]]:
    """Run all cases and sweeps; returns a record for JSON and the gates, one for each case among them."""
    cases = []
    gates = []
    for case in CASES:
        record, gate = check_case(case, job)
        cases.append(record)
        gates.append(gate)
    sweep, sweep_gates = watertight.run(job.quick, job.step)
    curves, curve_gates = sweeps.run(job.quick, job.step)
    record = {"cases": cases, "watertight": sweep, "curves": curves, "costs": dict.fromkeys(JUDGES)}
    return record, [*gates, *sweep_gates, *curve_gates]


def check_case(case: ExtremeCase, job: Job) -> tuple[dict[str, object], Gate]:
    """Run one case; returns its record for JSON and its gate."""
    subject = f"extreme case {case.number}: {case.construct}"
    job.step(subject)
    record = case.record(job.quick)
    return record, Gate("stability", subject, "holds", float(bool(record["holds"])), "at least", 1.0, case.tolerance)
