"""The installed contenders, and how to install the others."""

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
    found, missing = ours.systems(), {}
    for name, (module, how) in _PEERS.items():
        try:
            found += import_module(f"validation.benchmark.peers.{module}").systems()
        except ImportError:
            missing[name] = how
    if not any(system.name == "mitsuba_llvm" for system in found):
        missing["mitsuba_llvm"] = libllvm.HOW
    return found, missing
