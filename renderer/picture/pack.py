"""A scene's instances merged into the arrays that the Whitted kernel reads, and the mesh that the tree is built on."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.inside.rational import crossings_of, winding_of
from renderer.materials.base import appearance_of
from renderer.materials.columns import KIND, LAMBERT, MATERIAL_COLUMNS, PHONG, UNLIT
from renderer.mesh.mesh import Mesh
from renderer.picture.maps import Maps, maps_of, texcoords_of, tints_of
from renderer.scene.camera import Camera
from renderer.scene.light import light_row
from renderer.scene.needs import Features, lit_materials, needs_of
from renderer.scene.scene import Scene
from renderer.scene.sky import sky_rows
from renderer.shade.records import LIGHT_COLUMNS, MAP_COLUMNS
from renderer.shade.surface import MAX_MEDIA, SceneArrays


def pack(scene: Scene, needs: Features | None = None) -> tuple[Mesh, SceneArrays]:
    """The merged mesh of all instances in their order, and everything else that the kernel reads.

    Arrays that ``needs`` does not name are left empty; for None, those that the scene does not need; and ``touching``,
    which ``touching.touching_faces`` makes.
    """
    needs = needs_of(scene) if needs is None else needs
    instances = scene.instances
    starts = np.cumsum([0] + [len(i.mesh.vertices) for i in instances])
    if instances:
        vertices = np.concatenate([i.mesh.vertices for i in instances])
        faces = np.concatenate([i.mesh.faces + np.int32(s) for i, s in zip(instances, starts, strict=False)])
    else:
        vertices, faces = np.zeros((0, 3)), np.zeros((0, 3), np.int32)
    counts = [i.faces for i in instances]
    mesh, lit = Mesh(vertices, faces), without_faces(scene, needs)
    arrays = lit._replace(
        vertices=mesh.vertices,
        normals=_normals(scene, len(vertices)) if needs.smooth_normals else np.zeros((0, 3)),
        faces=mesh.faces,
        material=np.repeat(lit.material, counts),
        smooth=np.repeat(lit.smooth, counts if len(lit.smooth) else 0),
    )
    if needs.textures:
        looks = [(i, i.mesh, appearance_of(scene.materials[i.material])) for i in instances]
        texcoords = np.concatenate([np.zeros((0, 2)), *(texcoords_of(*look) for look in looks)])
        tints = np.concatenate([np.zeros((0, 3)), *(tints_of(*look) for look in looks)])
        arrays = arrays._replace(texcoords=texcoords, tints=tints)
    return mesh, arrays


def without_faces(scene: Scene, needs: Features) -> SceneArrays:
    """The kernel's arrays other than the faces, with a row of ``material`` and ``smooth`` for each instance."""
    rows = _material_rows(scene)
    return SceneArrays(
        vertices=np.zeros((0, 3)),
        normals=np.zeros((0, 3)),
        faces=np.zeros((0, 3), np.int32),
        placed=np.zeros(0, np.int64),
        material=np.array([rows[i.material] for i in scene.instances], np.int32),
        smooth=np.array([i.smooth for i in scene.instances if needs.smooth_normals], np.bool_),
        materials=_materials(scene, needs),
        **_maps(scene, needs),
        texcoords=np.zeros((0, 2)),
        tints=np.zeros((0, 3)),
        lights=light_rows(scene, needs),
        colors=_colors(scene),
        sky=sky_rows(scene.sky, scene.up),
        media=media_around(scene, scene.camera) if needs.refraction else np.zeros(0, np.int64),
        touching=np.zeros(0, np.uint8),
        soft=scene.render.terminator == "soft",
        clear=scene.render.glass_shadows == "clear",
    )


def _maps(scene: Scene, needs: Features) -> dict[str, Any]:
    """The fields of ``SceneArrays`` that only pictures with textures fill."""
    if not needs.textures:
        return Maps(np.zeros((0, MAP_COLUMNS)), np.zeros(0, np.int64), np.zeros(0, np.float32))._asdict()
    looks = [appearance_of(material) for material in scene.materials.values()]
    return maps_of(looks)._asdict() | {"holes": any(look.cutoff > 0.0 for look in looks)}


