"""Pictures in which one pixel would see what it cannot: ours passes, and a renderer that is wrong turns a gate red."""

from pathlib import Path

import numpy as np
import pytest
from cases import cases

from renderer.mesh.mesh import Mesh
from validation.job import Job
from validation.pictures import unseen
from validation.report import page
from validation.thresholds import Thresholds


def test_gates_and_rows_of_all_pictures(monkeypatch):
    """With one view of each body, so that it is quick."""
    own = unseen.from_within
    monkeypatch.setattr(unseen, "from_within", lambda mesh: [next(own(mesh))])
    said = []
    rows, gates = unseen.check_unseen(Job(True, Thresholds(), Path(), said.append))
    assert len(said) == unseen.steps() and len(rows) == len(gates) == 4 + 10 + 9
    assert all(gate.passed for gate in gates)
    assert all((row["wrong"] is None) != (row["error"] is None) and row["pixels"] > 0 for row in rows)
    assert "m.images.unseen" in (Path(page.__file__).parent / "templates" / "pictures.html").read_text("utf-8")


@cases("name", unseen.mirror_bodies())
def test_a_hole_in_a_mirror_is_seen(name):
    mesh = unseen.mirror_bodies()[name]
    scenes = [scene for k, scene in enumerate(unseen.from_within(mesh)) if k % 3 == 0]
    assert sum(unseen.unseen(scene, 3, max_depth=30)[1] for scene in scenes) == 0
    holed = Mesh(mesh.vertices, mesh.faces[1:])
    views = [scene for k, scene in enumerate(unseen.from_within(holed)) if k % 3 == 0]
    assert sum(9 - unseen.unseen(view, 3)[0] + unseen.unseen(view, 3, max_depth=30)[1] for view in views) > 0


@cases("name", unseen.grounds())
def test_air_below_glass_is_seen(monkeypatch, name):
    """Without the ground, and with bodies that are apart from it, the sky is seen."""
    scenes = unseen.grounds()[name][:3]
    bare = [
        scene.model_copy(
            update={"floor": None, "objects": tuple(one for one in scene.objects if len(one.mesh.faces) > 2)}
        )
        for scene in scenes
    ]
    assert sum(unseen.unseen(scene, 9, max_depth=8)[1] for scene in scenes) == 0
    if "corner" not in name:
        assert sum(unseen.unseen(scene, 9, max_depth=8)[1] for scene in bare) > 0


def test_a_gap_between_slabs_is_off():
    for gap, close in ((0.0, True), (1e-6, False)):
        parts = [(unseen._slab(gap, 1.0), unseen._of(1.5)), (unseen._slab(-1.0, 0.0), unseen._of(1.5))]
        (row,) = [unseen._worst("", [(parts, unseen.passed(50.0, 1.0, 1.5, 1.0), 50.0)], 2)]
        assert (row.error <= unseen.STORED) == close
    row = unseen.Row("some", 4, None, float("nan"))
    assert not unseen._gate(row).passed
    assert not unseen._gate(unseen.Row("some", 4, 1, None)).passed


def test_what_plane_glass_passes():
    """By hand: (1 - 0.04)^2, and Brewster's angle, at which one half is passed whole."""
    assert unseen.passed(0.0, 1.0, 1.5, 1.0) == pytest.approx(0.96**2, rel=1e-14)
    s = np.cos(2.0 * np.arctan(1.5))
    assert unseen.passed(np.degrees(np.arctan(1.5)), 1.0, 1.5) == pytest.approx(1.0 - s * s / 2.0, rel=1e-13)
