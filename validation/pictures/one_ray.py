"""Our pictures as references draw theirs: one ray a pixel, and no ray ends because it weighs little."""

from typing import Any, Literal

from renderer.picture.image import Image
from renderer.picture.prepare import MediaRule
from renderer.picture.render import render
from renderer.scene.scene import UNLIMITED_RAYS, Scene

Offset = Literal["bounded", "mitsuba"] | float


def picture(
    scene: Scene,
    resolution: tuple[int, int],
    offset: Offset,
    media: MediaRule = "stack",
    **settings: Any,
) -> Image:
    """Our picture under rules as of ``render``."""
    settings = {"samples": 1, "min_weight": 0.0, "max_rays": UNLIMITED_RAYS} | settings
    return render(scene, resolution=resolution, offset=offset, media=media, **settings)
