"""Rows of queries: ratios are of rounds and of threads that compare, and wrong answers and scenes are found."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from contenders import system

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.benchmark.measures import calls, queries
from validation.benchmark.measures.families import points
from validation.benchmark.measures.kinds import KINDS
from validation.benchmark.measures.meshes import named
from validation.benchmark.peers.contender import Family, System
from validation.benchmark.peers.ours import OURS, OURS_ONE, OURS_TWO


def test_measured_rows_say_who_hit_what(mesh: Mesh) -> None:
    slow = replace(system("mitsuba_scalar"), most_rays=2_000)
    chosen = [*(system(name) for name in (OURS, OURS_ONE, "embree")), slow]
    kinds = [KINDS["closest"], KINDS["any"]]
    rows = queries.measure(mesh, chosen, 3_000, lambda _: None, kinds)
    assert [(r["family"], r["query"]) for r in rows] == [
        (f, q) for f in ("camera", "shadow", "random", "bounce", "misses", "short") for q in ("closest", "any")
    ]
    for row in rows:
        seconds = {name: np.array(c["seconds"]) / c["rays"] for name, c in row["contenders"].items()}
        assert set(row["ratios_one_thread"]) == {"embree", "mitsuba_scalar"}
        for name, found in row["ratios_one_thread"].items():
            assert found == pytest.approx(np.median(seconds[name] / seconds[OURS_ONE]))
        assert row["ratios"]["embree"] == pytest.approx(np.median(seconds["embree"] / seconds[OURS]))
        assert row["agree"] and set(row["ratios"]) == {OURS_ONE, "embree", "mitsuba_scalar"}
        scalar = row["contenders"]["mitsuba_scalar"]
        assert scalar["rays"] == 2_000 and len(scalar["seconds"]) == 5
        # Its rays are two of three of ours: twice as many others would differ by a hundredth, one standard error.
        assert scalar["hits"] / 2_000 == pytest.approx(row["hit_share"], abs=0.02)
        assert row["contenders"][OURS]["hits"] == pytest.approx(row["hit_share"] * 3_000)


def test_measured_rows_of_all_hits_and_points(mesh: Mesh, octree: Octree) -> None:
    kinds = [KINDS[name] for name in ("all", "count", "contains", "nearest", "signed")]
    chosen = [system(name) for name in (OURS, OURS_ONE, "trimesh_embreex", "libigl")]
    few = [replace(chosen[-1], most_rays=150)]
    rows = queries.measure(mesh, chosen[:-1] + few, 4_000, lambda _: None, kinds)
    assert [(r["family"], r["query"], r["rays"], set(r["ratios"])) for r in rows] == [
        ("random", "all", 4_000, {OURS_ONE, "trimesh_embreex"}),
        ("random", "count", 4_000, {OURS_ONE}),
        ("wide", "contains", 4_000, {OURS_ONE, "trimesh_embreex", "libigl"}),
        ("box", "nearest", 400, {OURS_ONE, "libigl"}),
        ("box", "signed", 400, {OURS_ONE, "libigl"}),
        ("near", "nearest", 400, {OURS_ONE, "libigl"}),
        ("near", "signed", 400, {OURS_ONE, "libigl"}),
    ]
    wide = points(mesh, 4_000)[0].points
    assert rows[2]["contenders"][OURS]["hits"] == octree.contains(wide).sum() == round(rows[2]["hit_share"] * 4_000)
    for row in rows:
        assert row["agree"] and row["contenders"][OURS]["differing"] == 0
        igl = row["contenders"].get("libigl")
        assert igl is None or (igl["rays"] == 150 and igl["ns"] == pytest.approx(1e9 * igl["median"] / 150))
        assert row["query"] != "nearest" or row["hit_share"] == 1.0


@pytest.mark.parametrize("name", ["embree", "trimesh_embreex", "libigl", "trimesh", "open3d"])
def test_a_contender_that_sees_another_scene_is_found(name: str, mesh: Mesh) -> None:
    def elsewhere(vertices: Any, faces: Any) -> Callable[[], Any]:
        return system(name).load(vertices + 0.1, faces)

    wrong = System("wrong", "wrong", 1, "float32", elsewhere)
    rows = [r for r in queries.measure(mesh, [system(OURS), wrong], 100, lambda _: None) if "wrong" in r["contenders"]]
    assert rows and not any(row["agree"] for row in rows)


def test_other_kinds_of_meshes_are_asked_in_brief_and_fast_contenders_only() -> None:
    chosen = [system(name) for name in (OURS, "embree", "libigl", "mitsuba_scalar")]
    rows = queries.measure(named("city_300"), chosen, 300, lambda _: None, brief=True)
    closest = [(family, "closest") for family in ("camera", "shadow", "random", "bounce", "misses", "short")]
    assert sorted((r["family"], r["query"]) for r in rows) == sorted([*closest, ("shadow", "any"), ("short", "any")])
    assert all(set(r["contenders"]) == {OURS, "embree"} and r["agree"] for r in rows)
    # Without our one thread, nothing is compared to it.
    assert all(r["ratios_one_thread"] == {} and r["efficiency"] is None for r in rows)


def test_a_miss_that_hits_and_a_scene_without_hits_are_found(
    mesh: Mesh, rays: tuple[Family, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, family in (("misses", rays[0]), ("camera", rays[4])):
        wrong = (replace(family, name=name),)
        monkeypatch.setattr(queries, "families", lambda *_, wrong=wrong: wrong)
        rows = queries.measure(mesh, [system(OURS)], 600, lambda _: None, [KINDS["closest"]])
        assert [row["agree"] for row in rows] == [False]


def test_the_efficiency_is_that_of_two_threads() -> None:
    each = {OURS: [1.0, 2.0, 4.0], OURS_ONE: [8.0, 8.0, 8.0], OURS_TWO: [5.0, 5.0, 5.0]}
    assert queries._efficiency(each, 16) == pytest.approx(0.8)
    assert queries._efficiency(each, 2) == pytest.approx(2.0)
    del each[OURS_TWO]
    assert queries._efficiency(each, 16) is None and queries._efficiency(each, 1) is None


def test_calls_of_few_rays_are_compared_thread_by_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calls, "_CALLS", 3)
    single = system("embree")
    chosen = [system(OURS), system(OURS_ONE), single, replace(single, name="open3d", threads=2)]
    rows = calls.measure(chosen, lambda _: None)
    assert [row["rays"] for row in rows] == [1, 10, 100]
    for row in rows:
        micros = {name: np.array(runs) for name, runs in row["micros"].items()}
        assert set(micros) == {OURS, OURS_ONE, "embree", "open3d"} and set(row["ratios"]) == {"embree", "open3d"}
        assert row["ratios"]["embree"] == pytest.approx(np.median(micros["embree"] / micros[OURS_ONE]))
        assert row["ratios"]["open3d"] == pytest.approx(np.median(micros["open3d"] / micros[OURS]))
        assert row["median"][OURS] == pytest.approx(np.median(micros[OURS])) and row["median"][OURS] > 0.1
