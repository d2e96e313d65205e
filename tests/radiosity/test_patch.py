"""Patches: edges that are short enough and fit, faces that are covered, and what vertices and faces carry."""

import numpy as np
import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st

from renderer import Mesh
from renderer.mesh.material import MeshMaterial
from renderer.mesh.shapes import box, grid, icosphere, torus
from renderer.radiosity import Patches, patches, refined

pytestmark = pytest.mark.judges("radiosity.patches", "radiosity.refined", "radiosity.Patches")

CLOSED = [
    box((0, 0, 0), (1, 0.3, 2)),
    icosphere(1),
    torus(around=7, across=3),
    # Faces that share no vertices: edges fit by position alone.
    box((0, 0, 0), (1, 0.3, 2)).creased(),
]


def areas_of(mesh):
    corners = mesh.triangles
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


def lengths_of(mesh):
    corners = mesh.triangles
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def least_angle(mesh):
    corners = mesh.triangles
    out, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cosine = (out * back).sum(axis=2) / np.linalg.norm(out, axis=2) / np.linalg.norm(back, axis=2)
    return np.arccos(cosine).min()


def assert_covered(mesh, cut):
    """The patches of each face have its area and its normal, side by side in the order of faces."""
    assert (np.diff(cut.faces) >= 0).all()
    sums = np.bincount(cut.faces, areas_of(cut.mesh), len(mesh.faces))
    np.testing.assert_allclose(sums, areas_of(mesh), rtol=1e-12)
    turned = (cut.mesh.face_normals() * mesh.face_normals()[cut.faces]).sum(axis=1)
    np.testing.assert_allclose(turned, 1.0, rtol=1e-9)


def assert_fit(mesh, cut):
    """A corner within an edge of another face would leave that edge open."""
    assert mesh.is_closed() and cut.mesh.is_closed()
    assert len(cut.mesh.odd_edges) == 0


@cases("mesh", CLOSED)
@cases("edge", [5.0, 0.7, 0.31, 0.1])
def test_no_edge_is_longer_and_edges_fit(mesh, edge):
    cut = patches(mesh, edge)
    assert lengths_of(cut.mesh).max() <= edge
    assert_covered(mesh, cut)
    assert_fit(mesh, cut)


@given(st.integers(0, 2**32 - 1))
def test_faces_of_any_shape_are_cut_and_fit(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(6, 3)) * 10.0 ** rng.uniform(-2, 1, (1, 3))
    # An octahedron, pushed about: closed whatever its corners are.
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    mesh = Mesh(vertices, faces)
    edge = float(lengths_of(mesh).max() * rng.uniform(0.05, 1.0))
    cut = patches(mesh, edge)
    assert lengths_of(cut.mesh).max() <= edge
    sums = np.bincount(cut.faces, areas_of(cut.mesh), 8)
    np.testing.assert_allclose(sums, areas_of(mesh), rtol=1e-9)
    assert len(cut.mesh.open_edges) == 0


def test_an_edge_is_not_cut_if_it_is_as_long_as_allowed():
    mesh = grid()
    assert len(patches(mesh, float(np.sqrt(2.0))).faces) == 2
    assert len(patches(mesh, float(np.nextafter(np.sqrt(2.0), 0.0))).faces) == 4


def test_faces_whose_edges_are_all_cut_keep_their_shape():
    cut = patches(icosphere(0), 0.6)
    lengths = lengths_of(cut.mesh)
    assert len(cut.faces) == 80
    np.testing.assert_allclose(lengths, lengths[0, 0], rtol=1e-12)


def test_what_vertices_carry_is_interpolated_and_what_faces_have_stays():
    plane = grid(2, 3)
    colors = np.concatenate([plane.texcoords, plane.texcoords[:, :1]], axis=1)
    normals = np.concatenate([plane.texcoords, np.ones((len(plane.vertices), 1))], axis=1)
    materials, rows = (MeshMaterial(), MeshMaterial(name="other")), np.arange(12) % 3 - 1
    one = Mesh(plane.vertices, plane.faces, normals, colors, plane.texcoords, "plane", materials, rows)
    # A mesh of two parts; both are affine in x and z.
    mesh = Mesh.concatenate(one, one, name="both")
    cut = patches(mesh, 0.2)
    x, z = cut.mesh.vertices[:, 0] + 0.5, 0.5 - cut.mesh.vertices[:, 2]
    np.testing.assert_allclose(cut.mesh.texcoords, np.stack([x, z], axis=1), atol=1e-12)
    np.testing.assert_allclose(cut.mesh.colors, np.stack([x, z, x], axis=1), atol=1e-6)
    np.testing.assert_allclose(cut.mesh.normals, np.stack([x, z, np.ones_like(x)], axis=1), atol=1e-12)
    assert cut.mesh.materials == mesh.materials
    np.testing.assert_array_equal(cut.mesh.face_materials, mesh.face_materials[cut.faces])
    halves = [cut.faces[part.faces] for part in cut.mesh.parts]
    assert [part.name for part in cut.mesh.parts] == ["plane", "plane"] and cut.mesh.name == "both"
    assert halves[0].max() == 11 and halves[1].min() == 12 and len(halves[0]) + len(halves[1]) == len(cut.faces)


