"""Memory of a built system, measured in its own process.

``measure`` starts that process with the entry point ``answer``.

The process reads the mesh (``vertices.npy``, ``faces.npy``), imports the system, builds a small mesh once to load
libraries and compiled kernels, and converts the mesh to the system's own arrays. From then on all growth of resident
memory is the system's: at rest once it is built, and at its highest while building. Linux only: VmRSS and VmHWM of
/proc/self/status, the latter reset through /proc/self/clear_refs.
"""

import ctypes
import gc
import json
import re
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from renderer.mesh.mesh import Mesh
from renderer.system import child
from validation.benchmark.measures.meshes import displaced_spheres
from validation.benchmark.peers import ours
from validation.benchmark.peers.contender import System
from validation.benchmark.peers.systems import named

_STATUS = Path("/proc/self/status")


def measure(mesh: Mesh, systems: Sequence[System], step: Callable[[str], None]) -> dict[str, Any] | None:
    """One row: bytes at rest and at peak of every system that builds; None where the kernel does not report them."""
    if not _STATUS.exists():
        return None
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        np.save(f"{folder}/vertices.npy", mesh.vertices)
        np.save(f"{folder}/faces.npy", mesh.faces)
        for system in systems:
            if system.times_build and system.takes(len(mesh.faces)):
                step(f"{mesh.name}: memory of {system.label}")
                command = child.command("validation.benchmark.measures.memory:answer", system.name, folder)
                answer = subprocess.run(command, env=child.environment(), capture_output=True, text=True, check=True)
                found[system.name] = json.loads(answer.stdout.splitlines()[-1])
    return {"mesh": mesh.name, "faces": len(mesh.faces), "systems": found}


def grown(system: System, folder: Path) -> dict[str, int | None]:
    """Bytes ``rest`` and ``peak`` by which this process grows, and ``own``: our octree's own count."""
    vertices, faces = np.load(folder / "vertices.npy"), np.load(folder / "faces.npy")
    # In float32 like the meshes of the series, and large enough for a tree that is built in parts, so that all kernels
    # load.
    small = displaced_spheres(20_000)
    system.loaded(small.vertices, small.faces)
    build = system.load(vertices, faces)
    with system.scope():
        before = resident()
        peer = build()
        peer.touch()
    peak = most_resident() - before
    _trim()
    rest = _bytes("VmRSS") - before
    return {"rest": rest, "peak": peak, "own": peer.octree.stats.bytes if isinstance(peer, ours.Ours) else None}


def resident() -> int:
    """This process's resident bytes now, from which ``most_resident`` counts anew."""
    _trim()
    Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")
    return _bytes("VmRSS")


def most_resident() -> int:
    """The most resident bytes of this process since ``resident`` was called."""
    return _bytes("VmHWM")


def _trim() -> None:
    """Return freed memory to the system, so that the rest is in use."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def _bytes(field: str) -> int:
    found = re.search(rf"^{field}:\s+(\d+) kB", _STATUS.read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        raise OSError(f"{_STATUS}: expected a line {field}, got none")
    return int(found.group(1)) * 1024


def answer(name: str, folder: str) -> None:
    """Entry point of the child process of ``measure``: print one system's memory."""
    print(json.dumps(grown(named(name), Path(folder))))
