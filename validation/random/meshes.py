"""A mesh drawn at random: shipped models and generated bodies, whole, open, cut into triangles, overlapping."""

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from renderer.mesh.heightfield import heightfield_mesh
from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, torus
from validation.hits.rays import float32_exact
from validation.meshes import hilly, loose, prism, turned
from validation.scenes import SCENES

_MODELS = ("block", "displaced_sphere", "stairs", "teapot", "torus_knot")


def draw_mesh(rng: Generator) -> Mesh:
    """Draw a mesh whose vertices float32 holds; equal generators give equal meshes."""
    mesh = _BODIES[int(rng.integers(len(_BODIES)))](rng)
    if rng.random() < 0.2:
        mesh = _without_some(mesh, rng)
    if rng.random() < 0.2:
        mesh = loose(mesh.triangles)
    if rng.random() < 0.3:
        mesh = turned(mesh)
    return Mesh(float32_exact(mesh.vertices), mesh.faces)


def _without_some(mesh: Mesh, rng: Generator) -> Mesh:
    """With holes: a tenth of the faces is missing, at least one."""
    kept = np.sort(rng.permutation(len(mesh.faces))[: max(1, int(0.9 * len(mesh.faces)))])
    return Mesh(mesh.vertices, mesh.faces[kept])


def _model(rng: Generator) -> Mesh:
    return load_mesh(SCENES / "models" / f"{rng.choice(_MODELS)}.ply")


def _sphere(rng: Generator) -> Mesh:
    return icosphere(int(rng.integers(1, 5)))


def _torus(rng: Generator) -> Mesh:
    return torus(1.0, float(rng.uniform(0.1, 0.6)), int(rng.integers(6, 48)), int(rng.integers(4, 24)))


def _box(rng: Generator) -> Mesh:
    return box((0.0, 0.0, 0.0), tuple(rng.uniform(0.2, 2.0, 3).tolist()))


def _prism(rng: Generator) -> Mesh:
    return prism(float(rng.uniform(5.0, 355.0)))


def _hills(rng: Generator) -> Mesh:
    """A surface, open at its rim."""
    rows, columns = rng.integers(4, 24, 2).tolist()
    return heightfield_mesh(rng.uniform(0.0, 2.0, (rows, columns)), spacing=1.0)


def _crowd(rng: Generator) -> Mesh:
    """Triangles in no order, which cross each other."""
    return loose(rng.normal(size=(60, 1, 3)) + 0.3 * rng.normal(size=(60, 3, 3)))


def _twice(rng: Generator) -> Mesh:
    """A body that overlaps itself, moved by a part of its size."""
    ball = icosphere(2)
    return Mesh.concatenate([ball, Mesh(ball.vertices + rng.uniform(-0.8, 0.8, 3), ball.faces)])


def _hilly(_: Generator) -> Mesh:
    return hilly(1)


_BODIES: tuple[Callable[[Generator], Mesh], ...] = (
    _model, _model, _sphere, _torus, _box, _prism, _hills, _crowd, _twice, _hilly,
)  # fmt: skip
