"""Mesh: its checks at the boundary and the laws of what it derives."""

import dataclasses
import re
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st

from renderer import Octree
from renderer.errors import MeshError
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, grid, icosphere, torus

pytestmark = pytest.mark.judges(
    "Mesh", "Mesh.bounds", "Mesh.concatenate", "Mesh.extent", "Mesh.face_normals", "Mesh.is_closed", "Mesh.is_float32",
    "Mesh.transformed", "Mesh.vertex_normals", "MeshError",
)  # fmt: skip


TRIANGLE: dict[str, Any] = {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}


def signed_volume(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def rotation(seed: int) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.linalg.det(q)


def affine(linear: Any, shift: Any = (0, 0, 0)) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, shift
    return matrix


def test_is_read_only_and_apart_from_the_callers_arrays() -> None:
    vertices = np.array(TRIANGLE["vertices"], dtype=np.float64)
    mesh = Mesh(vertices, TRIANGLE["faces"], normals=np.ones((3, 3)))
    vertices[0] = 7
    assert mesh.vertices[0].tolist() == [0, 0, 0]
    assert mesh.normals is not None
    for array in (mesh.vertices, mesh.faces, mesh.normals, *mesh.bounds):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        mesh.name = "other"  # type: ignore[misc]


@cases(
    ("change", "message"),
    [
        ({"vertices": [[0, 0], [1, 0], [0, 1]]}, "vertices: expected shape (n, 3), got (3, 2)"),
        ({"vertices": [[0, 0, 0], [1, 0]]}, "vertices: expected an array, got"),
        ({"vertices": [["a", "b", "c"]]}, "vertices: expected real numbers, got dtype <U1"),
        ({"vertices": [[0, 0, 1j]]}, "vertices: expected real numbers, got dtype complex128"),
        ({"vertices": [[0, 0, 0], [0, np.nan, 0], [np.inf, 0, 0]]}, "finite values, got [0.0, nan, 0.0] in row 1"),
        ({"faces": [[0, 1, 2, 0]]}, "faces: expected shape (n, 3), got (1, 4)"),
        ({"faces": [[0, 1, 2.0]]}, "faces: expected integers, got dtype float64"),
        ({"faces": [[True, False, True]]}, "faces: expected integers, got dtype bool"),
        ({"faces": [[0, 1, 2], [0, 3, 1]]}, "faces: expected indices from 0 to 2, got 3 in row 1"),
        ({"faces": [[0, 1, 2], [0, 1, 2], [-1, 0, 1]]}, "faces: expected indices from 0 to 2, got -1 in row 2"),
        ({"faces": np.array([[0, 1, 2**32]])}, "got 4294967296 in row 0"),
        ({"faces": np.array([[0, 1, 2**64 - 1]], dtype=np.uint64)}, "got 18446744073709551615 in row 0"),
        ({"vertices": []}, "faces: expected no faces, as there are no vertices, got 0 in row 0"),
        ({"normals": [[0, 0, 1]]}, "normals: expected a row a vertex, 3, got 1"),
        ({"normals": [[0, 0, np.nan]] * 3}, "normals: expected finite values, got [0.0, 0.0, nan] in row 0"),
        ({"colors": [[0, 0, 0], [0, 0, 0], [0, 1.5, 0]]}, "colors: expected values in [0, 1], got [0.0, 1.5, 0.0]"),
        ({"colors": [[0, 1e300, 0]] * 3}, "colors: expected finite values"),
        ({"texcoords": [[0, 0, 0]] * 3}, "texcoords: expected shape (n, 2), got (3, 3)"),
    ],
)
def test_says_what_is_wrong(change: dict[str, Any], message: str) -> None:
    with pytest.raises(MeshError, match=re.escape(message)):
        Mesh(**(TRIANGLE | change))
    with pytest.raises(MeshError, match=f"^pot: .*{re.escape(message)}"):
        Mesh(**(TRIANGLE | change), name="pot")


def test_a_mesh_that_views_arrays_has_them_and_checks_their_values() -> None:
    """Of each name its own, nothing copied, and none that is not given."""
    arrays: dict[str, Any] = {
        "vertices": np.eye(3), "faces": np.array([[0, 1, 2]], np.int32), "normals": np.full((3, 3), 2.0),
        "colors": np.full((3, 3), 0.5, np.float32), "texcoords": np.zeros((3, 2)),
    }  # fmt: skip
    mesh = Mesh._viewing(arrays, "seen")
    assert all(np.shares_memory(getattr(mesh, name), array) for name, array in arrays.items()) and mesh.name == "seen"
    assert not mesh.colors.flags.writeable  # type: ignore[union-attr]
    bare = Mesh._viewing({name: arrays[name] for name in ("vertices", "faces")}, "")
    assert bare.normals is bare.colors is bare.texcoords is None
    for name, value in (
        ("vertices", np.nan),
        ("faces", 3),
        ("normals", np.inf),
        ("colors", 1.5),
        ("texcoords", np.nan),
    ):
        with pytest.raises(MeshError, match=f"^seen: {name}: expected"):
            Mesh._viewing(arrays | {name: np.full_like(arrays[name], value)}, "seen")


def test_may_be_empty() -> None:
    nothing = Mesh([], [])
    assert nothing.vertices.shape == nothing.faces.shape == (0, 3) and nothing.triangles.shape == (0, 3, 3)
    assert nothing.bounds[0].tolist() == [np.inf] * 3 and nothing.bounds[1].tolist() == [-np.inf] * 3
    assert nothing.extent.tolist() == [0, 0, 0]
    assert nothing.face_normals().shape == nothing.vertex_normals().shape == (0, 3)
    assert nothing.is_float32 and not nothing.is_closed()
    assert Mesh([[1, 2, 3]], []).vertex_normals().tolist() == [[0, 0, 0]]


def test_prints_on_one_line() -> None:
    assert repr(Mesh(**TRIANGLE, name="pot")) == "<Mesh 'pot' of 1 faces, 3 vertices>"
    assert repr(Mesh([], [])) == "<Mesh of 0 faces, 0 vertices>"


def test_is_float32() -> None:
    assert Mesh([[0.5, 1e-45 * 0, 2.0**-140]], []).is_float32
    assert not Mesh([[0.1, 0, 0]], []).is_float32
    assert not Mesh([[1e300, 0, 0]], []).is_float32
    assert not Mesh([[1e-300, 0, 0]], []).is_float32


@cases("exponent", [-500, -60, 0, 60, 500])
def test_normals_do_not_depend_on_scale(exponent: int) -> None:
    mesh = torus(around=7, across=5)
    scaled = Mesh(np.ldexp(mesh.vertices, exponent), mesh.faces)
    assert np.array_equal(scaled.face_normals(), mesh.face_normals())
    assert np.array_equal(scaled.vertex_normals(), mesh.vertex_normals())


def test_faces_without_area_have_no_normal_and_no_weight() -> None:
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]]
    mesh = Mesh(vertices, [[0, 1, 2], [0, 1, 3], [0, 0, 1], [3, 3, 3]])
    assert mesh.face_normals().tolist() == [[0, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    assert mesh.vertex_normals().tolist() == [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 0]]


def test_vertex_normals_weigh_by_angle() -> None:
    """At a box's corner three right angles meet, however the sides are cut: the normal is the diagonal."""
    mesh = box((-1, -1, -1), (1, 1, 1))
    # A few roundings of numbers of size one.
    np.testing.assert_allclose(mesh.vertex_normals(), mesh.vertices / np.sqrt(3), atol=1e-15)


def test_vertex_normals_against_a_slow_loop() -> None:
    rng = np.random.default_rng(3)
    mesh = Mesh(rng.normal(size=(20, 3)), rng.integers(0, 20, size=(60, 3)))
    expected = np.zeros((20, 3))
    for face in mesh.faces:
        p = mesh.vertices[face]
        normal = np.cross(p[1] - p[0], p[2] - p[0])
        if len(set(face.tolist())) < 3:
            continue
        for k in range(3):
            a, b = p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]
            angle = np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
            expected[face[k]] += angle * normal / np.linalg.norm(normal)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    # acos loses up to half the digits near 0 and pi; these random angles stay clear of both.
    np.testing.assert_allclose(mesh.vertex_normals(), expected, atol=1e-12)


