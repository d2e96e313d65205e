"""The meshes of other kinds than spheres: each is what its name says, at any size, and which of them a run has."""

from pathlib import Path

import numpy as np
import pytest

from renderer.mesh.load import save_ply
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.octree import Octree
from validation.benchmark.measures import meshes
from validation.benchmark.measures.families import families
from validation.benchmark.measures.forms import FORMS


@pytest.fixture(scope="module")
def forms() -> dict[str, Mesh]:
    return {name: make(5_000) for name, make in FORMS.items()}


def areas(mesh: Mesh) -> np.ndarray:
    a, b, c = mesh.triangles.transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


@pytest.mark.parametrize("faces", [1, 100, 5_000])
@pytest.mark.parametrize("name", FORMS)
def test_a_form_has_about_the_faces_asked_for_and_is_the_same_again(name: str, faces: int) -> None:
    mesh, again = FORMS[name](faces), FORMS[name](faces)
    assert np.array_equal(mesh.vertices, again.vertices) and np.array_equal(mesh.faces, again.faces)
    assert mesh.is_float32 and areas(mesh).min() > 0.0
    assert faces < 1_000 or abs(len(mesh.faces) / faces - 1) < 0.1
    # Whole numbers of rows and blocks cannot make few faces.
    assert 1 <= len(mesh.faces) <= 14 or abs(len(mesh.faces) / faces - 1) < 0.4
    assert mesh.name == f"{name}_{faces // 1_000}k" if faces >= 1_000 else mesh.name == f"{name}_{faces}"


@pytest.mark.parametrize("name", FORMS)
def test_every_family_asks_something_of_every_form(name: str, forms: dict[str, Mesh]) -> None:
    octree = Octree.from_mesh(forms[name])
    for family in families(octree, 3_000):
        share = octree.any_hit(family.origins, family.directions, t_max=family.t_max).mean()
        assert share == 0.0 if family.name == "misses" else share > 0.0, family.name


def test_a_mesh_by_name(tmp_path: Path) -> None:
    save_ply(box(), tmp_path / "city_1k.ply")
    assert meshes.named("2000").name == meshes.named("spheres_2k").name == "spheres_2k"
    assert meshes.named("city_3k").name == "city_3k" and len(meshes.named("soup_77").faces) == 77
    assert len(meshes.named(str(tmp_path / "city_1k.ply")).faces) == 12
