"""The heat map: which ratio a cell shows, where hues change, that texts can be read, and what the ratios come to."""

import re
from typing import Any

import pytest

from validation.benchmark.page import heat, page
from validation.benchmark.page.heat import SHADES, few, first_hits, geometric_mean, legend, others, shade, summary, text


def _row(mesh: str, faces: int, family: str, query: str, ratio: float, **more: Any) -> dict[str, Any]:
    return {"mesh": mesh, "faces": faces, "family": family, "query": query, "agree": True,
            "ratios": {"embree": 50.0, "open3d": ratio}, "ratios_one_thread": {"embree": 2 * ratio}} | more  # fmt: skip


@pytest.fixture
def record() -> dict[str, Any]:
    build = {"contenders": {"ours_refit": {}}, "ratios": {"open3d": 4.0}, "ratios_refit": {"open3d": 8.0}}
    return {
        "systems": {"embree": {"label": "Embree"}, "open3d": {"label": "Open3D"}},
        "kinds": {"s_100k": "spheres", "s_10k": "spheres", "city_1k": "city", "own": "file"},
        "queries": [
            _row("s_100k", 98_304, "camera", "closest", 0.25), _row("s_100k", 98_304, "camera", "any", 4.0),
            _row("s_10k", 9_600, "camera", "closest", 1.5, agree=False), _row("city_1k", 1_000, "short", "any", 0.125),
            _row("own", 7, "camera", "closest", 1.0), _row("own", 7, "box", "nearest", 0.001),
        ],
        "builds": [{"mesh": "s_10k", "faces": 10_000} | build],
        "memory": [{"mesh": "s_10k", "faces": 10_000,
                    "systems": {"ours": {"rest": 100}, "open3d": {"rest": 150}, "embree": {"rest": 0}}}],
        "calls": [{"rays": 1, "micros": {}, "median": {"ours": 4.0}, "ratios": {"embree": 0.5, "open3d": 3.0}}],
    }  # fmt: skip


def test_rows_are_by_kind_then_faces_and_cells_have_the_ratio_thread_by_thread(record: dict[str, Any]) -> None:
    found = first_hits(record)
    assert [row["mesh"] for row in found["rows"]] == ["s_10k", "s_100k", "city_1k", "own"]
    assert found["peers"] == [("Embree", "one thread each"), ("Open3D", "all threads")]
    assert found["heads"] == [("closest hit", ["camera"]), ("any hit", ["camera", "short"])]
    embree, open3d = found["rows"][1]["peers"]
    assert [c and c["text"] for c in embree] == ["0.50", "8.00", None]
    assert [c and c["text"] for c in open3d] == ["0.25", "4.00", None]
    assert embree[0]["said"] == "s_100k: camera rays, closest hit, against embree: 0.500"
    # Points are none of the map's.
    assert [c and c["text"] for c in found["rows"][3]["peers"][1]] == ["1.00", None, None]


def test_disagreeing_contenders_are_marked(record: dict[str, Any]) -> None:
    cell = first_hits(record)["rows"][0]["peers"][1][0]
    assert not cell["agree"] and cell["said"].endswith("disagree")
    assert all(c["agree"] for c in first_hits(record)["rows"][1]["peers"][1] if c)


def test_the_summary_counts_all_cells_and_means_those_from_nine_thousand_faces(record: dict[str, Any]) -> None:
    embree, open3d = summary(record)
    assert (open3d["cells"], open3d["below"], open3d["least"]) == (5, 2, 0.125)
    assert open3d["where"] == "city_1k: short rays, any hit"
    assert open3d["mean"] == pytest.approx((0.25 * 4.0 * 1.5) ** (1 / 3))
    # 1 itself is not below 1.
    assert (embree["cells"], embree["below"]) == (5, 2) and embree["mean"] == pytest.approx(2 * open3d["mean"])


def test_builds_refits_memory_and_calls_have_cells_where_they_were_measured(record: dict[str, Any]) -> None:
    found = others(record)
    assert found["what"] == ("build", "refit", "memory at rest")
    texts = [[c and c["text"] for c in cells] for cells in found["rows"][0]["cells"]]
    # A memory of nothing is below what a system reports, and makes no ratio.
    assert texts == [[None, "4.00", None], [None, "8.00", None], [None, "1.50", None]]
    assert [c and c["text"] for c in few(record)["rows"][0]["cells"]] == ["0.50", "3.00"]


@pytest.mark.parametrize(
    ("ratio", "name"),
    [(0.01, "below4"), (0.4999, "below4"), (0.5, "below3"), (0.75, "below2"), (0.99999, "below1"), (1.0, "above1"),
     (1.2, "above2"), (1.5, "above3"), (2.0, "above4"), (3.999, "above4"), (4.0, "above5"), (1e6, "above5")],
)  # fmt: skip
def test_shades_are_steps_of_the_logarithm_and_the_hue_changes_at_one(ratio: float, name: str) -> None:
    assert shade(ratio) == name


def test_a_ratio_below_one_does_not_read_as_one() -> None:
    assert [text(r) for r in (0.5, 0.999, 1.0, 1.234, 9.999, 42.42, 1234.5)] == [
        "0.50", "0.99", "1.00", "1.23", "10.0", "42.4", "1234"]  # fmt: skip


def test_the_geometric_mean_of_a_ratio_and_its_inverse_is_one() -> None:
    assert geometric_mean([4.0, 0.25]) == 1.0 and geometric_mean([]) is None


def test_the_legend_names_every_shade_in_order() -> None:
    assert [name for name, _ in legend()] == [s.name for s in SHADES] and SHADES[0].least == 0.0
    assert dict(legend())["above1"] == "1 to 1.2" and dict(legend())["below1"] == "0.84 to 1"


def _channels(colour: str) -> list[float]:
    return [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]


def _luminance(colour: str) -> float:
    """As WCAG 2 defines it."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in _channels(colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_texts_can_be_read_and_hues_told_apart(theme: str) -> None:
    for step in SHADES:
        back, ink = getattr(step, theme)
        least, most = sorted((_luminance(back), _luminance(ink)))
        assert (most + 0.05) / (least + 0.05) >= 4.5, step.name
        red, _, blue = _channels(back)
        # Orange beside blue: who is blind to red or green still sees which of blue and red is more.
        assert (red > blue) == step.name.startswith("below"), step.name
    # The farther from 1, the more a shade differs from the page's cards.
    lightness = [_luminance(getattr(step, theme)[0]) for step in SHADES]
    below, above = lightness[:4], lightness[4:]
    assert below == sorted(below, reverse=theme == "dark") and above == sorted(above, reverse=theme == "light")


def test_the_terminal_has_a_line_for_each_peer(record: dict[str, Any]) -> None:
    lines = list(page._heat_lines(record))
    assert len(lines) == 3
    assert re.fullmatch(
        r"heat map, open3d, all threads: geometric mean 1\.14, least 0\.12 "
        r"\(city_1k: short rays, any hit\), 2 of 5 cells below 1", lines[1])  # fmt: skip
    assert lines[2] == "calls of 1, peer's time over ours: embree 0.50, open3d 3.00"


def test_a_peer_that_was_not_measured_has_no_column(record: dict[str, Any]) -> None:
    for row in record["queries"]:
        del row["ratios"]["open3d"]
    assert heat.peers(record) == ["embree"] and len(first_hits(record)["rows"][0]["peers"]) == 1
