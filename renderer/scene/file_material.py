"""The looks that a mesh file gives its faces, as materials of scenes."""

from __future__ import annotations

import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from renderer.arguments.fields import SceneWarning
from renderer.materials.base import appearance_of
from renderer.materials.dielectric import Dielectric
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.load import load_mesh, mesh_suffix
from renderer.mesh.material import MeshMaterial
from renderer.mesh.mesh import Mesh
from renderer.mesh.texture import Texture
from renderer.mesh.texture_image import TextureImage, value_of_one

Space = Literal["linear", "srgb"]

# Light that a surface of glass or plastic mirrors straight on, of an index of refraction of 1.5.
_STRAIGHT = 0.04
# Rougher surfaces mirror no picture; and the largest exponent of highlights.
_BLURRED, _SHARPEST = 0.25, 10_000.0
# What of a file's material pictures do not show.
_NOT_SHOWN = ("occlusion_texture", "bump_texture")


class Part(NamedTuple):
    """The faces of a mesh with one material: a mesh of their own, and the material with its name."""

    mesh: Mesh
    name: str
    material: Material


def space_of(file: Path) -> Space:
    """The space of colours of vertices in a mesh file: linear in glTF, and sRGB in others."""
    return "linear" if mesh_suffix(file) in (".glb", ".gltf") else "srgb"


def with_own_materials(table: dict[str, Any]) -> dict[str, Any]:
    """The keywords of a ``Scene`` with an object for each material of a mesh whose object names none, and with these
    materials. Raises ``MeshError`` for a file that cannot be read.

    A table of an object may have the ``space`` of its mesh.
    """
    given = table.get("objects")
    if not isinstance(given, list | tuple) or all(_has_material(each) for each in given):
        return table
    materials, objects, known = dict(table.get("materials") or {}), list[Any](), dict[Any, list[Part]]()
    names = Counter[str]()
    for each in given:
        if _has_material(each):
            objects.append(each)
            continue
        # The fields of an object that was made in Python, or the keys of its table.
        entry = dict(each) if isinstance(each, dict) else {name: getattr(each, name) for name in each.model_fields_set}
        space, mesh = entry.pop("space", None), entry["mesh"]
        # Objects of one mesh share its parts.
        which = (
            id(mesh) if isinstance(mesh, Mesh) else Path(mesh),
            *(repr(entry.get(k)) for k in ("normals", "crease")),
        )
        if which not in known:
            known[which] = [_named_in(materials, names, part) for part in _parts_of_entry(entry, space)]
        objects += [{**entry, "mesh": part.mesh, "material": part.name} for part in known[which]]
    return {**table, "materials": materials, "objects": objects}


def _named_in(materials: dict[str, Any], names: Counter[str], part: Part) -> Part:
    """The part, whose material is then among ``materials`` by a name of its own; ``names`` counts those that recur."""
    name = part.name
    while materials.setdefault(name, part.material) != part.material:
        names[part.name] += 1
        name = f"{part.name} {names[part.name] + 1}"
    return part._replace(name=name)


def _has_material(entry: Any) -> bool:
    """Whether an object names a material, or is none at all."""
    mesh = entry.get("mesh") if isinstance(entry, dict) else getattr(entry, "mesh", None)
    named = entry.get("material") if isinstance(entry, dict) else getattr(entry, "material", None)
    return named is not None or not isinstance(mesh, Mesh | Path | str)


def _parts_of_entry(entry: dict[str, Any], space: Space | None) -> list[Part]:
    """The parts of the mesh of an object that names no material."""
    given = entry["mesh"]
    mesh = given if isinstance(given, Mesh) else load_mesh(given)
    if space is None:
        space = "srgb" if isinstance(given, Mesh) else space_of(Path(given))
    left_out = not_shown(mesh)
    if left_out:
        warnings.warn(f"pictures do not show {', '.join(left_out)} of {mesh.name}", SceneWarning, stacklevel=6)
    crease = entry.get("crease", 180.0)
    return parts_of_file(
        mesh, space, entry.get("normals") == "smooth", crease if isinstance(crease, int | float) else 180.0
    )


def parts_of_file(mesh: Mesh, space: Space, smooth: bool, crease: float) -> list[Part]:
    """The parts of a mesh by its own materials, in their order, faces without a material first.

    ``space`` is that of the colours of vertices. Normals of ``smooth`` parts are those of the whole.
    """
    colors = space if mesh.colors is not None else None
    rows = np.full(len(mesh.faces), -1) if mesh.face_materials is None else mesh.face_materials
    present, counts = np.unique(rows, return_counts=True)
    whole = mesh.creased(crease) if smooth and mesh.normals is None and len(present) > 1 else mesh
    chosen = np.split(np.argsort(rows, kind="stable"), np.cumsum(counts)[:-1])
    parts = []
    for row, faces in zip(present.tolist() or [-1], chosen, strict=True):
        own = mesh.materials[row] if row >= 0 else None
        name = f"{mesh.name or 'mesh'}: {own.name or row}" if own else f"{mesh.name or 'mesh'}: plain"
        part = whole if len(present) <= 1 else _of_faces(whole, faces)
        look = material_of(own, colors) if own else Phong(diffuse=1.0 if colors else 0.8, vertex_colors=colors)
        parts.append(Part(part, name, look if mesh.texcoords is not None else _without_maps(look)))
    return parts


