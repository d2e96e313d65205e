"""Who judges the public names: a name without a judge and a judge without a name turn a gate red."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from validation.gates import Gate
from validation.promises import judges, names, section
from validation.promises.judges import check_names, marked
from validation.report import chapters, page
from validation.studies import holds

GATE = Gate("hits", "a sphere", "leaks", 0.0, "at most", 0.0, "it is closed")


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout whose public names are two, one of which a test judges."""
    monkeypatch.setattr(judges, "public_names", lambda: ["load", "save"])
    (tmp_path / "tests").mkdir()
    (tmp_path / "pyproject.toml").touch()
    (tmp_path / "tests" / "test_files.py").write_text(
        'import pytest\n\n@pytest.mark.judges("load")\ndef test_load(): ...\n'
    )
    return tmp_path


def red(found: tuple[dict[str, Any], list[Gate]]) -> list[str]:
    return [gate.quantity for gate in found[1] if not gate.passed]


def test_a_name_without_a_judge_turns_the_gate_red(checkout: Path) -> None:
    found = check_names([GATE], (), checkout)
    assert red(found) == ["public names without a test or gate"] and len(found[1]) == 2
    assert found[0]["rows"] == [
        {"name": "load", "tests": ["test_files.py::test_load"], "gates": {}},
        {"name": "save", "tests": [], "gates": {}},
    ]


def test_gates_that_name_what_they_judge_count(checkout: Path) -> None:
    given = [replace(GATE, judged=("save",)), replace(GATE, judged=("save", "load"), section="queries")]
    found = check_names(given, (), checkout)
    assert red(found) == []
    assert [row["gates"] for row in found[0]["rows"]] == [{"queries": 1}, {"hits": 1, "queries": 1}]


def test_a_judge_of_an_unknown_name_turns_a_gate_red(checkout: Path) -> None:
    found = check_names([replace(GATE, judged=("save", "saev"))], (), checkout)
    assert red(found) == ["tested names that are not public"] and found[0]["unknown"] == ["saev"]
    (checkout / "tests" / "test_more.py").write_text('@pytest.mark.judges("laod")\ndef test(): ...\n')
    assert check_names([], (), checkout)[0]["unknown"] == ["laod"]


def shown(found: dict[str, Any]) -> str:
    """The section of the report, without promises."""
    environment = Environment(loader=FileSystemLoader(page._TEMPLATES), undefined=StrictUndefined)
    environment.filters["number"] = page.number
    environment.globals["partials"] = chapters.PARTIALS
    return environment.get_template("promises.html").render(m={"promises": {"rows": [], "names": found}})


def test_the_report_shows_who_judges_each_name_and_is_red_where_nobody_does(checkout: Path) -> None:
    html = shown(check_names([replace(GATE, judged=("saev",))], (), checkout)[0])
    assert '<td class="name bad">save</td><td class="wrap bad">no judge</td>' in html
    assert "test_files.py::test_load" in html and '<p class="bad">Judged, and not public: saev</p>' in html
    assert "Hits 1" in shown(check_names([replace(GATE, judged=("save",))], (), checkout)[0])
    assert "the run left out images" in shown(check_names([], ["images"], checkout)[0])


def test_where_tests_or_sections_are_missing_the_reason_is_said_and_nothing_is_judged(checkout: Path) -> None:
    assert check_names([GATE], ["images"], checkout) == ({"left_out": "the run left out images"}, [])
    (checkout / "pyproject.toml").unlink()
    assert check_names([GATE], (), checkout) == ({"left_out": "only a checkout has the tests"}, [])


def test_markers_of_files_classes_and_functions_are_found(tmp_path: Path) -> None:
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "test_all.py").write_text(
        """
pytestmark = [pytest.mark.slow, pytest.mark.judges("a", "b")]

@pytest.mark.judges("c")
class TestIt:
    @pytest.mark.parametrize("d", ["e"])
    @pytest.mark.judges("a")
    def test_it(self): ...

def test_none(): ...
"""
    )
    assert marked(tmp_path) == {
        "a": ["room/test_all.py", "room/test_all.py::TestIt::test_it"],
        "b": ["room/test_all.py"],
        "c": ["room/test_all.py::TestIt"],
    }


def test_every_public_name_has_a_judge_and_every_judge_a_public_name() -> None:
    """The checks of the suite are not run here; what they would judge stands beside them."""
    tests = set(marked(judges.ROOT / "tests"))
    parts = (section.HITS, section.QUERIES, section.PICTURES, section.SCENES, holds.CHECKS)
    judged = tests.union(*(check.judged for checks in parts for check in checks.values()))
    assert judged == set(names.public_names())
