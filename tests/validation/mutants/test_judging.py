"""What notices a mutant is told right: a red gate, a failing test, a crash, a process that never ends, or nothing."""

import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from validation.mutants import judge as judging
from validation.mutants import record, workshop
from validation.mutants.record import Record, summary
from validation.mutants.sites import Mutant, mutants
from validation.mutants.touched import read, touching
from validation.mutants.verdict import Verdict
from validation.mutants.workshop import Ended, Workshop

TOUCHED: dict[str, Any] = {
    "tests/tree/test_far.py": {"lines": {"renderer/trace/a.py": [3]}, "kernels": [], "seconds": 1.0},
    "tests/trace/test_own.py": {"lines": {"renderer/trace/a.py": [2, 3]}, "kernels": [], "seconds": 5.0},
    "tests/shade/test_kernel.py": {"lines": {}, "kernels": ["renderer/trace/a.py"], "seconds": 9.0},
    "tests/mesh/test_none.py": {"lines": {"renderer/mesh/b.py": [3]}, "kernels": [], "seconds": 1.0},
    "tests/validation/defects/test_text.py": {"lines": {"renderer/trace/a.py": [3]}, "kernels": [], "seconds": 0.1},
}


def mutant(**changes: Any) -> Mutant:
    fields = {
        "file": "renderer/trace/a.py", "place": "renderer.trace.a.f", "line": 3, "operator": "arithmetic",
        "before": "a + b", "instead": "(a) - (b)", "kernel": False, "at_top": False, "nth": 0,
    }  # fmt: skip
    return Mutant(**(fields | changes))


def test_the_tests_of_a_mutant_run_its_line_and_its_own_room_comes_first() -> None:
    own, far, kernel = "tests/trace/test_own.py", "tests/tree/test_far.py", "tests/shade/test_kernel.py"
    assert touching(mutant(), TOUCHED) == [own, far, kernel]
    assert touching(mutant(line=2), TOUCHED) == [own, kernel]
    # Nobody measured that the own room's tests run that line, but they may start a process that does.
    assert touching(mutant(line=99), TOUCHED) == [kernel, own]
    assert touching(mutant(line=99, at_top=True), TOUCHED) == [own, far, kernel]


def test_a_line_that_runs_while_its_module_is_imported_is_left_to_all_tests_of_the_module() -> None:
    lines = {test: {**found, "kernels": []} for test, found in TOUCHED.items()}
    own, far = "tests/trace/test_own.py", "tests/tree/test_far.py"
    assert touching(mutant(line=99), lines) == [own, far] and touching(mutant(line=2), lines) == [own]


def test_what_judges_is_judged_by_its_tests_alone_those_beside_it_first() -> None:
    file = "validation/references/trace.py"
    tests = ("tests/references/test_a.py", "tests/validation/hits/test_b.py", "tests/validation/references/test_c.py")
    touched = {test: {"lines": {file: [3]}, "kernels": [], "seconds": 1.0} for test in tests}
    broken = mutant(file=file)
    assert touching(broken, touched)[0] == tests[2] and judging.groups_of(broken) == ()
    assert judging.groups_of(mutant()) == ("hits", "queries", "pictures")
    assert judging.groups_of(mutant(file="validation/queries/inside.py")) == ()


class Shop:
    """Stands in for a workshop: answers as it is told while it is broken, and otherwise that all is well."""

    def __init__(self, gates: list[Ended], tests: Ended, sound: Ended | None = None) -> None:
        self.answers, self.tests, self.asked = gates, tests, 0
        self.sound, self.is_broken = sound or GREEN, False

    @contextmanager
    def broken(self, mutant: Mutant) -> Iterator[None]:
        self.is_broken = True
        yield
        self.is_broken = False

    def call(self, target: str, *arguments: str, patience: float) -> Ended:
        assert json.loads(arguments[0])[0] in judging.groups_of(mutant())
        if not self.is_broken:
            return self.sound
        self.asked += 1
        return self.answers.pop(0)

    def run(self, arguments: list[str], patience: float) -> Ended:
        assert arguments[-1] == "tests/shade/test_kernel.py"
        return self.tests if self.is_broken else self.sound


GREEN = Ended(0, "red: null\n", 2.0)
SUMMARY = "F\n=== short test summary info ===\n"