def _without_maps(look: Material) -> Material:
    """A material for a mesh without texture coordinates."""
    maps = appearance_of(look).textures
    return look.model_copy(update=dict.fromkeys(maps)) if maps else look


def not_shown(mesh: Mesh) -> list[str]:
    """The names of what the materials of a mesh have and pictures do not show."""
    found = {name for material in mesh.materials for name in material.textures}
    shown = set() if mesh.texcoords is None else found - set(_NOT_SHOWN)
    return sorted(name.removesuffix("_texture") for name in found - shown)


def _of_faces(mesh: Mesh, chosen: Any) -> Mesh:
    """The mesh of some faces, with their vertices alone."""
    used, faces = np.unique(mesh.faces[chosen], return_inverse=True)
    normals, colors, texcoords = (None if a is None else a[used] for a in (mesh.normals, mesh.colors, mesh.texcoords))
    return Mesh(mesh.vertices[used], faces.reshape(-1, 3), normals, colors, texcoords, mesh.name)


def material_of(own: MeshMaterial, colors: Space | None = None) -> Material:
    """The material of a scene that comes nearest to one of a file; ``colors`` of vertices multiply its base colour.

    Metal returns light in its base colour: evenly the share of its roughness, as pictures mirror nothing blurred, and
    the rest in highlights and mirrored. Other surfaces mirror 0.04. Highlights have the exponent 2 / roughness^4 - 2,
    and the height at which they return as much light. Surfaces smoother than 0.25 also mirror what is around. Textures
    of metal, roughness and transmission count by their means. What transmits at least half is glass, unless it
    has textures, colours of vertices or emission.
    """
    shared: dict[str, Any] = {"normal_map": own.normal_texture, "vertex_colors": colors, **_opacity(own)}
    base, texture = own.base_color, own.base_color_texture
    # rule: unlit-file
    if own.unlit:
        return Phong(diffuse=0.0, emission=base, emission_map=texture, **shared)
    metallic = own.metallic * _mean(own.metallic_roughness_texture, 2)
    roughness = own.roughness * _mean(own.metallic_roughness_texture, 1)
    through = own.transmission * _mean(own.transmission_texture, 0)
    if through >= 0.5 and not (texture or own.normal_texture or colors or any(own.emissive)):
        return Dielectric(ior=own.ior, transmittance=np.multiply(own.transmission_color, through))
    # rule: mirrored-by-metal
    straight = _STRAIGHT * (1.0 - metallic) + np.multiply(base, metallic * (1.0 - roughness))
    # Highlights of metal have the colours of its texture; others are white.
    of_metal = texture if metallic >= 0.5 else None
    exponent = min(max(2.0 / max(roughness, 0.01) ** 4 - 2.0, 0.0), _SHARPEST)
    specular = np.minimum(straight * (exponent + 2.0) / 2.0, 1.0)
    mirrored = straight * max(1.0 - roughness / _BLURRED, 0.0)
    if own.specular is not None:
        specular = np.minimum(own.specular, 1.0)
        exponent = 32.0 if own.shininess is None else own.shininess
        mirrored = specular if own.mirror else np.zeros(3)
    return Phong(
        diffuse=np.multiply(base, (1.0 - metallic * (1.0 - roughness)) * (1.0 - through)),
        diffuse_map=texture,
        specular=specular,
        specular_map=of_metal if own.specular is None else own.specular_texture,
        shininess=exponent,
        reflectance=np.minimum(mirrored, 1.0),
        reflectance_map=of_metal,
        transmittance=np.multiply(own.transmission_color, through),
        transmittance_map=texture if through > 0.0 else None,
        ior=own.ior,
        emission=own.emissive,
        emission_map=own.emissive_texture,
        **shared,
    )


def _mean(texture: Texture | None, channel: int) -> float:
    """The mean of a channel of a texture, from 0 to 1, of a grey one its grey; 1 for none."""
    if texture is None:
        return 1.0
    pixels = texture.image.pixels
    values = pixels[..., channel if pixels.shape[2] >= 3 else 0]
    return min(max(float(values.mean(dtype=np.float64)) / value_of_one(pixels), 0.0), 1.0)


def _opacity(own: MeshMaterial) -> dict[str, Any]:
    """The fields of opacity by the mode of a file's alpha."""
    # rule: opaque-file
    if own.alpha_mode == "opaque" or (own.alpha_mode == "mask" and own.alpha_cutoff == 0.0):
        return {}
    # rule: cutoff-of-file
    cutoff = own.alpha_cutoff if own.alpha_mode == "mask" else 0.0
    return {"opacity": own.alpha, "cutoff": cutoff, "opacity_map": _alpha_map(own)}


def _alpha_map(own: MeshMaterial) -> Texture | None:
    """The texture whose alpha is the opacity."""
    if own.alpha_texture is not None:
        pixels = own.alpha_texture.image.pixels
        if pixels.shape[2] == 3:  # its grey
            grey = pixels.mean(axis=2) / value_of_one(pixels)
            return replace(own.alpha_texture, image=TextureImage(grey.astype(np.float32)))
        return own.alpha_texture
    texture = own.base_color_texture
    return texture if texture is not None and texture.image.pixels.shape[2] in (2, 4) else None
