"""Colours of vertices from values of faces: means, creases, surfaces, files, and pictures of these."""

import numpy as np
import pytest
from cases import cases

from renderer import DirectionalLight, Mesh, PerspectiveCamera, Phong, Scene, SceneObject, load_mesh, render, srgb
from renderer.mesh.material import MeshMaterial
from renderer.mesh.shapes import box, grid, icosphere
from renderer.radiosity import patches, vertex_colors

pytestmark = pytest.mark.judges("radiosity.vertex_colors")


def areas_of(mesh):
    corners = mesh.triangles
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


def test_a_smooth_mesh_has_the_means_by_area_of_the_faces_around():
    mesh = icosphere(2).transformed(np.diag([1.0, 2.0, 0.5, 1.0]))
    rng = np.random.default_rng(1)
    values = rng.random((len(mesh.faces), 3))
    found = vertex_colors(mesh, values, crease=180.0, space="linear")
    assert len(found.vertices) == len(mesh.vertices)
    for vertex in range(0, len(mesh.vertices), 7):
        around = (mesh.faces == vertex).any(axis=1)
        expected = np.average(values[around], axis=0, weights=areas_of(mesh)[around])
        at = np.flatnonzero((found.vertices == mesh.vertices[vertex]).all(axis=1))
        np.testing.assert_allclose(found.colors[at], [expected], rtol=1e-6)


def test_nothing_bleeds_across_a_crease():
    cut = patches(box(), 0.3)
    side = cut.faces // 2
    found = vertex_colors(cut.mesh, np.eye(6)[side][:, :3] + np.eye(6)[side][:, 3:] * 0.5, space="linear")
    # Every face has its side's own colour at all corners, at the edges of the box too.
    own = np.eye(6)[side][:, :3] + np.eye(6)[side][:, 3:] * 0.5
    np.testing.assert_array_equal(found.colors[found.faces], np.repeat(own[:, None], 3, axis=1).astype(np.float32))
    np.testing.assert_array_equal(found.triangles, cut.mesh.triangles)
    # With no crease it does.
    smooth = vertex_colors(cut.mesh, own, crease=180.0, space="linear")
    assert len(smooth.vertices) == len(cut.mesh.vertices) < len(found.vertices)


def test_nothing_bleeds_between_surfaces_and_materials_are_surfaces():
    mesh = grid(4, 4)
    surfaces = np.arange(32) % 2
    for given, own in ((mesh, surfaces), (_with_materials(mesh, surfaces - 1), None)):
        found = vertex_colors(given, surfaces * 0.5, surfaces=own, space="linear")
        np.testing.assert_array_equal(found.colors[found.faces][:, :, 0], np.repeat(surfaces[:, None] * 0.5, 3, axis=1))
    one = vertex_colors(_with_materials(mesh, surfaces - 1), surfaces * 0.5, surfaces=np.full(32, 7), space="linear")
    assert len(one.vertices) == len(mesh.vertices)


def _with_materials(mesh, rows):
    return Mesh(mesh.vertices, mesh.faces, materials=[MeshMaterial()], face_materials=rows)


def test_faces_that_share_no_vertices_blend():
    apart = Mesh(grid().triangles.reshape(-1, 3), np.arange(6).reshape(-1, 3))
    found = vertex_colors(apart, [0.0, 1.0], space="linear")
    shared = vertex_colors(grid(), [0.0, 1.0], space="linear")
    np.testing.assert_array_equal(found.colors[found.faces], shared.colors[shared.faces])


def test_what_else_the_mesh_has_stays():
    mesh = Mesh.concatenate(grid(), grid(), name="two")
    normals = np.tile([0.0, 1.0, 0.0], (8, 1))
    mesh = Mesh(mesh.vertices, mesh.faces, normals, None, mesh.texcoords, "two", [MeshMaterial()], None, mesh.parts)
    found = vertex_colors(mesh, np.linspace(0, 1, 4))
    assert found.name == "two" and found.parts == mesh.parts and found.materials == mesh.materials
    np.testing.assert_array_equal(found.texcoords[found.faces], mesh.texcoords[mesh.faces])
    np.testing.assert_array_equal(found.normals[found.faces], mesh.normals[mesh.faces])


