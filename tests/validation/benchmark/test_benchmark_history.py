"""The history of ideas: its file, what is refused of it, and how the page shows it."""

from pathlib import Path
from typing import Any

import pytest

from validation.benchmark.page import history
from validation.benchmark.page.page import ideas_tables

# An example of the form, to be replaced by nothing: it was never tried.
EXAMPLE = """
[[ideas]]
idea = "EXAMPLE, to be replaced: <boxes> of four faces instead of one."
kept = true
before = "0123abc"
after = "4567defabcd"
date = 2026-01-31
machine = "a machine"
command = "python -m nothing"
[[ideas.rows]]
mesh = "city_1m"
family = "camera rays, closest hit"
threads = 1
ratio = 1.25
[[ideas.rows]]
mesh = "soup_1m"
family = "short rays, any hit"
threads = 2
ratio = 0.97
"""
DROPPED = EXAMPLE.replace("kept = true", "kept = false").replace('after = "4567defabcd"\n', "").replace("1.25", "0.625")


def _read(tmp_path: Path, text: str) -> list[history.Idea]:
    (tmp_path / "history.toml").write_text(text, encoding="utf-8")
    return history.read(tmp_path / "history.toml")


def test_the_projects_own_file_is_sound_and_tells_its_form(tmp_path: Path) -> None:
    assert isinstance(history.read(), list)
    said = history.FILE.read_text(encoding="utf-8").splitlines()
    form = [line[2:] for line in said if line.startswith("# ") and ("=" in line or line.startswith("# [["))]
    (idea,) = _read(tmp_path, "\n".join(form))
    assert idea.rows[0].threads == 1 and idea.kept


def test_ideas_are_read_in_order_with_all_rows(tmp_path: Path) -> None:
    kept, dropped = _read(tmp_path, EXAMPLE + DROPPED)
    assert [row.ratio for row in kept.rows] == [1.25, 0.97] and str(kept.date) == "2026-01-31"
    assert kept.kept and not dropped.kept and dropped.after is None
    assert _read(tmp_path, "# nothing yet\n") == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('machine = "a machine"', 'machine = "a"\nmachin = "b"', r"ideas\.0\.machin: Extra inputs are not permitted"),
        ("threads = 1", "threads = 1\nquery = 3", r"ideas\.0\.rows\.0\.query: Extra inputs"),
        ("[[ideas]]", "version = 1\n[[ideas]]", r"version: Extra inputs"),
        ('machine = "a machine"\n', "", r"ideas\.0\.machine: Field required"),
        ("ratio = 0.97", "ratio = 0.0", r"ideas\.0\.rows\.1\.ratio: Input should be greater than 0"),
        ("ratio = 0.97", "ratio = inf", r"rows\.1\.ratio: Input should be a finite number"),
        ("threads = 2", "threads = 0", r"rows\.1\.threads: "),
        ("threads = 2", 'threads = "2"', r"rows\.1\.threads: Input should be a valid integer"),
        ("kept = true", 'kept = "yes"', r"ideas\.0\.kept: Input should be a valid boolean"),
        ("2026-01-31", '"January"', r"ideas\.0\.date: "),
        ('before = "0123abc"', 'before = "main"', r"ideas\.0\.before: String should match"),
        ('after = "4567defabcd"\n', "", r"ideas\.0: .*after: expected the commit with the idea"),
        ("[[ideas]]", "[[ideas", r"history\.toml: .*line 2"),
    ],
)
def test_faults_are_refused_with_their_place(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in EXAMPLE
    with pytest.raises(ValueError, match=said) as caught:
        _read(tmp_path, EXAMPLE.replace(old, new, 1))
    assert "\n" not in str(caught.value) and "history.toml" in str(caught.value)


def test_an_idea_without_a_measurement_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"ideas\.0\.rows"):
        _read(tmp_path, EXAMPLE.split("[[ideas.rows]]")[0] + "rows = []\n")


def test_the_page_shows_kept_and_dropped_ideas(tmp_path: Path) -> None:
    ideas: list[Any] = _read(tmp_path, EXAMPLE + DROPPED)
    kept, dropped = ideas_tables(ideas).split("Tried and dropped")
    assert "EXAMPLE, to be replaced: &lt;boxes&gt;" in kept and "1.25" in kept and "0.97" in kept
    assert "4567defabcd" in kept and "2026-01-31" in kept and "0.62" not in kept
    assert "0.62" in dropped and "1.25" not in dropped
    assert ideas_tables([]).count("Nothing is recorded yet.") == 2
