"""A prepared scene: the data that its pictures share is computed once, and a picture then costs its rays alone."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.split import SPLIT, Split
from renderer.errors import expect
from renderer.jit.notice import Stopwatch
from renderer.lazy import lazy
from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from renderer.picture.camera_rays import TILE, rays_of_tiles, tile_side
from renderer.picture.image import PLANES, Image
from renderer.picture.pack import media_around, pack
from renderer.picture.placed import placed, placed_arrays
from renderer.picture.touching import touching_faces
from renderer.rayscene.built import BuiltScene, SceneTree
from renderer.scene.camera import Camera
from renderer.scene.needs import Features
from renderer.scene.scene import RenderSettings, Scene
from renderer.shade.bundle import SIZE
from renderer.shade.surface import MAX_MEDIA, SceneArrays
from renderer.shade.tile import CUT, Film, Rectangle, render_tile, tile_scratch
from renderer.shade.whitted import Settings
from renderer.system.threads import available_threads, checked_threads, for_chunks
from renderer.trace.closest import rays_against_blocks
from renderer.trace.layout import Tree, cache_aligned
from renderer.trace.spawn import OffsetRule

# The rule by which a ray knows the media on both sides of a surface: from the stack of those that it is in, or from the
# side of the normal alone.
MediaRule = Literal["stack", "normal"]


@dataclass(frozen=True, eq=False)
class PreparedScene:
    """A scene with all that its pictures share. ``prepare`` makes it, ``render`` renders it.

    Attributes
    ----------
    scene : Scene
        The scene that it is made of.
    built : Octree, BruteForce or BuiltScene
        What rays are traced against: meshes that stand in the scene many times are kept once.
    needs : Needs
        The features that are ready, at least those of ``needs_of(scene)``.
    build_seconds : float
        The time that it took, without compilation.

    Examples
    --------
    >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, prepare
    >>> from renderer.mesh.shapes import icosphere
    >>> ball = SceneObject(mesh=icosphere(3), material="grey", normals="smooth")
    >>> eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
    >>> ready = prepare(Scene(camera=eye, materials={"grey": Phong()}, objects=[ball]))
    >>> len(ready.mesh.faces), ready.octree.stats.faces, ready.needs.octree
    (1280, 1280, True)
    """

    scene: Scene
    built: Octree | BruteForce | BuiltScene
    needs: Features
    arrays: SceneArrays
    tree: Any
    build_seconds: float

    @property
    def mesh(self) -> Mesh:
        """The triangles of all meshes of the scene, in their order: Mesh.

        Examples
        --------
        >>> from renderer import load_scene, prepare
        >>> len(prepare(load_scene("scenes/stairs.toml")).mesh.faces)
        46
        """
        return self.octree.mesh

    @property
    def octree(self) -> Octree | BruteForce:
        """The tree over ``mesh``; ``BruteForce`` where there are few faces.

        Examples
        --------
        >>> from renderer import load_scene, prepare
        >>> prepare(load_scene("scenes/glass.toml")).octree.closest_hit([[0, 9, 0]], [0, -1, 0]).hit
        array([ True])
        """
        return self.built.merged if isinstance(self.built, BuiltScene) else self.built

    def __repr__(self) -> str:
        return f"<PreparedScene of {sum(part.faces for part in self.scene.instances):,} faces>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles make the kernels' arrays anew, so that they are of the types that kernels know."""
        return _restored, (self.scene, self.built, self.needs, self.build_seconds)

    @lazy
    def touching(self) -> NDArray[np.uint8]:
        """A mark for each face that may coincide with another, for any materials: ndarray, uint8.

        Examples
        --------
        >>> from renderer import PerspectiveCamera, Phong, Scene, SceneObject, prepare
        >>> from renderer.mesh.shapes import box
        >>> cube, eye = SceneObject(mesh=box(), material="grey"), PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        >>> bool(prepare(Scene(camera=eye, materials={"grey": Phong()}, objects=[cube, cube])).touching.all())
        True
        """
        threads = available_threads()
        marks = touching_faces(_searched(self.built, self.tree, self.needs, threads), self.arrays, threads, True)
        placed = isinstance(self.tree, SceneTree) and len(marks) > 0
        return np.repeat(marks, [i.faces for i in self.scene.instances]) if placed else marks

    def picture(
        self,
        camera: Camera,
        chosen: RenderSettings,
        offset: OffsetRule,
        threads: int,
        finished: Callable[[int], object] | None = None,
        planes: Collection[str] = PLANES,
        band: tuple[int, int] | None = None,
        media: MediaRule = "stack",
        columns: tuple[int, int] | None = None,
    ) -> Image:
        """The picture that ``camera`` takes, by checked settings; see ``render``. Of a ``band`` of rows, first and
        end, only these: with the bits that they have in the whole picture, and in little more memory than their own
        pixels take. Of ``columns`` likewise, with the memory of those to their left.

        ``finished(tiles)`` is called after each tile, and with 0 at least every 16,384 rays of a long one, shadow rays
        not counted, by one thread at a time. What it raises stops the others and is raised here.
        """
        clock = Stopwatch()
        width, height = chosen.resolution
        first_row, end_row = (0, height) if band is None else band
        first_column, end_column = (0, width) if columns is None else columns
        view = camera, (width, height), chosen.samples
        rays_of, side = rays_of_tiles(*view, chosen.filter), tile_side(*view)
        settings = kernel_settings_of(self.needs, chosen, offset, media)
        arrays = arrays_for(self, camera, chosen, offset, media)
        wide, tall = end_column - first_column, end_row - first_row
        across, cut = -(-wide // side), np.zeros(tiles(wide, tall, side), np.int64)

        def render_in(film: Film, first: int) -> Iterator[None]:
            x, y = first_column + first % across * side, first_row + first // across * side
            bottom, right = film.radiance.shape[:2]
            tile = Rectangle(x, y, min(x + side, right), min(y + side, bottom))
            scratch, rays = tile_scratch(self.tree.depth, settings, _bundles_in_a_row(self.tree)), rays_of(tile)
            while not render_tile(self.tree.descriptor, arrays, settings, rays, film, tile, scratch):
                yield
            cut[first] = scratch.state[CUT]

        # The kernel is loaded before the picture takes its memory: without any left, LLVM ends the process.
        for _ in render_in(_film(1, 0, planes), 0):
            pass
        film = _film(end_column, end_row, planes, first_row)
        for_chunks(lambda first, _end: render_in(film, first), len(cut), 1, threads, finished)
        film = _film_from(first_row, first_column, film)
        return Image(*film, build_seconds=self.build_seconds, render_seconds=clock.seconds(), cut=int(cut.sum()))


def prepare_scene(
    scene: Scene,
    needs: Features,
    accelerator: str = "auto",
    split: Split = SPLIT,
    threads: int | None = None,
) -> PreparedScene:
    """Make ``scene`` ready, by checked arguments; see ``render``."""
    clock, threads = Stopwatch(), checked_threads(threads)
    built = placed(scene, needs, split, threads) if accelerator == "auto" and needs.octree else None
    if built is not None:
        return _with_touching(scene, built, needs, placed_arrays(scene, needs, built), threads, clock)
    mesh, arrays = pack(scene, needs)
    octree = build_octree(mesh, accelerator, split, needs, threads)
    return _with_touching(scene, octree, needs, arrays, threads, clock)


def _with_touching(
    scene: Scene,
    built: Octree | BruteForce | BuiltScene,
    needs: Features,
    arrays: SceneArrays,
    threads: int,
    clock: Stopwatch,
) -> PreparedScene:
    tree = built.top if isinstance(built, BuiltScene) else tree_for(built, needs)
    if needs.refraction:
        arrays = arrays._replace(touching=touching_faces(_searched(built, tree, needs, threads), arrays, threads))
    return PreparedScene(scene, built, needs, arrays, tree, clock.seconds())


def _searched(built: Octree | BruteForce | BuiltScene, tree: Any, needs: Features, threads: int) -> Any:
    """The tree through which touching faces are found: an octree also for brute force, unless the faces are few. All
    faces against all others would take longer than the picture.
    """
    if isinstance(built, BruteForce) and needs.octree:
        return tree_for(Octree.from_mesh(built.mesh, threads=threads), needs)
    return tree


def _bundles_in_a_row(tree: Tree | SceneTree) -> int:
    """The number of bundles per call of the kernel: some 10 ms, so that Ctrl-C takes effect soon."""
    return 256 if isinstance(tree, SceneTree) or tree.has_nodes else max(1, rays_against_blocks(tree) // SIZE)


def _restored(
    scene: Scene, built: Octree | BruteForce | BuiltScene, needs: Features, build_seconds: float
) -> PreparedScene:
    arrays = placed_arrays(scene, needs, built) if isinstance(built, BuiltScene) else pack(scene, needs)[1]
    restored = _with_touching(scene, built, needs, arrays, checked_threads(None), Stopwatch())
    return replace(restored, build_seconds=build_seconds)


def tiles(width: int, height: int, side: int = TILE) -> int:
    """The number of tiles of a picture."""
    return -(-width // side) * -(-height // side)


def build_octree(
    mesh: Mesh, accelerator: str, split: Split, needs: Features, threads: int | None = None
) -> Octree | BruteForce:
    """A tree, or the blocks alone where ``accelerator`` is "brute" or no tree is needed.

    Raises ``ValueError`` for coordinates that would have to be rescaled, as the lights would too.
    """
    with_tree = needs.octree if accelerator == "auto" else accelerator == "octree"
    built = Octree.from_mesh(mesh, split=split, threads=threads) if with_tree else BruteForce.from_mesh(mesh)
    expect(built.tree.scale == 1.0, "scene", "a largest coordinate from 2^-60 to 2^60", f"bounds {mesh.bounds}")
    return built


def tree_for(octree: Octree | BruteForce, needs: Features) -> Tree:
    """The tree that the kernel traces rays against."""
    return _widened(octree.tree) if needs.float64_vertices else octree.tree


def _widened(tree: Tree) -> Tree:
    """The tree with its vertices in float64."""
    blocks = cache_aligned(len(tree.blocks), np.float64)
    blocks[:] = tree.blocks
    return replace(tree, blocks=blocks)


def _widths(camera: Camera, resolution: tuple[int, int], samples: int) -> tuple[float, float]:
    """The width of camera rays where they start, and by how much they are wider after a distance of 1: that between
    the samples in the middle of the film.
    """
    middle, step = np.array(resolution) / 2.0, 1.0 / np.sqrt(samples)
    origins, directions = camera.rays([middle, np.add(middle, (step, 0.0))], resolution)
    return float(np.linalg.norm(origins[1] - origins[0])), float(np.linalg.norm(directions[1] - directions[0]))


def kernel_settings_of(
    needs: Features, chosen: RenderSettings, offset: OffsetRule, media: MediaRule = "stack"
) -> Settings:
    """The kernel's settings: no bounces where nothing bounces, and no media where nothing refracts."""
    bounces = chosen.max_depth if needs.reflection or needs.refraction else 0
    return Settings(bounces, chosen.min_weight, offset, media_limit(needs, media), chosen.shadows, chosen.max_rays)


def arrays_for(
    prepared: PreparedScene, camera: Camera, chosen: RenderSettings, offset: OffsetRule, media: MediaRule
) -> SceneArrays:
    """The kernel's arrays for pictures by ``camera``: with the media around it, the widths of its rays, and without the
    faces that are crossed together where the rules cross each face by itself.
    """
    arrays = prepared.arrays._replace(soft=chosen.terminator == "soft", clear=chosen.glass_shadows == "clear")
    if prepared.needs.textures:
        pixel, spread = _widths(camera, chosen.resolution, chosen.samples)
        arrays = arrays._replace(pixel=pixel, spread=spread)
    # rule: media-at-eye
    if prepared.needs.refraction and camera is not prepared.scene.camera:
        arrays = arrays._replace(media=media_around(prepared.scene, camera))
    if media == "normal":
        arrays = arrays._replace(media=arrays.media[:0])
    if media == "normal" or not offset.uses_error_bound:
        arrays = arrays._replace(touching=arrays.touching[:0])
    return arrays


def media_limit(needs: Features, media: MediaRule) -> int:
    """The most media in a ray's stack. With none, a ray along the normal is inside."""
    return MAX_MEDIA if needs.refraction and media == "stack" else 0


def _film_from(row: int, column: int, film: Film) -> Film:
    """The film without the rows and columns before some."""
    planes: tuple[Any, ...] = tuple(np.ascontiguousarray(plane[row:, column:]) for plane in film)
    return Film(*planes)


def _film(width: int, height: int, planes: Collection[str], first: int = 0) -> Film:
    """A film of ``height`` rows; those before the ``first`` are never written to, and so take no memory."""
    depth, normal, face, rays = ((height, width) if name in planes else (0, 0) for name in PLANES[1:])
    film = Film(
        radiance=np.zeros((height, width, 3), np.float32),
        depth=np.empty(depth),
        normal=np.zeros((*normal, 3), np.float32),
        face=np.empty(face, np.int32),
        rays=np.zeros(rays, np.int32),
    )
    film.depth[first:] = np.inf
    film.face[first:] = -1
    return film
