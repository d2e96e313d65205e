"""Meshes and rays for tests: seeded kinds that provoke ties, flat boxes and lost precision, and how to compare hits.

Hypothesis draws a kind, a seed and a count; numpy fills the arrays.
"""

import copy
from collections.abc import Callable

import numpy as np
from hypothesis import strategies as st
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.octree import BruteForce, Octree
from renderer.results.hits import Hits

Floats = NDArray[np.float64]
Arrays = tuple[Floats, NDArray[np.int32]]


def separate(corners: Floats) -> Arrays:
    """Triangles (F, 3, 3) that share no vertices, as vertices and faces."""
    return corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)


def soup(rng: Generator, count: int) -> Arrays:
    return separate(rng.normal(size=(count, 1, 3)) + 0.5 * rng.normal(size=(count, 3, 3)))


def soup_float32(rng: Generator, count: int) -> Arrays:
    vertices, faces = soup(rng, count)
    return vertices.astype(np.float32).astype(np.float64), faces


def lattice(rng: Generator, count: int) -> Arrays:
    """Small integers: ties, shared edges, vertices on split planes, some triangles without area."""
    return rng.integers(-3, 4, (count + 3, 3)).astype(float), rng.integers(0, count + 3, (count, 3)).astype(np.int32)


def duplicates(rng: Generator, count: int) -> Arrays:
    """Every triangle several times, its corners turned, among triangles that repeat an index."""
    vertices, faces = soup(rng, count // 4 + 1)
    turned = (np.arange(3) + rng.integers(0, 3, (count, 1))) % 3
    faces = np.take_along_axis(faces[rng.integers(0, len(faces), count)], turned, axis=1)
    faces[::7, 2] = faces[::7, 1]
    return vertices, faces


def sizes(rng: Generator, count: int) -> Arrays:
    """Sizes from a thousandth to a hundred times the scene."""
    size = 10.0 ** rng.uniform(-3, 2, (count, 1, 1))
    return separate(rng.normal(size=(count, 1, 3)) + size * rng.normal(size=(count, 3, 3)))


def flat(rng: Generator, count: int) -> Arrays:
    """All triangles in one plane across an axis: every box is flat."""
    vertices, faces = lattice(rng, count)
    vertices[:, rng.integers(3)] = rng.choice([0.0, 1.0, 0.1])
    return vertices, faces


def far_away(rng: Generator, count: int) -> Arrays:
    vertices, faces = soup(rng, count)
    return vertices + np.array([1e6, -1e6, 1e6]), faces


def scaled(rng: Generator, count: int) -> Arrays:
    vertices, faces = soup(rng, count)
    return vertices * 10.0 ** rng.integers(-3, 7), faces


KINDS: dict[str, Callable[[Generator, int], Arrays]] = {
    kind.__name__: kind for kind in (soup, soup_float32, lattice, duplicates, sizes, flat, far_away, scaled)
}


def make_mesh(kind: str, seed: int, count: int) -> Arrays:
    return KINDS[kind](np.random.default_rng(seed), count)


meshes = st.builds(make_mesh, st.sampled_from(sorted(KINDS)), st.integers(0, 2**20), st.integers(0, 100))
options = st.fixed_dictionaries(
    {
        "split": st.sampled_from(["midpoint", "sah"]),
        "leaf_size": st.sampled_from([1, 2, 4, 7, 8, 32]),
        "max_depth": st.sampled_from([1, 2, 32]),
        "threads": st.just(1),
    }
)


def rays_at(vertices: Floats, faces: NDArray[np.int32], seed: int, count: int = 40) -> tuple[Floats, Floats]:
    """Rays of six kinds, ``count`` each: through the bounds, at vertices, at edges, at faces, axis-parallel with zeros
    of either sign, and axis-parallel through vertices."""
    rng = np.random.default_rng(seed)
    corners = vertices[faces] if len(faces) else np.zeros((1, 3, 3))
    lower, upper = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    size = np.maximum(upper - lower, 1e-3 * np.abs(upper) + 1e-3)

    def near(n: int) -> Floats:
        return (lower + upper) / 2 + rng.uniform(-1, 1, (n, 3)) * size

    picked = corners[rng.integers(0, len(corners), (3, count))]
    share = rng.random((count, 1))
    weights = rng.dirichlet(np.ones(3), count)
    targets = [
        near(count),
        picked[0][:, 0],
        picked[1][:, 0] * share + picked[1][:, 1] * (1 - share),
        np.einsum("nk,nkj->nj", weights, picked[2]),
    ]
    origins = near(4 * count)
    directions = np.concatenate(targets) - origins
    through = np.concatenate([near(count), picked[0][:, 1]])
    axis = rng.integers(0, 3, 2 * count)
    parallel = np.where(rng.random((2 * count, 3)) < 0.5, 0.0, -0.0)
    parallel[np.arange(2 * count), axis] = rng.choice([-2.0, -1.0, 1.0, 0.7], 2 * count)
    through -= parallel * 2 * size.max()
    origins, directions = np.concatenate([origins, through]), np.concatenate([directions, parallel])
    directions[~directions.any(axis=1)] = [0.0, -0.0, 1.0]
    return origins, directions


def arrays(tree):
    """The arrays of a tree."""
    return tree.nodes, tree.blocks, tree.faces


def answers(target: Octree | BruteForce, origins: Floats, directions: Floats) -> dict[str, bytes]:
    """The bits that each query answers, by its name; those that need a closed mesh only where it is one."""
    faces = np.arange(len(origins)) % max(1, len(target.mesh.faces)) if len(target.mesh.faces) else -1
    few, hits = target.closest_hit(origins[:5], directions[:5]), target.closest_hit(origins, directions)
    still = copy.copy(target)  # which another thread does not refit between these two lines
    starts = still.mesh.triangles[faces].mean(axis=1) if len(still.mesh.faces) else origins
    every, left = target.all_hits(origins, directions), still.closest_hit(starts, directions, leaving=faces)
    found = {
        "few": (few.t, few.face, few.u, few.v, few.points, few.normals),
        "closest_hit": (hits.t, hits.face, hits.u, hits.v, hits.points, hits.normals),
        "leaving": (left.t, left.face, left.u, left.v, left.points, left.normals),
        "any_hit": (target.any_hit(origins, directions, t_max=2.0),),
        "all_hits": (every.offsets, every.t, every.face, every.u, every.v, every.points, every.normals),
        "count_hits": (target.count_hits(origins, directions, contacts=False),),
        "visible": (target.visible(origins, origins[::-1]),),
    }
    if len(target.mesh.faces):
        near = target.closest_point(origins)
        found["closest_point"] = (near.distance, near.face, near.u, near.v, near.points)
    if len(target.mesh.faces) and not len(target.mesh.open_edges):
        found["contains"] = (target.contains(origins, boundary=False),)
        found["signed_distance"] = (target.signed_distance(origins),)
    return {name: b"".join(array.tobytes() for array in arrays) for name, arrays in found.items()}


def assert_same_hits(got: Hits, expected: Hits) -> None:
    """The same bits in t, face, u and v."""
    for name in ("face", "t", "u", "v"):
        a, b = getattr(got, name), getattr(expected, name)
        assert a.dtype == b.dtype and a.shape == b.shape
        different = np.flatnonzero(a.view(np.int64) != b.view(np.int64))
        assert not len(different), f"{name} differs in rows {different[:5]}: {a[different[:5]]} and {b[different[:5]]}"
