"""An octree ray tracer for triangle meshes: ray queries, and Whitted pictures of scenes.

The names below are imported when they are first used, so that ``import renderer`` costs nothing, and reading meshes
needs no compiler. Kernels are compiled by their first call, which one line on standard error reports, and kept on disk;
``octree-render compile`` compiles them ahead. The line comes from the logger ``renderer.jit``:
``logging.getLogger("renderer").setLevel("ERROR")`` or OCTREE_RENDERER_QUIET=1 in the environment turns it off.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING

from renderer.jit import loaded as _loaded  # noqa: F401  # before all others, to note the time

if TYPE_CHECKING:
    from typing import Any

    from renderer.distance.closest import ClosestPoints
    from renderer.errors import MeshError, SceneError
    from renderer.mesh.load import load_mesh
    from renderer.mesh.mesh import Mesh, Repairs, RepairWarning
    from renderer.octree import BruteForce, Octree
    from renderer.picture.image import CutWarning, Image, srgb
    from renderer.picture.prepare import PreparedScene
    from renderer.picture.render import prepare, render
    from renderer.scene.camera import OrthographicCamera, PerspectiveCamera
    from renderer.scene.light import DirectionalLight, PointLight
    from renderer.scene.material import Dielectric, Mirror, Phong
    from renderer.scene.needs import Needs, needs_of
    from renderer.scene.scene import Floor, RenderSettings, Scene, SceneObject, load_scene
    from renderer.trace.hits import AllHits, Hits
    from renderer.trace.steps import Steps
    from renderer.viewer.view import view

__version__ = "0.1.0"

__all__ = [
    "AllHits",
    "BruteForce",
    "ClosestPoints",
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
    "Steps",
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
    "AllHits": "trace.hits",
    "BruteForce": "octree",
    "ClosestPoints": "distance.closest",
    "CutWarning": "picture.image",
    "Dielectric": "scene.material",
    "DirectionalLight": "scene.light",
    "Floor": "scene.scene",
    "Hits": "trace.hits",
    "Image": "picture.image",
    "Mesh": "mesh.mesh",
    "MeshError": "errors",
    "Mirror": "scene.material",
    "Needs": "scene.needs",
    "Octree": "octree",
    "OrthographicCamera": "scene.camera",
    "PerspectiveCamera": "scene.camera",
    "Phong": "scene.material",
    "PointLight": "scene.light",
    "PreparedScene": "picture.prepare",
    "RenderSettings": "scene.scene",
    "RepairWarning": "mesh.mesh",
    "Repairs": "mesh.mesh",
    "Scene": "scene.scene",
    "SceneError": "errors",
    "SceneObject": "scene.scene",
    "Steps": "trace.steps",
    "load_mesh": "mesh.load",
    "load_scene": "scene.scene",
    "needs_of": "scene.needs",
    "prepare": "picture.render",
    "render": "picture.render",
    "srgb": "picture.image",
    "view": "viewer.view",
}


def __getattr__(name: str) -> "Any":
    """Import a public name at its first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(_import_module(f"{__name__}.{_HOMES[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