@pytest.mark.parametrize(
    ("gates", "tests", "by", "gate", "how"),
    [
        ([GREEN, Ended(0, 'noise\nred: "hits: cube: wrong"\n', 3.0)], None, "hits: cube: wrong", True, "fails"),
        ([Ended(None, "", 9.0)], None, "the checks of hits", True, "hangs"),
        ([Ended(-11, "a warning", 9.0)], None, "the checks of hits: ended by SIGSEGV", True, "crashes"),
        ([Ended(1, "Trace\nKeyError: 3\n", 9.0)], None, "the checks of hits: KeyError: 3", True, "crashes"),
        ([GREEN] * 3, Ended(1, f"{SUMMARY}FAILED tests/a.py::test_b - x\n", 4.0), "tests/a.py::test_b", False, "fails"),
        # What a test prints may look like a verdict.
        ([GREEN] * 3, Ended(1, f"FAILED images: x\n{SUMMARY}FAILED t.py::b - x\n", 4.0), "t.py::b", False, "fails"),
        ([GREEN, Ended(-40, "", 9.0)], None, "the checks of queries: ended by signal 40", True, "crashes"),
        ([GREEN] * 3, Ended(None, "..", 4.0), "the tests", False, "hangs"),
        ([GREEN] * 3, Ended(-6, "..", 4.0), "the tests: exit code -6", False, "crashes"),
        ([GREEN] * 3, Ended(0, "9 passed", 4.0), None, False, None),
    ],
)
def test_a_verdict_says_what_noticed_and_how(
    gates: list[Ended], tests: Ended | None, by: str | None, gate: bool, how: Any
) -> None:
    spent = sum(ended.seconds for ended in [*gates, *([tests] if tests else [])])
    shop: Any = Shop(list(gates), tests or GREEN)
    sound = dict.fromkeys(("hits", "queries", "pictures"), 1.0)
    assert judging.judge(mutant(kernel=True), shop, TOUCHED, sound) == Verdict(by, gate, how, spent)
    assert shop.asked == len(gates)


@pytest.mark.parametrize(("kernel", "gate"), [(True, True), (False, False)])
def test_gates_are_asked_first_about_kernels_and_tests_about_other_code(kernel: bool, gate: bool) -> None:
    red, failed = (
        Ended(0, 'red: "hits: cube: wrong"\n', 3.0),
        Ended(1, f"{SUMMARY}FAILED tests/a.py::test_b - x\n", 4.0),
    )
    shop: Any = Shop([red], failed)
    sound = dict.fromkeys(("hits", "queries", "pictures"), 1.0)
    found = judging.judge(mutant(kernel=kernel), shop, TOUCHED, sound)
    assert (found.gate, found.seconds) == (gate, 3.0 if kernel else 4.0)


@pytest.mark.parametrize("kernel", [True, False])
def test_what_crashes_without_a_fault_too_is_no_verdict(kernel: bool) -> None:
    crash = Ended(4, "pytest: unrecognized arguments: --nosuch\n", 1.0)
    sound = dict.fromkeys(("hits", "queries", "pictures"), 1.0)
    shop: Any = Shop([crash], crash, crash)
    with pytest.raises(ChildProcessError, match="expected the sound renderer to pass, got the"):
        judging.judge(mutant(kernel=kernel), shop, TOUCHED, sound)
    # A crash that only the fault brings is one.
    shop = Shop([crash], crash)
    assert judging.judge(mutant(kernel=kernel), shop, TOUCHED, sound).how == "crashes"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for folder in ("renderer/trace", "tests", "validation"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "renderer" / "trace" / "a.py").write_text("\n\nx = a + b\n")
    return tmp_path


def test_a_record_goes_on_until_the_code_or_what_judges_it_changes(root: Path) -> None:
    path = root / "mutants.json"
    killed, survivor, tested, by_test = mutant(), mutant(nth=1), mutant(nth=2), mutant(nth=3, kernel=True)
    first = Record(path, root)
    first.add(killed, Verdict("a gate", True, "fails", 1.0))
    first.add(survivor, Verdict(None, False, None, 1.0))
    for one in (tested, by_test):
        first.add(one, Verdict("a test", False, "fails", 1.0))
    first.write(7, [killed, survivor])
    again = Record(path, root)
    assert again.row(killed)["by"] == "a gate" and again.row(survivor)["by"] is None  # type: ignore[index]
    assert again.row(tested) is not None and again.row(by_test) is not None
    (root / "tests" / "test_new.py").write_text("")
    again = Record(path, root)
    assert again.row(killed) is not None and again.row(survivor) is None
    # A new gate may notice what only a test did.
    assert again.row(tested) is not None and again.row(by_test) is None
    again.forget([killed])
    assert again.row(killed) is None
    (root / "renderer" / "trace" / "a.py").write_text("x = a + b + c\n")
    assert Record(path, root).row(killed) is None


