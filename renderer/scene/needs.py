"""The features that a picture needs, read off its scene; others are left out and cost nothing.

Left out are rays (reflected, refracted, shadow), memory (vertex normals, the media of a ray, lights that are dark) and
building (the tree over a handful of triangles). Kernel code is not, but for that of textures: a kernel compiled without
bounces, highlights and interpolated normals was 3.5 % faster on diffuse scenes (the median), too little for its own
compilation.
"""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import NamedTuple

from renderer.arguments.counts import count_argument
from renderer.errors import expect
from renderer.materials.appearance import Appearance
from renderer.materials.base import appearance_of
from renderer.materials.columns import CLEAR
from renderer.scene.instance import Instance
from renderer.scene.light import light_row
from renderer.scene.scene import Scene, kind_of

# The most faces for which no tree is built. Whole frames of boxes and spheres on a floor, one thread: to test all
# blocks took 0.72 of the time with a tree for 2 faces, 0.88 for 14, 0.89 for 22, 0.96 for 26, 1.06 to 1.10 for 38, 1.28
# for 50.
FEW_FACES = 24


@dataclass(frozen=True)
class Features:
    """The features that a picture needs. More of them, by ``dataclasses.replace``, change no bit of it.

    Attributes
    ----------
    reflection : bool
        Reflected rays.
    refraction : bool
        Refracted rays, and the media that each ray is in.
    shadows : bool
        Direct light, and shadow rays.
    specular : bool
        Highlights.
    smooth_normals : bool
        Interpolated normals.
    lights : int
        The number of lights that shine on something.
    float64_vertices : bool
        Vertices that float32 does not hold exactly.
    octree : bool
        A tree. Without it every ray is tested against every face.
    textures : bool
        Textures, colours of vertices, opacity and emission.

    Examples
    --------
    >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, needs_of
    >>> from renderer.mesh.shapes import icosphere
    >>> ball = SceneObject(mesh=icosphere(3), material="grey", normals="smooth")
    >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
    >>> scene = Scene(camera=eye, materials={"grey": Phong()}, objects=[ball])
    >>> needs = needs_of(scene)
    >>> needs.octree, needs.smooth_normals, needs.reflection
    (True, True, False)
    """

    reflection: bool
    refraction: bool
    shadows: bool
    specular: bool
    smooth_normals: bool
    lights: int
    float64_vertices: bool
    octree: bool
    textures: bool


# The public name.
Needs = Features


class Finding(NamedTuple):
    """One feature of ``Features``: its name, its value, and the reason."""

    feature: str
    value: bool | int
    reason: str


def examine(scene: Scene, max_depth: int | None = None) -> tuple[Finding, ...]:
    """The features that a picture of ``scene`` with ``max_depth`` bounces (the scene's own by default) needs, each with
    its reason, in the order of the fields of ``Features``.

    Only the materials of faces count: one that no face has is not needed.
    """
    depth = scene.render.max_depth if max_depth is None else max_depth
    present = _present(scene)
    used = {i.material: appearance_of(scene.materials[i.material]) for i in present}
    # rule: shining-lights
    shining = sum(any(light_row(light)[4:]) for light in scene.all_lights)
    faces = sum(i.faces for i in present)
    receiving = _lit("shadows", "receives direct light", shining, (n for n, m in used.items() if m.receives_light))
    return (
        _bounce("reflection", "reflects", depth, (n for n, m in used.items() if any(m.reflectance))),
        _bounce("refraction", "lets light through", depth, (n for n, m in used.items() if m.passes_light)),
        receiving,
        _lit("specular", "has highlights", shining, (n for n, m in used.items() if any(m.specular))),
        _smooth(present),
        _lights(receiving, shining, len(scene.all_lights)),
        _precision(present),
        Finding("octree", faces > FEW_FACES, f"{faces} faces, and a tree pays above {FEW_FACES}"),
        _finding("textures", "has textures, opacity or emission", (n for n, m in used.items() if not m.is_plain)),
    )


