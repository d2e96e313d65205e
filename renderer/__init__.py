"""An octree ray tracer for triangle meshes: ray queries, and Whitted pictures of scenes.

The names below are imported when they are first used, so that ``import renderer`` costs nothing and whoever only
reads meshes needs no compiler. Kernels are compiled by their first call, which one line on standard error says, and
kept on disk; ``octree-render compile`` compiles them ahead. The line comes from the logger ``renderer.jit``:
``logging.getLogger("renderer").setLevel("ERROR")`` or OCTREE_RENDERER_QUIET=1 in the environment turns it off.
"""

import sys as _sys
from importlib import import_module as _import_module
from types import ModuleType as _ModuleType
from typing import TYPE_CHECKING

from renderer import loaded as _loaded  # noqa: F401  # before all others, to look at the clock

if TYPE_CHECKING:
    from typing import Any

    from renderer.camera import OrthographicCamera, PerspectiveCamera
    from renderer.errors import MeshError, SceneError
    from renderer.image import CutWarning, Image, srgb
    from renderer.light import DirectionalLight, PointLight
    from renderer.material import Dielectric, Mirror, Phong
    from renderer.mesh import Mesh, Repairs, RepairWarning
    from renderer.mesh_io import load_mesh
    from renderer.needs import Needs, needs_of
    from renderer.octree import BruteForce, Octree
    from renderer.prepared_scene import PreparedScene
    from renderer.query import Hits
    from renderer.render import prepare, render
    from renderer.scene import Floor, RenderSettings, Scene, SceneObject, load_scene
    from renderer.viewer.view import view

__version__ = "0.1.0"

__all__ = [
    "BruteForce",
    "CutWarning",
    "Dielectric",
    "DirectionalLight",
    "Floor",
    "Hits",
    "Image",
    "Mesh",
    "MeshError",
    "Mirror",
    "Needs",
    "Octree",
    "OrthographicCamera",
    "PerspectiveCamera",
    "Phong",
    "PointLight",
    "PreparedScene",
    "RenderSettings",
    "RepairWarning",
    "Repairs",
    "Scene",
    "SceneError",
    "SceneObject",
    "__version__",
    "load_mesh",
    "load_scene",
    "needs_of",
    "prepare",
    "render",
    "srgb",
    "view",
]

_HOMES = {
    "BruteForce": "octree",
    "CutWarning": "image",
    "Dielectric": "material",
    "DirectionalLight": "light",
    "Floor": "scene",
    "Hits": "query",
    "Image": "image",
    "Mesh": "mesh",
    "MeshError": "errors",
    "Mirror": "material",
    "Needs": "needs",
    "Octree": "octree",
    "OrthographicCamera": "camera",
    "PerspectiveCamera": "camera",
    "Phong": "material",
    "PointLight": "light",
    "PreparedScene": "prepared_scene",
    "RenderSettings": "scene",
    "RepairWarning": "mesh",
    "Repairs": "mesh",
    "Scene": "scene",
    "SceneError": "errors",
    "SceneObject": "scene",
    "load_mesh": "mesh_io",
    "load_scene": "scene",
    "needs_of": "needs",
    "prepare": "render",
    "render": "render",
    "srgb": "image",
    "view": "viewer.view",
}


class _Package(_ModuleType):
    """This package, with its public names imported at their first use."""

    def __getattr__(self, name: str) -> "Any":
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(_import_module(f"{__name__}.{_HOMES[name]}"), name)
        setattr(self, name, value)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        # Importing the module renderer.render must not hide the function of that name.
        if not (name in _HOMES and isinstance(value, _ModuleType)):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted(__all__)


_sys.modules[__name__].__class__ = _Package
