"""Light and visibility studies of any size: what each of a million points sees, in rays that are never written down.

The functions are imported when they are first used. They take an ``Octree`` first.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Any

    from renderer.studies.ambient import ambient_occlusion, openness
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
    from renderer.studies.views import Scan, depth_map, scan, visible_faces

__all__ = [
    "FacePoints",
    "Pattern",
    "Scan",
    "ambient_occlusion",
    "cosine_hemisphere",
    "depth_map",
    "face_points",
    "fibonacci_hemisphere",
    "fibonacci_sphere",
    "occlusion",
    "openness",
    "reinhart",
    "scan",
    "sky_view_factor",
    "sun_hours",
    "tregenza",
    "visible_faces",
]

_HOMES = {
    "FacePoints": "places",
    "Pattern": "directions",
    "Scan": "views",
    "ambient_occlusion": "ambient",
    "cosine_hemisphere": "directions",
    "depth_map": "views",
    "face_points": "places",
    "fibonacci_hemisphere": "directions",
    "fibonacci_sphere": "directions",
    "occlusion": "hidden",
    "openness": "ambient",
    "reinhart": "directions",
    "scan": "views",
    "sky_view_factor": "sky",
    "sun_hours": "sky",
    "tregenza": "directions",
    "visible_faces": "views",
}


def __getattr__(name: str) -> "Any":
    """Import a public name at its first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(_import_module(f"{__name__}.{_HOMES[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