def test_no_patch_is_marked():
    cut = patches(box(), 0.5)
    assert refined(cut, np.zeros(len(cut.faces), bool)) is cut


@given(st.integers(0, 2**32 - 1))
def test_marked_patches_are_cut_in_four_and_angles_stay_wide(seed):
    rng = np.random.default_rng(seed)
    mesh = CLOSED[seed % len(CLOSED)]
    cut, least = patches(mesh, 0.9), least_angle(patches(mesh, 0.9).mesh)
    for _ in range(4):
        # Always at one place too, where cuts are the smallest.
        marked = rng.random(len(cut.faces)) < 0.1
        marked[len(marked) // 2] = True
        finer = refined(cut, marked)
        before = areas_of(cut.mesh)
        # Each marked patch is covered by pieces of a quarter of its area.
        small = areas_of(finer.mesh).min()
        assert small <= before[marked].min() / 4 * (1 + 1e-9)
        assert len(finer.faces) >= len(cut.faces) + 3 * marked.sum()
        assert_covered(mesh, finer)
        assert_fit(mesh, finer)
        cut = finer
    assert least_angle(cut.mesh) >= 0.5 * least * (1 - 1e-9)


def test_cuts_stay_near_what_is_marked():
    cut = patches(grid(8, 8), 1.0)
    marked = np.zeros(128, bool)
    marked[0] = True
    finer = refined(cut, marked)
    assert np.flatnonzero(np.bincount(finer.faces) > 1).max() < 20
    assert np.bincount(finer.faces)[0] == 4


@cases(
    ("edge", "message"),
    [
        (0.0, "edge: expected a finite number > 0, got 0.0"),
        (-1.0, "edge: expected a finite number > 0, got -1.0"),
        (np.nan, "edge: expected a finite number > 0, got nan"),
        (np.inf, "edge: expected a finite number > 0, got inf"),
        ([1.0], "edge: expected a finite number > 0, got [1.0]"),
        ("1", "edge: expected real numbers, got dtype <U1"),
        # A square metre in patches of a nanometre.
        (1e-9, "edge: expected at most 16777216 patches from it, got 1.39e+19 or more"),
    ],
)
def test_a_bad_edge_is_named(edge, message):
    with pytest.raises(ValueError) as caught:
        patches(box(), edge)
    assert str(caught.value).startswith(message)


@cases("marked", [[1, 0] * 6, [True] * 11, True])
def test_bad_marks_are_named(marked):
    with pytest.raises(ValueError, match=r"^marked: expected bool of shape \(12,\), one a patch, got "):
        refined(patches(box(), 9.0), marked)


def test_what_is_no_mesh_is_named():
    with pytest.raises(ValueError, match=r"^mesh: expected a renderer.Mesh, got int"):
        patches(3, 1.0)
    with pytest.raises(ValueError, match=r"^patches: expected Patches, got Mesh"):
        refined(box(), [True] * 12)


def test_too_many_patches_are_named(monkeypatch):
    monkeypatch.setattr("renderer.radiosity.patch.MOST_PATCHES", 100)
    # So thin that their area says nothing.
    thin = box((0, 0, 0), (1, 1e-9, 1e-9))
    with pytest.raises(ValueError, match=r"^edge: expected at most 100 patches from it, got 220 or more"):
        patches(thin, 0.01)
    cut = patches(box(), 0.5)
    with pytest.raises(ValueError, match=r"^marked: expected at most 100 patches from it, got 384 or more"):
        refined(cut, np.ones(len(cut.faces), bool))


def test_a_mesh_without_faces_has_no_patches():
    cut = patches(Mesh([[0, 0, 0]], np.empty((0, 3), int)), 1.0)
    assert isinstance(cut, Patches) and len(cut.faces) == 0
