"""Floors, square by square, and how objects are placed, against slow twins."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer import Floor, PerspectiveCamera, Phong, Scene, SceneObject
from renderer.mesh.shapes import box

QUARTERS = st.integers(-20, 20).map(lambda k: k / 4.0)


def scene_of(**parts: Any) -> Scene:
    camera = PerspectiveCamera(eye=(0, 2, 9), target=(0, 0, 0))
    return Scene(camera=camera, materials={"a": Phong(), "b": Phong()}, **parts)


@given(QUARTERS, QUARTERS, st.integers(1, 9), st.integers(1, 9), st.tuples(st.integers(1, 5), st.integers(1, 5)),
       st.sampled_from([("a",), ("b", "a"), ("a", "a")]))  # fmt: skip
@settings(max_examples=40)
def test_each_square_of_a_floor_is_there_once_in_its_material(
    x: float, z: float, wide: int, deep: int, squares: tuple[int, int], materials: tuple[str, ...]
) -> None:
    """In turn along x and along z, from the least x and z on, facing up."""
    floor = Floor(min=(x, z), max=(x + wide, z + deep), materials=materials, squares=squares)
    scene, found = scene_of(floor=floor), {}
    for number, instance in enumerate(scene.instances):
        assert instance.material == materials[number] and not instance.smooth
        triangles = instance.mesh.triangles
        assert (triangles[..., 1] == 0.0).all() and (instance.mesh.face_normals() == [0.0, 1.0, 0.0]).all()
        for square in triangles.reshape(-1, 6, 3):
            lower, upper = square.min(axis=0), square.max(axis=0)
            place = tuple(np.rint((lower[[0, 2]] - [x, z]) / [wide, deep] * squares).astype(int).tolist())
            ends = [
                (x + wide * (i + k) / squares[0], z + deep * (j + k) / squares[1]) for i, j in [place] for k in (0, 1)
            ]
            np.testing.assert_allclose([lower[[0, 2]], upper[[0, 2]]], ends, rtol=0, atol=1e-14)
            a, b, c = square[:3], square[3:], np.unique(square, axis=0)
            assert len(c) == 4 and not np.array_equal(a, b)
            assert place not in found
            found[place] = materials[number]
    expected = {(i, j): materials[(i + j) % len(materials)] for i in range(squares[0]) for j in range(squares[1])}
    assert found == expected


def turn(axis: int, degrees: float) -> Any:
    """Counter-clockwise about a coordinate axis, seen against it."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[[1, 0, 0], [0, c, -s], [0, s, c]], [[c, 0, s], [0, 1, 0], [-s, 0, c]],
                     [[c, -s, 0], [s, c, 0], [0, 0, 1]]][axis])  # fmt: skip


THREE = st.tuples(*[st.sampled_from([-130.0, 0.0, 30.0, 90.0])] * 3)


@given(st.one_of(st.sampled_from([2.0, -1.0]), st.tuples(*[st.sampled_from([-0.5, 1.0, 3.0])] * 3)), THREE, THREE)
@settings(max_examples=40)
def test_an_object_is_scaled_then_turned_about_x_y_and_z_then_moved(scale: Any, rotate: Any, translate: Any) -> None:
    mesh = box((1.0, 2.0, 3.0), (2.0, 4.0, 7.0))
    thing = SceneObject(mesh=mesh, material="a", scale=scale, rotate=rotate, translate=translate)
    expected = mesh.vertices * scale
    for axis in range(3):
        expected = expected @ turn(axis, rotate[axis]).T
    (instance,) = scene_of(objects=[thing]).instances
    np.testing.assert_allclose(instance.mesh.vertices, expected + translate, rtol=0, atol=1e-13)
    # Outside stays outside, though it is mirrored.
    centre = instance.mesh.vertices.mean(axis=0)
    out = instance.mesh.triangles.mean(axis=1) - centre
    assert (np.einsum("ij,ij->i", instance.mesh.face_normals(), out) > 0.0).all()