def needs_of(scene: Scene, max_depth: int | None = None) -> Features:
    """The features that a picture of a scene needs.

    Parameters
    ----------
    scene : Scene
        The scene.
    max_depth : int, optional
        The number of bounces, by default the scene's own.

    Returns
    -------
    Needs

    Raises
    ------
    ValueError
        For a bad argument, which the message names.

    Examples
    --------
    >>> from renderer import PerspectiveCamera, Scene, needs_of
    >>> empty = Scene(camera=PerspectiveCamera(eye=(0, 0, 1), target=(0, 0, 0)), materials={})
    >>> needs_of(empty).shadows
    False
    """
    expect(isinstance(scene, Scene), "scene", "a Scene", kind_of(scene))
    if max_depth is not None:
        count_argument("max_depth", max_depth, alternative=" or None")
    return features_of(examine(scene, max_depth))


def features_of(findings: tuple[Finding, ...]) -> Features:
    """The features that ``examine`` found."""
    return Features(**{f.feature: f.value for f in findings})  # type: ignore[arg-type]


def checked_needs(needs: Features | None, scene: Scene, max_depth: int) -> Features:
    """``needs`` if it has all that the picture needs, or what it needs for None. Raises ``ValueError`` otherwise."""
    findings = examine(scene, max_depth)
    if needs is None:
        return features_of(findings)
    expect(isinstance(needs, Features), "needs", "a Needs or None", type(needs).__name__)
    for finding, (name, given) in zip(findings, asdict(needs).items(), strict=True):
        if name == "lights":
            count_argument("needs.lights", given, int(finding.value), len(scene.all_lights))
        else:
            expect(isinstance(given, bool), f"needs.{name}", "True or False", repr(given))
            expect(given or not finding.value, f"needs.{name}", f"True ({finding.reason})", "False")
    return needs


def lit_materials(scene: Scene) -> list[Appearance]:
    """The materials of faces that may reflect the light of lights, none where no light shines."""
    if not any(any(light_row(light)[4:]) for light in scene.all_lights):
        return []
    used = (appearance_of(scene.materials[i.material]) for i in _present(scene))
    return [appearance for appearance in used if appearance.kind != CLEAR]


def _present(scene: Scene) -> list[Instance]:
    """The instances that have faces."""
    return [i for i in scene.instances if i.faces]


def _bounce(feature: str, does: str, depth: int, names: Iterable[str]) -> Finding:
    found = _finding(feature, does, names)
    return Finding(feature, False, "max_depth is 0") if found.value and depth == 0 else found


def _lit(feature: str, does: str, shining: int, names: Iterable[str]) -> Finding:
    return _finding(feature, does, names) if shining else Finding(feature, False, "no light shines")


def _finding(feature: str, does: str, names: Iterable[str]) -> Finding:
    """The first of the materials ``names`` is the reason; without any the feature is not needed."""
    name = next(iter(names), None)
    return Finding(feature, name is not None, f"no material {does}" if name is None else f"material {name!r} {does}")


def _lights(receiving: Finding, shining: int, count: int) -> Finding:
    if not receiving.value:
        return Finding("lights", 0, receiving.reason)
    return Finding("lights", shining, f"{shining} of {count} lights shine")


def _smooth(present: list[Instance]) -> Finding:
    count = sum(i.smooth for i in present)
    reason = f"{count} of {len(present)} meshes are smooth" if count else "every mesh is flat"
    return Finding("smooth_normals", count > 0, reason)


def _precision(present: list[Instance]) -> Finding:
    count = sum(not i.is_float32 for i in present)
    reason = f"float32 does not hold the vertices of {count} meshes" if count else "float32 holds every vertex exactly"
    return Finding("float64_vertices", count > 0, reason)


__all__ = ["FEW_FACES", "Features", "Finding", "checked_needs", "examine", "needs_of"]
