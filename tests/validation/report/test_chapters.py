"""The order of the page: what comes first, what is open, what is named as absent, and that it fits every width."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from viewer_page import chromium

from validation.gates import Gate
from validation.report import chapters, summary
from validation.report import page as report

PARTIAL = """{% from "macros.html" import fold %}<p>What {{ row.section }} found.</p>
{% call fold(row.failed, "More") %}{% if row.section == "images" %}<h3 id="picture-glass">glass</h3>{% endif %}
<p>All of {{ row.section }}.</p>{% endcall %}"""
KERNELS = ("ours", "embree_default", "embree_robust")
POINTS = [{"x": x} | {kernel: {"relative_max": 1e-7} for kernel in KERNELS} for x in (1.0, 10.0)]
LEAKS = [{"faces": faces, "rays": 1000} | dict.fromkeys(KERNELS, 0) for faces in (80, 320)]
CURVE = {"who": "ours", "knob": "samples", "points": [{"seconds": 1.0, "rmse": 0.1}, {"seconds": 2.0, "rmse": 0.05}]}
FILES = {"ours": "a.png", "reference": "b.png", "difference": "c.png"}
# What the head of the page reads of the records.
RECORDS: dict[str, dict[str, Any]] = {
    "images": {"scenes": [{"name": "glass", "rungs": [{"comparisons": [{"ssim": 0.5, "files": FILES}]}]}]},
    "stability": {"curves": {"offset": {"label": "offset", "points": POINTS}, "leaks": LEAKS}},
    "efficiency": {"tradeoff_pictures": {"scene": "glass", "curves": [CURVE]}},
}
DEFECTS = {
    "caught": 1, "defects": [], "gates": [], "control": {"red": [], "gates": 9, "error": None},
    "started": "2026-01-01T10:00:00+00:00", "quick": False, "changed": False,
}  # fmt: skip
LONG = Gate("queries", "a_name_that_is_long" * 12, "wrong", 2.0, "at most", 0.0, "a reason that is long as well " * 9)


def drawn(metrics: dict[str, Any], folder: Path, *parts: str, gates: tuple[Gate, ...] = (), **more: Any) -> str:
    """The page of a run of these parts, all of them by default, in which each has a gate that holds."""
    ran = [name for name in chapters.PARTIALS if name in (parts or chapters.PARTIALS)]
    held = [Gate(name, "all", "errors", 0.0, "at most", 0.0, "") for name in ran if name != "efficiency"]
    judged = [gate.record() for gate in (*held, *gates)]
    records = {name: {"seconds": 1.0, "costs": {}} | RECORDS.get(name, {}) for name in ran}
    metrics = {key: value for key, value in metrics.items() if key != "images"} | records
    metrics |= {"gates": judged, "verdict": summary.verdict(judged), "matrix": summary.matrix(records, judged)}
    metrics["left_out"] = {name: "not named by --only" for name in chapters.PARTIALS if name not in ran}
    return report.page(metrics | more, folder)


@pytest.fixture(autouse=True)
def plain(metrics: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each part of the page is a sentence and a fold."""
    (tmp_path / "plain.html").write_text(PARTIAL)
    partials = {name: partial._replace(template="plain.html") for name, partial in chapters.PARTIALS.items()}
    monkeypatch.setattr(chapters, "PARTIALS", partials)


def sections(page: str) -> dict[str, str]:
    """The text of each section of the page by its id, tags left out."""
    found = re.findall(r'<section id="(\w+)">\s*<h2>.*?</h2>(.*?)</section>', page, re.DOTALL)
    return {name: " ".join(re.sub(r"<[^>]*>", " ", text).split()) for name, text in found}


def test_verdict_pictures_and_plots_come_before_the_sections_in_their_order(
    metrics: dict[str, Any], tmp_path: Path
) -> None:
    page = drawn(metrics, tmp_path, defects=DEFECTS)
    keys = ["hits", "pictures", "queries", "studies", "stability", "checks", "appendix"]
    places = [page.index(f'id="{name}"') for name in ("verdict", "strip", "plots", *keys)]
    assert places == sorted(places)
    assert page[: page.index("<section")].count("<svg") == 3
    assert re.findall(r'href="#(\w+)"', page[page.index("<nav") : page.index("</nav")]) == keys
    assert list(sections(page)) == keys


def test_a_failing_gate_is_at_the_top_and_first_in_its_open_section(metrics: dict[str, Any], tmp_path: Path) -> None:
    page = drawn(metrics, tmp_path, gates=(Gate("random", "scene 3", "red", 2.0, "at most", 0.0, "why"),))
    assert "scene 3: red" in page[: page.index("<section")]
    stability = sections(page)["stability"]
    assert 0 <= stability.index("scene 3: red") < stability.index("What stability found")
    # The part that fails is open, and no other.
    assert page.count(" open>") == 1 and '" open>' in page[page.index('id="section-random"') :].partition("</div>")[0]
    assert re.findall(r'class="bad">(\w+)</a>', page) == ["Stability"]


def test_no_section_is_empty_and_what_did_not_run_is_one_line(metrics: dict[str, Any], tmp_path: Path) -> None:
    page = drawn(metrics, tmp_path, "hits")
    assert list(sections(page)) == ["hits", "appendix"] and all(sections(page).values())
    assert 'id="strip"' not in page and 'id="plots"' not in page
    (line,) = re.findall(r'id="absent">(.*?)</p>', page)
    assert line == (
        "Not in this run: Pictures, Queries, Studies, Stability, Random input, Promises, Efficiency (not named by "
        "--only); seeded defects (no run is stored; python -m validation --defects makes one in one to two hours)."
    )
    assert 'id="absent"' not in drawn(metrics, tmp_path, defects=DEFECTS)


def test_seeded_defects_and_judged_names_are_one_section(metrics: dict[str, Any], tmp_path: Path) -> None:
    checks = sections(drawn(metrics, tmp_path, "hits", "promises", defects=DEFECTS))["checks"]
    assert "seeded defects were caught" in checks and "What promises found" in checks
    assert "seeded defects" in sections(drawn(metrics, tmp_path, "hits", defects=DEFECTS))["checks"]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as started:
        yield started


@pytest.fixture
def file(metrics: dict[str, Any], tmp_path: Path) -> str:
    """The address of a page whose failing gate has long words."""
    path = tmp_path / "index.html"
    path.write_text(drawn(metrics, tmp_path, gates=(LONG,), defects=DEFECTS), encoding="utf-8")
    return path.as_uri()


@pytest.mark.parametrize("width", [390, 1280])
def test_the_page_is_as_wide_as_its_window_with_all_folds_open(browser: Any, file: str, width: int) -> None:
    page = browser.new_page(viewport={"width": width, "height": 800})
    page.goto(file)
    for _ in range(2):
        assert page.evaluate("document.documentElement.scrollWidth") == width
        page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    page.close()


def test_a_small_picture_opens_the_fold_of_the_large_one(browser: Any, file: str) -> None:
    page = browser.new_page()
    page.goto(file)
    large = page.locator("#picture-glass")
    assert not large.is_visible()
    page.click("#strip a >> nth=0")
    assert large.is_visible()
    page.close()
