"""Shapes: closed, outward, of the size that their docstrings promise."""

import numpy as np
import pytest
from cases import cases

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, grid, icosphere, torus


def signed_volume(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


@cases("level", range(6))
def test_icosphere(level: int) -> None:
    mesh = icosphere(level)
    assert len(mesh.faces) == 20 * 4**level and len(mesh.vertices) == 10 * 4**level + 2
    assert mesh.is_closed()
    # Normalising rounds each coordinate by half an ulp of at most 1.
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, atol=4e-16)
    # A regular icosahedron in the unit sphere has volume 2.536150710; finer ones grow to 4 pi / 3.
    assert 2.53615 < signed_volume(mesh) < 4 * np.pi / 3
    assert (np.einsum("ij,ij->i", mesh.face_normals(), mesh.triangles.mean(axis=1)) > 0).all()


def test_torus() -> None:
    mesh = torus(2.0, 0.5, 128, 64)
    assert len(mesh.faces) == 2 * 128 * 64 and mesh.is_closed()
    # Inscribed polygons fall short by the factors sin(x)/x of their central angles.
    polygons = np.sinc(2 / 64) * np.sinc(2 / 128)
    assert signed_volume(mesh) == pytest.approx(2 * np.pi**2 * 2.0 * 0.25 * polygons, rel=1e-12)
    assert mesh.bounds[1].tolist() == [2.5, 0.5, 2.5]


@pytest.mark.judges("Mesh", "Mesh.face_normals")
def test_box() -> None:
    mesh = box((-1, 0, 2), (1, 3, 4))
    assert mesh.is_closed() and signed_volume(mesh) == 12
    away = np.einsum("ij,ij->i", mesh.face_normals(), mesh.triangles.mean(axis=1) - [0, 1.5, 3])
    assert sorted(away.tolist()) == [1] * 8 + [1.5] * 4


@pytest.mark.judges("Mesh")
def test_grid() -> None:
    mesh = grid(2, 3, (6.0, 4.0))
    assert len(mesh.faces) == 12 and [b.tolist() for b in mesh.bounds] == [[-3, 0, -2], [3, 0, 2]]
    assert (mesh.face_normals() == [0, 1, 0]).all()
    assert mesh.texcoords is not None
    assert mesh.texcoords[0].tolist() == [0, 0] and mesh.vertices[0].tolist() == [-3, 0, 2]
    assert mesh.texcoords[-1].tolist() == [1, 1] and mesh.vertices[-1].tolist() == [3, 0, -2]


@cases(
    "call",
    [
        lambda: icosphere(-1),
        lambda: torus(1, 1),
        lambda: torus(around=2),
        lambda: box((0, 0, 0), (1, 0, 1)),
        lambda: grid(0, 1),
    ],
)
def test_refuses_shapes_that_are_none(call) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match="expected"):
        call()
