"""Ray queries at the ends of numbers: octree and brute force give the same bits, or the same clear error."""

import warnings
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fuzz.values import NOT_FINITE, SIZES, Kind, expect_clear, extreme, vector
from renderer import BruteForce, Hits, Mesh, MeshError, Octree
from renderer.arguments.limits import LONGEST, SHORTEST
from renderer.mesh.shapes import box

Values = dict[str, Any]
Point = tuple[float, ...]

# Shapes and types in which users hand over what is meant as (n, 3) float64.
FORMS: dict[str, Any] = {
    "float64": lambda a: a,
    "list": lambda a: a.tolist(),
    "float32": lambda a: a.astype(np.float32),
    "float16": lambda a: a.astype(np.float16),
    "longdouble": lambda a: a.astype(np.longdouble),
    "big-endian": lambda a: a.astype(">f8"),
    "int8": lambda a: np.sign(np.nan_to_num(a)).astype(np.int8),
    "uint64": lambda a: np.nan_to_num(np.abs(a) % 4).astype(np.uint64),
    "object": lambda a: a.astype(object),
    "Fraction": lambda a: np.array([[Fraction(x) if np.isfinite(x) else x for x in row] for row in a], object),
    "complex": lambda a: a.astype(complex),
    "bool": lambda a: a.astype(bool),
    "text": lambda a: a.astype(str),
    "masked": lambda a: np.ma.masked_greater(a, 1.0),
    "fortran": lambda a: np.asfortranarray(a),
    "strided": lambda a: np.repeat(a, 2, axis=0)[::2],
    "reversed": lambda a: a[::-1][:, ::-1],
    "read-only": lambda a: np.frombuffer(a.tobytes()).reshape(a.shape),
    "first": lambda a: a[:1],
    "one": lambda a: a[0] if len(a) else a,
    "shared": lambda a: np.broadcast_to(a[:1], a.shape),
    "deep": lambda a: a[None],
    "pairs": lambda a: a[:, :2],
    "ragged": lambda a: [*a.tolist(), [1.0]],
    "none": lambda a: None,
}


# --- meshes and rays -------------------------------------------------------------------------------------------


def _vertices(rng: Random) -> list[Point]:
    """A box, or some points, of any size; some far from the origin, some of sizes apart."""
    points = box().vertices.tolist() if rng.random() < 0.4 else [vector(rng, 0.0) for _ in range(rng.randrange(3, 10))]
    style = rng.randrange(8)
    size = 10.0 ** rng.uniform(-310.0, 307.0) if rng.random() < 0.5 else rng.choice(SIZES)
    if style < 3:
        return [tuple(x * (1.0 if style == 0 else size) for x in p) for p in points]
    if style == 3:
        return [tuple(x * 10.0 ** rng.uniform(-12.0, 12.0) for x in p) for p in points]
    if style == 4:
        far = vector(rng, 0.0)
        return [tuple((x + 10.0 ** rng.uniform(0.0, 16.0) * y) * size for x, y in zip(p, far, strict=True))
                for p in points]  # fmt: skip
    if style == 5:
        flat = rng.randrange(3)
        return [tuple(0.0 if k == flat else x * size for k, x in enumerate(p)) for p in points]
    if style == 6:
        return [tuple(rng.choice([-1.0, 1.0]) * rng.choice(SIZES[:30]) for _ in p) for p in points]
    return [tuple(extreme(rng, 0.001) for _ in p) for p in points]


def _on_face(rng: Random, vertices: list[Point], face: list[int]) -> list[float]:
    """A point of a face, which may be a corner or on an edge."""
    u, v = rng.choice([(1.0, 0.0), (0.0, 0.0), (0.5, 0.5), (0.25, 0.25), (rng.random() / 2, rng.random() / 2)])
    a, b, c = (vertices[k] for k in face)
    return [(1.0 - u - v) * x + u * y + v * z for x, y, z in zip(a, b, c, strict=True)]


def _within(direction: list[float]) -> list[float]:
    """The direction, or another of its kind that is not zero and of a length that is taken."""
    largest = max(map(abs, direction))
    if not 0.0 < largest < np.inf:
        return [0.0, -0.0, 1.0]
    if SHORTEST <= largest <= LONGEST:
        return direction
    return [x / largest for x in direction]


