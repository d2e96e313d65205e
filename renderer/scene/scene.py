"""Scenes: the contents of a TOML file, and the world-space triangles that it describes.

Units are scene units and degrees. Paths are relative to the scene file. An unknown key, a missing file or a bad value
is one ``SceneError`` that names the file, the key's path, the value that was expected and the one given.
"""

from __future__ import annotations

import os
import tomllib
import warnings
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, ValidationError, model_validator

from renderer.arguments.fields import (
    Color,
    Fields,
    FiniteVector,
    Keys,
    SceneWarning,
    first_fault,
    one_for,
    shown,
    stated,
)
from renderer.arguments.types import ArrayLike
from renderer.arguments.up import UP_AXES, up_axis
from renderer.errors import MeshError, NoSuchSceneError, SceneError, expect, expect_known
from renderer.lazy import lazy
from renderer.materials.registry import Material
from renderer.mesh.load import MESH_SUFFIXES, FilePaths, load_mesh, mesh_paths, mesh_suffix
from renderer.mesh.mesh import Mesh
from renderer.scene.camera import Camera, sample_offsets
from renderer.scene.cameras.base import BaseCamera
from renderer.scene.file_material import space_of, with_own_materials
from renderer.scene.filters import FilterName
from renderer.scene.instance import Instance
from renderer.scene.light import DirectionalLight, Light, PointLight
from renderer.scene.showcase import showcase_text
from renderer.scene.sky import Sky
from renderer.system.files import as_path, read_whole, write_atomically


def _typed(default: str) -> BeforeValidator:
    """Fill in ``type`` where a table leaves it out, so that the union's error names the right kind."""

    def fill(value: Any) -> Any:
        return {"type": default, **value} if isinstance(value, dict) else value

    return BeforeValidator(fill)


AnyCamera = Annotated[Annotated[Camera, Field(discriminator="type")], _typed("perspective")]
AnyMaterial = Annotated[Annotated[Material, Field(discriminator="type")], _typed("phong")]
AnyLight = Annotated[DirectionalLight | PointLight, Field(discriminator="type")]
# A side of the largest picture.
MOST_PIXELS = 16384
_Pixels = Annotated[int, Field(ge=1, le=MOST_PIXELS, strict=True)]
_Squares = Annotated[int, Field(ge=1, le=1000, strict=True)]
_Finite = Annotated[float, Field(strict=True)]


def _path_or_mesh(value: Any) -> Any:
    if not isinstance(value, str | os.PathLike | Mesh):
        raise ValueError(f"expected a path or a Mesh, got {shown(value)}")
    return value


# The most that a count can hold, for ``max_rays``.
UNLIMITED_RAYS = 2**62 - 1


