"""Files of a lit scene: a scene file with its meshes, and one mesh with colours for other programs."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.fields import Fields
from renderer.arguments.up import turn_to
from renderer.errors import expect
from renderer.materials.base import appearance_of
from renderer.mesh.load import save_ply
from renderer.mesh.mesh import Mesh
from renderer.mesh.ply import by_name, format_columns, vertex_columns
from renderer.mesh.texture import Texture
from renderer.picture.exposure import exposed
from renderer.picture.image import srgb
from renderer.scene.scene import Scene
from renderer.system.files import as_path, write_atomically

LIT_FORMATS = (".toml", ".ply", ".glb")
# Of glTF: the types of components and of chunks, and what buffers are for.
_FLOAT, _UINT, _JSON, _BINARY, _VERTICES, _FACES = 5126, 5125, 0x4E4F534A, 0x004E4942, 34962, 34963


def save_lit(scene: Scene, path: str | os.PathLike[str], *, exposure: float = 0.0) -> list[Path]:
    """Write a scene that `lit_scene` returned.

    Parameters
    ----------
    scene : Scene
    path : path
        ``.toml``: a scene file, and beside it a PLY file for each object, with linear colours as floats. It shows what
        ``scene`` shows. ``.ply`` and ``.glb``: one mesh with a colour at each vertex for other programs, whose mirrors
        and glass are black; sRGB in PLY, and linear without lighting in glTF.
    exposure : float, default 0
        In stops, for ``.ply`` and ``.glb``: radiances are multiplied by 2^exposure. What is 1 or more then is white.

    Returns
    -------
    list of Path
        The files that were written, ``path`` first.

    Raises
    ------
    ValueError
        For another suffix, and for textures that are no files.
    OSError
        If a file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, load_mesh, shapes
    >>> from renderer.radiosity import lit_scene, save_lit
    >>> eye = PerspectiveCamera(eye=(0, 9, 9), target=(0, 0, 0))
    >>> ground = SceneObject(mesh=shapes.grid(), material="clay")
    >>> scene = Scene(camera=eye, materials={"clay": Phong(diffuse=0.5)}, objects=[ground], background=0.8)
    >>> with TemporaryDirectory() as folder:
    ...     names = [path.name for path in save_lit(lit_scene(scene, 0.5), f"{folder}/lit.ply")]
    ...     mesh = load_mesh(f"{folder}/lit.ply")
    >>> names, None if mesh.colors is None else (255 * mesh.colors[0]).round().tolist()  # sRGB of 0.4
    (['lit.ply'], [170.0, 170.0, 170.0])
    """
    target = as_path("path", path)
    suffix = target.suffix.lower()
    expect(suffix in LIT_FORMATS, "path", f"a file name that ends in {', '.join(LIT_FORMATS)}", repr(str(path)))
    if suffix == ".toml":
        return _save_scene(scene, target)
    mesh, radiance = _whole(scene)
    bright = exposed(radiance.astype(np.float32), exposure)
    content = _ply(mesh, srgb(bright)) if suffix == ".ply" else _glb(mesh, np.clip(bright, 0.0, 1.0), scene.up)
    write_atomically(target, lambda file: file.write(content))
    return [target]


def lit_files(path: Path, objects: int) -> list[Path]:
    """The files that `save_lit` writes of a scene of so many objects."""
    if path.suffix.lower() != ".toml":
        return [path]
    return [path, *(path.with_name(f"{path.stem}-{number}.ply") for number in range(objects))]


def _whole(scene: Scene) -> tuple[Mesh, NDArray[np.float64]]:
    """All meshes as one, and the radiance at its vertices (V, 3); black where a material has no colours of vertices."""
    meshes = [Mesh(instance.mesh.vertices, instance.mesh.faces) for instance in scene.instances]
    radiance = [np.zeros((len(mesh.vertices), 3)) for mesh in meshes]
    for instance, rows in zip(scene.instances, radiance, strict=True):
        look, colors = appearance_of(scene.materials[instance.material]), instance.mesh.colors
        if colors is not None and look.vertex_colors == "linear":
            rows += colors * np.array(look.emission)
    return Mesh.concatenate(meshes), np.concatenate(radiance)


def _ply(mesh: Mesh, colors: NDArray[np.uint8]) -> bytes:
    return format_columns(vertex_columns(mesh) | by_name(("red", "green", "blue"), colors), mesh.faces)


def _glb(mesh: Mesh, colors: NDArray[np.floating], up: str) -> bytes:
    """A binary glTF file (Khronos, glTF 2.0) of one mesh without lighting; y is up in glTF."""
    turn = turn_to("y") @ turn_to(up).T
    points = (mesh.vertices @ turn.T).astype("<f4")
    arrays = [points, colors.astype("<f4"), mesh.faces.astype("<u4")]
    starts = np.cumsum([0, *(array.nbytes for array in arrays)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": array.nbytes, "target": of}
        for start, array, of in zip(starts[:-1], arrays, (_VERTICES, _VERTICES, _FACES), strict=True)
    ]
    bounds = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    accessors = [
        {"bufferView": 0, "componentType": _FLOAT, "count": len(points), "type": "VEC3", **bounds},
        {"bufferView": 1, "componentType": _FLOAT, "count": len(points), "type": "VEC3"},
        {"bufferView": 2, "componentType": _UINT, "count": 3 * len(mesh.faces), "type": "SCALAR"},
    ]
    primitive = {"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0}
    document = {
        "asset": {"version": "2.0", "generator": "octree-renderer"},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}],
        "materials": [{"extensions": {"KHR_materials_unlit": {}}}], "extensionsUsed": ["KHR_materials_unlit"],
        "buffers": [{"byteLength": starts[-1]}], "bufferViews": views, "accessors": accessors,
    }  # fmt: skip
    text = json.dumps(document).encode()
    chunks = [(_JSON, text + b" " * (-len(text) % 4)), (_BINARY, b"".join(array.tobytes() for array in arrays))]
    body = b"".join(struct.pack("<2I", len(content), kind) + content for kind, content in chunks)
    return struct.pack("<4s2I", b"glTF", 2, 12 + len(body)) + body


def _save_scene(scene: Scene, target: Path) -> list[Path]:
    """Write a scene file, and the meshes of its objects beside it."""
    lines = [f'up = "{scene.up}"', f"background = {_value(scene.background)}", ""]
    lines = [line for line in lines if scene.sky is None or not line.startswith("background")]
    lines += _table("[camera]", scene.camera) + ([] if scene.sky is None else _table("[sky]", scene.sky))
    settings = scene.render.model_dump(mode="json", exclude_unset=True)  # cameras may have a resolution of their own
    lines += ["[render]", *_entries(settings.items()), ""]
    for name, material in scene.materials.items():
        lines += _table(f"[materials.{_value(name)}]", material, target.parent)
    files = lit_files(target, len(scene.objects))
    for thing, instance, file in zip(scene.objects, scene.instances, files[1:], strict=True):
        save_ply(instance.mesh, file)
        shown = {"mesh": file.name, "material": thing.material, "normals": thing.normals}
        lines += ["[[objects]]", *_entries(shown.items()), ""]
    write_atomically(target, lambda file: file.write("\n".join(lines).encode()))
    return files


def _table(head: str, fields: Fields, folder: Path | None = None) -> list[str]:
    """The lines of a table of a scene file: the fields that are set, textures by their files."""
    values = {key: getattr(fields, key) for key in type(fields).model_fields}
    plain = fields.model_dump(mode="json", exclude={key for key, value in values.items() if isinstance(value, Texture)})
    shown = {key: value for key, value in plain.items() if value is not None}
    maps = {key: value for key, value in values.items() if isinstance(value, Texture)}
    textures = [f"{key} = {_texture(key, texture, folder)}" for key, texture in maps.items()]
    return [head, *_entries(shown.items()), *textures, ""]


def _texture(key: str, texture: Texture, folder: Path | None) -> str:
    source = texture.image.source
    expect(isinstance(source, Path) and folder is not None, key, "a texture of a file", repr(texture.image))
    named = Path(os.path.relpath(Path(str(source)).resolve(), Path(str(folder)).resolve())).as_posix()
    parts: dict[str, Any] = {
        "image": named, "transform": texture.transform, "wrap": texture.wrap, "filter": texture.filter,
        "strength": texture.strength,
    }  # fmt: skip
    return f"{{{', '.join(_entries(parts.items()))}}}"


def _entries(items: Iterable[tuple[str, Any]]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in items]


def _value(value: object) -> str:
    """Numbers, words and lists in the forms that TOML shares with JSON."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