def test_closed() -> None:
    cube = box()
    assert cube.is_closed()
    assert not Mesh(cube.vertices, cube.faces[1:]).is_closed()
    turned = cube.faces.copy()
    turned[0] = turned[0, ::-1]
    assert not Mesh(cube.vertices, turned).is_closed()
    assert not grid().is_closed() and not Mesh([], []).is_closed()


@pytest.mark.judges("Mesh.is_closed")
def test_what_is_closed_is_what_contains_takes() -> None:
    """By position: triangle soup, a body that is there twice, and one with a face without area."""
    cube = box()
    soup = Mesh(cube.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    twice = Mesh(cube.vertices, np.concatenate([cube.faces, cube.faces]))
    flat = Mesh(cube.vertices, np.concatenate([cube.faces, [[0, 0, 0]]]))
    for mesh in (soup, twice, flat):
        assert mesh.is_closed()
        assert Octree(mesh).contains([0.5, 0.25, 0.5])
    with pytest.raises(ValueError, match=r"^mesh: expected a closed mesh"):
        Octree(Mesh(soup.vertices, soup.faces[1:])).contains([0.5, 0.25, 0.5])


@given(st.integers(0, 10**6), st.booleans())
def test_transformed_keeps_outside_outside(seed: int, mirror: bool) -> None:
    rng = np.random.default_rng(seed)
    linear = rotation(seed) * rng.uniform(0.5, 2, size=3)
    if mirror:
        linear = linear * [-1, 1, 1]
    ball = icosphere(2)
    ball = dataclasses.replace(ball, normals=ball.vertices)
    moved = ball.transformed(affine(linear, rng.normal(size=3)))
    assert moved.is_closed()
    # The volume sums 320 terms of size one.
    assert signed_volume(moved) == pytest.approx(signed_volume(ball) * abs(np.linalg.det(linear)), rel=1e-12)
    assert moved.normals is not None
    np.testing.assert_allclose(np.linalg.norm(moved.normals, axis=1), 1, rtol=1e-14)
    # An ellipsoid's normal is the gradient of |inverse(p)|^2.
    centred = moved.vertices - moved.vertices.mean(axis=0)
    gradient = np.linalg.solve(linear.T, np.linalg.solve(linear, centred.T)).T
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(moved.normals, gradient, atol=1e-12)  # condition number at most 16


def test_transformed_keeps_the_rest() -> None:
    mesh = Mesh(**TRIANGLE, colors=np.eye(3), texcoords=[[0, 0], [1, 0], [0, 1]], name="pot")  # type: ignore[arg-type]
    moved = mesh.transformed(affine(np.eye(3), (1, 2, 3)))
    assert moved.vertices.tolist() == [[1, 2, 3], [2, 2, 3], [1, 3, 3]]
    assert moved.name == "pot" and np.array_equal(moved.colors, mesh.colors)  # type: ignore[arg-type]
    assert np.array_equal(moved.texcoords, mesh.texcoords)  # type: ignore[arg-type]


def test_transformed_may_flatten() -> None:
    mesh = Mesh(**TRIANGLE, normals=[[0, 0, 1]] * 3)  # type: ignore[arg-type]
    flat = mesh.transformed(np.diag([1, 1, 0, 1]))
    assert flat.normals is not None and flat.normals.tolist() == [[0, 0, 1]] * 3


@cases("matrix", [np.eye(3), np.full((4, 4), np.nan), np.diag([1, 1, 1, 2]), "matrix"])
def test_transformed_refuses_what_is_not_affine(matrix: Any) -> None:
    with pytest.raises(MeshError, match=r"^pot: matrix: expected"):
        Mesh(**TRIANGLE, name="pot").transformed(matrix)


def test_concatenate() -> None:
    a = Mesh(**TRIANGLE, normals=np.ones((3, 3)), colors=np.ones((3, 3)))  # type: ignore[arg-type]
    b = Mesh(**TRIANGLE, normals=np.zeros((3, 3)))
    both = Mesh.concatenate([a, b], name="both")
    assert both.faces.tolist() == [[0, 1, 2], [3, 4, 5]] and both.name == "both"
    assert both.vertices.tolist() == TRIANGLE["vertices"] * 2
    assert both.normals is not None and both.normals.tolist() == [[1, 1, 1]] * 3 + [[0, 0, 0]] * 3
    assert both.colors is None
    assert len(Mesh.concatenate([]).vertices) == 0
    assert signed_volume(Mesh.concatenate([box(), box((2, 0, 0), (3, 1, 2))])) == 3
