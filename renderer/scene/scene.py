"""Scenes: the contents of a TOML file, and the world-space triangles that it describes.

Units are scene units and degrees, y is up. Paths are relative to the scene file. An unknown key, a missing file or a
bad value is one ``SceneError`` that names the file, the key's path, the value that was expected and the one given.
"""

import os
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, ValidationError, model_validator

from renderer.errors import MeshError, SceneError, expect
from renderer.lazy import lazy
from renderer.mesh.load import MESH_SUFFIXES, load_mesh
from renderer.mesh.mesh import Mesh
from renderer.scene.camera import OrthographicCamera, PerspectiveCamera, sample_offsets
from renderer.scene.fields import Color, Fields, FiniteVector, Keys, first_fault, shown, thrice
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.material import Material
from renderer.scene.showcase import showcase_text
from renderer.system.files import as_path, read_whole, write_atomically


def _typed(default: str) -> BeforeValidator:
    """Fill in ``type`` where a table leaves it out, so that the union's error names the right kind."""

    def fill(value: Any) -> Any:
        return {"type": default, **value} if isinstance(value, dict) else value

    return BeforeValidator(fill)


AnyCamera = Annotated[
    Annotated[PerspectiveCamera | OrthographicCamera, Field(discriminator="type")], _typed("perspective")
]
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
    """Defaults of ``render``; each can be given there instead.

    ``max_depth`` is the number of bounces: 0 shows what the eye sees directly. ``min_weight`` ends a ray whose
    largest weight is below it; it bounds no error when rays branch, because the cut ones may be many. Once a sample of
    a pixel has taken ``max_rays`` its surfaces leave no more rays, and ``render`` warns of the pixels that miss some:
    mirrors that halve their light, or glass in glass, may double the rays with each bounce. The default is more than
    full branching makes in ten bounces under three lights. Without ``shadows`` nothing hides a light from the surfaces
    that face it, and no shadow ray is traced.

    >>> from renderer import RenderSettings
    >>> RenderSettings(resolution=(640, 360), samples=4).max_depth
    6
    """

    resolution: tuple[_Pixels, _Pixels] = (512, 512)
    samples: Annotated[int, Field(le=65536, strict=True)] = 1
    max_depth: Annotated[int, Field(ge=0, le=64, strict=True)] = 6
    min_weight: Annotated[float, Field(ge=0.0, lt=1.0, strict=True)] = 0.0
    max_rays: Annotated[int, Field(ge=1, le=UNLIMITED_RAYS, strict=True)] = 16384
    shadows: Annotated[bool, Field(strict=True)] = True

    @model_validator(mode="after")
    def _square_samples(self) -> "RenderSettings":
        sample_offsets(self.samples)
        return self


def checked_settings(defaults: RenderSettings, given: dict[str, Any]) -> RenderSettings:
    """``defaults`` with the settings that are given, and not None, in their place, checked as a file's would be.

    Raises ``ValueError`` with one line that names the setting.
    """
    known = RenderSettings.model_fields
    for name in given:
        expect(name in known, "render", f"settings among {sorted(known)}", repr(name))
    values = {k: v for k, v in given.items() if v is not None}
    try:
        return RenderSettings.model_validate({**defaults.model_dump(), **values})
    except ValidationError as error:
        raise ValueError(first_fault(error)) from None


class SceneObject(Fields):
    """A mesh in the world: scaled, then turned about x, y and z (degrees, in this order), then moved.

    Its corners are float64 numbers, whatever those of its file are.

    >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject
    >>> from renderer.mesh.shapes import box
    >>> crate = SceneObject(mesh=box(), material="wood", scale=2, translate=(0, 1, 0))
    >>> eye = PerspectiveCamera(eye=(0, 2, 9), target=(0, 1, 0))
    >>> scene = Scene(camera=eye, materials={"wood": Phong()}, objects=[crate])
    >>> [corner.tolist() for corner in scene.instances[0].mesh.bounds]
    [[0.0, 1.0, 0.0], [2.0, 3.0, 2.0]]
    """

    mesh: Annotated[Path | Mesh, BeforeValidator(_path_or_mesh)]
    material: str
    normals: Literal["flat", "smooth"] = "flat"
    scale: Annotated[FiniteVector, BeforeValidator(thrice)] = (1.0, 1.0, 1.0)
    rotate: FiniteVector = (0.0, 0.0, 0.0)
    translate: FiniteVector = (0.0, 0.0, 0.0)

    def matrix(self) -> NDArray[np.float64]:
        """Object to world, (4, 4) float64.

        >>> from renderer import SceneObject
        >>> from renderer.mesh.shapes import box
        >>> SceneObject(mesh=box(), material="wood", rotate=(0, 90, 0), translate=(0, 1, 0)).matrix().round(12) + 0.0
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
    """The plane y = 0 cut to the rectangle from ``min`` to ``max`` (x, z), tiled with its materials in turn.

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

    @model_validator(mode="after")
    def _not_empty(self) -> "Floor":
        if not (np.isfinite([*self.min, *self.max]).all() and self.min[0] < self.max[0] and self.min[1] < self.max[1]):
            raise ValueError("expected finite min < max in x and z")
        return self


