"""An octree ray tracer for triangle meshes: ray, inside and distance queries, and Whitted pictures of scenes.

The public names::

    Meshes
        load_mesh            a mesh from a .ply, .obj, .stl or .glb file
        Mesh                 vertices and triangles; its faults raise MeshError
        Repairs              what ``Mesh.repaired`` left out; ``load_mesh`` warns of it with RepairWarning
        MeshMaterial         what a file says about the look of faces, with its Texture and TextureImage
        shapes               meshes of simple shapes: box, grid, icosphere, torus

    Queries
        Octree               ray, inside and distance queries on a mesh
        BruteForce           the same answers without a tree
        Hits, AllHits        the nearest hit of each ray, and all hits
        ClosestPoints        the nearest point of the mesh to each point
        Steps                the work that a search takes
        RayScene             many meshes, each placed many times, with the queries of Octree; it has SceneHits,
                             SceneAllHits and SceneClosestPoints

    Scenes and pictures
        load_scene           a scene from a .toml file, or around a mesh file
        Scene                camera, materials, lights, objects; faults raise SceneError, slips warn with SceneWarning
        PerspectiveCamera, OrthographicCamera, ThinLensCamera
        PinholeCamera, OpenCVCamera, OpenCVFisheyeCamera   calibrated, as of OpenCV, COLMAP and nerfstudio
        FisheyeCamera, EquirectangularCamera
        Phong, Mirror, Dielectric
        DirectionalLight, PointLight
        Sky                  a gradient around the scene, which shines
        SceneObject, Floor   a mesh placed in a scene, and a rectangle of the ground
        RenderSettings       resolution, samples and bounces
        render               a picture of a scene
        prepare              a PreparedScene, for many pictures of one scene
        Image                a picture with its depths, normals and faces; missing rays warn with CutWarning
        srgb                 8-bit colours of linear radiance
        view                 the scene in the browser, live
        Needs, needs_of      the features that pictures of a scene need

    Packages
        renderer.studies     sky, sun, visibility, ambient occlusion, depth maps
        renderer.radiosity   light and heat that diffuse surfaces exchange, from view factors
        renderer.cluster     the same on a Dask cluster
        renderer.trimesh_ray  a drop-in for trimesh's ray queries

``help(renderer.Octree)`` and so on have the details.

The first call of each kind compiles its kernels, once, and says so on standard error. ``octree-render compile``
compiles all of them now. The message is off with OCTREE_RENDERER_QUIET=1 in the environment, or with
``logging.getLogger("renderer").setLevel("ERROR")``.
"""

import sys as _sys

from renderer.jit import loaded as _loaded  # noqa: F401  # before all others, to note the time
from renderer.lazy_names import attach_stub as _attach_stub

# The names of ``__init__.pyi`` are imported when they are first used, so that ``import renderer`` costs nothing.
_find, __dir__, _names = _attach_stub(__name__)


def __getattr__(name: str) -> object:
    # pydoc would print everything in ``__all__`` in full: thousands of lines.
    if name == "__all__" and _sys._getframe(1).f_globals.get("__name__") != "pydoc":
        return _names
    return _find(name)
