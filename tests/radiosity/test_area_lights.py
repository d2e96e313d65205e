"""The light of lamps on patches: closed forms where nothing hides them, and half of it behind half a plate."""

import numpy as np
from numpy.typing import NDArray

from renderer import Mesh, Octree
from renderer.radiosity import patches
from renderer.radiosity.area_lights import lamps_of, light_of_lamps
from renderer.studies.factors.surfaces import areas_of

SQUARE = Mesh([[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]], [[0, 1, 2], [0, 2, 3]])
# Of two squares of side 1 at distance 1: Howell, C-11.
OPPOSITE = 0.19982489569838746


def above(mesh: Mesh, height: float) -> Mesh:
    """The mesh that far above, facing down."""
    return Mesh(mesh.vertices + np.array([0.0, height, 0.0]), mesh.faces[:, ::-1])


def light_on_ground(*more: Mesh) -> NDArray[np.float64]:
    """The mean light on a square of one above it that emits 1, 2 and 4, in patches."""
    ground, lamp = patches(SQUARE, 0.4).mesh, patches(above(SQUARE, 1.0), 0.4).mesh
    octree, count = Octree.from_mesh(Mesh.concatenate([ground, lamp, *more])), len(ground.faces)
    faces = np.arange(2 * count)
    emission = np.where(faces >= count, 1.0, 0.0)[:, None] * [1.0, 2.0, 4.0]
    light = light_of_lamps(octree, emission, faces, np.flatnonzero(faces >= count))
    assert np.abs(light[count:]).max() == 0  # the lamp does not see itself
    weights = areas_of(octree.mesh)[:count]
    return np.asarray(weights @ light[:count] / weights.sum())


def test_what_nothing_hides_is_exact() -> None:
    assert np.allclose(light_on_ground(), OPPOSITE * np.array([1, 2, 4]), rtol=1e-9)


def test_half_is_hidden_by_half_a_plane() -> None:
    """A plate half way up that reaches to the middle: mirrored at it, a ray that is hidden is one that is not."""
    plate = Mesh([[-9, 0.5, -9], [-9, 0.5, 9], [0.5, 0.5, 9], [0.5, 0.5, -9]], [[0, 1, 2], [0, 2, 3]])
    twice = Mesh.concatenate([plate, above(plate, 0.0)])
    # Rays between points that mirror each other touch the plate's end, and count as hidden.
    assert np.allclose(light_on_ground(twice), OPPOSITE / 2 * np.array([1, 2, 4]), rtol=0.05)


def test_lamps_are_small() -> None:
    ground, lamp = SQUARE, above(Mesh(0.1 * SQUARE.vertices, SQUARE.faces), 1.0)
    octree, faces = Octree.from_mesh(Mesh.concatenate([ground, lamp])), np.arange(4)
    shines = np.array([0.0, 0.0, 1.0, 1.0])[:, None] * np.ones(3)
    assert lamps_of(octree, shines, faces).tolist() == [2, 3]
    assert lamps_of(octree, shines[::-1], faces).tolist() == []  # most of all area
    assert lamps_of(octree, 0.0 * shines, faces).tolist() == []