class RenderSettings(Fields):
    """Settings of rendering; each can also be an argument of ``render``.

    Parameters
    ----------
    resolution : int or (int, int), default 512
        Width and height in pixels, from 1 to 16384; one number is both.
    samples : int, default 1
        Samples a pixel: 1, 4, 9 or another square number up to 65536.
    filter : {"box", "tent", "gaussian", "mitchell"}, default "box"
        How the samples around a pixel's centre become its radiance: see Notes.
    max_depth : int, default 6
        The number of bounces, from 0 to 64. 0 shows what the eye sees directly.
    min_weight : float, default 0
        A ray ends when its largest weight is below this number, which is less than 1. Where rays branch this bounds no
        error, because many rays may end.
    max_rays : int, default 16384
        The most rays of a sample of a pixel. After that its surfaces leave no more rays, and ``render`` warns with
        ``CutWarning``. Half-mirrors, or glass within glass, may double the rays with each bounce. The default is more
        than full branching makes in ten bounces under three lights.
    shadows : bool, default True
        Whether surfaces hide lights. If not, no shadow rays are traced.
    glass_shadows : {"opaque", "clear"}, default "opaque"
        Whether a surface that transmits light hides lights as all others do, or lets them through, each face times its
        ``transmittance``. Light is not bent, and none is lost to reflection.
    terminator : {"hard", "soft"}, default "hard"
        Where a smooth surface turns away from a light, its flat faces hide the light from one another: dark teeth show.
        "soft" starts shadow rays on the smooth surface above the faces. It also draws no dark dots at outlines. Flat
        surfaces stay as they are.

    Raises
    ------
    SceneError
        For a value out of its range.

    Notes
    -----
    A pixel is the integral of the picture times a filter. "box" is 1 in the pixel, whose samples are a regular grid.
    "tent" is 1 - abs(x) within 1 pixel of the centre, along both axes. "gaussian" has a standard deviation of 0.5
    pixels and ends at 2. "mitchell" is Mitchell and Netravali's cubic with B = C = 1/3, which also ends at 2. These are
    Mitsuba's filters with their defaults. "mitchell" sharpens by lobes below 0, so radiance beside bright edges may be
    negative; with less than 16 samples a pixel it has none. With 1 sample all filters show the pixel's centre.

    Samples lie by the distribution of the filter, and each pixel has its own: windows, bands and tiles change no bit.

    References
    ----------
    Mitchell and Netravali, Reconstruction filters in computer graphics, 1988. Ernst, Stamminger and Greiner, Filter
    importance sampling, 2006. Hanika, Hacking the Shadow Terminator, in Ray Tracing Gems II, 2021, for the soft
    terminator.

    Examples
    --------
    >>> from renderer import RenderSettings
    >>> RenderSettings(resolution=(640, 360), samples=4).max_depth
    6
    """

    resolution: Annotated[tuple[_Pixels, _Pixels], one_for(2)] = (512, 512)
    samples: Annotated[int, Field(le=65536, strict=True)] = 1
    filter: FilterName = "box"
    max_depth: Annotated[int, Field(ge=0, le=64, strict=True)] = 6
    min_weight: Annotated[float, Field(ge=0.0, lt=1.0, strict=True)] = 0.0
    max_rays: Annotated[int, Field(ge=1, le=UNLIMITED_RAYS, strict=True)] = 16384
    shadows: Annotated[bool, Field(strict=True)] = True
    glass_shadows: Literal["opaque", "clear"] = "opaque"
    terminator: Literal["hard", "soft"] = "hard"

    @stated
    def __init__(
        self,
        *,
        resolution: int | Sequence[int] = (512, 512),
        samples: int = 1,
        filter: FilterName = "box",
        max_depth: int = 6,
        min_weight: float = 0.0,
        max_rays: int = 16384,
        shadows: bool = True,
        glass_shadows: Literal["opaque", "clear"] = "opaque",
        terminator: Literal["hard", "soft"] = "hard",
    ) -> None: ...

    @model_validator(mode="after")
    def _square_samples(self) -> RenderSettings:
        sample_offsets(self.samples)
        return self


_USUAL = RenderSettings()


class GivenSettings(TypedDict, total=False):
    """Keyword arguments that take the place of a scene's ``RenderSettings``; None leaves the scene's."""

    resolution: int | Sequence[int] | None
    samples: int | None
    filter: FilterName | None
    max_depth: int | None
    min_weight: float | None
    max_rays: int | None
    shadows: bool | None
    glass_shadows: Literal["opaque", "clear"] | None
    terminator: Literal["hard", "soft"] | None


def checked_settings(
    defaults: RenderSettings, given: Mapping[str, Any], camera: BaseCamera | None = None
) -> RenderSettings:
    """``defaults`` with the settings that are given, and not None, in their place, checked as a file's would be.

    Where neither says a resolution it is that of ``camera``, if it has one. Raises ``ValueError`` with one line that
    names the setting.
    """
    for name in given:
        expect_known("render", name, sorted(RenderSettings.model_fields))
    values = {k: v for k, v in given.items() if v is not None}
    if camera is not None and camera.film_size is not None and "resolution" not in defaults.model_fields_set:
        values = {"resolution": camera.film_size, **values}
    try:
        return RenderSettings.model_validate({**defaults.model_dump(exclude_unset=True), **values})
    except ValidationError as error:
        raise ValueError(first_fault(error)) from None