@dataclass(frozen=True)
class Instance:
    """One mesh in world space with its material's name; ``smooth`` asks for interpolated normals."""

    mesh: Mesh
    material: str
    smooth: bool

    @lazy
    def normals(self) -> NDArray[np.float64]:
        """The file's own vertex normals, or else the mean of the faces around each vertex, (V, 3) float64."""
        return self.mesh.normals if self.mesh.normals is not None else self.mesh.vertex_normals()


class Scene(Fields):
    """Everything that a picture needs. Read one with ``load_scene`` or build it from keyword arguments.

    >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, render
    >>> from renderer.mesh.shapes import icosphere
    >>> ball = SceneObject(mesh=icosphere(3), material="grey", normals="smooth")
    >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
    >>> scene = Scene(camera=eye, materials={"grey": Phong()}, objects=[ball], ambient=1, background=(0.2, 0.4, 1))
    >>> render(scene, resolution=(3, 3)).srgb[1].tolist()
    [[124, 170, 255], [231, 231, 231], [124, 170, 255]]
    """

    camera: AnyCamera
    materials: dict[str, AnyMaterial]
    lights: tuple[AnyLight, ...] = ()
    objects: tuple[SceneObject, ...] = ()
    floor: Floor | None = None
    ambient: Color = (0.0, 0.0, 0.0)
    background: Color = (0.0, 0.0, 0.0)
    render: RenderSettings = RenderSettings()

    @model_validator(mode="after")
    def _materials_exist(self) -> "Scene":
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
        """The world-space meshes: the objects in their order, then the floor's (one for each material).

        >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject
        >>> from renderer.mesh.shapes import icosphere
        >>> ball = SceneObject(mesh=icosphere(3), material="grey", normals="smooth")
        >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        >>> scene = Scene(camera=eye, materials={"grey": Phong()}, objects=[ball])
        >>> [(part.material, part.smooth, part.mesh.name) for part in scene.instances]
        [('grey', True, 'icosphere')]
        """
        placed = [
            Instance(_place(_loaded(o.mesh), o.matrix()), o.material, o.normals == "smooth") for o in self.objects
        ]
        if self.floor is not None:
            placed += [Instance(m, name, False) for m, name in _floor_meshes(self.floor)]
        return tuple(placed)

    def altered(self, **changes: object) -> "Scene":
        """A copy with other values of fields, by name, that shares the meshes: none is loaded or placed again.

        So a change of ``objects`` or ``floor`` has no effect. Values are not checked as those of a scene file are.

        >>> from renderer import load_scene
        >>> scene = load_scene("scenes/stairs.toml")
        >>> dark = scene.altered(lights=())
        >>> len(scene.lights), len(dark.lights), dark.instances is scene.instances
        (2, 0, True)
        """
        _ = self.instances  # cached, so that the copy has it too
        return self.model_copy(update=changes)


def load_scene(path: str | Path) -> Scene:
    """Read and check a scene file, and load its meshes; of a mesh file, the scene that ``showcase`` puts around it.

    Raises ``SceneError``.

    >>> from renderer import load_scene
    >>> scene = load_scene("scenes/stairs.toml")
    >>> scene.camera.type, sorted(scene.materials), len(scene.objects)
    ('orthographic', ['ground', 'stone'], 1)
    """
    path = _scene_path(path)
    if path.suffix.lower() in MESH_SUFFIXES:
        try:
            mesh = load_mesh(path)
        except MeshError as error:
            raise SceneError(str(error)) from None
        table = tomllib.loads(showcase_text(mesh, "model"))
        table["objects"][0]["mesh"] = mesh
        return _checked(table, path)
    return _checked(_table(path), path)


def mesh_files(path: str | Path) -> list[Path]:
    """The files of meshes that a scene file names, none of which is read. Raises ``SceneError`` for what is no TOML."""
    path = _scene_path(path)
    if path.suffix.lower() in MESH_SUFFIXES:
        return [path]
    return [path.parent / entry["mesh"] for entry in _mesh_entries(_table(path))]