def _ray(rng: Random, vertices: list[Point], faces: list[list[int]], wild: bool) -> tuple[list[float], list[float]]:
    """An origin on or near the mesh and a direction to a point of it; any others for ``wild``."""
    size = max((abs(x) for p in vertices for x in p if np.isfinite(x)), default=1.0)
    origin = [x * size * rng.choice([0.0, 1.0, 10.0]) for x in vector(rng, 0.0)]
    if rng.random() < 0.4:
        origin = _on_face(rng, vertices, rng.choice(faces))
    direction = list(vector(rng, 0.5))
    if rng.random() < 0.7:
        aim = _on_face(rng, vertices, rng.choice(faces))
        direction = [x - y for x, y in zip(aim, origin, strict=True)]
    if rng.random() < 0.3:
        length = abs(extreme(rng, 0.0))
        direction = [x * length for x in direction]
    if wild and rng.random() < 0.2:
        return list(vector(rng, 0.9)), list(vector(rng, 0.9))
    origin = [x if np.isfinite(x) else 0.0 for x in origin]
    return origin, direction if wild and rng.random() < 0.2 else _within(direction)


def _bound(rng: Random, count: int, usual: float) -> Any:
    if rng.random() < 0.5:
        return usual
    values = [abs(extreme(rng, 0.0)) if rng.random() < 0.5 else rng.random() for _ in range(count)]
    if rng.random() < 0.1 and values:
        values[rng.randrange(count)] = rng.choice([-0.0, -1.0, -5e-324, *NOT_FINITE])
    if rng.random() < 0.05:
        return rng.choice([None, "1", [], [1.0, 2.0], True, 10**400, {}])
    return values if rng.random() < 0.5 else next(iter(values), 1.0)


def _leaving(rng: Random, count: int, faces: int) -> Any:
    if rng.random() < 0.6:
        return None
    values = [rng.randrange(-1, faces) for _ in range(count)]
    if rng.random() < 0.1 and values:
        values[rng.randrange(count)] = rng.choice([-2, faces, 2**31, 2**40, -(2**31)])
    if rng.random() < 0.05:
        return rng.choice([1.0, "0", [], True, 2**70, np.uint64(2**63), np.int8(0)])
    return values if rng.random() < 0.7 else next(iter(values), -1)


def _starts(
    rng: Random, leaving: Any, vertices: list[Point], faces: list[list[int]], origins: list[list[float]]
) -> list[list[float]]:
    """The origins, those that leave a face on it; any ones for some queries, which are refused."""
    named = leaving if isinstance(leaving, list) else [leaving] * len(origins)
    if rng.random() < 0.2 or len(named) != len(origins):
        return origins
    return [
        _on_face(rng, vertices, faces[face]) if type(face) is int and 0 <= face < len(faces) else origin
        for face, origin in zip(named, origins, strict=True)
    ]


def make_query(seed: int, index: int) -> Values:
    rng = Random(f"query {seed} {index}")
    vertices = _vertices(rng)
    faces = [[rng.randrange(len(vertices)) for _ in range(3)] for _ in range(rng.choice([1, 2, 5, 12, 40]))]
    if len(vertices) == 8 and rng.random() < 0.7:
        faces = box().faces.tolist()
    count, wild = rng.choice([0, 1, 1, 2, 5, 15, 16, 17, 40]), rng.random() < 0.15
    rays = [_ray(rng, vertices, faces, wild) for _ in range(count)]
    odd, leaving = rng.random() < 0.3, _leaving(rng, count, len(faces))
    return {
        "vertices": vertices,
        "faces": faces,
        "single": rng.random() < 0.3,
        "split": rng.choice(["midpoint", "sah"]),
        "origins": _starts(rng, leaving, vertices, faces, [o for o, _ in rays]),
        "directions": [d for _, d in rays],
        "forms": [rng.choice(list(FORMS)) if odd else "float64" for _ in range(2)],
        "t_min": _bound(rng, count, 0.0),
        "t_max": _bound(rng, count, float("inf")),
        "leaving": leaving,
    }


# --- checks ----------------------------------------------------------------------------------------------------


def _answer(accelerator: Octree | BruteForce, rays: Values) -> tuple[Hits, NDArray[np.bool_]] | str:
    """Closest and any hits, or what the clear error says, which is one for both."""
    told: list[Any] = []
    for query in (accelerator.closest_hit, accelerator.any_hit):
        try:
            told.append(query(**rays))
        except ValueError as error:
            expect_clear(error)
            told.append(str(error))
    refused = [x for x in told if isinstance(x, str)]
    assert len(refused) in (0, 2) and len(set(refused)) < 2, f"one query refuses other than the other: {refused}"
    return refused[0] if refused else (told[0], told[1])


