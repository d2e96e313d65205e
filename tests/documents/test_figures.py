"""The figures of pages and chart are those of ``docs/figures.json``, which whole runs alone can change."""

import json
import re
import runpy
from copy import deepcopy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from cases import cases

ROOT = Path(__file__).parents[2]


def module(name: str) -> SimpleNamespace:
    """What a module of docs/ defines; it finds those beside it."""
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(ROOT / "docs")
        return SimpleNamespace(**runpy.run_path(str(ROOT / "docs" / f"{name}.py")))


@pytest.fixture(scope="module")
def figures() -> SimpleNamespace:
    return module("figures")


@pytest.fixture(scope="module")
def record() -> Any:
    return json.loads((ROOT / "docs" / "figures.json").read_text(encoding="utf-8"))


def test_pages_and_chart_are_what_the_record_gives(figures: SimpleNamespace, record: Any) -> None:
    """After an edit by hand, or of the record: ``python docs/figures.py``."""
    for path, text in figures.written(record).items():
        assert path.read_text(encoding="utf-8") == text, path


def test_each_mark_of_a_page_is_filled(figures: SimpleNamespace, record: Any) -> None:
    used = set()
    for page in figures.PAGES:
        text = page.read_text(encoding="utf-8")
        marks = figures.MARK.findall(text)
        assert len(marks) == text.count("<!-- figures:") == text.count("<!-- /figures -->") > 0
        used |= {name for _, name, _, _, _ in marks}
    assert used <= set(figures.BLOCKS)


def test_another_record_gives_other_pages(figures: SimpleNamespace, record: Any) -> None:
    other = deepcopy(record)
    other["validate"]["hits"]["wrong"] = 3
    changed = figures.written(other)
    for page in (ROOT / "README.md", ROOT / "docs" / "measured.md"):
        assert changed[page] != page.read_text(encoding="utf-8")
    assert "3 wrong hits in " in changed[ROOT / "README.md"]


def test_a_record_is_written_as_it_was_read(record: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = module("record")
    made.write.__globals__["RECORD"] = tmp_path / "figures.json"
    made.write(record)
    assert (tmp_path / "figures.json").read_bytes() == (ROOT / "docs" / "figures.json").read_bytes()


def metrics(**changes: Any) -> dict[str, Any]:
    """The parts of a whole run's ``metrics.json`` that are taken; a mesh, a picture and a case."""
    exact = {"rays": 2}
    family = {"rays": 10, "wrong": 0, "near_edge": 1, "exact": exact}
    leaks = [{"kind": f"{kind}_leak", "rays": 5, "ours": 0,
              "references": [{"name": "all", "rays": 5, "leaks": 2}, {"name": "few", "rays": 1, "leaks": 1}]}
             for kind in ("edge", "vertex", "edge")]  # fmt: skip
    pictures = [
        {"offset": rule, "ssim": ssim} for rule, ssim in (("matched", 0.99991234), ("own", 0.99), ("own", 0.98))
    ]
    cases = [{"number": number, "holds": True, "ours": f"case {number}"} for number in (12, 32)]
    inside = [{"subject": f"inside: star, {kind} points", "asked": 7, "wrong": 0, "beside": 3, "others": {"libigl": 1}}
              for kind in ("random", "nasty", "random")]  # fmt: skip
    return {
        "schema": 3, "quick": False, "own": True, "left_out": {}, "started": "2026-11-25T03:32:28+00:00",
        "seconds": 321.4567, "environment": {"processor": "P", "processors": 2, "sources": "0123456789abcdef"},
        "verdict": {"gates": 9, "failed": 0, "passed": True},
        "hits": {"meshes": [{"families": [family, family]}], "leaks": {"sets": leaks}},
        "stability": {"cases": cases, "watertight": {"meshes": [{"ours_rays": 4, "ours": 0}]}},
        "images": {"scenes": [{"rungs": [{"comparisons": pictures}], "paths": {"slope": -0.51234567}}, {"rungs": []}]},
        "queries": {"rows": [*inside, {"subject": "distance: ball", "asked": 1, "wrong": 0, "others": {}}]},
    } | changes  # fmt: skip


def test_a_run_of_the_validation_is_summed_up(tmp_path: Path) -> None:
    (tmp_path / "metrics.json").write_text(json.dumps(metrics()))
    name, run = module("record").distilled(tmp_path / "metrics.json")
    assert name == "validate" and run["hits"] == {"rays": 20, "wrong": 0, "near_edge": 2, "exact": 4}
    assert run["leaks"] == {"edge": {"rays": 10, "ours": 0, "all": 4}, "vertex": {"rays": 5, "ours": 0, "all": 2}}
    assert run["ssim"] == {"matched": 0.99991234, "own": 0.98} and run["slopes"] == [-0.51235]
    assert run["inside"]["random"] == {"asked": 14, "wrong": 0, "beside": 6, "others": {"libigl": 2}}
    assert (run["commit"], run["date"], run["seconds"]) == ("sources 0123456", "2026-11-25", 321.46)


@cases(
    "changes",
    [
        {"quick": True},
        {"own": False},
        {"left_out": {"images": "--only hits"}},
        {"verdict": {"gates": 9, "failed": 1, "passed": False}},
    ],
)
def test_a_run_that_is_not_whole_or_did_not_pass_is_refused(changes: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "metrics.json").write_text(json.dumps(metrics(**changes)))
    with pytest.raises(ValueError, match=re.escape(str(tmp_path / "metrics.json"))):
        module("record").distilled(tmp_path / "metrics.json")


def test_ratios_below_1_are_bold_and_do_not_read_as_1(figures: SimpleNamespace) -> None:
    assert [figures.times(r) for r in (0.999, 0.5, 1.0, 24.31, None)] == ["**0.99**", "**0.50**", "1.00", "24", "–"]
