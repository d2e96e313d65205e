"""Studies, pictures and ray queries on a Dask cluster: the mesh goes to each worker once, and the tree is built there.

``pip install 'octree-ray-tracer[cluster]'`` installs what it needs. Functions are imported by their first use.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Any

    from renderer.cluster.clients import connected
    from renderer.cluster.pictures import frames_on, render_on
    from renderer.cluster.rays import any_hit, closest_hit
    from renderer.cluster.studies import run_on

__all__ = ["any_hit", "closest_hit", "connected", "frames_on", "render_on", "run_on"]

_HOMES = {
    "any_hit": "rays",
    "closest_hit": "rays",
    "connected": "clients",
    "frames_on": "pictures",
    "render_on": "pictures",
    "run_on": "studies",
}


def __getattr__(name: str) -> "Any":
    """Import a public name at its first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(_import_module(f"{__name__}.{_HOMES[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
