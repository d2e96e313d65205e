"""The hit section on small efforts: it passes on the real octree and fails when octree or reference is broken."""

import dataclasses
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.octree import Octree
from renderer.results.hits import Hits
from renderer.trace.layout import BLOCK_FACES
from validation.gates import Gate
from validation.hits import check as check_hits
from validation.hits import leaks as hit_leaks
from validation.hits import section as hits
from validation.hits.rays import float32_exact
from validation.job import Job
from validation.references.table import REFERENCES, HitReference
from validation.thresholds import Thresholds

QUICK = tuple(one for one in REFERENCES if one.key in ("embree_robust", "embree_default", "igl"))
EFFORT = hits.HitEffort(rays=300, exact=60, leaks=2_000, references=QUICK)


def ball() -> Mesh:
    sphere = icosphere(2)
    return Mesh(float32_exact(sphere.vertices), sphere.faces)


def job(**changes: Any) -> Job:
    return Job(True, Thresholds(), Path(), lambda _: None, **changes)


def checked(mesh: Mesh, effort: hits.HitEffort = EFFORT) -> tuple[dict[str, Any], list[Gate]]:
    return hits.check_mesh("ball", mesh, effort, job())


def failing(gates: list[Gate]) -> set[str]:
    return {gate.quantity for gate in gates if not gate.passed}


def test_the_real_octree_passes_and_says_the_same_bits_again() -> None:
    record, gates = checked(ball())
    assert gates and all(g.passed for g in gates)
    again, _ = checked(ball())
    digests = [[family["ours_sha256"] for family in one["families"]] for one in (record, again)]
    assert digests[0] == digests[1] and len(set(digests[0])) == len(digests[0])
    for family in record["families"]:
        for one in family["references"]:
            assert one["both_hit"] + one["both_miss"] + one["only_ours"] + one["only_theirs"] == one["rays"]
            assert sum(one["verdicts"].values()) + one["unjudged"] == one["disagreements"]


def broken(monkeypatch: pytest.MonkeyPatch, change: Callable[[Octree], None]) -> None:
    """Let the section build an octree that ``change`` has been at."""

    def build(mesh: Mesh) -> Octree:
        octree = Octree.from_mesh(mesh)
        tree = octree.tree
        octree.tree = dataclasses.replace(tree, faces=tree.faces.copy(), blocks=tree.blocks.copy())
        change(octree)
        return octree

    monkeypatch.setattr(check_hits, "Octree", type("Broken", (), {"from_mesh": staticmethod(build)}))


def _drop_a_face(octree: Octree) -> None:
    """Collapse the triangle in the first place of block 7 to a point, as an unused place is."""
    rows = octree.tree.blocks.reshape(-1, 9, BLOCK_FACES)
    rows[7, 3:6, 0] = rows[7, 0:3, 0]
    rows[7, 6:9, 0] = rows[7, 0:3, 0]


def _scale_vertices(octree: Octree) -> None:
    octree.tree.blocks[:] *= np.float32(1.0 + 2.0**-20)


def _swap_two_faces(octree: Octree) -> None:
    """Report the face of another block, so that t belongs to a face that is elsewhere."""
    faces = octree.tree.faces
    faces[[0, BLOCK_FACES * 40]] = faces[[BLOCK_FACES * 40, 0]]


@pytest.mark.judges("Octree.tree")
@pytest.mark.parametrize("change", [_drop_a_face, _scale_vertices, _swap_two_faces])
def test_a_broken_octree_turns_a_gate_red(change: Callable[[Octree], None], monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, change)
    sample = "wrong hits in the exact sample"
    assert failing(checked(ball())[1]) == {"wrong hits", sample}


def _blind(octree: Octree) -> None:
    octree.any_hit = lambda origins, directions: np.zeros(len(origins), dtype=np.bool_)  # type: ignore[method-assign]


def test_any_hit_that_differs_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, _blind)
    assert failing(checked(ball())[1]) == {"any_hit differs from closest_hit", FEW}


FEW = "other hits in small batches"


def _miss_alone(octree: Octree) -> None:
    """Let a ray that is asked alone miss whatever it hits."""
    sound = octree.closest_hit

    def closest(origins: NDArray[np.float64], directions: NDArray[np.float64]) -> Hits:
        hits = sound(origins, directions)
        return hits if len(origins) > 1 else Hits(np.full(1, np.inf), np.full(1, -1), hits.u, hits.v, octree.mesh)

    octree.closest_hit = closest  # type: ignore[method-assign, assignment]