def repacked(arrays: SceneArrays, scene: Scene, needs: Features) -> SceneArrays:
    """``arrays`` with the materials and all light of ``scene``, which has the meshes that they were packed of, and as
    many materials of the same names.
    """
    media = media_around(scene, scene.camera) if needs.refraction else np.zeros(0, np.int64)
    return arrays._replace(
        materials=_materials(scene, needs),
        **_maps(scene, needs),
        lights=light_rows(scene, needs),
        colors=_colors(scene),
        sky=sky_rows(scene.sky, scene.up),
        media=media,
    )


def _colors(scene: Scene) -> NDArray[np.float64]:
    return np.array([scene.ambient, scene.background])


def _materials(scene: Scene, needs: Features) -> NDArray[np.float64]:
    """The rows of the materials, of kinds that have all that ``needs`` names, whether the scene needs it or not."""
    rows = np.array([appearance_of(m).row() for m in scene.materials.values()]).reshape(-1, MATERIAL_COLUMNS)
    kinds, lit = rows[:, KIND], {appearance.kind for appearance in lit_materials(scene)}
    if needs.shadows and lit <= {UNLIT}:
        kinds[kinds == UNLIT] = LAMBERT
    if needs.specular and PHONG not in lit:
        kinds[kinds == LAMBERT] = PHONG
    return rows


def light_rows(scene: Scene, needs: Features) -> NDArray[np.float64]:
    """The rows of the lights that shine, and of as many others as ``needs`` asks for, in the scene's order."""
    if not needs.shadows:
        return np.zeros((0, LIGHT_COLUMNS))
    rows = np.array([light_row(light) for light in scene.all_lights]).reshape(-1, LIGHT_COLUMNS)
    dark = ~rows[:, 4:].any(axis=1)
    extra = np.cumsum(dark) <= needs.lights - np.count_nonzero(~dark)
    return rows[~dark | (dark & extra)]


def _material_rows(scene: Scene) -> dict[str, int]:
    """The place of each material's row in the flat array of materials, by name."""
    return {name: i * MATERIAL_COLUMNS for i, name in enumerate(scene.materials)}


def media_around(scene: Scene, camera: Camera) -> NDArray[np.int64]:
    """Materials of the closed, light-passing meshes around the camera's eye, outermost (by volume) first."""
    rows, around, eye = _material_rows(scene), list[tuple[float, int]](), np.array(camera.eye)
    for instance in scene.instances:
        if not (scene.materials[instance.material].passes_light and instance.may_contain(eye)):
            continue
        mesh = instance.placed()
        if _is_inside(mesh, eye):
            p0, p1, p2 = mesh.triangles.transpose(1, 0, 2)
            with np.errstate(over="ignore", invalid="ignore"):  # such sizes are refused when the tree is built
                volume = abs(np.einsum("nk,nk->", p0, np.cross(p1, p2)))
            around.append((volume, rows[instance.material]))
    # rule: media-by-volume
    return np.array([row for _, row in sorted(around, reverse=True)][:MAX_MEDIA], np.int64)


def _is_inside(mesh: Mesh, point: NDArray[np.float64]) -> bool:
    """Whether the winding number of ``mesh`` around ``point`` is above 1/2.

    A point on the surface is outside: rays from there into the mesh enter it, and others leave what they were never in.
    """
    lower, upper = mesh.bounds
    if (np.less(point, lower) | np.greater(point, upper)).any():
        return False
    _, on = crossings_of(point, mesh.triangles, 0)
    return not on and winding_of(point, mesh.triangles) > 0.5


def _normals(scene: Scene, count: int) -> NDArray[np.float64]:
    """Vertex normals, (V, 3): those of the smooth instances, or of all where none is."""
    flat_too = not any(i.smooth for i in scene.instances)
    normals = np.zeros((count, 3))
    start = 0
    for instance in scene.instances:
        end = start + len(instance.mesh.vertices)
        if instance.smooth or flat_too:
            normals[start:end] = instance.normals
        start = end
    return normals
