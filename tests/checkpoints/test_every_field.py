"""Each field that decides a study's answers: it is in the plan of a run, and the run answers as the function does."""

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, fields, replace
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenery import scenery

from renderer import Mesh, Octree
from renderer.checkpoints.parts import Parts
from renderer.checkpoints.study import KINDS, Study, plan_of, run
from renderer.cluster import run_on
from renderer.cluster import studies as on_cluster
from renderer.studies import tregenza
from renderer.studies.points import Points, on_faces

# What a run has of its own, and no option of a study; and a former name.
OF_POINTS = {"octree", "points", "normals", "leaving", "threads", "progress"} | {"distance"}
SUNS = {"sun_directions": np.array([[1.0, 0.2, 0.7], [-0.6, 0.5, 0.4]]), "weights": np.array([2.0, 3.5])}
PATTERN = tregenza()._replace(weights=np.arange(145.0))
USUAL: dict[str, dict[str, Any]] = {"sky": {}, "sun": SUNS, "ao": {}}
SHARES = [[0.25] * len(scenery().faces), np.linspace(0.0, 1.0, len(scenery().faces))]
# Another value for each option of each kind, or several in all forms that it may have.
OTHERS: dict[str, dict[str, list[Any]]] = {
    "sky": {"patches": [100, np.int64(101), PATTERN, PATTERN._replace(weights=np.arange(145.0)[::-1])],
            "up": ["x", (0.3, 0.0, 1.0), [0.0, 0.3, 1.0], np.array([0.2, 0.3, 1.0])], "definition": ["geometric"],
            "max_distance": [0.6], "transmittance": SHARES},
    "sun": {"sun_directions": [SUNS["sun_directions"][::-1], [np.array([0.0, 0.3, 1.0]), np.array([0.4, 0.0, 1.0])]],
            "weights": [np.array([3.5, 2.5])], "max_distance": [np.float32(0.6)], "up": ["x", (-0.6, 0.5, 0.4)],
            "transmittance": SHARES},
    "ao": {"samples": [64], "max_distance": [0.6], "transmittance": SHARES},
}  # fmt: skip


@dataclass(frozen=True)
class Asked:
    """A study of some points of a mesh, and what of it is not as usual."""

    study: Study
    mesh: Mesh
    points: Points
    said: str

    def __str__(self) -> str:
        return f"{self.study.kind}-{self.said}"

    def answers(self) -> Any:
        """What the function says."""
        own, points = self.points, self.points.points
        return KINDS[self.study.kind](
            Octree.from_mesh(self.mesh), points, own.normals, leaving=own.leaving, **self.study.options
        )

    def plan(self) -> str:
        """What a folder is known by, as it is written there."""
        return json.dumps(asdict(plan_of(self.study, self.mesh, self.points, self.points.order(), 8)))


MESH = scenery()
_MIDDLES = on_faces(Octree.from_mesh(MESH)).points
# A little below the faces: hidden by them unless they are named as those that the points lie on.
POINTS = replace(_MIDDLES, points=_MIDDLES.points - 1e-7 * _MIDDLES.normals)
OTHER_POINTS = {
    "points": 0.75 * POINTS.points + 0.25 * MESH.triangles[POINTS.leaving, 0],
    "normals": np.roll(POINTS.normals, 1, axis=0),
    "leaving": np.full(len(POINTS), -1),
}


def usual(kind: str) -> Asked:
    return Asked(Study(kind, USUAL[kind]), MESH, POINTS, "usual")


def varied() -> Iterator[Asked]:
    """Studies that differ from the usual one of their kind in one field alone."""
    for kind, others in OTHERS.items():
        for name, values in others.items():
            for number, value in enumerate(values):
                yield replace(usual(kind), study=Study(kind, USUAL[kind] | {name: value}), said=f"{name}{number}")
        for field in fields(Points):
            yield replace(
                usual(kind), points=replace(POINTS, **{field.name: OTHER_POINTS[field.name]}), said=field.name
            )


def of_other_meshes() -> Iterator[Asked]:
    """The usual study of sky, of a mesh that differs in each of its arrays."""
    moved, turned = MESH.vertices.copy(), MESH.faces.copy()
    moved[-1, 2] += 2.0**-20
    turned[0] = turned[0, [1, 2, 0]]
    for name, mesh in (("vertices", Mesh(moved, MESH.faces)), ("faces", Mesh(MESH.vertices, turned))):
        yield replace(usual("sky"), mesh=mesh, said=name)


ASKED = [*map(usual, KINDS), *varied()]
# Another kind than each.
NEXT = {"sky": "ao", "ao": "sun", "sun": "sky"}


def here(asked: Asked, folder: Path) -> Parts:
    return run(Octree.from_mesh(asked.mesh), asked.study, asked.points, folder)


def there(asked: Asked, folder: Path) -> Parts:
    return run_on(None, Octree.from_mesh(asked.mesh), asked.study, asked.points, folder, size=8)


@pytest.fixture(autouse=True)
def few_points_a_part(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan_of, "__defaults__", (8,))


@pytest.fixture
def tasks(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The tasks of a cluster that is this process."""
    asked: list[Any] = []

    def results(_client: object, function: Callable[..., Any], tasks: Iterator[Any]) -> Iterator[tuple[Any, Any]]:
        for task in tasks:
            asked.append(task)
            yield task.name, function(task.shared, *task.arguments)

    monkeypatch.setattr(on_cluster, "results", results)
    return asked


def test_every_field_has_another_value() -> None:
    assert OTHERS.keys() == USUAL.keys() == KINDS.keys()
    assert OTHER_POINTS.keys() == {field.name for field in fields(Points)}
    for kind, of in KINDS.items():
        assert OTHERS[kind].keys() == signature(of).parameters.keys() - OF_POINTS


def test_no_two_studies_have_a_plan_in_common() -> None:
    plans = [asked.plan() for asked in (*ASKED, *of_other_meshes())]
    assert len(set(plans)) == len(plans)


@pytest.mark.parametrize("by", [here, there])
@pytest.mark.parametrize("asked", ASKED, ids=str)
def test_a_run_answers_as_the_function_and_takes_over_no_part_of_another(
    tmp_path: Path, tasks: list[Any], asked: Asked, by: Callable[[Asked, Path], Parts]
) -> None:
    left = by(usual(asked.study.kind if asked.said != "usual" else NEXT[asked.study.kind]), tmp_path / "parts")
    with pytest.raises(ValueError, match="got those of another, whose"):
        by(asked, tmp_path / "parts")
    before = left.joined().tobytes()
    (left.folder / "manifest.json").unlink()
    answers = by(asked, tmp_path / "parts").joined()
    assert answers.tobytes() == asked.answers().tobytes()
    assert answers.tobytes() != before


@pytest.mark.parametrize("split", ["midpoint", "sah"])
def test_workers_build_the_tree_that_is_asked_for(tmp_path: Path, tasks: list[Any], split: Any) -> None:
    asked = usual("sky")
    run_on(None, Octree.from_mesh(MESH), asked.study, asked.points, tmp_path / "parts", size=5, split=split)
    assert len(tasks) == -(-len(POINTS) // 5) and {task.shared.mesh.split for task in tasks} == {split}
