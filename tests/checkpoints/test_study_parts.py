"""The parts of a study: points that lie together, told and answered in the order of the caller."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer import Octree
from renderer.checkpoints.study import Study, parts_of, plan_of, run
from renderer.studies.points import Points, on_faces
from validation.benchmark.measures.meshes import named

STUDY = Study("sky", {})


@pytest.fixture(scope="module")
def octree() -> Octree:
    return Octree.from_mesh(named("city_2000"))


@pytest.fixture(scope="module")
def points(octree: Octree) -> Points:
    """The faces' middles in an order of chance."""
    points = on_faces(octree).points
    return points.part(np.random.default_rng(2).permutation(len(points)))


def test_points_of_a_part_lie_together_and_answers_stay_in_the_callers_order(
    octree: Octree, points: Points, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plan_of, "__defaults__", (64,))
    parts = run(octree, STUDY, points, tmp_path / "parts")
    assert parts.joined().tobytes() == STUDY.evaluate(octree, points).tobytes()
    rows = [parts.rows(part) for part in range(parts.plan.parts)]
    assert sorted(np.concatenate(rows)) == list(range(len(points)))
    # 64 of 2,000 points have a thirtieth of the city, if they lie together; else nearly all of it.
    areas = [np.ptp(points.points[some], axis=0)[[0, 2]].prod() for some in rows]
    assert np.median(areas) < 0.2 * np.ptp(points.points, axis=0)[[0, 2]].prod()


def test_points_that_are_put_in_order_in_turns_are_all_there(points: Points, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("renderer.studies.points._TOGETHER", 100)
    order = points.order()
    for first in range(0, len(points), 100):
        assert sorted(order[first : first + 100]) == list(range(first, min(len(points), first + 100)))


@pytest.mark.parametrize(
    "spoil, said",
    [(lambda p: p.points.__setitem__((1234, 1), np.nan), r"points: expected finite numbers.* in row 1234"),
     (lambda p: p.normals.__setitem__(1234, 0.0), r"normals: expected vectors that are not zero.* in row 1234"),
     (lambda p: p.leaving.__setitem__(1234, 10**6), r"leaving: expected .* row 1234")],
)  # fmt: skip
def test_a_bad_point_is_told_by_the_callers_row(
    octree: Octree, points: Points, tmp_path: Path, spoil: Any, said: str
) -> None:
    bad = replace(points, points=points.points.copy(), normals=points.normals.copy(), leaving=points.leaving.copy())
    spoil(bad)
    with pytest.raises(ValueError, match=said):
        parts_of(octree, STUDY, bad, tmp_path / "parts", 64)
    assert not (tmp_path / "parts").exists()


def test_parts_in_another_order_are_refused(octree: Octree, points: Points, tmp_path: Path) -> None:
    """Those of a manifest that knows no order too: their rows follow each other in the result."""
    path = parts_of(octree, STUDY, points, tmp_path / "parts", 64).folder / "manifest.json"
    manifest = json.loads(path.read_text())
    assert manifest["made_of"].pop("order")
    path.write_text(json.dumps(manifest))
    with pytest.raises(ValueError, match="whose order differ; remove the folder"):
        parts_of(octree, STUDY, points, tmp_path / "parts", 64)


def test_no_points_are_one_part_without_rows(octree: Octree, points: Points, tmp_path: Path) -> None:
    parts = run(octree, STUDY, points.part(slice(0, 0)), tmp_path / "parts")
    parts.join(tmp_path / "none.npy")
    assert np.load(tmp_path / "none.npy").shape == parts.joined().shape == (0,)
