"""The forms in which a mesh is given to an octree: a mesh, a file, a mesh of trimesh, arrays."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from cases import cases

import renderer
from renderer import BruteForce, Mesh, MeshError, Octree, RepairWarning, SceneError, load_mesh, load_scene
from renderer.mesh.shapes import icosphere

BALL = icosphere(1)


@pytest.mark.judges("Octree", "BruteForce")
@cases("accelerator", [Octree, BruteForce])
def test_all_forms_are_the_same_mesh(accelerator: Any, tmp_path: Path) -> None:
    BALL.save(tmp_path / "ball.ply")
    foreign = trimesh.Trimesh(BALL.vertices, BALL.faces, process=False)
    for form in (
        BALL,
        tmp_path / "ball.ply",
        str(tmp_path / "ball.ply"),
        foreign,
        SimpleNamespace(vertices=BALL.vertices.tolist(), faces=BALL.faces.tolist()),
    ):
        for repair in (False, True):
            built = accelerator(form, repair=repair, threads=1)
            np.testing.assert_array_equal(built.mesh.vertices, BALL.vertices)
            np.testing.assert_array_equal(built.mesh.faces, BALL.faces)
    assert accelerator(BALL).mesh is BALL and accelerator(BALL, repair=True).mesh is BALL
    assert not accelerator(BALL, repair=True).repairs and accelerator(BALL).repairs is None
    by_name = accelerator(vertices=BALL.vertices, faces=BALL.faces)
    assert by_name.closest_hit([0, 0.1, 3], [0, 0, -1]).t == accelerator(foreign).closest_hit([0, 0.1, 3], [0, 0, -1]).t


def test_repairs_of_each_form(tmp_path: Path) -> None:
    bad = SimpleNamespace(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2], [0, 1, 3]])
    built = Octree(bad, repair=True)
    assert built.repairs is not None and built.repairs.dropped_faces.tolist() == [1]
    (tmp_path / "bad.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n")
    with pytest.warns(RepairWarning, match="dropped 1 of 2 faces"):
        assert len(Octree(tmp_path / "bad.obj", repair=True).mesh.faces) == 1
    with pytest.raises(MeshError, match=r"^faces: expected indices from 0 to 2, got 3 in row 1$"):
        Octree(bad)


@cases("accelerator", [Octree, BruteForce])
@cases(
    ("given", "says"),
    [
        ((5,), "mesh: expected a Mesh, a path, an object with vertices and faces .*, got builtins.int"),
        ((None,), "mesh: expected .* got builtins.NoneType"),
        ((Mesh,), "mesh: expected .* got builtins.type"),
        (
            (trimesh.Scene(),),
            r"mesh: expected .* got trimesh.scene.scene.Scene; scene.to_mesh\(\) makes one of a scene",
        ),
        ((np.eye(3),), r"faces: expected integers of shape \(F, 3\) beside vertices, got None"),
        (([[0, 0, 0]],), r"faces: expected integers of shape \(F, 3\) beside vertices, got None"),
        ((BALL, BALL.faces), "faces: expected none beside a mesh, got ndarray"),
        (((row for row in BALL.vertices), BALL.faces), "vertices: expected an array, got a generator, which list.*"),
        (([[0, 0, 0], [1, 2]], [[0, 1, 2]]), "vertices: expected an array, got rows of different lengths"),
        (("a.stl", [[0, 1, 2]]), "vertices: expected .*"),
        (("a.txt",), "a.txt: expected a suffix of .ply, .obj, .stl, .glb, .gltf, got '.txt'"),
    ],
)
def test_what_is_no_mesh_is_said(accelerator: Any, given: Any, says: str) -> None:
    with pytest.raises(MeshError, match=f"^{says}$"):
        accelerator(*given)


@pytest.mark.judges("load_mesh", "Octree.load", "load_scene")
def test_a_missing_file_is_what_python_calls_it_and_what_this_package_does(tmp_path: Path) -> None:
    mesh, scene = tmp_path / "missing.ply", tmp_path / "missing.toml"
    calls = [(load_mesh, mesh, MeshError), (Octree, mesh, MeshError), (Octree.load, mesh, ValueError)]
    for call, path, own in [*calls, (load_scene, scene, SceneError), (load_scene, mesh, SceneError)]:
        with pytest.raises(FileNotFoundError) as caught:
            call(path)
        assert isinstance(caught.value, own)
        assert str(caught.value) == f"{path}: cannot be read: No such file or directory"


# --- trimesh ----------------------------------------------------------------------------------------------------------


@pytest.mark.judges("Mesh.from_trimesh")
def test_a_mesh_of_trimesh_brings_colours_texture_coordinates_and_normals_that_are_its_own() -> None:
    given = trimesh.Trimesh(BALL.vertices, BALL.faces, process=False)
    assert given.vertex_normals.shape == BALL.vertices.shape  # computed, and kept by trimesh from now on
    plain = Mesh.from_trimesh(given, name="ball")
    assert plain.normals is plain.colors is plain.texcoords is None and plain.name == "ball"
    given.apply_translation([1, 2, 3])
    assert Mesh.from_trimesh(given).normals is None
    own = trimesh.Trimesh(BALL.vertices, BALL.faces, vertex_normals=np.tile([0.0, 0.0, 1.0], (42, 1)), process=False)
    np.testing.assert_array_equal(Mesh.from_trimesh(own).normals, np.tile([0.0, 0.0, 1.0], (42, 1)))
    colors = np.arange(42 * 4).reshape(42, 4).astype(np.uint8)
    own.visual.vertex_colors = colors
    np.testing.assert_array_equal(Mesh.from_trimesh(own).colors, (colors[:, :3] / 255).astype(np.float32))
    textured = trimesh.Trimesh(BALL.vertices, BALL.faces, process=False)
    textured.visual = trimesh.visual.TextureVisuals(uv=BALL.vertices[:, :2])
    np.testing.assert_array_equal(Mesh.from_trimesh(textured).texcoords, BALL.vertices[:, :2])


@pytest.mark.judges("Mesh.from_trimesh")
def test_a_mesh_of_this_library_loses_nothing() -> None:
    colored = Mesh(BALL.vertices, BALL.faces, colors=np.ones((42, 3)), name="ball")
    again = Mesh.from_trimesh(colored)
    np.testing.assert_array_equal(again.colors, colored.colors)
    assert again.name == "ball" and Mesh.from_trimesh(colored, name="x").name == "x"


def test_what_is_no_mesh_of_another_library_is_said() -> None:
    bad: Any = Mesh.from_trimesh
    with pytest.raises(MeshError, match=r"^pot: mesh: expected an object with .* got builtins.int$"):
        bad(3, name="pot")
    with pytest.raises(MeshError, match=r"^vertices: expected shape \(n, 3\)"):
        bad(SimpleNamespace(vertices=[1, 2], faces=[]))


@cases(("made", "module"), [
    ("renderer.Mesh.from_trimesh(types.SimpleNamespace(vertices=np.eye(3), faces=[[0, 1, 2]]))", "trimesh"),
    ("renderer.Octree", "renderer.mesh.load"),
])  # fmt: skip
def test_what_is_not_needed_is_not_imported(made: str, module: str) -> None:
    code = f"import sys, types, numpy as np, renderer; {made}; sys.exit({module!r} in sys.modules)"
    folder = Path(renderer.__file__).parent.parent
    assert subprocess.run([sys.executable, "-c", code], cwd=folder, check=False).returncode == 0
