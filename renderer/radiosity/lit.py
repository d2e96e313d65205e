"""A scene lit by radiosity: its surfaces shine by themselves, so that pictures from anywhere cost their rays alone."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.fields import SceneWarning
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.materials.registry import Material
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.radiosity.area_lights import lamps_of, light_of_lamps
from renderer.radiosity.colors import vertex_colors
from renderer.radiosity.lamps import direct_light
from renderer.radiosity.looks import Look, check_reflectance, left_out, lit_material, look_of
from renderer.radiosity.patch import patches
from renderer.radiosity.solve import radiosity
from renderer.scene.instance import Instance
from renderer.scene.scene import Scene, SceneObject, kind_of
from renderer.studies.factors.compute import view_factors
from renderer.studies.factors.result import ViewFactors
from renderer.studies.factors.surfaces import areas_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Patches along the longest side of the scene by default: of a room some thousands in all, which take seconds.
_ALONG = 16
# The share of all light that may end on backs of faces: floors under what stands on them, plates without a thickness.
_ON_BACKS = 0.25


class _Part(NamedTuple):
    """An instance of the scene, cut into patches where it returns or emits light evenly: where it has a ``look``."""

    instance: Instance
    mesh: Mesh
    look: Look | None


def lit_scene(
    scene: Scene,
    edge: float | None = None,
    *,
    rtol: float = 0.05,
    max_rays: int = 1 << 16,
    crease: float = 30.0,
    threads: int | None = None,
    progress: bool = False,
) -> Scene:
    """Return the scene lit by radiosity: surfaces emit what they return of all light, and there are no lights.

    Parameters
    ----------
    scene : Scene
    edge : float, optional
        The longest edge of a patch, in scene units. Shadows are no sharper. By default 1/16 of the scene's longest
        side.
    rtol : float, default 0.05
        As for `view_factors`: the share of what a patch sends that may arrive elsewhere.
    max_rays : int, default 65536
        As for `view_factors`.
    crease : float, default 30
        As for `vertex_colors`: colours are blended over edges where normals differ by at most this many degrees.
    threads : int, optional
        By default all processors.
    progress : bool, default False
        Show bars on standard error if that is a terminal.

    Returns
    -------
    Scene
        Of the same camera, background and settings. Each object is one of ``scene``, or a material's part of its
        floor: its mesh has colours of vertices, and its material, of the same name, multiplies them by its emission.
        Mirrors and glass stay as they are, and show the lit surfaces.

    Raises
    ------
    ValueError
        If an argument is not as above, or if a material returns all light. The message names it.
    ImportError
        If SciPy is not installed.

    Warns
    -----
    SceneWarning
        For what radiosity leaves out: highlights, what mirrors and glass throw on other surfaces, details of textures
        in what they throw on others, ambient light. Also if much light ends on backs of faces, which are black.

    Notes
    -----
    Lights, and a sky by its lights, light the front sides of faces as in `render`. Emission and a background light
    surfaces too, which they do not in `render`. The front is the side from which corners run counter-clockwise.

    Colours are right in the middle of patches within the errors of view factors, and blended between them.

    Examples
    --------
    A closed room that emits what it does not return is equally bright everywhere.

    >>> from renderer import Mesh, PerspectiveCamera, Phong, Scene, SceneObject, render, shapes
    >>> from renderer.radiosity import lit_scene
    >>> room = shapes.box()
    >>> room = Mesh(room.vertices, room.faces[:, ::-1])
    >>> eye = PerspectiveCamera(eye=(0.5, 0.5, 0.9), target=(0.5, 0.5, 0.0))
    >>> walls = SceneObject(mesh=room, material="plaster")
    >>> scene = Scene(camera=eye, materials={"plaster": Phong(diffuse=0.7, emission=0.3)}, objects=[walls])
    >>> render(lit_scene(scene, 0.5), resolution=2).radiance.round(3)[0].tolist()
    [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
    """
    expect(isinstance(scene, Scene), "scene", "a renderer.Scene", kind_of(scene))
    angle = real_argument("crease", crease)
    expect(angle.ndim == 0 and 0.0 <= float(angle) <= 180.0, "crease", "an angle from 0 to 180 degrees", repr(crease))
    check_reflectance(scene)
    for line in left_out(scene):
        warnings.warn(f"radiosity leaves out {line}", SceneWarning, stacklevel=2)
    parts = _parts(scene, edge)
    octree = Octree.from_mesh(Mesh.concatenate([part.mesh for part in parts]), threads=threads)
    groups = _groups(parts)
    with warnings.catch_warnings():
        # One of its own follows, which lets floors be hidden beneath what stands on them.
        warnings.filterwarnings("ignore", "octree: .* see backs of faces", UserWarning)
        factors = view_factors(octree, groups, rtol=rtol, max_rays=max_rays, threads=threads, progress=progress)
    _warn_of_backs(factors)
    values = _radiances(scene, octree, parts, groups, factors, progress)
    ends = np.cumsum([len(part.mesh.faces) for part in parts])
    return _shown(scene, parts, np.split(values[groups], ends[:-1]), crease)


def _radiances(
    scene: Scene, octree: Octree, parts: list[_Part], groups: Ints, factors: ViewFactors, progress: bool
) -> Floats:
    """The radiance of each surface, (n, 3)."""
    emission, diffuse = _own(parts, groups)
    patch = np.flatnonzero(np.concatenate([np.full(len(p.mesh.faces), p.look is not None) for p in parts]))
    rows = groups[patch]
    lamps = lamps_of(octree, emission[rows], patch)
    light = direct_light(octree, scene.all_lights, patch, progress=progress)
    light += light_of_lamps(octree, emission[rows], patch, lamps, progress=progress)
    # Lamps, whose light is counted by now, are dark for view factors.
    own = emission.copy()
    own[rows[lamps]] = 0.0
    source = own.copy()
    source[rows] += diffuse[rows] * light
    found = radiosity(factors, source, diffuse, sky=None if scene.sky is not None else scene.background)
    return found.values + (emission - own)


def _parts(scene: Scene, edge: float | None) -> list[_Part]:
    """The instances that have faces with an area, cut into patches."""
    whole = [(instance, _with_area(instance.mesh)) for instance in scene.instances]
    whole = [(instance, mesh) for instance, mesh in whole if len(mesh.faces)]
    expect(len(whole) > 0, "scene", "a scene with faces", "none")
    if edge is None:
        corners = np.array([mesh.bounds for _, mesh in whole])
        edge = float((corners[:, 1].max(axis=0) - corners[:, 0].min(axis=0)).max()) / _ALONG
    return [_part(instance, mesh, scene.materials[instance.material], edge) for instance, mesh in whole]


def _with_area(mesh: Mesh) -> Mesh:
    """The mesh without faces of no area, which neither send nor show anything."""
    areas = areas_of(mesh)
    if (areas > 0.0).all():
        return mesh
    return Mesh(mesh.vertices, mesh.faces[areas > 0.0], mesh.normals, mesh.colors, mesh.texcoords, mesh.name)


def _part(instance: Instance, mesh: Mesh, material: Material, edge: float) -> _Part:
    if instance.smooth:
        mesh = Mesh(mesh.vertices, mesh.faces, instance.normals, mesh.colors, mesh.texcoords, mesh.name)
    if look_of(material, instance, mesh) is None:
        return _Part(instance, mesh, None)
    cut = patches(mesh, edge).mesh
    return _Part(instance, cut, look_of(material, instance, cut))


def _groups(parts: list[_Part]) -> Ints:
    """The surface of each face: each patch is one, and so is each instance that only hides."""
    found, first = [], 0
    for part in parts:
        count = len(part.mesh.faces)
        found.append(np.full(count, first) if part.look is None else first + np.arange(count))
        first = int(found[-1][-1]) + 1
    return np.concatenate(found)


def _own(parts: list[_Part], groups: Ints) -> tuple[Floats, Floats]:
    """The emission and the reflectance of surfaces, (n, 3) each."""
    emission, diffuse = np.zeros((2, int(groups[-1]) + 1, 3))
    first = 0
    for part in parts:
        rows = groups[first : first + len(part.mesh.faces)]
        if part.look is not None:
            emission[rows], diffuse[rows] = part.look.emission, part.look.diffuse
        first += len(rows)
    return emission, diffuse


def _warn_of_backs(factors: ViewFactors) -> None:
    share = float(factors.backs @ factors.areas / factors.areas.sum())
    if share > _ON_BACKS:
        told = f"{100.0 * share:.3g} % of what surfaces send ends on backs of faces, which are black: turn these faces"
        warnings.warn(told, SceneWarning, stacklevel=3)


def _shown(scene: Scene, parts: list[_Part], values: list[Floats], crease: float) -> Scene:
    """The scene whose patches have these radiances, (n, 3) for each part."""
    shown = [None if p.look is None else _over(rows, p.look.detail) for p, rows in zip(parts, values, strict=True)]
    brightness: dict[str, Floats] = {}
    for part, colors in zip(parts, shown, strict=True):
        if colors is not None:
            name = part.instance.material
            brightness[name] = np.maximum(brightness.get(name, np.zeros(3)), colors.max(axis=0))
    objects = [_object(part, colors, brightness, crease) for part, colors in zip(parts, shown, strict=True)]
    lit = {name: lit_material(scene.materials[name], top) for name, top in brightness.items()}
    sky = None if scene.sky is None else scene.sky.model_copy(update={"lights": 0, "sun": None})
    return Scene(
        camera=scene.camera,
        materials={**scene.materials, **lit},
        objects=objects,
        background=scene.background,
        sky=sky,
        up=scene.up,
        render=scene.render,
    )


def _over(values: Floats, whole: ArrayLike) -> Floats:
    """Shares of a whole, 0 of nothing."""
    return np.divide(values, whole, out=np.zeros_like(values), where=np.asarray(whole) > 0.0)


def _object(part: _Part, colors: Floats | None, brightness: dict[str, Floats], crease: float) -> SceneObject:
    mesh, name = part.mesh, part.instance.material
    if colors is not None:
        one = np.zeros(len(mesh.faces), np.int64)
        mesh = vertex_colors(mesh, _over(colors, brightness[name]), crease=crease, surfaces=one, space="linear")
    return SceneObject(mesh=mesh, material=name, normals="smooth" if part.instance.smooth else "flat")
