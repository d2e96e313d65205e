"""``mesh.octree`` of PyVista: found by its entry point, follows the mesh, answers as the octree does."""

import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
DOWN = [[0.0, 0.0, -1.0]]


def test_an_old_pyvista_is_named() -> None:
    script = """
import sys, types
sys.modules["pyvista"] = types.SimpleNamespace(__version__="0.47.1")
try:
    import renderer.pyvista_accessor
except ImportError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.stdout == "renderer: mesh.octree takes PyVista 0.48 or newer, which has accessors, got 0.47.1\n", (
        done.stderr
    )


def test_the_entry_point_names_the_module() -> None:
    (point,) = [p for p in entry_points(group="pyvista.accessors") if p.name == "octree"]
    assert point.value == "renderer.pyvista_accessor"


@pytest.fixture
def ball() -> Any:
    pyvista = pytest.importorskip("pyvista", minversion="0.48", reason="no PyVista 0.48: pip install '.[pyvista]'")
    return pyvista.Icosphere(radius=1.0, nsub=2)


def test_answers_are_those_of_the_octree(ball: Any) -> None:
    from renderer import Octree

    octree = Octree(ball.points, ball.regular_faces)
    rng = np.random.default_rng(5)
    o, d, p = rng.uniform(-2, 2, (50, 3)), rng.normal(size=(50, 3)), rng.uniform(-1, 1, (50, 3))
    np.testing.assert_array_equal(ball.octree.closest_hit(o, d).t, octree.closest_hit(o, d).t)
    np.testing.assert_array_equal(ball.octree.any_hit(o, d, t_max=0.5), octree.any_hit(o, d, t_max=0.5))
    np.testing.assert_array_equal(ball.octree.all_hits(o, d).face, octree.all_hits(o, d).face)
    np.testing.assert_array_equal(ball.octree.contains(p), octree.contains(p))
    np.testing.assert_array_equal(ball.octree.closest_point(p).points, octree.closest_point(p).points)
    np.testing.assert_array_equal(ball.octree.signed_distance(p), octree.signed_distance(p))
    np.testing.assert_array_equal(ball.octree.visible(o, p), octree.visible(o, p))
    assert 0 < ball.octree.contains(p).sum() < 50


def test_a_tree_is_kept_until_the_mesh_changes(ball: Any) -> None:
    tree = ball.octree.tree
    assert ball.octree.tree is tree
    ball.points[:, 2] += 1.0
    assert ball.octree.closest_hit([[0, 0, 9]], DOWN).t == pytest.approx(7.0, abs=1e-6)
    moved = ball.translate([0, 0, 1])
    assert moved.octree.closest_hit([[0, 0, 9]], DOWN).t == pytest.approx(6.0, abs=1e-6)
    assert ball.copy().octree.tree is not ball.octree.tree


def test_other_cells_are_refused(ball: Any) -> None:
    pyvista = pytest.importorskip("pyvista")
    with pytest.raises(
        ValueError, match=r"^mesh: expected triangles only, as mesh.triangulate\(\) makes them, got other"
    ):
        pyvista.Cube().octree.any_hit([[0, 0, 9]], DOWN)
    assert pyvista.Cube().triangulate().octree.any_hit([[0, 0, 9]], DOWN).tolist() == [True]
    assert pyvista.PolyData().octree.any_hit([[0, 0, 9]], DOWN).tolist() == [False]


def test_pyvista_finds_it_and_imports_no_compiler() -> None:
    pytest.importorskip("pyvista", minversion="0.48", reason="no PyVista 0.48: pip install '.[pyvista]'")
    script = """
import sys, pyvista
ball = pyvista.Icosphere()
assert "renderer" not in sys.modules
ball.octree
assert "renderer" in sys.modules and "numba" not in sys.modules
assert ball.octree.contains([0, 0, 0]) == True
"""
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
