"""Places of objects: scaled, then turned about x, y and z in this order, then moved; by trimesh's matrices."""

from typing import Any, cast

import numpy as np
import trimesh
from numpy.random import Generator
from numpy.typing import NDArray
from trimesh.transformations import compose_matrix

from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.instance import Instance
from renderer.scene.scene import Scene, SceneObject
from validation.promises.row import row

Floats = NDArray[np.float64]
# Matrices of two programs round differently, by some units of the last place of the largest coordinate; the rules that
# are broken here differ by a tenth of it and more.
_ROUNDING = 1e-12
_JUDGE = "trimesh"


def check_placing(rng: Generator, count: int) -> list[dict[str, Any]]:
    """Meshes placed at random: every corner, every normal, and that outside stays outside."""
    corners, normals, outside = [], [], []
    for number in range(count):
        scale, angles, move = _random(rng, number)
        mesh = _mesh()
        placed = _placed(mesh, scale, angles, move)
        expected = _expected(scale, angles, move)
        world = mesh.vertices @ expected[:3, :3].T + expected[:3, 3]
        size = np.abs(world).max()
        corners.append(np.abs(placed.mesh.vertices - world).max(axis=1) <= _ROUNDING * size)
        assert mesh.normals is not None
        turned = mesh.normals @ np.linalg.inv(expected[:3, :3])
        turned /= np.linalg.norm(turned, axis=1)[:, None]
        normals.append(np.abs(placed.normals - turned).max(axis=1) <= 1e3 * _ROUNDING)
        volume = trimesh.Trimesh(placed.mesh.vertices, placed.mesh.faces, process=False).volume
        outside.append(np.array([volume > 0.0]))
    return [
        row("objects are scaled, turned about x, y, z, then moved", _JUDGE, np.concatenate(corners)),
        row("vertex normals stay perpendicular and outside", "NumPy", np.concatenate(normals)),
        row("placed float32 vertices are those of the map in float64", "NumPy", _exact(rng, count)),
        row("an object's outside stays outside, mirrored or not", "trimesh", np.concatenate(outside)),
    ]


def _exact(rng: Generator, count: int) -> NDArray[np.bool_]:
    """A float32 mesh, made larger or smaller and moved by a hundredth to 1e7 of its new size: each corner.

    A processor that multiplies and adds at once does not round the product.
    """
    sphere = icosphere(1)
    mesh, kept = Mesh(sphere.vertices.astype(np.float32), sphere.faces), []
    for _ in range(count):
        scale = 10.0 ** rng.uniform(-7.0, 7.0)
        move = rng.choice([-1.0, 1.0], 3) * scale * 10.0 ** rng.uniform(-2.0, 7.0, 3)
        placed = _placed(mesh, np.full(3, scale), np.zeros(3), move).mesh.vertices
        product = mesh.vertices * scale
        kept.append((np.abs(placed - (product + move)) <= 2.0 * np.spacing(np.abs(product) + np.abs(move))).all(axis=1))
    return np.concatenate(kept)


def _expected(scale: Floats, angles: Floats, move: Floats) -> Floats:
    matrix: Any = compose_matrix
    return cast(Floats, matrix(scale=scale, angles=np.radians(angles), translate=move))


def _random(rng: Generator, number: int) -> tuple[Floats, Floats, Floats]:
    """Scale, angles in degrees and move: about one, two and three axes in turn, and mirrored every other time."""
    scale = rng.uniform(0.5, 2.0, 3) * np.where(rng.random(3) < 0.5 * (number % 2), -1.0, 1.0)
    angles = rng.uniform(20.0, 160.0, 3) * rng.choice([-1.0, 1.0], 3)
    angles[rng.permutation(3)[number % 3 + 1 :]] = 0.0
    return scale, angles, rng.uniform(-5.0, 5.0, 3)


def _mesh() -> Mesh:
    """A closed mesh with vertex normals, in float64."""
    sphere = icosphere(1)
    squashed = sphere.vertices * (1.0, 0.7, 1.3) + 1e-9
    normals = squashed / (1.0, 0.49, 1.69)
    return Mesh(squashed, sphere.faces, normals / np.linalg.norm(normals, axis=1)[:, None])


def _placed(mesh: Mesh, scale: Floats, angles: Floats, move: Floats) -> Instance:
    x, y, z = (tuple(vector.tolist()) for vector in (scale, angles, move))
    thing = SceneObject(mesh=mesh, material="any", normals="smooth", scale=x, rotate=y, translate=z)
    camera = PerspectiveCamera(eye=(0.0, 0.0, 50.0), target=(0.0, 0.0, 0.0))
    return Scene(camera=camera, materials={"any": Phong()}, objects=(thing,)).instances[0]