def test_a_ray_that_answers_otherwise_when_alone_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, _miss_alone)
    assert failing(checked(ball())[1]) == {FEW}


class _Wrong:
    """A reference that hits face 0 at t = 1 with every ray."""

    def closest_hit(self, origins: Any, directions: Any) -> Any:
        return np.ones(len(origins)), np.zeros(len(origins), dtype=np.int64)


def reference(**changes: Any) -> HitReference:
    return QUICK[0]._replace(key="wrong", name="Wrong", make=lambda vertices, faces: _Wrong(), **changes)


def test_a_reference_that_is_wrong_does_not_speak_against_us() -> None:
    record, gates = checked(ball(), dataclasses.replace(EFFORT, references=(reference(),)))
    assert all(g.passed for g in gates)
    found = [family["references"][0] for family in record["families"] if family["family"] == "from_inside"]
    assert found[0]["disagreements"] == found[0]["verdicts"]["ours right"] == EFFORT.rays
    assert found[0]["sizes"]["other_face"] > 50


def test_a_users_mesh_is_judged_by_those_that_can(tmp_path: Path) -> None:
    path = tmp_path / "turned.obj"
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in (ball().vertices * np.pi).tolist()]
    path.write_text("\n".join([*rows, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in ball().faces.tolist())]))
    seen: list[str] = []
    asked = dataclasses.replace(job(meshes=(path,)), step=seen.append)
    record, gates = hits.run(asked)
    assert len(seen) == hits.steps(asked) and all(g.passed for g in gates)
    (mesh,) = record["meshes"]
    assert mesh["name"] == "turned" and "Embree robust" in mesh["left_out"]
    assert [one["key"] for one in mesh["references"]] and "leaks" not in record and record["leaks_left_out"]
    assert all(one["precision"] == "float64" for one in mesh["references"])
    assert set(record["costs"]) == {check_hits.EXACT, *(one["name"] for one in mesh["references"])}
    json.dumps(record, allow_nan=False)


def test_rays_that_begin_in_a_flat_mesh_are_undecidable() -> None:
    """All that begins in the box of a flat mesh begins on its faces; what merely passes it stays decidable."""
    few = dataclasses.replace(EFFORT, references=())
    _, gates = checked(Mesh(ball().vertices * np.array([1.0, 0.0, 1.0]), ball().faces), few)
    assert all(gate.passed for gate in gates)
    aimed_at_nothing = {gate.subject for gate in gates if "rounding" in gate.quantity}
    assert aimed_at_nothing == {f"ball, {name} rays" for name in ("camera", "camera_squares", "grazing", "face")}


def test_a_mesh_beyond_float32_is_refused() -> None:
    for scale in (1e-31, 1e31):
        with pytest.raises(ValueError, match="expected faces whose largest coordinate is 1e-30 to 1e30, got 1e"):
            checked(Mesh(ball().vertices * scale, ball().faces))


def test_a_hole_is_a_leak(monkeypatch: pytest.MonkeyPatch) -> None:
    sphere = icosphere(2)
    around = (sphere.faces == 0).any(axis=1)
    whole, holed = partial(dict, icosphere=sphere), dataclasses.replace(sphere, faces=sphere.faces[~around])
    monkeypatch.setattr(hit_leaks, "leak_meshes", whole)
    assert all(g.passed for g in hits.check_leaks(EFFORT, job())[1])
    monkeypatch.setattr(hit_leaks, "leak_meshes", lambda: {"icosphere": holed})
    record, found = hits.check_leaks(EFFORT, job())
    assert not any(g.passed for g in found)
    assert all(one["ours"] > 0 for one in record["sets"])
    assert any(theirs["leaks"] for one in record["sets"] for theirs in one["references"])


def test_a_leak_of_any_hit_alone_is_a_leak(monkeypatch: pytest.MonkeyPatch) -> None:
    def build(mesh: Mesh) -> Octree:
        octree = Octree.from_mesh(mesh)
        _blind(octree)
        return octree

    monkeypatch.setattr(hit_leaks, "leak_meshes", lambda: {"icosphere": icosphere(2)})
    monkeypatch.setattr(hit_leaks, "Octree", type("Broken", (), {"from_mesh": staticmethod(build)}))
    assert not any(g.passed for g in hits.check_leaks(dataclasses.replace(EFFORT, references=()), job())[1])
