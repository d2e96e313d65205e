"""Installed, new meshes of trimesh get intersectors of ours, where they would get those over embreex."""

import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from renderer.trimesh_ray import distances, intersector

# What stood in a module or in ``sys.modules`` before, by the module's name and the attribute's; None for nothing.
_before: dict[tuple[str, str], Any] = {}
_MODULES = "sys.modules"


def install(proximity: bool = False) -> None:
    """Let every ``trimesh.Trimesh`` made from now on trace its rays here; those made before keep what they have.

    proximity  whether ``trimesh.proximity``'s ``closest_point`` and ``signed_distance`` answer by ours too, for all
               meshes, and with them ``mesh.nearest``, ``thickness`` and ``max_tangent_sphere``

    May be called again, as to add ``proximity``. Undone by ``uninstall()``.
    """
    import trimesh

    _put("trimesh.ray", "ray_pyembree", intersector)
    _put("trimesh.ray", "has_embree", True)
    _put(_MODULES, "trimesh.ray.ray_pyembree", intersector)
    if proximity:
        for name in ("closest_point", "signed_distance"):
            _put(trimesh.proximity.__name__, name, getattr(distances, name))


def uninstall() -> None:
    """Give trimesh back what stood there before ``install()``; does nothing where nothing is installed."""
    while _before:
        (place, name), value = _before.popitem()
        _set(place, name, value)


@contextmanager
def installed(proximity: bool = False) -> Iterator[None]:
    """``install()`` for a block, and after it whatever was installed before."""
    earlier = dict(_before)
    install(proximity)
    try:
        yield
    finally:
        for key in [key for key in _before if key not in earlier]:
            _set(*key, _before.pop(key))


def _put(place: str, name: str, value: Any) -> None:
    if (place, name) not in _before:
        _before[place, name] = sys.modules.get(name) if place == _MODULES else getattr(_module(place), name)
    _set(place, name, value)


def _set(place: str, name: str, value: Any) -> None:
    if place != _MODULES:
        setattr(_module(place), name, value)
    elif value is None:
        sys.modules.pop(name, None)
    else:
        sys.modules[name] = value


def _module(name: str) -> Any:
    return importlib.import_module(name)
