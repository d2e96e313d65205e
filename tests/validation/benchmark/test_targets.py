"""Targets: the worst of the rows that count, the mean that is aimed at, and whether a bound is reached."""

from typing import Any

import pytest

from validation.benchmark.measures import frames, processes
from validation.benchmark.page.targets import Target, judged


@pytest.mark.parametrize(
    ("better", "measured", "met"),
    [("above", 2.0, True), ("above", 1.9, False), ("below", 2.0, True), ("below", 2.1, False), ("above", None, None)],
)
def test_a_target_is_met_from_its_bound_on(better: str, measured: float | None, met: bool | None) -> None:
    assert Target("s", "times", better, 2.0, None, measured, "w", "r").record()["met"] is met


def _rays(name: str, faces: int, efficiency: float | None = None, **ratios: float) -> dict[str, Any]:
    """A row of first hits, whose ratio to embree with all threads must not be taken."""
    one = {name: value for name, value in ratios.items() if name == "embree"}
    return {"mesh": name, "faces": faces, "family": "camera", "query": "closest", "agree": True,
            "efficiency": efficiency, "ratios": ratios | dict.fromkeys(one, 9.0), "ratios_one_thread": one}  # fmt: skip


def _points(name: str, faces: int, **ratios: float) -> dict[str, Any]:
    return {"mesh": name, "faces": faces, "family": "near", "query": "nearest", "ratios": ratios}


def _record() -> dict[str, Any]:
    return {
        "systems": {name: {"label": name.title()} for name in ("embree", "open3d", "mitsuba_llvm")},
        "kinds": {"small": "spheres", "middle": "spheres", "large": "spheres"},
        "queries": [
            _rays("small", 1_000, 0.5, embree=0.75),
            _rays("middle", 9_600, 0.96, embree=8.0, open3d=1.5),
            _rays("large", 1_000_000, 0.97, embree=2.0),
            _points("small", 1_000, open3d=0.5),
            _points("middle", 100_000, open3d=1.5, libigl=2.5),
            _points("large", 5_000_000, open3d=2.5, libigl=7.0),
        ],
        "builds": [
            {"mesh": "small", "faces": 1_000, "ratios": {"open3d": 0.1}, "ratios_refit": {"open3d": 0.1}},
            {"mesh": "middle", "faces": 100_000, "ratios": {"open3d": 4.0}, "ratios_refit": {"open3d": 8.0}},
            {"mesh": "large", "faces": 1_000_000, "ratios": {"open3d": 1.0}, "ratios_refit": {"open3d": 2.0}},
        ],
        "memory": [
            {"mesh": "large", "faces": 1_000_000, "systems": {"ours": {"rest": 30}, "open3d": {"rest": 40}}},
            {"mesh": "middle", "faces": 100_000, "systems": {"ours": {"rest": 30}}},
        ],
        "calls": [
            {"rays": 1, "median": {"ours": 4.5, "embree": 2.0}, "ratios": {"embree": 2.5}},
            {"rays": 10, "median": {"ours": 5.0, "embree": 4.0}, "ratios": {"embree": 0.75}},
        ],
        "studies": [
            {"mesh": "city", "rays": 80, "seconds": 2.0, "shadow": 20.0, "memory": 5, "array": 100,
             "peers": {"open3d": {"whole": 4.0}}},
            {"mesh": "terrain", "rays": 90, "seconds": 3.0, "shadow": 60.0, "memory": 20, "array": 100,
             "peers": {"open3d": {"whole": 12.0}}},
        ],
        "frames": {"size": 512, "ratios": {frames.LISTS: 1.5}},
        "processes": {name: {"median": 1.0} for name in (processes.WARM, processes.IMPORT)},
        "first_answers": {"rows": {"first_hit_cpu": {"median": 8.5, "unit": "CPU s"}}},
    }  # fmt: skip


@pytest.fixture(scope="module")
def targets() -> dict[str, dict[str, Any]]:
    return {t["subject"]: t for t in judged(_record())}


def test_first_hits_are_judged_on_every_row_and_aimed_at_by_their_mean(targets: dict[str, dict[str, Any]]) -> None:
    embree = targets["first hits, against embree, one thread each"]
    assert (embree["at_least"], embree["aim"]) == (1.0, 1.5)
    assert (embree["measured"], embree["where"], embree["met"]) == (0.75, "small: camera rays, closest hit", False)
    # The root of 8 times 2: the mesh below 9,000 faces is not part of it.
    assert embree["mean"] == pytest.approx(4.0) and embree["aimed"] is True
    beside = targets["first hits, against open3d, all threads"]
    assert (beside["at_least"], beside["aim"], beside["met"], beside["aimed"]) == (1.0, 1.6, True, False)
    llvm = targets["first hits, against mitsuba_llvm, all threads"]
    assert (llvm["at_least"], llvm["aim"], llvm["met"], llvm["aimed"]) == (1.0, 1.6, None, None)
    threads = targets["first hits, efficiency of two threads"]
    assert (threads["measured"], threads["at_least"], threads["met"]) == (0.96, 0.95, True)
    assert threads["where"].startswith("middle")


def test_points_take_the_worst_of_the_meshes_that_count(targets: dict[str, dict[str, Any]]) -> None:
    near = targets["near points, closest point, against open3d"]
    assert (near["measured"], near["where"], near["met"], near["aimed"]) == (1.5, "middle", True, False)
    assert targets["near points, closest point, against libigl"]["met"] is False
    asked = {("random rays, all hits", "open3d"): 1.5, ("random rays, all hits", "trimesh_embreex"): 5.0,
             ("wide points, inside", "open3d"): 2.0, ("wide points, inside", "trimesh_embreex"): 10.0,
             ("box points, closest point", "open3d"): 1.0, ("box points, closest point", "libigl"): 3.0}  # fmt: skip
    for (what, peer), least in asked.items():
        target = targets[f"{what}, against {peer}"]
        assert (target["at_least"], target["aim"], target["met"]) == (least, 2 * least, None)
