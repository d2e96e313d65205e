"""From a scene to a picture: the tree, the tiles on threads, the progress bar."""

import sys
import time
from typing import Any, Literal

import numpy as np

from renderer.build import SPLITS
from renderer.camera import sample_offsets
from renderer.errors import expect
from renderer.image import Image
from renderer.octree import BruteForce, Octree
from renderer.parallel import checked_threads, for_chunks
from renderer.scene import RenderSettings, Scene
from renderer.shading import BOUNDED, MITSUBA_EPSILON
from renderer.whitted import Accelerator, Film, Settings, render_tile
from renderer.world import pack

# Pixels a side: 256 tiles share a 512 x 512 picture evenly, and neighbouring rays find their nodes in the cache.
TILE = 32


def render(
    scene: Scene,
    *,
    accelerator: Literal["octree", "brute"] = "octree",
    split: Literal["midpoint", "sah"] = "midpoint",
    offset: Literal["bounded", "mitsuba"] | float = "bounded",
    threads: int | None = None,
    progress: bool = False,
    **settings: Any,
) -> Image:
    """Render ``scene``; ``resolution``, ``samples``, ``max_depth`` and ``min_weight`` override the scene's own.

    accelerator  "octree", or "brute" to test every ray against every face
    offset       how spawned rays leave a surface: "bounded" by their rounding error, or Mitsuba's rule with its
                 epsilon or another one
    progress     a bar on standard error when that is a terminal

    The same bits for any number of threads. Raises ``ValueError`` naming the argument. Ctrl-C stops between tiles.
    """
    expect(isinstance(scene, Scene), "scene", "a Scene", type(scene).__name__)
    chosen = _settings(scene, settings)
    width, height = chosen.resolution
    named = isinstance(accelerator, str) and accelerator in ("octree", "brute")
    expect(named, "accelerator", "'octree' or 'brute'", repr(accelerator))
    expect(isinstance(split, str) and split in SPLITS, "split", f"one of {sorted(SPLITS)}", repr(split))
    threads = checked_threads(threads)
    kernel_settings = Settings(chosen.max_depth, chosen.min_weight, _offset(offset))
    began = time.perf_counter()
    mesh, world = pack(scene)
    built = Octree.from_mesh(mesh, split=split) if accelerator == "octree" else BruteForce.from_mesh(mesh)
    expect(built.target.scale == 1.0, "scene", "a largest coordinate from 2^-60 to 2^60", f"bounds {mesh.bounds}")
    target = Accelerator(built.target.tree, built.target.depth)
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