def expect_sound(hits: Hits, octree: Octree, t_min: Any, t_max: Any) -> None:
    """Every hit within its bounds and its face, no -0.0, and a miss as documented."""
    hit, mesh, scale = hits.hit, octree.mesh, octree.tree.scale
    for name in ("t", "u", "v"):
        values = getattr(hits, name)
        assert np.isfinite(values[hit]).all(), f"{name} of a hit that is not finite"
        # Known: u and v may be -0.0.
        below = np.signbit(values) if name == "t" else values < 0.0
        assert not below[hit].any(), f"{name} below 0 or -0.0"
    low, high = (np.broadcast_to(np.asarray(x, np.float64), hits.t.shape) for x in (t_min, t_max))
    # Known: bounds are rounded in the tree's unit, which shows where they are denormal there.
    low, high = low - 2.0**-1074 / scale, high + 2.0**-1074 / scale
    assert ((hits.t >= low) & (hits.t <= high))[hit].all(), "a hit out of its bounds"
    assert (hits.u[hit] + hits.v[hit] <= 1.0 + 2.0**-50).all() and (hits.face < len(mesh.faces)).all()
    assert np.isposinf(hits.t[~hit]).all() and np.isnan(hits.u[~hit]).all() and np.isnan(hits.v[~hit]).all()
    assert (hits.face[~hit] == -1).all()
    assert np.isfinite(hits.points[hit]).all(), "a point of a hit that is not finite"
    # Known: a face whose sides are beyond float64 has no normal; see tests/boundary/test_fuzz.py.
    if np.abs(mesh.vertices).max(initial=0.0) < 2.0**1023:
        assert np.isfinite(hits.normals[hit]).all(), "a normal of a hit that is not finite"


def _built(given: Values) -> tuple[Octree, BruteForce] | None:
    """Both accelerators over the mesh; None where it is refused."""
    with np.errstate(all="ignore"):
        vertices = np.array(given["vertices"], np.float64)
        vertices = vertices.astype(np.float32) if given["single"] else vertices
    try:
        mesh = Mesh(vertices, np.array(given["faces"], np.int32))
    except MeshError as error:
        expect_clear(error)
        return None
    told: list[Any] = []
    for build in (lambda: Octree.from_mesh(mesh, split=given["split"], threads=1), lambda: BruteForce.from_mesh(mesh)):
        try:
            # Known: an unused vertex may overflow; see tests/boundary/test_fuzz.py.
            with np.errstate(over="ignore"):
                told.append(build())
        except MeshError as error:
            expect_clear(error)
            told.append(str(error))
    if isinstance(told[0], str) or isinstance(told[1], str):
        assert told[0] == told[1], f"a mesh refused by one only: {told}"
        return None
    return told[0], told[1]


def check_query(folder: Path, given: Values, index: int) -> str:
    built = _built(given)
    if built is None:
        return "no mesh"
    octree, brute = built
    with np.errstate(all="ignore"):
        arrays = (np.array(given[name], np.float64).reshape(-1, 3) for name in ("origins", "directions"))
        origins, directions = (FORMS[form](array) for form, array in zip(given["forms"], arrays, strict=True))
    rays = {"origins": origins, "directions": directions, **{k: given[k] for k in ("t_min", "t_max", "leaving")}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", np.exceptions.ComplexWarning)
        one, other = _answer(octree, rays), _answer(brute, rays)
    if isinstance(one, str) or isinstance(other, str):
        assert one == other, f"refused by one only: {one}, {other}"
        return "refused"
    (hits, any_hits), (expected, any_expected) = one, other
    expect_sound(hits, octree, given["t_min"], given["t_max"])
    for name in ("face", "t", "u", "v"):
        a, b = getattr(hits, name), getattr(expected, name)
        rows = np.flatnonzero(~((a == b) | (np.isnan(a) & np.isnan(b))))
        assert a.tobytes() == b.tobytes() or not len(rows), f"another {name} in rows {rows[:5].tolist()} of {len(a)}"
    assert np.array_equal(any_hits, hits.hit) and np.array_equal(any_expected, hits.hit), "any_hit is not hit"
    return "hit" if hits.hit.any() else "missed"


KINDS = {"query": Kind(make_query, check_query, share=10)}


def prepare_kinds() -> None:
    """Compile the kernels before a clock starts."""
    Octree.from_mesh(box(), threads=1, split="midpoint")
    for accelerator in (Octree.from_mesh(box(), threads=1), BruteForce.from_mesh(box())):
        for count in (1, 40):
            origins, directions = np.tile(box().triangles[0, 0], (count, 1)), np.ones((count, 3))
            for leaving in (None, 0):
                _answer(accelerator, {"origins": origins, "directions": directions, "leaving": leaving})