def test_faces_without_area_change_no_mean_and_have_a_color():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], [[0, 1, 2], [0, 1, 1], [3, 3, 3]])
    found = vertex_colors(mesh, [0.25, 1.0, 0.75], space="linear")
    np.testing.assert_array_equal(found.colors[found.faces][:, :, 0], [[0.25] * 3, [0.25] * 3, [0.75] * 3])


@cases("stops", [-3.0, 0.0, 2.5])
def test_exposure_and_srgb(stops):
    values = np.array([0.0, 0.001, 0.2, 0.9])
    mesh = Mesh.concatenate([grid()] * 2)
    # Each face by itself.
    found = vertex_colors(mesh, values, surfaces=range(4), exposure=stops)
    codes = np.round(found.colors[found.faces][:, 0, 0] * 255.0).astype(np.uint8)
    np.testing.assert_array_equal(codes, srgb(values * 2.0**stops))
    linear = vertex_colors(mesh, values, surfaces=range(4), exposure=stops, space="linear")
    exact = np.minimum(values * 2.0**stops, 1.0)
    np.testing.assert_allclose(linear.colors[linear.faces][:, 0, 0], exact, rtol=1e-6)


def test_a_file_keeps_the_colors_and_a_picture_shows_them(tmp_path):
    cut = patches(grid(size=(2.0, 2.0)), 0.25)
    left = cut.mesh.triangles[:, :, 0].mean(axis=1) < 0.0
    values = np.where(left[:, None], [0.5, 0.1, 0.0], [0.0, 0.2, 0.8])
    colored = vertex_colors(cut.mesh, values, surfaces=left.astype(int))
    colored.save(tmp_path / "light.ply")
    loaded = load_mesh(tmp_path / "light.ply")
    np.testing.assert_array_equal(loaded.colors, colored.colors)
    np.testing.assert_array_equal(loaded.faces, colored.faces)
    # By ambient light alone, with nothing else in the scene, the picture has the radiosities themselves.
    look = Phong(diffuse=0.0, ambient=1.0, vertex_colors="srgb")
    scene = Scene(
        camera=PerspectiveCamera(eye=(0, 3, 0), target=(0, 0, 0), up=(0, 0, -1), fov=30),
        objects=[SceneObject(mesh=loaded, material="light")],
        materials={"light": look},
        lights=[DirectionalLight(direction=(0, -1, 0), irradiance=0.0)],
        ambient=1.0,
    )
    picture = render(scene, resolution=(8, 8)).radiance
    np.testing.assert_allclose(picture[:, 1], np.tile([0.5, 0.1, 0.0], (8, 1)), atol=1e-5)
    np.testing.assert_allclose(picture[:, 6], np.tile([0.0, 0.2, 0.8], (8, 1)), atol=1e-5)


@cases(
    ("arguments", "message"),
    [
        ({"mesh": 1}, "mesh: expected a renderer.Mesh, got int"),
        ({"values": [0.0] * 11}, "values: expected shape (12,) or (12, 3), a row a face, got shape (11,)"),
        ({"values": [0.0] * 11 + [-1]}, "values: expected finite numbers >= 0, got [-1.0] in row 11"),
        ({"values": np.full((12, 3), np.nan)}, "values: expected finite numbers >= 0, got [nan, nan, nan] in row 0"),
        ({"crease": 181}, "crease: expected an angle from 0 to 180 degrees, got 181"),
        ({"surfaces": [0] * 11 + [-2]}, "surfaces: expected numbers >= 0, got -2 in row 11"),
        ({"surfaces": [0.5] * 12}, "surfaces: expected an integer or integers of shape (12,), got float64"),
        ({"exposure": np.inf}, "exposure: expected a finite number of stops, got inf"),
        ({"space": "rgb"}, "space: expected one of srgb, linear, got 'rgb'. Did you mean 'srgb'?"),
    ],
)
def test_bad_input_is_named(arguments, message):
    given = {"mesh": box(), "values": [0.5] * 12} | arguments
    with pytest.raises(ValueError) as caught:
        vertex_colors(**given)
    assert str(caught.value).startswith(message)
