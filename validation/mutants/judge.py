"""Judges one mutant in a workshop, by gates and by the tests that touch its code."""

import json
import re
import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from validation.mutants.answer import MARK
from validation.mutants.sites import Mutant
from validation.mutants.touched import Touched, touching
from validation.mutants.verdict import How, Verdict
from validation.mutants.workshop import Ended, Workshop

# The groups of checks, and those that run code of each folder or module of the renderer; what is not here no gate runs.
GROUPS = ("hits", "queries", "pictures")
_RUNS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("arrays", "errors", "kernels", "limits", "lazy", "mesh", "octree", "points", "process"), GROUPS),
    **dict.fromkeys(("queries", "trace", "tree"), GROUPS),
    **dict.fromkeys(("contacts", "distance", "inside", "trimesh_ray"), ("queries",)),
    **dict.fromkeys(("scene", "shade", "picture", "inspect"), ("pictures",)),
}
# A process that takes this many times as long as with the sound renderer, and what compiling takes, hangs.
_TIMES, _COMPILING = 6.0, 150.0
# Seconds of tests, as long as the sound renderer takes for them, that are tried on a mutant.
_TESTS = 240.0


def groups_of(mutant: Mutant) -> tuple[str, ...]:
    """The groups of checks that may notice a mutant."""
    package, part, *_ = Path(mutant.file).with_suffix("").parts
    return _RUNS.get(part, ()) if package == "renderer" else ()  # a gate says nothing of what judges it


def judge(mutant: Mutant, workshop: Workshop, touched: Touched, sound: dict[str, float]) -> Verdict:
    """Break the workshop's copy, and try gates and tests until one notices; ``sound`` is each group's seconds.

    The gates come first for a kernel, whose share they must notice alone; for other code the tests do, which are
    quicker there. Raises ``ChildProcessError`` where a process crashes that crashes in the sound copy too.
    """
    spent = 0.0
    with workshop.broken(mutant):
        for tried in _ways(mutant, workshop, touched, sound):
            found = tried()
            spent += found.seconds
            if found.how is not None:
                break
    if found.how == "crashes":
        control = tried()
        if control.how is not None:
            raise ChildProcessError(f"mutants: expected the sound renderer to pass, got {control.by}")
    return replace(found, seconds=spent)


def _ways(
    mutant: Mutant, workshop: Workshop, touched: Touched, sound: dict[str, float]
) -> Iterator[Callable[[], Verdict]]:
    """The processes that may notice a mutant, one after the other."""
    tests = _affordable(touching(mutant, touched), touched)
    by_gates = [partial(_by_gates, group, workshop, sound) for group in groups_of(mutant)]
    by_tests = [partial(_by_tests, tests, workshop, touched)]
    yield from [*by_gates, *by_tests] if mutant.kernel else [*by_tests, *by_gates]


def _by_gates(group: str, workshop: Workshop, sound: dict[str, float]) -> Verdict:
    """What the gates of a group say of the copy."""
    ended = gates(workshop, (group,), _COMPILING + _TIMES * sound[group])
    by, how = noticed_by_gates(ended, group)
    return Verdict(by, how is not None, how, ended.seconds)


def _by_tests(tests: Sequence[str], workshop: Workshop, touched: Touched) -> Verdict:
    """What the tests say of the copy."""
    if not tests:
        return Verdict(None, False, None, 0.0)
    own = sum(touched[test]["seconds"] for test in tests)
    ended = workshop.run(
        ["-m", "pytest", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", "--durations=0", *tests],
        _COMPILING + _TIMES * own,
    )
    by, how = _noticed_by_tests(ended)
    return Verdict(by, False, how, ended.seconds)


def gates(workshop: Workshop, groups: Sequence[str], patience: float) -> Ended:
    """Run the gates of some groups until one is red."""
    return workshop.call("validation.mutants.answer:answer", json.dumps(groups), patience=patience)


def noticed_by_gates(ended: Ended, group: str) -> tuple[str | None, How | None]:
    """What noticed a fault in a process of ``gates``, and how; None where nothing did."""
    said = re.search(rf"^{MARK}(.*)$", ended.output, re.MULTILINE)
    if ended.code is None:
        return f"the checks of {group}", "hangs"
    if ended.code != 0 or said is None:
        return f"the checks of {group}: {_last_words(ended)[:200]}", "crashes"
    red = json.loads(said[1])
    return (red, "fails") if red is not None else (None, None)


def _last_words(ended: Ended) -> str:
    """The last line of a process that crashed, or the signal that ended it."""
    if ended.code is not None and ended.code < 0:
        known = {number.value: number.name for number in signal.Signals}
        return f"ended by {known.get(-ended.code, f'signal {-ended.code}')}"
    return (ended.output.strip().splitlines() or [f"exit code {ended.code}"])[-1]


def _noticed_by_tests(ended: Ended) -> tuple[str | None, How | None]:
    if ended.code == 0:
        return None, None
    # What the tests print may look like a verdict; the summary comes last.
    said = ended.output.rpartition("short test summary info")[2]
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE)
    if ended.code is None:
        return "the tests", "hangs"
    return (failed[1], "fails") if failed else (f"the tests: exit code {ended.code}", "crashes")


def _affordable(tests: Sequence[str], touched: Touched) -> list[str]:
    """The first tests, as many as _TESTS allows, at least one."""
    taken: list[str] = []
    left = _TESTS
    for test in tests:
        if not taken or touched[test]["seconds"] <= left:
            taken.append(test)
            left -= touched[test]["seconds"]
    return taken
