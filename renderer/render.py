"""From a scene to a picture: the tree, the tiles on threads, the progress bar."""

import sys
import time
from typing import Any, Literal

import numpy as np

from renderer.build import SPLITS
from renderer.camera import sample_offsets
from renderer.errors import expect
from renderer.image import Image
from renderer.layout import Tree, cache_aligned
from renderer.mesh import Mesh
from renderer.needs import Needs, checked_needs
from renderer.octree import BruteForce, Octree
from renderer.parallel import checked_threads, for_chunks
from renderer.scene import RenderSettings, Scene
from renderer.shading import BOUNDED, MITSUBA_EPSILON
from renderer.sight import MAX_MEDIA
from renderer.tile import Film, render_tile
from renderer.whitted import Accelerator, Settings
from renderer.world import pack

# Pixels a side: 256 tiles share a 512 x 512 picture evenly, and neighbouring rays find their nodes in the cache.
TILE = 32


def render(
    scene: Scene,
    *,
    accelerator: Literal["auto", "octree", "brute"] = "auto",
    split: Literal["midpoint", "sah"] = "midpoint",
    needs: Needs | None = None,
    offset: Literal["bounded", "mitsuba"] | float = "bounded",
    threads: int | None = None,
    progress: bool = False,
    **settings: Any,
) -> Image:
    """Render ``scene``; ``resolution``, ``samples``, ``max_depth`` and ``min_weight`` override the scene's own.

    accelerator  "octree", "brute" to test every ray against every face, or "auto": the octree unless the faces are so
                 few that it does not pay
    needs        what to have ready: at least what ``needs_of`` says, which None stands for. More changes no bit of
                 radiance, depth, normal or face, and costs time and memory
    offset       how spawned rays leave a surface: "bounded" by their rounding error, or Mitsuba's rule with its
                 epsilon or another one
    progress     a bar on standard error when that is a terminal

    The same bits for any number of threads. Raises ``ValueError`` naming the argument. Ctrl-C stops between tiles.
    """
    expect(isinstance(scene, Scene), "scene", "a Scene", type(scene).__name__)
    chosen = _settings(scene, settings)
    width, height = chosen.resolution
    named = isinstance(accelerator, str) and accelerator in ("auto", "octree", "brute")
    expect(named, "accelerator", "'auto', 'octree' or 'brute'", repr(accelerator))
    expect(isinstance(split, str) and split in SPLITS, "split", f"one of {sorted(SPLITS)}", repr(split))
    threads = checked_threads(threads)
    wanted = checked_needs(needs, scene, chosen.max_depth)
    kernel_settings = kernel_settings_of(wanted, chosen, _offset(offset))
    began = time.perf_counter()
    mesh, world = pack(scene, wanted)
    target = build_target(mesh, accelerator, split, wanted, threads)
    camera, samples = scene.camera.rows(width, height), sample_offsets(chosen.samples)
    film = _film(width, height)
    ready = time.perf_counter()
    across = -(-width // TILE)
    tiles = across * -(-height // TILE)

    def render_one(first: int, _end: int) -> None:
        x, y = first % across * TILE, first // across * TILE
        tile = (x, y, min(x + TILE, width), min(y + TILE, height))
        render_tile(target, world, kernel_settings, camera, samples, film, tile)

    with _bar(tiles, progress) as bar:
        for_chunks(render_one, tiles, 1, threads, bar.update)
    return Image(*film, build_seconds=ready - began, render_seconds=time.perf_counter() - ready)


def build_target(
    mesh: Mesh, accelerator: str, split: Literal["midpoint", "sah"], needs: Needs, threads: int | None = None
) -> Accelerator:
    """What the rays are shot at: a tree, or the blocks alone where ``accelerator`` is "brute" or no tree is needed."""
    with_tree = needs.octree if accelerator == "auto" else accelerator == "octree"
    built = Octree.from_mesh(mesh, split=split, threads=threads) if with_tree else BruteForce.from_mesh(mesh)
    expect(built.target.scale == 1.0, "scene", "a largest coordinate from 2^-60 to 2^60", f"bounds {mesh.bounds}")
    tree = built.target.tree
    return Accelerator(_widened(tree) if needs.float64_vertices else tree, built.target.depth)


def _widened(tree: Tree) -> Tree:
    """The tree with its vertices in float64, whether they need it or not."""
    blocks = cache_aligned(len(tree.blocks), np.float64)
    blocks[:] = tree.blocks
    return tree._replace(blocks=blocks)


def kernel_settings_of(needs: Needs, chosen: RenderSettings, offset: float) -> Settings:
    """The kernel's settings: no bounces where nothing bounces, and no media where nothing refracts."""
    bounces = chosen.max_depth if needs.reflection or needs.refraction else 0
    return Settings(bounces, chosen.min_weight, offset, MAX_MEDIA if needs.refraction else 0)


def _settings(scene: Scene, given: dict[str, Any]) -> RenderSettings:
    """The scene's settings with those given in their place, checked as a file's would be."""
    known = RenderSettings.model_fields
    for name in given:
        expect(name in known, "render", f"settings among {sorted(known)}", repr(name))
    values = {k: v for k, v in given.items() if v is not None}
    return RenderSettings(**{**scene.render.model_dump(), **values})


def _offset(offset: str | float) -> float:
    if isinstance(offset, str):
        expect(offset in ("bounded", "mitsuba"), "offset", "'bounded', 'mitsuba' or a number", repr(offset))
        return BOUNDED if offset == "bounded" else MITSUBA_EPSILON
    expect(isinstance(offset, int | float) and 0.0 <= offset < 0.1, "offset", "a number from 0 to below 0.1", offset)
    return float(offset)


def _film(width: int, height: int) -> Film:
    return Film(
        radiance=np.zeros((height, width, 3), np.float32),
        depth=np.full((height, width), np.inf),
        normal=np.zeros((height, width, 3), np.float32),
        face=np.full((height, width), -1, np.int32),
        rays=np.zeros((height, width), np.int32),
    )


def _bar(tiles: int, progress: bool) -> Any:
    from tqdm import tqdm  # only a picture needs it

    return tqdm(total=tiles, unit="tile", leave=False, disable=not (progress and sys.stderr.isatty()))
