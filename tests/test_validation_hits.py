"""The hit section on small efforts: it passes on the real octree and fails when the octree is broken."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from renderer.layout import LANES
from renderer.mesh import Mesh
from renderer.octree import Octree
from renderer.shapes import icosphere
from validation import hits
from validation.embree import Embree
from validation.gates import Gate
from validation.rays import face_rays, families, float32_exact

EFFORT = hits.Effort(rays=300, exact=60, leaks=2_000)


def ball() -> Mesh:
    sphere = icosphere(2)
    return Mesh(float32_exact(sphere.vertices), sphere.faces)


def checked(octree: Octree) -> list[Gate]:
    """All gates of all families for ``octree``, which claims to be that of the ball."""
    mesh = ball()
    embree = Embree(mesh.vertices, mesh.faces)
    batches = (*families(mesh.vertices, mesh.faces, EFFORT.rays, 1), face_rays(mesh.vertices, mesh.faces))
    return [g for rays in batches for g in hits._check("ball", mesh, octree, embree, rays, EFFORT)[1]]


def broken(change: Callable[[Octree], None]) -> Octree:
    octree = Octree.from_mesh(ball())
    tree = octree.target.tree
    copied = tree._replace(faces=tree.faces.copy(), blocks=tree.blocks.copy())
    octree.target = dataclasses.replace(octree.target, tree=copied)
    change(octree)
    return octree


def test_the_real_octree_passes() -> None:
    assert all(g.passed for g in checked(Octree.from_mesh(ball())))


def _drop_a_face(octree: Octree) -> None:
    """Collapse the triangle in the first place of block 7 to a point, as an unused place is."""
    rows = octree.target.tree.blocks.reshape(-1, 9, LANES)
    rows[7, 3:6, 0] = rows[7, 0:3, 0]
    rows[7, 6:9, 0] = rows[7, 0:3, 0]


def _scale_vertices(octree: Octree) -> None:
    octree.target.tree.blocks[:] *= np.float32(1.0 + 2.0**-20)


def _swap_two_faces(octree: Octree) -> None:
    """Report the face of another block, so that t belongs to a face that is elsewhere."""
    faces = octree.target.tree.faces
    faces[[0, LANES * 40]] = faces[[LANES * 40, 0]]


@pytest.mark.parametrize("change", [_drop_a_face, _scale_vertices, _swap_two_faces])
def test_a_broken_octree_turns_a_gate_red(change: Callable[[Octree], None]) -> None:
    assert not all(g.passed for g in checked(broken(change)))


def test_a_hole_is_a_leak(monkeypatch: pytest.MonkeyPatch) -> None:
    def with_hole() -> dict[str, Mesh]:
        sphere = icosphere(2)
        around = (sphere.faces == 0).any(axis=1)
        return {"icosphere": dataclasses.replace(sphere, faces=sphere.faces[~around])}

    monkeypatch.setattr(hits, "closed_meshes", with_hole)
    records, found = hits._leaks(EFFORT, lambda _: None)
    assert not any(g.passed for g in found)
    assert all(r["ours"] > 0 for r in records)  # type: ignore[operator]
