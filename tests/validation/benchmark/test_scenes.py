"""Scenes in the benchmark: all contenders hit the same, copies cost what is stored, and targets find their rows."""

from typing import Any

import pytest

from validation.benchmark.measures import scenes
from validation.benchmark.measures.scenes import INSTANCES, OCTREE
from validation.benchmark.page import targets
from validation.benchmark.peers import libllvm
from validation.benchmark.peers.mitsuba_variant import libllvm_path


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scenes, "QUICK_MANY", (200, 300))
    monkeypatch.setattr(scenes, "QUICK_FEW", 8)
    monkeypatch.setattr(scenes, "QUICK_RAYS", 2000)


def measured(llvm: bool) -> dict[str, Any]:
    return scenes.measure(True, llvm, lambda name: None)


def test_our_octrees_hit_the_same_and_memory_is_what_is_stored() -> None:
    found = measured(False)
    assert [set(row["ratios"]) for row in found["rows"]] == [set()] * 2 + [{OCTREE}] * 4
    assert all(row["differing"] == dict.fromkeys(row["ratios"], 0) for row in found["rows"])
    assert all(0.03 < row["hit_share"] < 0.97 for row in found["rows"])
    # Python's own objects of a scene are a few kilobytes.
    assert found["bytes"] <= found["grown"] <= found["bytes"] + 40
    where = [target.where.split(",")[0] for target in targets._scenes({"scenes": found})]
    assert where[2:] == ["not measured", "8 of torus_knot", "1 knot"]


def test_mitsubas_instances_hit_the_same() -> None:
    if libllvm_path() is None:
        pytest.skip(libllvm.HOW)
    rows = measured(True)["rows"]
    assert all(set(row["ratios"]) >= {INSTANCES} for row in rows)
    # A ray in a thousand may pass an edge closer than float32 resolves.
    assert all(row["differing"][INSTANCES] <= row["rays"] / 1000 for row in rows)
