"""The checks of scenes: each kind of fault turns a gate red."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import RayScene
from renderer.mesh.shapes import box
from renderer.rayscene.hits import SceneHits
from validation.gates import Gate
from validation.hits import placements, scenes, seams
from validation.hits.check import HitEffort
from validation.hits.rays import float32_exact
from validation.job import Job
from validation.merged import Merged, changed, made, parted
from validation.oracle.placing import placed
from validation.thresholds import Thresholds

JOB = Job(True, Thresholds(), Path(), lambda _: None)
EFFORT = HitEffort(rays=40, exact=8, leaks=0)


def red(found: tuple[Any, list[Gate]]) -> set[str]:
    return {gate.quantity for gate in found[1] if not gate.passed}


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two scenes, of which the first is also made by changes."""
    kept = {name: placements.placements()[name] for name in ("mirrors", "shared edges and planes", "UTM offsets")}
    monkeypatch.setattr(scenes, "placements", lambda: kept)


def test_embree_gets_the_numbers_that_we_get() -> None:
    for name, bodies in placements.placements().items():
        for body in bodies:
            for array in (body.vertices, body.matrices):
                assert np.array_equal(float32_exact(array), array), name
    assert sum(len(body.matrices) for bodies in placements.placements().values() for body in bodies) > 1000


@pytest.mark.parametrize("make", [made, changed])
def test_hits_are_numbered_as_the_faces_of_the_placed_corners(make: Callable[..., Merged]) -> None:
    bodies = placements.placements()["mirrors"]
    vertices, faces = placed(bodies)
    corners, merged = vertices[faces], make(bodies)
    assert np.array_equal(merged.scene.merged.triangles, corners)
    towards = corners.mean(axis=1)
    hits = merged.closest_hit(towards + np.array([0.1, 0.2, 20.0]), [-0.1, -0.2, -20.0])
    assert hits.hit.all() and len(set(hits.face.tolist())) > 100
    places = (corners[hits.face] - hits.points[:, None]).transpose(1, 0, 2)
    volumes = np.einsum("ij,ij->i", np.cross(places[0], places[1]), places[2])
    assert np.abs(volumes).max() < 1e-12


def _another_instance(hits: SceneHits) -> Any:
    return hits._at._replace(instance=np.where(hits._at.instance == 1, 0, hits._at.instance))


def _another_face(hits: SceneHits) -> Any:
    return hits._at._replace(face=np.where(hits._at.face == 3, 4, hits._at.face))


@cases("change", [_another_instance, _another_face])
@pytest.mark.usefixtures("few")
def test_hits_on_another_instance_or_face_are_found(
    change: Callable[[Any], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("instance", "face"):
        monkeypatch.setattr(SceneHits, name, property(lambda hits, name=name: getattr(change(hits), name)))
    assert "wrong hits" in red(scenes.check_scenes(JOB, EFFORT))


@pytest.mark.usefixtures("few")
def test_corners_an_ulp_off_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Far from the origin an ulp is as much as an error of t that nothing excuses."""
    sound = RayScene.add

    def add(scene: RayScene, mesh: Any, transforms: Any = None) -> int:
        return sound(scene, mesh, transforms if transforms is None else np.nextafter(transforms, np.inf))

    monkeypatch.setattr(RayScene, "add", add)
    assert "wrong hits in the exact sample" in red(scenes.check_scenes(JOB, EFFORT))


def test_a_gap_between_parts_is_found_and_embree_has_some(monkeypatch: pytest.MonkeyPatch) -> None:
    (edges, vertices), gates = seams.check_seams(JOB, 300)
    assert edges["ours"] == vertices["ours"] == 0 and all(gate.passed for gate in gates)
    assert edges["references"][0]["leaks"] > 0 < vertices["references"][0]["leaks"]
    sound = seams.made
    moved = np.zeros((8, 3, 4))
    moved[3, 0, 3] = 2.0**-30
    monkeypatch.setattr(
        seams, "made", lambda bodies: sound([body._replace(matrices=body.matrices + moved) for body in bodies])
    )
    assert red(seams.check_seams(JOB, 2000)) == {"leaks"}


@pytest.mark.judges("SceneHits.through")
def test_rays_that_start_elsewhere_than_on_the_part_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SceneHits, "through", lambda hits: hits)
    assert red(scenes.check_parts(JOB)) == {"rays that pass other faces than their lines"}


def test_parts_stand_where_their_mesh_is() -> None:
    cube = box((0.1, 0.2, 0.3), (1.7, 2.9, 3.1))
    assert np.array_equal(parted(cube.vertices, cube.faces).scene.merged.triangles, cube.triangles)