class SceneObject(Fields):
    """A mesh in the world: scaled, then turned about x, y and z in this order, then moved.

    Parameters
    ----------
    mesh : Mesh or path
        The mesh, or its file.
    material : str, optional
        The name of one of the scene's materials. Without it, ``Scene`` makes an object of each material of the mesh.
    normals : {"flat", "smooth"}, default "flat"
        Whether shading interpolates the normals of vertices: those of the file, or else means of the faces around.
    crease : float, default 180
        Where the file has no normals: the angle in degrees above which an edge stays sharp. 180 smooths all edges.
    scale : float or array_like, shape (3,), default 1
        The factor of all axes, or of each.
    rotate : array_like, shape (3,), default (0, 0, 0)
        Angles about x, y and z, in degrees.
    translate : array_like, shape (3,), default (0, 0, 0)
        The move.

    Raises
    ------
    SceneError
        For values that are not finite.

    Notes
    -----
    Vertices are float64 numbers, whatever those of the file are.

    Examples
    --------
    >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, shapes
    >>> crate = SceneObject(mesh=shapes.box(), material="wood", scale=2, translate=(0, 1, 0))
    >>> eye = PerspectiveCamera(eye=(0, 2, 9), target=(0, 1, 0))
    >>> scene = Scene(camera=eye, materials={"wood": Phong()}, objects=[crate])
    >>> [corner.tolist() for corner in scene.instances[0].mesh.bounds]
    [[0.0, 1.0, 0.0], [2.0, 3.0, 2.0]]
    """

    mesh: Annotated[Path | Mesh, BeforeValidator(_path_or_mesh)]
    material: str | None = None
    normals: Literal["flat", "smooth"] = "flat"
    crease: Annotated[float, Field(ge=0.0, le=180.0, strict=True)] = 180.0
    scale: Annotated[FiniteVector, one_for(3)] = (1.0, 1.0, 1.0)
    rotate: FiniteVector = (0.0, 0.0, 0.0)
    translate: FiniteVector = (0.0, 0.0, 0.0)

    @stated
    def __init__(
        self,
        *,
        mesh: Mesh | str | os.PathLike[str],
        material: str | None = None,
        normals: Literal["flat", "smooth"] = "flat",
        crease: float = 180.0,
        scale: ArrayLike = 1.0,
        rotate: ArrayLike = (0.0, 0.0, 0.0),
        translate: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None: ...

    def _slips(self) -> Iterable[str]:
        """A scale that leaves no area: one of a single 0 makes a mesh flat, which is seen."""
        if self.scale.count(0.0) > 1:
            yield f"scale: expected at most one factor of 0, got {self.scale}, which leaves nothing to see."

    def matrix(self) -> NDArray[np.float64]:
        """The transformation from the mesh's coordinates to the world's.

        Returns
        -------
        ndarray, shape (4, 4), float64

        Examples
        --------
        >>> from renderer import SceneObject, shapes
        >>> crate = SceneObject(mesh=shapes.box(), material="wood", rotate=(0, 90, 0), translate=(0, 1, 0))
        >>> crate.matrix().round(12) + 0.0
        array([[ 0.,  0.,  1.,  0.],
               [ 0.,  1.,  0.,  1.],
               [-1.,  0.,  0.,  0.],
               [ 0.,  0.,  0.,  1.]])
        """
        result = np.eye(4)
        linear = np.diag(self.scale)
        for axis, degrees in enumerate(self.rotate):
            linear = _rotation(axis, degrees) @ linear
        result[:3, :3] = linear
        result[:3, 3] = self.translate
        return result


class Floor(Fields):
    """A rectangle of the ground, tiled with its materials in turn.

    It lies at height 0: in the plane y = 0, or x = 0 or z = 0 where the scene has this axis ``up``. Each tile shows the
    whole image of a texture.

    Parameters
    ----------
    min, max : array_like, shape (2,)
        Its least and greatest corner by the two axes that are not up, in their order: (x, z) where y is up.
    materials : sequence of str
        The names of one or two of the scene's materials.
    squares : (int, int), default (1, 1)
        The number of tiles along these axes, from 1 to 1000.

    Raises
    ------
    SceneError
        For corners that are not finite, or of which the first is not the least.

    Examples
    --------
    >>> from renderer import Floor, PerspectiveCamera, Phong, Scene
    >>> floor = Floor(min=(-4, -4), max=(4, 4), materials=["light", "dark"], squares=(8, 8))
    >>> eye = PerspectiveCamera(eye=(0, 2, 9), target=(0, 0, 0))
    >>> scene = Scene(camera=eye, materials={"light": Phong(), "dark": Phong(diffuse=0.2)}, floor=floor)
    >>> [(part.material, len(part.mesh.faces)) for part in scene.instances]
    [('light', 64), ('dark', 64)]
    """

    min: tuple[_Finite, _Finite]
    max: tuple[_Finite, _Finite]
    materials: Annotated[tuple[str, ...], Field(min_length=1, max_length=2)]
    squares: tuple[_Squares, _Squares] = (1, 1)

    @stated
    def __init__(
        self, *, min: ArrayLike, max: ArrayLike, materials: Sequence[str], squares: Sequence[int] = (1, 1)
    ) -> None: ...

    @model_validator(mode="after")
    def _not_empty(self) -> Floor:
        if not (np.isfinite([*self.min, *self.max]).all() and self.min[0] < self.max[0] and self.min[1] < self.max[1]):
            raise ValueError("expected finite min < max in both directions")
        return self


class SceneChanges(TypedDict, total=False):
    """Keyword arguments of ``Scene.altered``."""

    camera: Camera | Mapping[str, Any]
    materials: Mapping[str, Material | Mapping[str, Any]]
    lights: Sequence[Light | Mapping[str, Any]]
    ambient: ArrayLike
    background: ArrayLike
    sky: Sky | Mapping[str, Any] | None
    render: RenderSettings | Mapping[str, Any]


class Scene(Fields):
    """Everything that a picture needs. ``load_scene`` reads one from a file.

    Parameters
    ----------
    camera : PerspectiveCamera, OrthographicCamera or another of the cameras
        The camera.
    materials : dict of str to Phong, Mirror or Dielectric
        Materials by the names that objects have for them.
    lights : sequence of DirectionalLight or PointLight, default ()
        The lights.
    objects : sequence of SceneObject, default ()
        The meshes. Faces of the scene are numbered in this order.
    floor : Floor, optional
        A rectangle of the ground; its faces come last.
    ambient : float or array_like, shape (3,), default 0
        Light from everywhere, for the ``ambient`` of ``Phong``.
    background : float or array_like, shape (3,), default 0
        The radiance where a ray hits nothing.
    sky : Sky, optional
        A sky in place of the background. Its lights shine beside ``lights``.
    up : {"x", "y", "z"}, default "y"
        The axis that points up: that of the floor, and of a camera that has no ``up`` of its own.
    render : RenderSettings, optional
        The settings of its pictures.

    Raises
    ------
    SceneError
        For a value out of its range, or a material that is not there.

    Notes
    -----
    Each of these may also be a table as in a scene file, such as ``camera={"eye": (0, 0, 5), "target": (0, 0, 0)}``.

    Examples
    --------
    >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, render, shapes
    >>> ball = SceneObject(mesh=shapes.icosphere(3), material="grey", normals="smooth")
    >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
    >>> scene = Scene(camera=eye, materials={"grey": Phong()}, objects=[ball], ambient=1, background=(0.2, 0.4, 1))
    >>> render(scene, resolution=3).srgb[1].tolist()
    [[124, 170, 255], [231, 231, 231], [124, 170, 255]]
    """

    camera: AnyCamera
    materials: dict[str, AnyMaterial]
    lights: tuple[AnyLight, ...] = ()
    objects: tuple[SceneObject, ...] = ()
    floor: Floor | None = None
    ambient: Color = (0.0, 0.0, 0.0)
    background: Color = (0.0, 0.0, 0.0)
    sky: Sky | None = None
    up: Literal["x", "y", "z"] = "y"
    render: RenderSettings = _USUAL

    @stated
    def __init__(
        self,
        *,
        camera: Camera | Mapping[str, Any],
        materials: Mapping[str, Material | Mapping[str, Any]],
        lights: Sequence[Light | Mapping[str, Any]] = (),
        objects: Sequence[SceneObject | Mapping[str, Any]] = (),
        floor: Floor | Mapping[str, Any] | None = None,
        ambient: ArrayLike = 0.0,
        background: ArrayLike = 0.0,
        sky: Sky | Mapping[str, Any] | None = None,
        up: Literal["x", "y", "z"] = "y",
        render: RenderSettings | Mapping[str, Any] = _USUAL,
    ) -> None: ...

    @model_validator(mode="before")
    @classmethod
    def _lists(cls, values: Any) -> Any:
        for name in ("lights", "objects"):
            if isinstance(values, dict) and isinstance(one := values.get(name), Fields):
                raise ValueError(f"{name}: expected a list, got one {type(one).__name__}")
        return values

    @model_validator(mode="before")
    @classmethod
    def _own_materials(cls, values: Any) -> Any:
        return with_own_materials(values) if isinstance(values, dict) else values

    @model_validator(mode="before")
    @classmethod
    def _upright(cls, values: Any) -> Any:
        """Let a camera that has no ``up`` of its own have the scene's."""
        if not isinstance(values, dict) or values.get("up") not in ("x", "z"):
            return values
        camera, up = values.get("camera"), tuple(np.eye(3)[UP_AXES[values["up"]]].tolist())
        if isinstance(camera, BaseCamera) and "up" not in camera.model_fields_set:
            camera = type(camera).model_validate({**camera.model_dump(), "up": up})
        if isinstance(camera, dict) and "extrinsics" not in camera:
            camera = {"up": up, **camera}
        return {**values, "camera": camera}

    @model_validator(mode="after")
    def _one_background(self) -> Scene:
        if self.sky is not None and any(self.background):
            raise ValueError(f"background: expected none beside a sky, got {self.background}")
        return self

    @model_validator(mode="after")
    def _materials_exist(self) -> Scene:
        used = [(f"objects.{i}.material", o.material) for i, o in enumerate(self.objects)]
        used += [("floor.materials", name) for name in (self.floor.materials if self.floor else ())]
        for where, name in used:
            if name not in self.materials:
                raise ValueError(f"{where}: expected one of {sorted(self.materials)}, got {name!r}")
        return self

    @staticmethod
    def _union_member(keys: Keys) -> int | None:
        return {"camera": 1, "materials": 2, "lights": 2}.get(str(keys[0])) if keys else None

    @lazy
    def instances(self) -> tuple[Instance, ...]:
        """The meshes in world space: the objects in their order, then the floor's, one for each of its materials.

        Examples
        --------
        >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, shapes
        >>> ball = SceneObject(mesh=shapes.icosphere(3), material="grey", normals="smooth")
        >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        >>> scene = Scene(camera=eye, materials={"grey": Phong()}, objects=[ball])
        >>> [(part.material, part.smooth, part.mesh.name) for part in scene.instances]
        [('grey', True, 'icosphere')]
        """
        # A file that several objects name is one mesh.
        files = dict.fromkeys(o.mesh for o in self.objects if isinstance(o.mesh, Path))
        loaded = {file: load_mesh(file) for file in files}
        placed = [_instance(o, loaded[o.mesh] if isinstance(o.mesh, Path) else o.mesh) for o in self.objects]
        if self.floor is not None:
            placed += [Instance(m, name, False) for m, name in _floor_meshes(self.floor, UP_AXES[self.up])]
        return tuple(placed)

    @property
    def all_lights(self) -> tuple[Light, ...]:
        """The lights, then those of the sky.

        Examples
        --------
        >>> from renderer import PerspectiveCamera, Scene, Sky
        >>> scene = Scene(camera=PerspectiveCamera(eye=(0, 0, 1), target=(0, 0, 0)), materials={}, sky=Sky(lights=8))
        >>> len(scene.all_lights)
        8
        """
        return self.lights if self.sky is None else (*self.lights, *self.sky.directional(self.up))

    def altered(self, **changes: Unpack[SceneChanges]) -> Scene:
        """A copy with other values of some fields. It shares the meshes: none is loaded or placed again.

        Parameters
        ----------
        **changes
            New values of ``camera``, ``materials``, ``lights``, ``ambient``, ``background``, ``sky`` or ``render``.

        Returns
        -------
        Scene

        Raises
        ------
        ValueError
            For another name, and for values as of ``Scene``. Other objects, another floor or another ``up`` need a new
            ``Scene``.

        Examples
        --------
        >>> from renderer import load_scene
        >>> scene = load_scene("scenes/stairs.toml")
        >>> dark = scene.altered(lights=())
        >>> len(scene.lights), len(dark.lights), dark.instances is scene.instances
        (1, 0, True)
        """
        for name in changes:
            if name in _PLACED:
                raise ValueError(f"{name}: altered keeps the scene's meshes. Make a new Scene for another {name}.")
            expect_known("Scene.altered", name, SceneChanges.__annotations__)
        values: dict[str, Any] = {name: getattr(self, name) for name in type(self).model_fields}
        checked = Scene(**{**values, **changes})
        _ = self.instances  # cached, so that the copy has it too
        return self.model_copy(update={name: getattr(checked, name) for name in changes})


# The fields of a scene that place its meshes.
_PLACED = ("objects", "floor", "up")


def kind_of(value: object) -> str:
    """What an error says that it got in the place of a ``Scene``."""
    hint = ". load_scene makes a Scene of a file" if isinstance(value, str | os.PathLike) else ""
    return f"{type(value).__name__}{hint}"


def load_scene(path: FilePaths, *, up: Literal["x", "y", "z"] | None = None) -> Scene:
    """Read a scene file and its meshes, or put a scene around mesh files.

    Parameters
    ----------
    path : path, or iterable of paths
        A ``.toml`` file, or mesh files (.ply, .obj, .stl, .glb, .gltf) and folders of them, each file an object. A
        camera that sees all of them, a sky and a floor are then chosen to fit; ``octree-render render --write-scene``
        writes them as a scene file.
    up : {"x", "y", "z"}, optional
        The axis of mesh files that points up, by default "y". A scene file has the key ``up`` instead.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        For a file that cannot be read, an unknown key or a bad value; it names the file and the key.

    Warns
    -----
    SceneWarning
        For a value that is probably a slip.

    Examples
    --------
    >>> from renderer import load_scene
    >>> scene = load_scene("scenes/stairs.toml")
    >>> scene.camera.type, sorted(scene.materials), len(scene.objects)
    ('orthographic', ['ground', 'stone'], 1)
    """
    files = scene_files(path)
    if mesh_suffix(files[0]):
        return _around(files, up)
    if up is not None:
        raise SceneError(f"up: expected None for a scene file, which has the key up, got {up!r}")
    table = _table(files[0])
    for entry in _mesh_entries(table):
        entry["mesh"] = files[0].parent / entry["mesh"]
    for material in _material_entries(table):
        for key in [key for key in material if key.endswith("_map")]:
            material[key] = _beside(material[key], files[0].parent)
    return _checked(table, str(files[0]))


def _material_entries(table: dict[str, Any]) -> list[dict[str, Any]]:
    """The entries of materials in a scene file's table."""
    entries = table.get("materials")
    return [entry for entry in entries.values() if isinstance(entry, dict)] if isinstance(entries, dict) else []


def _beside(texture: Any, folder: Path) -> Any:
    """A texture of a scene file, whose image is beside the file."""
    if isinstance(texture, dict) and isinstance(texture.get("image"), str):
        return {**texture, "image": folder / texture["image"]}
    return folder / texture if isinstance(texture, str) else texture


def scene_files(path: FilePaths) -> list[Path]:
    """The scene file at ``path``, or all mesh files there. Raises ``SceneError`` for other files beside each other."""
    try:
        files = mesh_paths(path)
    except MeshError as error:
        raise SceneError(str(error)) from None
    other = [file for file in files if not mesh_suffix(file)]
    if other and len(files) > 1:
        raise SceneError(f"{other[0]}: expected a mesh file ({', '.join(MESH_SUFFIXES)}) beside others")
    return files


def _around(files: list[Path], up: str | None) -> Scene:
    """A scene around mesh files."""
    try:
        meshes = [load_mesh(file) for file in files]
    except MeshError as error:
        kind = NoSuchSceneError if isinstance(error, FileNotFoundError) else SceneError
        raise kind(str(error)) from None
    table = tomllib.loads(showcase_text(meshes, ["model"] * len(meshes), _up_of_mesh(up)))
    for entry, mesh, file in zip(table["objects"], meshes, files, strict=True):
        entry |= {"mesh": mesh} | ({} if "material" in entry else {"space": space_of(file)})
    return _checked(with_own_materials(table), ", ".join(map(str, files)))


def _up_of_mesh(up: str | None) -> str:
    """The axis that is up in a mesh file: the one given, or y, which is that of GLB and most other files."""
    if up is not None:
        up_axis(up)
    return up or "y"


def mesh_files(path: str | os.PathLike[str]) -> list[Path]:
    """The files of meshes that a scene file names, none of which is read. Raises ``SceneError`` for what is no TOML."""
    path = _scene_path(path)
    if mesh_suffix(path):
        return [path]
    return [path.parent / entry["mesh"] for entry in _mesh_entries(_table(path))]


def _scene_path(path: object) -> Path:
    try:
        return as_path("path", path)
    except ValueError as error:
        raise SceneError(str(error)) from None


def _table(path: Path) -> dict[str, Any]:
    """The content of a scene file."""
    other = f"{path}: expected a scene file (.toml) or a mesh file ({', '.join(MESH_SUFFIXES)}), got {path.suffix!r}"
    named = path.suffix.lower() == ".toml"
    try:
        content = read_whole(path)
    except FileNotFoundError as error:
        raise NoSuchSceneError(f"{path}: cannot be read: {error.strerror}") from None
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror}") from None
    try:
        table = tomllib.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:  # not only TOML's: bad UTF-8, too many digits
        told = f"{path}: expected TOML, got a syntax error: {error}" if named or not path.suffix else other
        raise SceneError(told) from None
    if not named and "camera" not in table:
        raise SceneError(other)
    return table