def test_a_verdict_holds_for_the_text_that_was_judged(root: Path) -> None:
    path, one = root / "mutants.json", mutant()
    record = Record(path, root)
    assert record.row(one) is None
    (root / "renderer" / "trace" / "a.py").write_text("x = a + b + c\n")  # while it is judged in a copy
    record.add(one, Verdict("a gate", True, "fails", 1.0))
    record.write(7, [one])
    assert Record(path, root).row(one) is None


def test_a_test_that_went_notices_nothing(root: Path) -> None:
    path, one, test = root / "mutants.json", mutant(), root / "tests" / "test_a.py"
    record = Record(path, root)
    record.add(one, Verdict("tests/test_a.py::TestIt::test_b[x::y]", False, "fails", 1.0))
    record.write(7, [one])
    for text, holds in (("def test_b(self):\n", True), ("def test_bc(self):\n", False)):
        test.write_text(text)
        assert (Record(path, root).row(one) is not None) == holds
        assert summary(path, root)["outdated"] == (not holds)  # type: ignore[index]


def test_two_runs_at_once_keep_the_verdicts_of_both(root: Path) -> None:
    path, all_ = root / "mutants.json", [mutant(nth=n) for n in range(3)]
    first, second = Record(path, root), Record(path, root)
    first.add(all_[0], Verdict("a gate", True, "fails", 1.0))
    first.write(7, all_)
    second.add(all_[1], Verdict("a gate", True, "fails", 1.0))
    second.write(7, all_)
    again = Record(path, root)
    assert [again.row(one) is not None for one in all_] == [True, True, False]
    again.forget(all_[:1])
    again.write(7, all_)
    assert Record(path, root).row(all_[0]) is None


@pytest.mark.parametrize("text", ["", '{"schema": 1, "se', "[]", '{"schema": 1}', '{"schema": 2, "seed": 9}',
                                  '{"schema": 1, "seed": 1, "asked": [], "mutants": [{"key": "a"}]}'])  # fmt: skip
def test_a_file_that_is_no_record_is_refused_and_stays(root: Path, text: str) -> None:
    path = root / "mutants.json"
    path.write_text(text)
    for read_it in (lambda: Record(path, root), lambda: summary(path, root)):
        with pytest.raises(ValueError, match=r"mutants\.json: expected"):
            read_it()
    assert path.read_text() == text


def test_reasons_to_leave_mutants_make_no_verdict_older(root: Path) -> None:
    path, one = root / "mutants.json", mutant()
    record = Record(path, root)
    record.add(one, Verdict(None, False, None, 1.0))
    record.write(7, [one])
    (root / "validation" / "equivalent.py").write_text("LEFT = {}\n")
    assert Record(path, root).row(one) is not None
    (root / "validation" / "moved.py").write_text("")
    assert Record(path, root).row(one) is None
    record = Record(path, root)
    record.add(one, Verdict(None, False, None, 1.0))
    record.write(7, [one])
    (root / "validation" / "deeper").mkdir()
    (root / "validation" / "moved.py").rename(root / "validation" / "deeper" / "moved.py")
    assert Record(path, root).row(one) is None


