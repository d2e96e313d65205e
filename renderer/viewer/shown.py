"""A scene on show: prepared once for its connections, and varied by the settings of their panels."""

import tomllib
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from secrets import token_hex
from typing import Literal, NamedTuple

from renderer.arguments.split import SPLIT
from renderer.errors import expect
from renderer.lazy import lazy
from renderer.materials.columns import REFLECTANCE, TRANSMITTANCE
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.picture.pack import light_rows, repacked
from renderer.picture.prepare import PreparedScene, build_octree, prepare_scene, tree_for
from renderer.precompile import touch_viewing
from renderer.scene.change import surroundings
from renderer.scene.hide import is_side, object_names, without
from renderer.scene.needs import Features, needs_of
from renderer.scene.scene import RenderSettings, Scene, load_scene, mesh_files
from renderer.scene.vectors import unit
from renderer.shade.records import DIRECTIONAL
from renderer.shade.surface import SceneArrays
from renderer.system.files import is_special
from renderer.system.threads import available_threads
from renderer.trace.spawn import BOUNDED
from renderer.viewer.protocol import Edits, ViewSettings
from renderer.viewer.viewpoint import page_camera

# The most bytes of a file that may be a saved camera alone: the viewer writes some 300, and 150 for each light.
_CAMERA_BYTES = 16384
# Fields of materials that the page does not show.
UNSEEN = (
    *("emission", "opacity", "cutoff", "vertex_colors"),
    *(name for name in Phong.model_fields if name.endswith("_map")),
)


class _Mark(NamedTuple):
    """The state of a file, by which edits show: the time of its last change in ns, its bytes, and its inode."""

    changed: int
    size: int
    number: int


@dataclass(frozen=True, eq=False)
class ShownScene:
    """The scene as the page shows it.

    path      the scene file, or None for a scene made in Python
    prepared  the scene over its octree, ready for any number of bounces
    marks     the files that it was loaded from, as they were then
    up        the axis that was given for a mesh file, else None
    id        what tells it from every other scene, also from the same file loaded anew or by another server
    hidden    the objects that are left out, by name, and sides of planes
    all       the scene with all objects where some are hidden, else None
    """

    scene: Scene
    path: Path | None
    prepared: PreparedScene
    threads: int
    marks: dict[Path, _Mark | None] = field(default_factory=dict)
    id: str = field(default_factory=lambda: token_hex(8))
    hidden: tuple[str, ...] = ()
    all: "ShownScene | None" = None
    up: Literal["x", "y", "z"] | None = None

    @property
    def whole(self) -> "ShownScene":
        """The scene with all its objects."""
        return self.all or self

    @property
    def name(self) -> str:
        """The scene file's name; what is no text in it, as Linux allows it, is replaced."""
        return self.path.name.encode(errors="replace").decode() if self.path else "scene"

    @property
    def files(self) -> list[str]:
        """The scene files that may be opened: this one and those beside it, but for pipes and devices, names that are
        no text and files of a camera without a scene, as the viewer saves them.
        """
        if self.path is None:
            return []
        beside = {path.name for path in self.path.parent.glob("*.toml") if not (is_special(path) or _is_camera(path))}
        return sorted(name for name in beside | {self.path.name} if name.encode(errors="replace").decode() == name)

    @property
    def edited(self) -> bool:
        """Whether a file that it was loaded from has changed since."""
        return self.marks_now() != self.marks

    def marks_now(self) -> dict[Path, _Mark | None]:
        """The marks of the files that it was loaded from, as they are now."""
        return _marks(self.marks)

    def beside(self, file: str) -> Path:
        """The path of one of ``files``. Raises ``ValueError`` for any other."""
        files = self.files
        expect(self.path is not None and file in files, "scene.file", f"one of {files}", repr(file))
        assert self.path is not None  # which mypy cannot tell
        return self.path.parent / file

    @lazy
    def brute(self) -> PreparedScene:
        """The same scene with every ray tested against every face."""
        octree = build_octree(self.prepared.mesh, "brute", SPLIT, self.prepared.needs, self.threads)
        return replace(self.prepared, built=octree, tree=tree_for(octree, self.prepared.needs))