def _mesh_entries(table: dict[str, Any]) -> list[dict[str, Any]]:
    """The entries of objects, in a scene file's table, that name a file."""
    entries = table.get("objects") if isinstance(table.get("objects"), list) else []
    return [entry for entry in entries or [] if isinstance(entry, dict) and isinstance(entry.get("mesh"), str)]


def write_scene(mesh_files: FilePaths, path: str | Path, up: str | None = None) -> None:
    """Write the scene that ``load_scene(mesh_files, up=up)`` gives as a scene file, to be changed at will.

    Raises ``ValueError`` unless ``path`` is that of a .toml file, and leads to no other kind.
    """
    files, path = scene_files(mesh_files), as_path("path", path)
    target = Path(os.path.realpath(path))
    for name in (path, target):
        leads = "" if name == path else f", a link to {target}"
        expect(name.suffix.lower() == ".toml", "path", "a .toml file", f"{path}{leads}")
    text = showcase_text([load_mesh(file) for file in files], [_inside(file, path) for file in files], _up_of_mesh(up))
    write_atomically(path, lambda file: file.write(text.encode()))


def _inside(mesh_file: Path, path: Path) -> str:
    """The path of a mesh file as a scene file at ``path`` has it."""
    # From beside the scene file as it is named, where ``load_scene`` looks, and not from where a link may lead.
    inside = os.path.relpath(mesh_file.resolve(), path.parent.resolve())
    is_text = inside.encode(errors="replace").decode() == inside
    expect(is_text, "mesh", "a name in UTF-8, as TOML has no other", ascii(inside))
    return Path(inside).as_posix()


