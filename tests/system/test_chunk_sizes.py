"""What is done some at a time is what is done all at once: each size of chunks, as if much more were there.

Few are enough then for the way that only large inputs take.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
import pytest
import trimesh
from cases import cases

from renderer import (
    BruteForce,
    Dielectric,
    Mesh,
    MeshError,
    Octree,
    PerspectiveCamera,
    Phong,
    Scene,
    SceneObject,
    prepare,
)
from renderer.diagnostics.face_phong import face_colors
from renderer.inside.moments import moments_of
from renderer.mesh.polygons import triangulate
from renderer.mesh.shapes import box, icosphere
from renderer.scene.light import DirectionalLight
from renderer.studies import visible_faces
from renderer.trimesh_ray import distances

BALL = icosphere(3)
RNG = np.random.default_rng(5)
# Which float32 holds, but for the last vertex.
ROUND = Mesh(np.append(BALL.vertices.astype(np.float32)[:-1], BALL.vertices[-1:] + 2.0**-40, axis=0), BALL.faces)
# Whose answers no other query has left in memory.
OTHER = Mesh(BALL.vertices * [1.5, 1.25, 0.75], BALL.faces)
POINTS, WAYS = RNG.uniform(-1.5, 1.5, (500, 3)), RNG.normal(size=(500, 3))
TREES = [Octree.from_mesh(BALL, threads=2), BruteForce.from_mesh(BALL, threads=2)]


def asked(ask: Callable[[Any], Any]) -> Callable[[], list[Any]]:
    """The answers of both kinds of trees."""
    return lambda: [ask(tree) for tree in TREES]


def hits_of(hits: Any) -> list[Any]:
    return [getattr(hits, name) for name in ("t", "face", "u", "v", "side", "t_error")]


def built() -> list[Any]:
    tree = Octree.from_mesh(BALL, threads=2).tree
    return [tree.nodes, tree.blocks, tree.faces]


def refitted() -> list[Any]:
    octree = Octree.from_mesh(BALL, threads=2)
    octree.refit(BALL.vertices * [1.0, 2.0, 3.0])
    return [octree.tree.nodes, octree.tree.blocks]


def inside() -> list[Any]:
    tree = Octree.from_mesh(BALL, threads=2)  # whose sums over octants are not there yet
    return [tree.contains(POINTS), tree.winding_number(POINTS), tree.signed_distance(POINTS, 1.0)]


def crowded() -> Any:
    """Two boxes of glass side by side, balls of grey, flat and smooth."""
    things = [SceneObject(mesh=box(), material="glass"), SceneObject(mesh=box((1, 0, 0), (2, 1, 1)), material="glass")]
    for k, normals in enumerate(("smooth", "flat")):
        things.insert(k, SceneObject(mesh=icosphere(2), material="grey", normals=normals, translate=(0, 3 + 3 * k, 0)))
    light = DirectionalLight(direction=(0, -1, -1), irradiance=1)
    return prepare(Scene(
        camera=PerspectiveCamera(eye=(0, 0, 9), target=(0, 0, 0)), objects=things, lights=[light], ambient=0.2,
        materials={"glass": Dielectric(), "grey": Phong(ambient=(0.5, 0.2, 0.1))},
    ))  # fmt: skip


def polygons() -> list[Any]:
    """Stars of several numbers of corners, which no fan cuts right."""
    starts, corners = [0], []
    for size in (6, 8, 6, 10, 8, 6):
        angle = 2.0 * np.pi * np.arange(size) / size
        reach = np.where(np.arange(size) % 2, 1.0, 0.3)
        corners.append(np.stack([reach * np.cos(angle), reach * np.sin(angle), 0.0 * angle], axis=1))
        starts.append(starts[-1] + size)
    positions = np.concatenate(corners)
    return list(triangulate(positions, np.arange(len(positions)), np.array(starts)))


def too_small() -> list[Any]:
    """The row that an error names."""
    small = Mesh(np.eye(3) * 2.0**-400, [[0, 1, 2]])
    with pytest.raises(MeshError, match=r"got .* in row \d+") as error:
        Octree.from_mesh(Mesh.concatenate([BALL, Mesh(BALL.vertices * 1.1, BALL.faces), small]))
    return [np.array(str(error.value).split()[-1])]


def nearest_of_trimesh() -> list[Any]:
    mesh = trimesh.creation.box()
    near = distances.closest_point(mesh, np.concatenate([POINTS[:60], mesh.vertices * 2.0]))
    return list(near)


# The module and the name of each size, a small one, and what is done.
SIZES: list[tuple[str, str, int, Callable[[], list[Any]]]] = [
    ("trace.closest", "_LEAST_CHUNK", 7, asked(lambda tree: hits_of(tree.closest_hit(POINTS, WAYS)))),
    ("trace.closest", "_LEAST_CHUNK", 8, asked(lambda tree: [tree.any_hit(POINTS, WAYS, t_max=1.0)])),
    ("trace.closest", "_BLOCK_TESTS", 4000, asked(lambda tree: [tree.any_hit(POINTS, WAYS, t_max=1.0)])),
    ("trace.closest", "_BLOCK_TESTS", 4000, asked(lambda tree: hits_of(tree.all_hits(POINTS, WAYS)))),
    ("trace.batch", "CHUNK", 7, asked(lambda tree: hits_of(tree.closest_hit(
        BALL.triangles.mean(axis=1)[:500], WAYS, leaving=np.arange(500), side=1)))),
    ("trace.error", "CHUNK", 7, asked(lambda tree: hits_of(tree.closest_hit(POINTS, WAYS, t_error=True)))),
    ("trace.error", "CHUNK", 7, asked(lambda tree: hits_of(tree.all_hits(POINTS, WAYS, t_error=True)))),
    ("trace.steps", "CHUNK", 64, asked(lambda tree: [tree.count_steps(POINTS, WAYS).triangles])),
    ("all_hits.all_hits", "CHUNK", 7, asked(lambda tree: hits_of(tree.all_hits(POINTS, WAYS, contacts=False)))),
    ("all_hits.all_hits", "_OF_A_RAY", 1, asked(lambda tree: hits_of(tree.all_hits(POINTS, WAYS)))),
    ("distance.closest", "_LEAST", 7, asked(lambda tree: [tree.closest_point(POINTS, 0.5).u])),
    ("inside.contains", "_LEAST", 7, inside),
    ("inside.winding", "_LEAST", 7, inside),
    ("inside.moments", "_NODES", 3, lambda: [moments_of(Octree.from_mesh(OTHER).tree, 2)]),
    ("ordering.cells", "_MOST", 7, inside),
    ("tree.build", "_SUBTREE", 50, lambda: hits_of(Octree.from_mesh(BALL, threads=2).all_hits(POINTS, WAYS))),
    ("tree.build", "_BOXES", 7, built),
    ("tree.blocks", "_VERTICES", 7, built),
    ("tree.blocks", "_BLOCKS", 7, built),
    ("tree.blocks", "_VERTICES", 7, lambda: [Octree.from_mesh(ROUND).closest_hit(POINTS, WAYS).t]),
    ("tree.refit", "_NODES", 3, refitted),
    ("octree", "_ROWS", 7, too_small),
    ("mesh.polygons", "_BLOCK_CORNERS", 12, polygons),
    ("picture.touching", "_CHUNK", 1, lambda: [crowded().touching]),
    ("diagnostics.face_phong", "_CHUNK", 7, lambda: [face_colors(crowded().arrays, (0.0, 2.0, 9.0))]),
    ("trimesh_ray.facing", "_TOGETHER", 3, nearest_of_trimesh),
    ("studies.views", "_ROWS", 7, lambda: [visible_faces(TREES[0], (0.0, 2.0, 3.0))]),
]  # fmt: skip


def flat(answers: Any) -> list[bytes]:
    if isinstance(answers, list):
        return [part for answer in answers for part in flat(answer)]
    return [np.asarray(answers).tobytes()]


@cases(("module", "name", "few", "done"), SIZES)
def test_some_at_a_time_are_all_at_once(
    monkeypatch: pytest.MonkeyPatch, module: str, name: str, few: int, done: Callable[[], list[Any]]
) -> None:
    where = import_module(f"renderer.{module}")
    assert getattr(where, name) > few
    with monkeypatch.context() as patched:
        patched.setattr(where, name, few)
        # First, or what a chunk left out would find the right answers in memory that is used again.
        found = flat(done())
    assert found == flat(done()) and len(found[0]) > 0
