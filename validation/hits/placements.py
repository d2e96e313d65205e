"""Placed bodies whose hits are judged: each number of meshes and matrices is exact in float32, as Embree needs them."""

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere
from validation.hits.rays import float32_exact
from validation.meshes import hilly, tetrahedron
from validation.oracle.placing import Body

Floats = NDArray[np.float64]

_SEED = 2040
_COUNT = 20
# Metres east, north and up of a zone's origin: float64 resolves 1e-9 there, float32 half a metre.
_UTM = np.array([500_000.0, 5_400_000.0, 128.0])
_FAR = np.array([1e6, -2e6, 5e5])
_MIRROR = np.diag([-1.0, 1.0, 1.0])


def placements() -> dict[str, list[Body]]:
    """Lists of bodies by name."""
    rng = np.random.default_rng(_SEED)
    ball, cube, hill = icosphere(1), box(), hilly(1)
    turns, places = _turns(rng, _COUNT), rng.uniform(-6.0, 6.0, (_COUNT, 3))
    shears = np.eye(3) + np.triu(rng.uniform(-3.0, 3.0, (_COUNT, 3, 3)), 1)
    powers = 10.0 ** np.arange(-6, 7)
    lattice = np.stack(np.meshgrid(*map(np.arange, (4, 3, 2)), indexing="ij"), axis=-1).reshape(-1, 3)
    far = Mesh(8.0 * ball.vertices + _FAR, ball.faces)
    back = 10.0 * places - turns @ _FAR
    near = [body(ball, turns, places), body(cube, np.roll(turns, 1, axis=0), -places)]
    return {
        "one mesh where it is": [body(hill, np.eye(3)[None], np.zeros(3))],
        "one mesh turned": [body(hill, turns[:1], places[:1])],
        "rotations": near,
        "rotations times 1e-6": [_times(one, 1e-6) for one in near],
        "rotations times 1e6": [_times(one, 1e6) for one in near],
        "mirrors": [body(ball, turns @ _MIRROR, places), body(cube, np.stack([np.eye(3), _MIRROR]), places[:2])],
        "shears": [body(ball, shears, places), body(cube, shears @ _MIRROR, -places)],
        # One within the other.
        "scales from 1e-6 to 1e6": [body(hill, turns[: len(powers)] * powers[:, None, None], 0.2 * powers[:, None])],
        "UTM offsets": [body(ball, turns, _UTM + places), body(cube, turns[::-1] @ _MIRROR, _UTM - places)],
        "from far away to the origin": [body(far, turns, back)],
        "shared edges and planes": [
            body(cube, np.where(lattice.sum(axis=1)[:, None, None] % 2, _MIRROR, np.eye(3)), lattice),
            body(box((-1.0, 0.0, -1.0), (3.0, 3.0, 0.0)), np.eye(3)[None], np.zeros((1, 3))),
        ],
        "overlapping copies": [body(ball, turns[:3].repeat(3, axis=0), places[:3].repeat(3, axis=0))] * 2,
        "a thousand instances": [body(tetrahedron(), _turns(rng, 1000), rng.uniform(-12.0, 12.0, (1000, 3)))],
    }


def body(mesh: Mesh, linear: ArrayLike, places: ArrayLike) -> Body:
    """A mesh with linear parts (k, 3, 3) at ``places``, one for each or for all, in the digits of float32."""
    matrices = np.empty((len(np.asarray(linear)), 3, 4))
    matrices[:, :, :3], matrices[:, :, 3] = linear, places
    return Body(float32_exact(mesh.vertices), mesh.faces.astype(np.int64), float32_exact(matrices))


def _times(one: Body, size: float) -> Body:
    """The bodies ``size`` times as large."""
    return one._replace(matrices=float32_exact(one.matrices * size))


def _turns(rng: Generator, count: int) -> Floats:
    """Random rotations (count, 3, 3)."""
    found = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    turned: Floats = found * np.linalg.det(found)[:, None, None]
    return turned
