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


@pytest.mark.parametrize("faces", [1, 7, 100, 5_000, 30_000])
@pytest.mark.parametrize("name", FORMS)
def test_a_form_has_about_the_faces_asked_for_and_is_the_same_again(name: str, faces: int) -> None:
    mesh, again = FORMS[name](faces), FORMS[name](faces)
    assert np.array_equal(mesh.vertices, again.vertices) and np.array_equal(mesh.faces, again.faces)
    assert mesh.is_float32 and areas(mesh).min() > 0.0
    assert faces < 1_000 or abs(len(mesh.faces) / faces - 1) < 0.1
    # Whole numbers of rows and blocks cannot make few faces.
    assert 1 <= len(mesh.faces) <= 14 or abs(len(mesh.faces) / faces - 1) < 0.4
    assert mesh.name == f"{name}_{faces // 1_000}k" if faces >= 1_000 else mesh.name == f"{name}_{faces}"


@pytest.mark.parametrize("name", ["scan", "thin"])
def test_scan_and_tube_are_closed_and_face_outward(name: str) -> None:
    for faces in (1, 100, 5_000):
        mesh = FORMS[name](faces)
        assert not len(mesh.open_edges)
        a, b, c = mesh.triangles.transpose(1, 0, 2)
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0.0


def test_a_tube_is_forty_times_as_long_as_wide_lies_obliquely_and_is_missed(forms: dict[str, Mesh]) -> None:
    mesh = forms["thin"]
    along = np.linalg.svd(mesh.vertices - mesh.vertices.mean(axis=0), full_matrices=False)[2]
    extent = np.ptp(mesh.vertices @ along.T, axis=0)
    assert 20 < extent[0] / extent[1] < 45 and 30 < extent[0] / extent[2] < 45
    assert (np.abs(along[0]) > 0.3).all() and (np.abs(along[0]) < 0.9).all()
    octree = Octree.from_mesh(mesh)
    random = next(family for family in families(octree, 4_000) if family.name == "random")
    assert 0.002 < octree.any_hit(random.origins, random.directions).mean() < 0.2


def test_a_terrain_is_a_height_field(forms: dict[str, Mesh]) -> None:
    mesh = forms["terrain"]
    assert (mesh.face_normals()[:, 1] > 0).all() and len(np.unique(mesh.vertices[:, [0, 2]], axis=0)) == len(
        mesh.vertices
    )
    # Open at its four borders and nowhere else.
    assert len(mesh.open_edges) == 4 * (len(mesh.vertices) ** 0.5 - 1)
    assert 0.1 < np.ptp(mesh.vertices[:, 1]) < 1.5


def test_a_city_has_blocks_of_twelve_faces_with_streets_between_and_a_ground(forms: dict[str, Mesh]) -> None:
    mesh = forms["city"]
    blocks, rest = divmod(len(mesh.faces), 12)
    corners = mesh.vertices[: 8 * blocks].reshape(blocks, 8, 3)
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    assert rest == 2 and len(mesh.vertices) == 8 * blocks + 4
    assert np.array_equal(mesh.faces[:12], box().faces)
    side = round(blocks**0.5)
    low, high = (a[:, 0].reshape(side, side) for a in (lower, upper))
    assert side**2 == blocks and (low[:, 1:] > high[:, :-1]).all()
    low, high = (a[:, 2].reshape(side, side) for a in (lower, upper))
    assert (low[1:] > high[:-1]).all()
    heights = upper[:, 1]
    assert (lower[:, 1] < 0).all() and (heights > 0).all() and np.quantile(heights, 0.9) > 3 * np.quantile(heights, 0.1)
    assert areas(mesh)[-2:].tolist() == [2.0, 2.0] and (mesh.face_normals()[-2:, 1] > 0.99).all()


@pytest.mark.parametrize("name", FORMS)
def test_every_family_asks_something_of_every_form(name: str, forms: dict[str, Mesh]) -> None:
    octree = Octree.from_mesh(forms[name])
    for family in families(octree, 3_000):
        share = octree.any_hit(family.origins, family.directions, t_max=family.t_max).mean()
        assert share == 0.0 if family.name == "misses" else share > 0.0, family.name


def test_a_run_has_its_series_every_form_twice_and_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_ply(Mesh(box().vertices / 3, box().faces), tmp_path / "own.ply")
    full = {(form, faces) for form, faces in meshes.FULL_FORMS}
    assert full == {(form, faces) for form in FORMS for faces in (100_000, 1_000_000)} and len(meshes.FULL_FORMS) == 10
    assert len(meshes.QUICK_FORMS) <= 2 and all(faces <= 10_000 for _, faces in meshes.QUICK_FORMS)
    monkeypatch.setattr(meshes, "FULL", (300, 1_000))
    monkeypatch.setattr(meshes, "FULL_FORMS", (("soup", 100), ("terrain", 10_000)))
    found = list(meshes.chosen(False, False, (tmp_path / "own.ply",)))
    assert [(c.mesh.name, c.kind, c.brief) for c in found] == [
        ("spheres_300", "spheres", False), ("spheres_1k", "spheres", False), ("soup_100", "soup", True),
        ("terrain_10k", "terrain", True), ("own", "file", False)]  # fmt: skip
    assert found[-1].mesh.is_float32


def test_a_mesh_by_name(tmp_path: Path) -> None:
    save_ply(box(), tmp_path / "city_1k.ply")
    assert meshes.named("2000").name == meshes.named("spheres_2k").name == "spheres_2k"
    assert meshes.named("city_3k").name == "city_3k" and len(meshes.named("soup_77").faces) == 77
    assert len(meshes.named(str(tmp_path / "city_1k.ply")).faces) == 12
