"""The installed contenders, and how to install the others."""

from collections.abc import Iterator
from importlib import import_module

from validation.benchmark.peers import libllvm, ours
from validation.benchmark.peers.contender import System

# By name: the module, and how to install it.
_PEERS = {
    "embree": ("embree", "pip install embreex"),
    "open3d": ("open3d", "pip install open3d"),
    "trimesh": ("trimesh_rays", "pip install trimesh rtree"),
    "mitsuba": ("mitsuba", "pip install mitsuba"),
    "trimesh_embreex": ("trimesh_embreex", "pip install trimesh embreex"),
    "libigl": ("libigl", "pip install libigl"),
}


def available() -> tuple[list[System], dict[str, str]]:
    """Ours and every peer that can be imported; and by name how to install the others."""
    missing: dict[str, str] = {}
    found = list(_installed(missing))
    if not any(system.name == "mitsuba_llvm" for system in found):
        missing["mitsuba_llvm"] = libllvm.HOW
    return found, missing


def named(name: str) -> System:
    """One contender that can be imported, without importing those that come after it."""
    return next(system for system in _installed({}) if system.name == name)


def _installed(missing: dict[str, str]) -> Iterator[System]:
    """Ours, then those of each peer as it is imported; ``missing`` gets how to install the others."""
    yield from ours.systems()
    for name, (module, how) in _PEERS.items():
        try:
            peer = import_module(f"validation.benchmark.peers.{module}")
        except ImportError:
            missing[name] = how
        else:
            yield from peer.systems()
