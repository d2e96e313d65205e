"""Installed, new meshes of trimesh get intersectors of ours, where they would get those over embreex."""

import copyreg
import importlib.util
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from threading import RLock
from types import ModuleType
from typing import Any

from renderer.trimesh_ray import distances, intersector

# What stood in a module or in ``sys.modules`` before, by the module's name and the attribute's; None for nothing.
_before: dict[tuple[str, str], Any] = {}
_MODULES = "sys.modules"
# What is wanted, rays alone (False) or proximity too (True): by ``install()``, and by how many blocks under way.
_installed: set[bool] = set()
_blocks: Counter[bool] = Counter()
_changing = RLock()


def install(proximity: bool = False) -> None:
    """Let every ``trimesh.Trimesh`` made from now on trace its rays by the octree; earlier meshes stay as they are.

    May be called again, for instance to add ``proximity``. ``uninstall`` undoes it. Names that were imported from
    trimesh before stay as they are, and a mesh made with ``use_embree=False`` keeps trimesh's own intersector.

    Parameters
    ----------
    proximity : bool, default False
        Also answer ``closest_point`` and ``signed_distance`` of ``trimesh.proximity`` for all meshes, and with them
        ``mesh.nearest``, ``thickness`` and ``max_tangent_sphere``. If rtree or SciPy is missing, without which
        trimesh's own functions fail, this is always done.

    Examples
    --------
    >>> import trimesh
    >>> from renderer import trimesh_ray
    >>> trimesh_ray.install()
    >>> trimesh.creation.box().ray.intersects_any([[0, 0, 2]], [[0, 0, -1]])
    array([ True])
    >>> trimesh_ray.uninstall()
    """
    with _changing:
        _installed.add(bool(proximity))
        _apply()


def uninstall() -> None:
    """Undo ``install``; does nothing if nothing is installed. Blocks of ``installed`` go on."""
    with _changing:
        _installed.clear()
        _apply()


@contextmanager
def installed(proximity: bool = False) -> Iterator[None]:
    """Install for a ``with`` block. Blocks may overlap, also on several threads.

    Parameters
    ----------
    proximity : bool, default False
        As for ``install``.

    Examples
    --------
    >>> import trimesh
    >>> from renderer.trimesh_ray import installed
    >>> with installed(proximity=True):
    ...     trimesh.creation.box().nearest.signed_distance([[0, 0, 0.25]])
    array([0.25])
    """
    with _changing:
        _blocks[bool(proximity)] += 1
        _apply()
    try:
        yield
    finally:
        with _changing:
            _blocks[bool(proximity)] -= 1
            _apply()


def _apply() -> None:
    """Put in place, or give back, what is wanted now."""
    wanted = _installed | {*_blocks.elements()}
    names = [("trimesh.ray", "ray_pyembree"), ("trimesh.ray", "has_embree"), (_MODULES, "trimesh.ray.ray_pyembree")]
    ours = dict(zip(names, (intersector, True, intersector), strict=True)) if wanted else {}
    if True in wanted or (wanted and not _trimesh_finds_points()):
        for name in ("closest_point", "signed_distance"):
            ours["trimesh.proximity", name] = getattr(distances, name)
    for key in [key for key in _before if key not in ours]:
        _set(*key, _before.pop(key))
    for key, value in ours.items():
        if key not in _before:
            _before[key] = _get(*key)
            _keep_picklable(_before[key])
            _set(*key, value)


def _trimesh_finds_points() -> bool:
    """Whether trimesh's own ``closest_point`` has what it needs."""
    return all(importlib.util.find_spec(name) is not None for name in ("rtree", "scipy"))


def _keep_picklable(module: Any) -> None:
    """Let intersectors over embreex made before travel by a function: meanwhile no name leads to their class."""
    if isinstance(module, ModuleType):
        replaced: Any = vars(module)["RayMeshIntersector"]
        copyreg.pickle(replaced, lambda ray: (over_embreex, (ray.mesh, ray._scale_to_box)))


def over_embreex(mesh: Any, scale_to_box: bool) -> Any:
    """trimesh's intersector over embreex, whatever is installed."""
    module = _before.get((_MODULES, "trimesh.ray.ray_pyembree")) or _module("trimesh.ray.ray_pyembree")
    return module.RayMeshIntersector(mesh, scale_to_box)


def _get(place: str, name: str) -> Any:
    return sys.modules.get(name) if place == _MODULES else getattr(_module(place), name)


def _set(place: str, name: str, value: Any) -> None:
    if place != _MODULES:
        setattr(_module(place), name, value)
    elif value is None:
        sys.modules.pop(name, None)
    else:
        sys.modules[name] = value


def _module(name: str) -> Any:
    return import_module(name)
