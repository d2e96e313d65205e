"""The baseline: what counts as better, worse or noise, and what may become a baseline."""

from pathlib import Path
from typing import Any

import pytest
from cases import cases

from validation.gates import Gate
from validation.report import baseline


def gate(value: float, threshold: float = 1.0, section: str = "hits", bound: Any = "at most") -> dict[str, Any]:
    return Gate(section, "subject", "quantity", value, bound, threshold, "reason").record()


def metrics(*gates: dict[str, Any], seconds: float = 10.0, **records: Any) -> dict[str, Any]:
    sections = dict.fromkeys(g["section"] for g in gates)
    return {
        "schema": 3, "command": "python -m validation", "quick": False, "own": True, "left_out": {},
        "started": "2026-01-01",
        "verdict": {"passed": all(g["passed"] for g in gates), "failed": sum(not g["passed"] for g in gates)},
        "environment": {"python": "3.11", "threads": 2, "processor": "one", "packages": {"numpy": "2.0"}},
        "matrix": [{"section": name} for name in sections], "gates": list(gates),
        **{name: {"seconds": seconds, "costs": {}, **records.get(name, {})} for name in sections},
    }  # fmt: skip


def change(before: dict[str, Any], now: dict[str, Any]) -> dict[str, Any]:
    return baseline.compare(now, baseline.summary(before))


@cases(
    ("before", "now", "better", "worse"),
    [
        (gate(0.5), gate(0.5), 0, 0),
        (gate(0.5), gate(0.54), 0, 0),  # within 10 %
        (gate(0.5), gate(0.6), 0, 1),
        (gate(0.5), gate(0.4), 1, 0),
        (gate(0.001), gate(0.009), 0, 0),  # nine times as much, but less than 1 % of the threshold
        (gate(0.0, 0.0), gate(1.0, 0.0), 0, 1),  # fails
        (gate(0.999, 1.0), gate(1.001, 1.0), 0, 1),  # within 10 %, but the verdict changed
        (gate(0.5), gate(float("nan")), 0, 1),
        # Similarities: the error is what is missing to 1.
        (gate(0.9999, 0.999, bound="at least"), gate(0.9995, 0.999, bound="at least"), 0, 1),
        (gate(0.9995, 0.999, bound="at least"), gate(0.9999, 0.999, bound="at least"), 1, 0),
        # Counts from below: more is better.
        (gate(20.0, 5.0, bound="at least"), gate(10.0, 5.0, bound="at least"), 0, 1),
        (gate(0.5, section="efficiency"), gate(0.9, section="efficiency"), 0, 0),
        (gate(0.5, section="efficiency"), gate(1.1, section="efficiency"), 0, 1),
    ],
)
def test_better_and_worse(before: dict[str, Any], now: dict[str, Any], better: int, worse: int) -> None:
    found = change(metrics(before), metrics(now))
    assert (len(found["better"]), len(found["worse"])) == (better, worse)


def test_bits_ratios_and_seconds() -> None:
    before = {"a": {"ours_sha256": "1"}, "b": [{"ours_sha256": "2", "ratio_to_embree": 2.0}], "speedup": 9.0}
    now = {"a": {"ours_sha256": "1"}, "b": [{"ours_sha256": "3", "ratio_to_embree": 1.9}], "speedup": 3.0}
    found = change(metrics(gate(0.5), hits=before), metrics(gate(0.5), seconds=14.0, hits=now))
    assert found["outputs"] == 2 and found["outputs_differ"] == ["hits.b.0.ours_sha256"]
    assert found["slower"] == ["hits.speedup: 9 × before, 3 × now"] and found["faster"] == []
    found = change(metrics(gate(0.5), hits=now), metrics(gate(0.5), seconds=5.0, hits=before))
    assert found["faster"] == ["hits: 10 s before, 5 s now", "hits.speedup: 3 × before, 9 × now"]


def test_versions_and_defects() -> None:
    caught = [{"name": "gain", "caught": True}, {"name": "fov", "caught": True}]
    before = metrics(gate(0.5)) | {"defects": {"defects": caught}}
    now = metrics(gate(0.5)) | {"defects": {"defects": [{"name": "gain", "caught": False}]}}
    now["environment"] = now["environment"] | {"packages": {"numpy": "2.4"}}
    found = change(before, now)
    assert found["defects_lost"] == ["gain"] and found["versions"] == ["numpy: 2.0 before, 2.4 now"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"quick": True}, "quick run"), ({"own": False}, "files given"), ({"left_out": {"hits": "why"}}, "a part")],
)
def test_only_a_whole_run_becomes_a_baseline(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        baseline.summary(metrics(gate(0.5)) | changes)


@pytest.mark.parametrize(("changes", "words"), [({"quick": True}, "Quick runs"), ({"own": False}, "files given")])
def test_what_is_not_compared_says_so(changes: dict[str, Any], words: str) -> None:
    stored = baseline.summary(metrics(gate(0.5)))
    assert words in baseline.compare(metrics(gate(0.5)) | changes, stored)["absent"]
    assert "--write-baseline" in baseline.compare(metrics(gate(0.5)), None)["absent"]


def test_the_file_is_read_as_it_was_written_and_checked(tmp_path: Path) -> None:
    path = tmp_path / "baseline.json"
    assert baseline.read(path) is None
    path.write_bytes(baseline.text(metrics(gate(0.5), gate(0.25, section="images"))))
    assert baseline.read(path) == baseline.summary(metrics(gate(0.5), gate(0.25, section="images")))
    path.write_text(path.read_text(encoding="utf-8").replace('"value": 0.5', '"value": "half"'))
    with pytest.raises(ValueError, match=r"baseline\.json: gates\.hits: subject: quantity\.value"):
        baseline.read(path)
