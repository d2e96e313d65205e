"""The heat map: which ratio a cell shows, and what the ratios come to."""

from typing import Any

import pytest

from validation.benchmark.page.heat import few, first_hits, geometric_mean, others, peers, summary, text


def _row(mesh: str, faces: int, family: str, query: str, ratio: float, **more: Any) -> dict[str, Any]:
    return {"mesh": mesh, "faces": faces, "family": family, "query": query, "agree": True,
            "ratios": {"embree": 50.0, "open3d": ratio}, "ratios_one_thread": {"embree": 2 * ratio}} | more  # fmt: skip


@pytest.fixture
def record() -> dict[str, Any]:
    build = {"ratios": {"open3d": 4.0}, "ratios_refit": {"open3d": 8.0}}
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
    texts = [[c and c["text"] for c in cells] for cells in found["rows"][0]["cells"]]
    # A memory of nothing is below what a system reports, and makes no ratio.
    assert texts == [[None, "4.00", None], [None, "8.00", None], [None, "1.50", None]]
    assert [c and c["text"] for c in few(record)["rows"][0]["cells"]] == ["0.50", "3.00"]


def test_a_ratio_below_one_does_not_read_as_one() -> None:
    assert [text(r) for r in (0.5, 0.999, 1.0, 1.234, 9.999, 42.42, 1234.5)] == [
        "0.50", "0.99", "1.00", "1.23", "10.0", "42.4", "1234"]  # fmt: skip


def test_the_geometric_mean_of_a_ratio_and_its_inverse_is_one() -> None:
    assert geometric_mean([4.0, 0.25]) == 1.0 and geometric_mean([]) is None


def test_a_peer_that_was_not_measured_has_no_column(record: dict[str, Any]) -> None:
    for row in record["queries"]:
        del row["ratios"]["open3d"]
    assert peers(record) == ["embree"] and len(first_hits(record)["rows"][0]["peers"]) == 1
