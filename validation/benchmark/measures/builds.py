"""Seconds to build, up to the first query less the time of a warm one, and to refit the octree."""

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

from renderer.arguments.split import SPLIT
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.benchmark.peers import ours
from validation.benchmark.peers.contender import System
from validation.timing import RUNS, interleaved, ratio, timed

REFIT = "ours_refit"
# Above this size a round of all builds takes half a minute, so there are three rounds instead of five.
_LARGE, _LARGE_RUNS = 2_000_000, 3


def measure(mesh: Mesh, systems: Sequence[System], step: Callable[[str], None]) -> dict[str, Any]:
    """One row: builds of ``mesh`` by our split rules and by every system with its own build."""
    step(f"{mesh.name}: builds")
    peers = [s for s in systems if s.times_build and s.name != ours.OURS and s.takes(len(mesh.faces))]
    contenders = ours.builds() + peers
    calls = {system.name: _build_clock(system, mesh) for system in contenders} | {REFIT: _refit_clock(mesh)}
    runs = _LARGE_RUNS if len(mesh.faces) > _LARGE else RUNS
    seconds = interleaved(calls, runs)
    own = f"{ours.OURS}_{SPLIT}"
    return {
        "mesh": mesh.name,
        "faces": len(mesh.faces),
        "contenders": {n: {"seconds": s, "median": statistics.median(s)} for n, s in seconds.items()},
        "ratios": {name: ratio(s, seconds[own]) for name, s in seconds.items() if name != own},
        "ratios_refit": {peer.name: ratio(seconds[peer.name], seconds[REFIT]) for peer in peers},
    }


def _build_clock(system: System, mesh: Mesh) -> Callable[[], float]:
    def seconds() -> float:
        build = system.load(mesh.vertices, mesh.faces)
        with system.scope():
            began = time.perf_counter()
            peer = build()
            peer.touch()
            built = time.perf_counter()
        # The cost of a warm query is not part of the build.
        return max(built - began - timed(peer.touch)(), 0.0)

    return seconds


def _refit_clock(mesh: Mesh) -> Callable[[], float]:
    """An octree whose vertices move back and forth by a power of two, so that float32 holds both positions."""
    octree = Octree.from_mesh(mesh)
    places = [mesh.vertices * 0.5, mesh.vertices.copy()]

    def seconds() -> float:
        places.reverse()
        return timed(octree.refit, places[0])()

    return seconds