def _checked(table: dict[str, Any], where: str) -> Scene:
    """The scene in a file's table, whose meshes are loaded; ``where`` begins the messages of faults."""
    try:
        scene = Scene.model_validate(table)
    except ValidationError as error:
        raise SceneError(f"{where}: {first_fault(error, Scene._union_member)}") from None
    try:
        with np.errstate(all="ignore"):
            _ = scene.instances
    except MeshError as error:
        raise SceneError(f"{where}: objects: {' '.join(str(error).split())}") from None
    warn_of_slips(scene.camera, scene.materials, f"{where}: ", scene.objects)
    return scene


def warn_of_slips(
    camera: Camera | None, materials: Mapping[str, Material], where: str, objects: Sequence[SceneObject] = ()
) -> None:
    """Warn with ``SceneWarning`` of values of tables that are probably slips; ``where`` begins the message."""
    tables: dict[str, Fields | None] = {"camera": camera}
    tables |= {f"materials.{name}": material for name, material in materials.items()}
    tables |= {f"objects.{i}": each for i, each in enumerate(objects)}
    for key, table in tables.items():
        for slip in table._slips() if table else ():
            warnings.warn(f"{where}{key}.{slip}", SceneWarning, stacklevel=4)


def _instance(of: SceneObject, mesh: Mesh) -> Instance:
    return Instance(mesh, of.material or "", of.normals == "smooth", of.matrix(), of.crease)