def _scene_path(path: object) -> Path:
    try:
        return as_path("path", path)
    except ValueError as error:
        raise SceneError(str(error)) from None


def _table(path: Path) -> dict[str, Any]:
    """The content of a scene file."""
    try:
        return tomllib.loads(read_whole(path).decode("utf-8-sig"))
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # not only TOML's: bad UTF-8, too many digits
        raise SceneError(f"{path}: expected TOML, got a syntax error: {error}") from None


def _mesh_entries(table: dict[str, Any]) -> list[dict[str, Any]]:
    """The entries of objects, in a scene file's table, that name a file."""
    entries = table.get("objects") if isinstance(table.get("objects"), list) else []
    return [entry for entry in entries or [] if isinstance(entry, dict) and isinstance(entry.get("mesh"), str)]


def write_scene(mesh_file: str | Path, path: str | Path) -> None:
    """Write the scene that ``load_scene(mesh_file)`` gives as a scene file, to be changed at will.

    Raises ``ValueError`` unless ``path`` is that of a .toml file, and leads to no other kind.
    """
    mesh_file, path = as_path("mesh_file", mesh_file), as_path("path", path)
    target = Path(os.path.realpath(path))
    for name in (path, target):
        leads = "" if name == path else f", a link to {target}"
        expect(name.suffix.lower() == ".toml", "path", "a .toml file", f"{path}{leads}")
    # From beside the scene file as it is named, where ``load_scene`` looks, and not from where a link may lead.
    inside = os.path.relpath(mesh_file.resolve(), path.parent.resolve())
    is_text = inside.encode(errors="replace").decode() == inside
    expect(is_text, "mesh", "a name in UTF-8, as TOML has no other", ascii(inside))
    text = showcase_text(load_mesh(mesh_file), Path(inside).as_posix())
    write_atomically(path, lambda file: file.write(text.encode()))


def _checked(table: dict[str, Any], path: Path) -> Scene:
    """The scene in a file's table, whose meshes are loaded."""
    for entry in _mesh_entries(table):
        entry["mesh"] = path.parent / entry["mesh"]
    try:
        scene = Scene.model_validate(table)
    except ValidationError as error:
        raise SceneError(f"{path}: {first_fault(error, Scene._union_member)}") from None
    try:
        with np.errstate(all="ignore"):
            _ = scene.instances
    except MeshError as error:
        raise SceneError(f"{path}: objects: {' '.join(str(error).split())}") from None
    return scene


def _loaded(mesh: Path | Mesh) -> Mesh:
    return mesh if isinstance(mesh, Mesh) else load_mesh(mesh)


def _place(mesh: Mesh, matrix: NDArray[np.float64]) -> Mesh:
    """``mesh`` in the world, in float64 whatever its file holds; itself where it is not moved."""
    return mesh if np.array_equal(matrix, np.eye(4)) else mesh.transformed(matrix)


def _rotation(axis: int, degrees: float) -> NDArray[np.float64]:
    """Rotation matrix about a coordinate axis, counter-clockwise seen against it, (3, 3) float64."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    result = np.eye(3)
    result[i, i], result[i, j], result[j, i], result[j, j] = c, -s, s, c
    return result


def _floor_meshes(floor: Floor) -> list[tuple[Mesh, str]]:
    """The floor's squares as one mesh per material, facing up, with the squares' edges shared exactly."""
    nx, nz = floor.squares
    x = np.linspace(floor.min[0], floor.max[0], nx + 1)
    z = np.linspace(floor.min[1], floor.max[1], nz + 1)
    grid_z, grid_x = np.meshgrid(z, x, indexing="ij")
    vertices = np.stack([grid_x, np.zeros_like(grid_x), grid_z], axis=-1).reshape(-1, 3)
    row, column = (a.ravel() for a in np.meshgrid(np.arange(nz), np.arange(nx), indexing="ij"))
    a = row * (nx + 1) + column
    b, c, d = a + nx + 1, a + nx + 2, a + 1
    faces = np.stack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)], 1)
    # rule: floor-colour
    color = (row + column) % len(floor.materials)
    meshes = []
    for index, name in enumerate(floor.materials):
        chosen = faces[color == index].reshape(-1, 3)
        if len(chosen):
            meshes.append((Mesh(vertices, chosen.astype(np.int32), name="floor"), name))
    return meshes


__all__ = ["Floor", "Instance", "Material", "RenderSettings", "Scene", "SceneObject", "load_scene"]
