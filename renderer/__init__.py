"""An octree ray tracer for triangle meshes: ray queries, and Whitted pictures of scenes.

The names below are imported when they are first used, so that ``import renderer`` costs nothing and whoever only
reads meshes needs no compiler. Kernels are compiled by their first call and kept on disk; the logger ``renderer.jit``
tells at level INFO, and ``octree-render compile`` compiles all of them ahead.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from renderer.errors import MeshError, SceneError
    from renderer.image import Image
    from renderer.mesh import Mesh, Repairs, RepairWarning
    from renderer.mesh_io import load_mesh
    from renderer.needs import Needs, needs_of
    from renderer.octree import BruteForce, Octree
    from renderer.query import Hits
    from renderer.render import render
    from renderer.scene import Scene, load_scene
    from renderer.viewer.view import view

__all__ = [
    "BruteForce",
    "Hits",
    "Image",
    "Mesh",
    "MeshError",
    "Needs",
    "Octree",
    "RepairWarning",
    "Repairs",
    "Scene",
    "SceneError",
    "load_mesh",
    "load_scene",
    "needs_of",
    "render",
    "view",
]

_HOMES = {
    "BruteForce": "octree",
    "Hits": "query",
    "Image": "image",
    "Mesh": "mesh",
    "MeshError": "errors",
    "Needs": "needs",
    "Octree": "octree",
    "RepairWarning": "mesh",
    "Repairs": "mesh",
    "Scene": "scene",
    "SceneError": "errors",
    "load_mesh": "mesh_io",
    "load_scene": "scene",
    "needs_of": "needs",
    "render": "render",
    "view": "viewer.view",
}


class _Package(ModuleType):
    """This package, with its public names imported at their first use."""

    def __getattr__(self, name: str) -> Any:
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
        setattr(self, name, value)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        # Importing the module renderer.render must not hide the function of that name.
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *__all__})


sys.modules[__name__].__class__ = _Package