def test_a_summary_counts_what_changes_an_answer(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    verdicts = {
        "gate": (mutant(kernel=True, nth=0), Verdict("a gate", True, "fails", 1.0)),
        "hangs": (mutant(kernel=True, nth=1), Verdict("a test", False, "hangs", 1.0)),
        "same": (mutant(kernel=True, nth=2), Verdict(None, False, None, 1.0)),
        "lost": (mutant(nth=3), Verdict(None, False, None, 1.0)),
        "other": (mutant(nth=4), Verdict(None, False, None, 1.0)),
    }
    path = root / "mutants.json"
    assert summary(path, root) is None
    stored = Record(path, root)
    for one, verdict in verdicts.values():
        stored.add(one, verdict)
    asked = [one for name, (one, _) in verdicts.items() if name != "other"] + [mutant(nth=9)]
    stored.write(7, asked)
    monkeypatch.setattr(record, "EQUIVALENT", {verdicts["same"][0].key: "the same either way"})
    monkeypatch.setattr(record, "LEFT", {verdicts["lost"][0].key: "no promise"})
    found = summary(path, root)
    assert found is not None and (found["seed"], found["asked"], found["judged"]) == (7, 5, 4)
    assert found["outdated"] == 0
    (root / "tests" / "test_new.py").write_text("")
    # What only a test noticed in a kernel, and what nothing did; not what is proved to change nothing.
    assert summary(path, root)["outdated"] == 2  # type: ignore[index]
    (root / "renderer" / "trace" / "a.py").write_text("x = a + b + c\n")
    changed = summary(path, root)
    assert changed is not None and changed["outdated"] == 4
    assert found["kernels"] == {
        "mutants": 3, "equivalent": 1, "killed": 2, "by_gates": 1, "hung": 1, "crashed": 0, "survivors": [],
    }  # fmt: skip
    lost = verdicts["lost"][0]
    assert found["python"]["survivors"] == [
        {"key": lost.key, "file": lost.file, "line": lost.line, "reason": "no promise"}
    ]
    assert [row["operator"] for row in found["operators"]] == ["arithmetic"]
    assert found["equivalent"] == [{"key": verdicts["same"][0].key, "proof": "the same either way"}]


def test_what_processes_measured_is_merged_and_kernels_bring_what_they_import(tmp_path: Path) -> None:
    root = Path(__file__).parents[3]
    leaf = str(root / "renderer" / "trace" / "leaf.py")
    for number, lines in enumerate(([1, 2], [2, 5])):
        found = {"tests/test_a.py": {"lines": {leaf: lines}, "kernels": [leaf], "seconds": 1.5}}
        (tmp_path / f"{number}.json").write_text(json.dumps(found))
    one = read(tmp_path, root)["tests/test_a.py"]
    assert one["lines"] == {"renderer/trace/leaf.py": [1, 2, 5]} and one["seconds"] == 3.0
    assert {"renderer/trace/leaf.py", "renderer/trace/intersect.py"} <= set(one["kernels"])


def test_a_workshop_breaks_one_file_and_mends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = Path(__file__).parents[3]
    shop = Workshop(root, tmp_path)
    shop.keep()
    files = sorted((root / "renderer" / "process").rglob("*.py"))
    one = next(m for m in mutants(files, root) if m.operator == "constant")
    sound = (shop.root / one.file).read_bytes()
    with shop.broken(one):
        assert (shop.root / one.file).read_bytes() != sound == (root / one.file).read_bytes()
        ended = shop.run(["-c", "import renderer, sys; print(renderer.__file__); sys.exit(3)"], 60.0)
        assert ended.code == 3 and str(shop.root) in ended.output
    assert (shop.root / one.file).read_bytes() == sound
    assert shop.run(["-c", "while True: pass"], 0.5).code is None
    # A limit of its own ends it where nobody is left to do so.
    monkeypatch.setattr(workshop, "_LARGEST", 1 << 22)
    printing = shop.run(["-c", "import os\nwhile True: os.write(1, b'x' * (1 << 20))"], 600.0)
    # 120 is Python's own where the words of its error find no room either.
    assert printing.code in (1, 120) and len(printing.output) == 1 << 20
    limited = "import resource as r\nwhile r.getrlimit(r.RLIMIT_CPU)[0] == r.RLIM_INFINITY: pass"
    assert shop.run(["-c", limited], 60.0).code == 0


def test_a_workshop_that_is_stopped_ends_what_it_runs(tmp_path: Path) -> None:
    shop = Workshop(Path(__file__).parents[3], tmp_path)
    begun = tmp_path / "begun"

    def stop() -> None:
        while not begun.exists():
            time.sleep(0.01)
        shop.stop()

    threading.Thread(target=stop).start()
    endless = f"import pathlib\npathlib.Path({str(begun)!r}).touch()\nwhile True: pass"
    for code in (endless, "pass"):
        with pytest.raises(ChildProcessError, match="stopped"):
            shop.run(["-c", code], 600.0)
