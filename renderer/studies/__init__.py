"""Light and visibility studies of any size: what each of a million points sees, in rays that are never written down.

The functions are imported when they are first used. They take an ``Octree`` first.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Any

    from renderer.studies.directions import (
        Pattern,
        cosine_hemisphere,
        fibonacci_hemisphere,
        fibonacci_sphere,
        reinhart,
        tregenza,
    )
    from renderer.studies.hidden import occlusion
    from renderer.studies.places import FacePoints, face_points
    from renderer.studies.sky import sky_view_factor, sun_hours

__all__ = [
    "FacePoints",
    "Pattern",
    "cosine_hemisphere",
    "face_points",
    "fibonacci_hemisphere",
    "fibonacci_sphere",
    "occlusion",
    "reinhart",
    "sky_view_factor",
    "sun_hours",
    "tregenza",
]

_HOMES = {
    "FacePoints": "places",
    "Pattern": "directions",
    "cosine_hemisphere": "directions",
    "face_points": "places",
    "fibonacci_hemisphere": "directions",
    "fibonacci_sphere": "directions",
    "occlusion": "hidden",
    "reinhart": "directions",
    "sky_view_factor": "sky",
    "sun_hours": "sky",
    "tregenza": "directions",
}


def __getattr__(name: str) -> "Any":
    """Import a public name at its first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(_import_module(f"{__name__}.{_HOMES[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