def _marks(paths: Iterable[Path]) -> dict[Path, _Mark | None]:
    """The marks of files; None of one that is not there."""
    return {path: _mark(path) for path in paths}


def _mark(path: Path) -> _Mark | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return _Mark(found.st_mtime_ns, found.st_size, found.st_ino)


def _is_camera(path: Path) -> bool:
    """Whether a file holds what the viewer saves and nothing else: a scene has materials."""
    try:
        if not path.is_file():  # but a device, which may have no end
            return False
        with path.open("rb") as file:
            content = file.read(_CAMERA_BYTES + 1)
        if len(content) > _CAMERA_BYTES:
            return False
        tables = tomllib.loads(content.decode("utf-8-sig")).keys()
        return "camera" in tables and tables <= {"camera", "render", "lights"}
    except (OSError, ValueError, RecursionError):
        return False  # opening it says what is wrong


def prepare_shown(scene: Scene, path: Path | None = None) -> ShownScene:
    """Prepare ``scene`` and load its kernels. Raises ``ValueError`` for a scene that cannot be shown."""
    expect(any(i.faces for i in scene.instances), "scene", "at least one face", "none")
    threads = available_threads()
    prepared = prepare_scene(scene, _needs(scene), "octree", SPLIT, threads)
    prepared = replace(prepared, arrays=_lit(prepared.arrays, scene, prepared.needs))
    # The first call of a kernel loads or compiles it; the first picture should not wait for that.
    few = {"resolution": (8, 8), "samples": 1, "max_rays": 1}
    prepared.picture(page_camera(scene.camera), scene.render.model_copy(update=few), BOUNDED, threads)
    touch_viewing(prepared)
    return ShownScene(scene, path, prepared, threads)


def _needs(scene: Scene) -> Features:
    """The needs of the scene's pictures with at least one bounce, because a panel may ask for more than the file does;
    they are the same for any number above.
    """
    return needs_of(scene, max_depth=max(1, scene.render.max_depth))


def _lit(arrays: SceneArrays, scene: Scene, needs: Features) -> SceneArrays:
    """``arrays`` with the scene's lights. None are packed for a scene of mirrors and glass alone, which needs none; but
    its face colours need them.
    """
    return arrays._replace(lights=light_rows(scene, replace(needs, shadows=True)))


def hiding(shown: ShownScene, hidden: Collection[str]) -> ShownScene:
    """``shown`` without the objects and the sides of planes ``hidden``, and with all others.

    Raises ``ValueError`` for unknown names, and if nothing is left.
    """
    whole = shown.whole
    known = object_names(whole.scene)
    names = (*(name for name in known if name in hidden), *(name for name in dict.fromkeys(hidden) if is_side(name)))
    scene = without(whole.scene, hidden)
    if not names:
        return whole
    return replace(prepare_shown(scene, whole.path), marks=whole.marks, hidden=names, all=whole, up=whole.up)


def open_file(path: Path, up: Literal["x", "y", "z"] | None = None) -> ShownScene:
    """Load a scene file, or a mesh file of which ``up`` points up, and make it ready.

    Raises ``ValueError``, which ``SceneError`` is, naming file and fault.
    """
    _expect_no_pipe(path)
    # Before they are read: those of a file that changes meanwhile differ from then on.
    marks = _marks([path])
    meshes = mesh_files(path)
    for mesh in meshes:
        _expect_no_pipe(mesh)
    marks |= _marks(meshes)
    scene = load_scene(path, up=up)
    return replace(prepare_shown(scene, path), marks=marks, up=up)


def _expect_no_pipe(path: Path) -> None:
    """Raise ``ValueError`` for a pipe: reading one without a writer waits for ever."""
    expect(not path.is_fifo(), str(path), "a file", "a pipe")


