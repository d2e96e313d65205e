"""Scenes of placed meshes: memory, moves, and closest hits beside Mitsuba's instances and our own octrees."""

import gc
import statistics
import tracemalloc
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.rayscene.scene import RayScene
from validation.benchmark.measures.kinds import KINDS
from validation.benchmark.measures.meshes import displaced_spheres
from validation.benchmark.peers.contender import Family, Floats, Peer
from validation.benchmark.peers.ours import OURS, Ours
from validation.hits.placements import body
from validation.hits.rays import camera_rays, float32_exact, random_rays
from validation.oracle.placing import Body
from validation.scenes import SCENES
from validation.timing import RUNS, interleaved, ratio, timed

_SEED = 50
# Contenders beside ours: the octree of the same faces, and Embree's instances.
OCTREE, INSTANCES = "octree", "mitsuba_instances"
# In full and in quick runs: faces and instances of the large scene, instances of one that can be merged, and rays of a
# family.
MANY, QUICK_MANY = (100_000, 10_000), (10_000, 1_000)
FEW, QUICK_FEW = 64, 16
RAYS, QUICK_RAYS = 1_000_000, 100_000


class _Placed(NamedTuple):
    """A mesh that stands in a scene, and half the side of the cube around all of it."""

    name: str
    mesh: Mesh
    body: Body
    half: float


def measure(quick: bool, llvm: bool, step: Callable[[str], None]) -> dict[str, Any]:
    """The record of a scene of many instances, one that can be merged, and one of a single mesh; see ``record``."""
    rng, (faces, count) = np.random.default_rng(_SEED), QUICK_MANY if quick else MANY
    knot = _unit(load_mesh(SCENES / "models" / "torus_knot.ply"))
    many, few = _spread(_unit(displaced_spheres(faces)), count, rng), _spread(knot, QUICK_FEW if quick else FEW, rng)
    one = _Placed("1 knot", knot, body(knot, np.eye(3)[None], np.zeros(3)), 1.0)
    rays = QUICK_RAYS if quick else RAYS
    step(f"scenes: {many.name}")
    found = {"instances": count, "faces": len(many.mesh.faces), **_memory(many), "move": _move(many)}
    rows = [row for placed in (many, few, one) for row in _rows(placed, rays, llvm, step)]
    return found | {"rows": rows}


def _unit(mesh: Mesh) -> Mesh:
    """The mesh around the origin with a diagonal of 2."""
    lower, upper = mesh.bounds
    vertices = (mesh.vertices - (lower + upper) / 2) * (2.0 / np.linalg.norm(upper - lower))
    return Mesh(float32_exact(vertices), mesh.faces, name=mesh.name)


def _spread(mesh: Mesh, count: int, rng: Generator) -> _Placed:
    """Instances turned and of several sizes, so far apart that some overlap."""
    half = 1.25 * count ** (1 / 3)
    turns = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0] * rng.uniform(0.5, 1.5, (count, 1, 1))
    placed = body(mesh, turns, rng.uniform(-half, half, (count, 3)))
    return _Placed(f"{count:,} of {mesh.name or 'knot'}", mesh, placed, half)


def _memory(placed: _Placed) -> dict[str, float]:
    """Bytes an instance beyond those of the mesh: of the arrays, and by which Python's memory grows."""
    octree = Octree.from_mesh(placed.mesh)
    _ready(RayScene(), octree, placed.body.matrices[:1])
    gc.collect()
    tracemalloc.start()
    scene = _ready(RayScene(), octree, placed.body.matrices)
    gc.collect()
    grown = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    top, count = scene._built.top, len(placed.body.matrices)
    return {"bytes": (top.instances.nbytes + top.nodes.nbytes) / count, "grown": grown / count}


def _ready(scene: RayScene, octree: Octree, matrices: Floats) -> RayScene:
    """The scene with instances of an octree, after a query."""
    scene.add(octree, matrices)
    scene.any_hit(np.zeros(3), np.ones(3))
    return scene


def _move(placed: _Placed) -> dict[str, Any]:
    """Seconds from moving all instances to the first answer, of several runs."""
    scene = RayScene()
    number = scene.add(placed.mesh, placed.body.matrices)

    def move() -> None:
        scene.move(number, placed.body.matrices)
        scene.any_hit(np.zeros(3), np.ones(3))

    seconds = interleaved({OURS: timed(move)}, 3 * RUNS)[OURS]
    return {"seconds": seconds, "median": statistics.median(seconds)}


def _rows(placed: _Placed, count: int, llvm: bool, step: Callable[[str], None]) -> list[dict[str, Any]]:
    """A row for camera and one for random rays."""
    scene = RayScene()
    scene.add(placed.mesh, placed.body.matrices)
    peers: dict[str, Peer] = {OURS: Ours(scene)}
    if len(placed.body.matrices) <= FEW:
        peers[OCTREE] = Ours(Octree.from_mesh(scene.merged))
    if llvm:
        from validation.benchmark.peers.mitsuba import instances_peer

        peers[INSTANCES] = instances_peer([placed.body])
    corners = placed.half * np.array([[(x, y, z) for z in (-1.0, 0.0, 1.0)] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    camera = camera_rays(corners.reshape(-1, 3), count)
    random = random_rays(corners, count, np.random.default_rng(_SEED))
    rows = []
    for rays in (camera, random):
        step(f"scenes: {placed.name}, {rays.name} rays")
        family = Family(rays.name, rays.origins, rays.directions)
        of_scene = {"scene": placed.name, "instances": len(placed.body.matrices), "faces": len(placed.mesh.faces)}
        rows.append(of_scene | _row(peers, family))
    return rows


def _row(peers: dict[str, Peer], family: Family) -> dict[str, Any]:
    """Seconds of all contenders in turn, ratios to ours, and rays that one of both misses."""
    queries = {name: query for name, peer in peers.items() if (query := peer.closest(family)) is not None}
    seconds = interleaved({name: timed(query.trace) for name, query in queries.items()}, RUNS)
    t = {name: query.read(query.trace()) for name, query in queries.items()}
    hit = KINDS["closest"].hit
    return {
        "rays": len(family),
        "family": family.name,
        "hit_share": float(hit(t[OURS]).mean()),
        "differing": {name: int((hit(t[name]) != hit(t[OURS])).sum()) for name in t if name != OURS},
        "contenders": {n: {"median": statistics.median(s), "seconds": s} for n, s in seconds.items()},
        "ratios": {name: ratio(runs, seconds[OURS]) for name, runs in seconds.items() if name != OURS},
    }