def _rotation(axis: int, degrees: float) -> NDArray[np.float64]:
    """Rotation matrix about a coordinate axis, counter-clockwise seen against it, (3, 3) float64."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    result = np.eye(3)
    result[i, i], result[i, j], result[j, i], result[j, j] = c, -s, s, c
    return result


def _floor_meshes(floor: Floor, up: int) -> list[tuple[Mesh, str]]:
    """The floor's squares as one mesh per material, facing up, with the squares' edges shared exactly."""
    first, second = (axis for axis in range(3) if axis != up)
    columns, rows = floor.squares
    a = np.linspace(floor.min[0], floor.max[0], columns + 1)
    b = np.linspace(floor.min[1], floor.max[1], rows + 1)
    vertices = np.zeros((rows + 1, columns + 1, 3))
    vertices[..., first], vertices[..., second] = a, b[:, None]
    texcoords = np.stack(np.meshgrid(np.arange(columns + 1.0), np.arange(rows + 1.0)), axis=2)
    row, column = (index.ravel() for index in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    corner = row * (columns + 1) + column
    beside, across, above = corner + columns + 1, corner + columns + 2, corner + 1
    faces = np.stack([np.stack([corner, beside, across], 1), np.stack([corner, across, above], 1)], 1)
    if up == 1:  # x, z are not in the order of a right hand, as x, y and y, z are
        texcoords[..., 1] = rows - texcoords[..., 1]
    else:
        faces = faces[..., ::-1]
    # rule: floor-colour
    color = (row + column) % len(floor.materials)
    meshes = []
    for index, name in enumerate(floor.materials):
        chosen = faces[color == index].reshape(-1, 3)
        if len(chosen):
            arrays = vertices.reshape(-1, 3), chosen.astype(np.int32)
            meshes.append((Mesh(*arrays, texcoords=texcoords.reshape(-1, 2), name="floor"), name))
    return meshes


__all__ = ["Floor", "Instance", "Material", "RenderSettings", "Scene", "SceneObject", "load_scene"]
