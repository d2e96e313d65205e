"""The page: it stands alone, shows each picture once, and says what the metrics say; the schema of the metrics."""

import re
import struct
import zlib
from pathlib import Path
from typing import Any

import pytest

from validation.gates import Gate
from validation.report import page as report
from validation.report import schema, summary


def png(path: Path, grey: int, width: int = 2, height: int = 1) -> None:
    """A grey picture with the least that a PNG needs."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    rows = (b"\x00" + bytes([grey]) * width) * height
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    chunks = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


@pytest.fixture
def metrics(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Of a run of the pictures alone, one gate of which fails; its partial shows the same pictures twice."""
    triple = '{{ triple({"ours": "a.png", "reference": "b.png", "difference": "c.png"}, "a scene") }}'
    (tmp_path / "plain.html").write_text('{% from "macros.html" import triple %}' + triple * 2)
    monkeypatch.setattr(report, "_TEMPLATES", [report._TEMPLATES, tmp_path])
    plain = report.PARTIALS["images"]._replace(template="plain.html")
    monkeypatch.setattr(report, "PARTIALS", report.PARTIALS | {"images": plain})
    for name, grey in (("a.png", 10), ("b.png", 20), ("c.png", 10)):
        png(tmp_path / name, grey)
    gates = [
        Gate("images", "glass", "ssim", 0.5, "at least", 0.998, "structure").record(),
        Gate("images", "stairs", "ssim", 0.9999, "at least", 0.998, "structure").record(),
    ]
    failed = {"subject": "glass", "failed": {"ours": "failed/glass-ours.exr"}}
    record = {"seconds": 2.0, "costs": {"Mitsuba <3>": 1.5}, "scenes": [failed]}
    rows = summary.matrix({"images": record}, gates)
    return {
        "schema": 3, "command": "python -m validation --only images", "quick": False, "own": True,
        "started": "2026-01-01T10:00:00+00:00", "seconds": 3.0, "verdict": summary.verdict(gates), "matrix": rows,
        "facts": summary.facts({"images": record}, gates, None), "thresholds": {"file": None, "moved": {}},
        "gates": gates,
        "left_out": {"hits": "not named by --only"}, "baseline": {"absent": "There is none."}, "images": record,
        "environment": {"python": "3.11", "processor": "one", "threads": 2, "platform": "p", "packages": {"numpy": "2"},
                        "sources": "0" * 64},
    }  # fmt: skip


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


def test_the_verdict_comes_first_and_names_what_fails(metrics: dict[str, Any], tmp_path: Path) -> None:
    page = report.page(metrics, tmp_path)
    assert "1 of 2 gates hold" in page
    top = page[: page.index('id="sections"')]
    assert "glass: ssim" in top and "stairs" not in top
    assert 'href="pictures/failed/glass-ours.exr"' in top
    assert page.index("<details") > page.index('id="sections"')
    # The section that fails is open, and no other.
    assert page.count('" open>') == 1 and 'id="section-images" open>' in page
    names = (
        "verdict",
        "sections",
        "section-images",
        "checks",
        "defects",
        "appendix",
        "gates",
        "references",
        "versions",
    )
    order = [page.index(f'id="{name}"') for name in names]
    assert order == sorted(order)
    assert "Mitsuba &lt;3&gt;" in page and "not named by --only" in page and "There is none." in page


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
