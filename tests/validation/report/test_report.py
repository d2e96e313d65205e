"""The page: it stands alone, shows each picture once, and says what the metrics say; the schema of the metrics."""

import re
from pathlib import Path
from typing import Any

import pytest

from validation.gates import Gate
from validation.report import page as report
from validation.report import schema, summary


def test_the_page_stands_alone_and_holds_each_picture_once(metrics: dict[str, Any], tmp_path: Path) -> None:
    schema.check(metrics)
    page = report.page(metrics, tmp_path)
    assert page.count('class="triple"') == 2
    # Three names, but two of them hold the same picture.
    assert page.count("data:image/png;base64,") == 2 and page.count("aspect-ratio: 2 / 1") == 2
    outside = re.findall(r'(?:src|href)="(?!#|data:|pictures/)[^"]*"|url\((?!"data:)|@import|<link', page)
    assert outside == []
    anchors = set(re.findall(r'href="#([^"]+)"', page))
    assert anchors <= set(re.findall(r'id="([^"]+)"', page))


def test_a_failing_gate_has_its_files_and_names_are_escaped(metrics: dict[str, Any], tmp_path: Path) -> None:
    page = report.page(metrics, tmp_path)
    assert "1 of 2 gates hold" in page
    assert 'href="pictures/failed/glass-ours.exr"' in page[: page.index("<section")]
    assert "Mitsuba &lt;3&gt;" in page and "There is none." in page


@pytest.mark.parametrize(
    ("key", "value", "where"),
    [
        ("schema", 1, "schema"),
        ("gates", [{"section": "hits"}], "gates.0.subject"),
        ("images", {"seconds": 1.0}, "images.costs"),
        ("images", {"seconds": -1.0, "costs": {}}, "images.seconds"),
        ("surprise", 1, "surprise"),
        ("seconds", float("nan"), "seconds"),
    ],
)
def test_metrics_of_another_form_are_refused_with_the_key(
    metrics: dict[str, Any], key: str, value: Any, where: str
) -> None:
    with pytest.raises(ValueError, match=f"metrics: {where}: "):
        schema.check(metrics | {key: value})


def test_a_verdict_that_its_numbers_do_not_give_is_refused(metrics: dict[str, Any], tmp_path: Path) -> None:
    metrics["gates"][0] |= {"passed": True}
    with pytest.raises(ValueError, match=r"gates\.0: .*passed is True"):
        schema.check(metrics)


def test_metrics_are_read_as_they_were_written(metrics: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "metrics.json"
    path.write_bytes(schema.text(metrics))
    assert schema.read(path) == metrics
    path.write_text(path.read_text(encoding="utf-8").replace('"schema": 3', '"schema": 1'))
    with pytest.raises(ValueError, match=r"metrics\.json: schema: .*got 1"):
        schema.read(path)
    path.write_text("{")
    with pytest.raises(ValueError, match=r"metrics\.json: expected JSON"):
        schema.read(path)


README = Path(__file__).parents[3] / "reports" / "README.md"


def described() -> dict[str, tuple[str, str]]:
    """The type and the meaning of each key of ``metrics.json`` by its table in the folder's readme."""
    rows = re.findall(
        r"^\| (`.*?) \| (.*?) \| (.*) \|$", README.read_text().partition("## metrics.json")[2], re.MULTILINE
    )
    return {key: (kind, meaning) for keys, kind, meaning in rows for key in re.findall(r"`(\w+)`", keys)}


def test_every_key_of_the_schema_is_in_the_readme() -> None:
    keys = {field.alias or name for name, field in schema.Metrics.model_fields.items()}
    assert keys == set(described())


def test_a_failure_that_rounds_to_its_threshold_keeps_its_digits() -> None:
    nearly = Gate("images", "glass", "ssim", 1.0 - 2**-40, "at least", 1.0, "why").record()
    assert summary.failure(nearly) == "ssim is 0.9999999999990905, expected at least 1"


def test_five_numbers_at_the_head_each_over_what_was_counted() -> None:
    gates = [
        Gate("hits", "a, camera", "wrong hits", 0.0, "at most", 0.0, "").record(),
        Gate("hits", "a, edges", "wrong hits", 2.0, "at most", 0.0, "").record(),
        Gate("hits", "a", "leaks", float("nan"), "at most", 0.0, "").record(),
        Gate("queries", "inside", "wrong answers", 0.0, "at most", 0.0, "").record(),
    ]
    families = [{"rays": 1000}, {"rays": 500}]
    records: dict[str, Any] = {"hits": {"meshes": [{"families": families}]}, "queries": {"rows": [{"asked": 40}]}}
    found = [(fact["value"], fact["label"].partition(":")[0]) for fact in summary.facts(records, gates, None)]
    assert found == [
        (2.0, "wrong hits in 1,500 rays"),
        (None, "leaks through closed meshes, in 1 sets of rays"),
        (0.0, "wrong answers in 40 queries"),
    ]


def test_every_table_scrolls_by_itself_and_the_page_is_as_wide_as_a_phone() -> None:
    """A table of seven columns had made the whole page wider than a phone."""
    texts = {path.name: path.read_text(encoding="utf-8") for path in (report._TEMPLATES).glob("*.html")}
    assert "hits.html" in texts and 'content="width=device-width' in texts["report.html"]
    for name, text in texts.items():
        assert text.count("<table") == len(re.findall(r'<div class="scroll[^"]*"><table', text)), name
