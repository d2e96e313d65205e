"""The benchmark's arithmetic: fits, rounds and ratios, targets, and what a libLLVM's name says."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from validation import timing
from validation.benchmark.measures import frames, processes
from validation.benchmark.measures.fit import log_fit
from validation.benchmark.page.targets import Target, judged
from validation.benchmark.peers import libllvm
from validation.timing import interleaved, ratio


def test_a_fit_finds_the_law_that_made_the_costs() -> None:
    sizes = [1_000, 10_000, 98_304, 1_000_000]
    fit = log_fit(sizes, [17.5 * math.log2(n) - 40.25 for n in sizes])
    assert fit is not None
    # Least squares of four points in float64.
    assert fit.a == pytest.approx(17.5, rel=1e-12) and fit.b == pytest.approx(-40.25, rel=1e-11)
    assert fit.residual < 1e-10
    assert fit.at(4096) == pytest.approx(17.5 * 12 - 40.25, rel=1e-12)


def test_the_residual_is_the_root_mean_square() -> None:
    # +1, -2, +1 about a line has no part along it: mean 0, slope 0.
    fit = log_fit([2, 4, 8], [11.0, 18.0, 31.0])
    assert fit is not None
    assert (fit.a, fit.b) == (pytest.approx(10.0), pytest.approx(0.0, abs=1e-12))
    assert fit.residual == pytest.approx(math.sqrt(6 / 3))


def test_two_sizes_fit_nothing() -> None:
    assert log_fit([1000, 2000, 2000], [1.0, 2.0, 3.0]) is None


def test_contenders_take_turns_after_a_rest_and_the_first_round_is_not_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    rests: list[tuple[float, int]] = []
    monkeypatch.setattr(timing, "REST", 0.25)
    monkeypatch.setattr(timing.time, "sleep", lambda seconds: rests.append((seconds, len(order))))

    def call(name: str) -> Callable[[], float]:
        def seconds() -> float:
            order.append(name)
            return float(len(order))

        return seconds

    seconds = interleaved({name: call(name) for name in "abc"}, runs=2)
    assert "".join(order) == "abcabcabc" and rests == [(0.25, i) for i in range(9)]
    assert seconds == {"a": [4.0, 7.0], "b": [5.0, 8.0], "c": [6.0, 9.0]}


def test_the_ratio_is_the_median_of_the_rounds() -> None:
    # The ratio of the medians would be 4 / 2.
    assert ratio([3.0, 4.0, 9.0], [3.0, 2.0, 1.0]) == 2.0
    assert ratio([2.0, 4.0, 30.0], [2.0, 1.0, 10.0]) == 3.0


@pytest.mark.parametrize(
    ("better", "measured", "met"),
    [("above", 2.0, True), ("above", 1.9, False), ("below", 2.0, True), ("below", 2.1, False), ("above", None, None)],
)
def test_a_target_is_met_from_its_bound_on(better: str, measured: float | None, met: bool | None) -> None:
    assert Target("s", "times", better, 2.0, None, measured, "w", "r").record()["met"] is met


def test_targets_take_the_worst_of_the_meshes_that_count() -> None:
    def rows(name: str, faces: int, embree: float) -> dict[str, Any]:
        return {"mesh": name, "faces": faces, "family": "camera", "query": "closest", "ratios": {"embree": embree}}

    def of_points(name: str, faces: int, **ratios: float) -> dict[str, Any]:
        return {"mesh": name, "faces": faces, "family": "near", "query": "nearest", "ratios": ratios}

    record = {
        "queries": [
            rows("small", 1_000, 0.1),
            rows("middle", 100_000, 3.0),
            rows("large", 1_000_000, 2.5),
            of_points("small", 1_000, open3d=0.5),
            of_points("middle", 100_000, open3d=1.5, libigl=2.5),
            of_points("large", 5_000_000, open3d=2.5, libigl=7.0),
        ],
        "builds": [
            {"mesh": "middle", "faces": 100_000, "ratios": {"open3d": 4.0}},
            {"mesh": "large", "faces": 1_000_000, "ratios": {"open3d": 1.25}},
        ],
        "memory": [
            {"mesh": "large", "faces": 1_000_000, "systems": {"ours": {"rest": 30}, "open3d": {"rest": 40}}},
            {"mesh": "middle", "faces": 100_000, "systems": {"ours": {"rest": 30}}},
        ],
        "frames": {"size": 512, "ratios": {frames.LISTS: 1.5}},
        "processes": {name: {"median": 1.0} for name in (processes.WARM, processes.IMPORT)},
        "first_answers": {"rows": {"first_hit_cpu": {"median": 8.5, "unit": "CPU s"}}},
    }
    found = {t["subject"]: t for t in judged(record)}
    camera = found["camera rays, closest hit, against embree"]
    assert (camera["measured"], camera["where"], camera["met"], camera["aimed"]) == (2.5, "large", True, False)
    assert found["camera rays, closest hit, against open3d"]["met"] is None
    near = found["near points, closest point, against open3d"]
    assert (near["measured"], near["where"], near["met"], near["aimed"]) == (1.5, "middle", True, False)
    assert found["near points, closest point, against libigl"]["met"] is False
    asked = {("random rays, all hits", "open3d"): 1.5, ("random rays, all hits", "trimesh_embreex"): 5.0,
             ("wide points, inside", "open3d"): 2.0, ("wide points, inside", "trimesh_embreex"): 10.0,
             ("box points, closest point", "open3d"): 1.0, ("box points, closest point", "libigl"): 3.0}  # fmt: skip
    for (what, peer), least in asked.items():
        target = found[f"{what}, against {peer}"]
        assert (target["at_least"], target["aim"], target["met"]) == (least, 2 * least, None)
    build = found["build, of Embree's time (Open3D's first query)"]
    assert (build["measured"], build["where"]) == (0.8, "large")
    assert found["memory at rest, of Embree's (Open3D)"]["measured"] == 0.75
    assert found["import renderer"]["met"] is False and found["render warm"]["met"] is False
    assert found["first hit"]["met"] is False and found["first picture"]["met"] is None


@pytest.mark.parametrize(
    ("path", "major"),
    [
        ("/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1", 19),
        ("/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1", 15),
        ("/nowhere/llvm-20/lib/libLLVM.so", 20),
        ("/opt/nowhere/libLLVM.so", 0),
    ],
)
def test_the_version_of_a_libllvm_is_read_from_its_path(path: str, major: int) -> None:
    assert libllvm.version(path) == major


def test_a_libllvm_that_the_user_names_is_the_only_candidate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(libllvm.VARIABLE, "/nowhere/libLLVM.so")
    assert list(libllvm.candidates()) == ["/nowhere/libLLVM.so"]
    # Dr.Jit cannot load it, in its own process: here an answer comes back.
    assert libllvm.usable() is None


def test_too_old_a_libllvm_is_no_candidate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(libllvm.VARIABLE, raising=False)
    monkeypatch.setattr(libllvm, "_PLACES", ("x",))
    monkeypatch.setattr(libllvm, "glob", lambda _: ["/a/libLLVM-15.so", "/a/libLLVM.so.19.1", "/a/libLLVM.so.20.1"])
    assert list(libllvm.candidates()) == ["/a/libLLVM.so.20.1", "/a/libLLVM.so.19.1"]
