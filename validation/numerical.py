"""The section on numerical stability: the table of extreme cases, the watertight sweep, the error curves."""

from collections.abc import Callable

from validation import extreme_hits, extreme_shading, stability, watertight
from validation.gates import Gate

CASES = (*extreme_hits.CASES, *extreme_shading.CASES)


def run(quick: bool, step: Callable[[str], None]) -> tuple[dict[str, object], list[Gate]]:
    """Run everything; returns a record for JSON and the gates, one for each case among them."""
    cases = []
    gates = []
    for case in CASES:
        step(f"extreme case {case.number}: {case.construct}")
        record = case.record(quick)
        cases.append(record)
        subject = f"extreme case {case.number}: {case.construct}"
        gates.append(
            Gate("stability", subject, "holds", float(bool(record["holds"])), "at least", 1.0, case.tolerance)
        )
    sweep, sweep_gates = watertight.run(quick, step)
    curves, curve_gates = stability.run(quick, step)
    return {"cases": cases, "watertight": sweep, "curves": curves}, [*gates, *sweep_gates, *curve_gates]
