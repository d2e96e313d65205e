"""``render``: a scene and settings in, checked, and a picture out."""

import sys
from typing import Any, Literal

from renderer.build import SPLITS
from renderer.errors import expect
from renderer.image import Image
from renderer.needs import Needs, checked_needs
from renderer.parallel import checked_threads
from renderer.scene import RenderSettings, Scene
from renderer.shading import BOUNDED, MITSUBA_EPSILON
from renderer.stage import set_up, tiles


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
    """Render ``scene``; ``resolution``, ``samples``, ``max_depth``, ``min_weight`` and ``shadows`` override the scene's
    own.

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
    chosen = settings_of(scene, settings)
    named = isinstance(accelerator, str) and accelerator in ("auto", "octree", "brute")
    expect(named, "accelerator", "'auto', 'octree' or 'brute'", repr(accelerator))
    expect(isinstance(split, str) and split in SPLITS, "split", f"one of {sorted(SPLITS)}", repr(split))
    threads = checked_threads(threads)
    wanted = checked_needs(needs, scene, chosen.max_depth)
    rule = _offset(offset)
    stage = set_up(scene, wanted, accelerator, split, threads)
    with _bar(tiles(chosen.resolution), progress) as bar:
        return stage.picture(scene.camera, chosen, rule, threads, bar.update)


def settings_of(scene: Scene, given: dict[str, Any]) -> RenderSettings:
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


def _bar(count: int, progress: bool) -> Any:
    from tqdm import tqdm  # only a picture needs it

    return tqdm(total=count, unit="tile", leave=False, disable=not (progress and sys.stderr.isatty()))