def edited(scene: Scene, edits: Edits) -> Scene:
    """``scene`` with what ``edits`` change. Raises ``ValueError`` for a material that it has not, and for a background
    beside a sky.
    """
    for name in edits.materials:
        expect(name in scene.materials, "edits.materials", f"names among {sorted(scene.materials)}", repr(name))
    lights = scene.lights if edits.lights is None else edits.lights
    changes = surroundings(edits.ambient, edits.background, edits.sky)
    materials = {name: _with_maps(scene.materials[name], material) for name, material in edits.materials.items()}
    changes |= {"materials": {**scene.materials, **materials}, "lights": lights}
    return scene.altered(**changes)


def _with_maps(own: Material, material: Material) -> Material:
    """An edited material with what the page neither shows nor may change: it names no files to read."""
    if not isinstance(material, Phong):
        return material
    kept = own if isinstance(own, Phong) else Phong()
    return material.model_copy(update={name: getattr(kept, name) for name in UNSEEN})


def _edited(prepared: PreparedScene, edits: Edits) -> PreparedScene:
    """``prepared`` with other materials and other light, over the same tree."""
    if not edits.any:
        return prepared
    scene = edited(prepared.scene, edits)
    own, geometry = _needs(scene), prepared.needs
    needs = replace(
        own,
        smooth_normals=geometry.smooth_normals,
        float64_vertices=geometry.float64_vertices,
        octree=geometry.octree,
    )
    arrays = _lit(repacked(prepared.arrays, scene, needs), scene, needs)
    if any(m.passes_light and not prepared.scene.materials[name].passes_light for name, m in scene.materials.items()):
        arrays = arrays._replace(touching=prepared.touching)
    return replace(prepared, scene=scene, needs=needs, arrays=arrays)


def varied(prepared: PreparedScene, settings: ViewSettings) -> PreparedScene:
    """``prepared`` with the edits of ``settings``, without the features that they switch off, and with its first
    directional light turned.

    No tree is rebuilt. Lights that are dark do not count, and without a directional light none is turned.
    """
    prepared = _edited(prepared, settings.edits)
    materials, lights = prepared.arrays.materials.copy(), prepared.arrays.lights.copy()
    needs, media = prepared.needs, prepared.arrays.media
    if not settings.reflection:
        materials[:, REFLECTANCE : REFLECTANCE + 3] = 0.0
        needs = replace(needs, reflection=False)
    if not settings.refraction:
        materials[:, TRANSMITTANCE : TRANSMITTANCE + 3] = 0.0
        needs, media = replace(needs, refraction=False), media[:0]
    sunny = (lights[:, 0] == DIRECTIONAL).nonzero()[0]
    if settings.light is not None and len(sunny):
        lights[sunny[0], 1:4] = -unit(settings.light)
    return replace(
        prepared, needs=needs, arrays=prepared.arrays._replace(materials=materials, lights=lights, media=media)
    )


# The most rays per pixel in a first picture of 16,384 pixels: a second of tracing at the most.
SOON = 256


def render_settings(
    scene: Scene, settings: ViewSettings, size: tuple[int, int], samples: int, last: bool
) -> RenderSettings:
    """The renderer's settings for a picture of ``size`` (w, h). Depth, normal and face need no light and no bounce.

    Pictures before the last have at most SOON rays per sample, so that they come soon in any scene.
    """
    seen_directly = settings.aov in ("depth", "normal", "face")
    return RenderSettings(
        resolution=size,
        samples=samples,
        filter=scene.render.filter,
        max_depth=0 if seen_directly else settings.max_depth,
        min_weight=scene.render.min_weight,
        max_rays=scene.render.max_rays if last else min(SOON, scene.render.max_rays),
        shadows=settings.shadows and not seen_directly,
        glass_shadows=scene.render.glass_shadows,
        terminator=scene.render.terminator,
    )
