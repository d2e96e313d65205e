"""Write the animated picture of docs/how-it-works.md: ``python scenes/make_turntable.py [file.webp]``; needs Pillow.

The camera turns once around the main scene, first by itself, then with the boxes of the octree's nodes, a level
deeper every few frames. Both are ours: the picture is ray traced, and a box's edge is seen where it lies before
what the ray of its pixel met.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow
from tqdm import trange

from renderer.diagnostics.tree_boxes import boxes_at
from renderer.picture.image import Image, srgb
from renderer.picture.prepare import PreparedScene, prepare_scene
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.needs import needs_of
from renderer.scene.scene import load_scene
from renderer.system.threads import available_threads
from renderer.trace.spawn import BOUNDED

Array = NDArray[np.float64]

SIZE = (480, 300)
FRAMES = 72
MILLISECONDS = 70
# Frames without boxes, and frames for each level, from the root's box on.
PLAIN, EACH = 22, 10
LINE = np.array([255, 196, 64], np.float64)
# Corners of a box, bit by bit, and the twelve pairs that differ in one.
CORNERS = np.array([[(k >> axis) & 1 for axis in range(3)] for k in range(8)])
EDGES = np.array([(k, k | 1 << axis) for k in range(8) for axis in range(3) if not k >> axis & 1])


def main(path: Path) -> None:
    """Render all frames and write them."""
    scene = load_scene(Path(__file__).parent / "three_models.toml")
    stage = prepare_scene(scene, needs_of(scene))
    frames = [frame(stage, number) for number in trange(FRAMES, disable=None)]
    pictures = [Pillow.fromarray(one) for one in frames]
    first, *rest = pictures
    first.save(path, save_all=True, append_images=rest, duration=MILLISECONDS, loop=0, quality=62, method=6)


def frame(stage: PreparedScene, number: int) -> NDArray[np.uint8]:
    """A frame as sRGB, (h, w, 3)."""
    camera = turned(stage.scene.camera, 2.0 * np.pi * number / FRAMES)
    chosen = stage.scene.render.model_copy(update={"resolution": SIZE, "samples": 9})
    image = stage.picture(camera, chosen, BOUNDED, available_threads())
    picture = srgb(image.radiance)
    if number < PLAIN:
        return picture
    boxes = boxes_at(stage.octree, (number - PLAIN) // EACH)
    return with_lines(picture, image, camera, boxes)


def turned(camera: PerspectiveCamera, angle: float) -> PerspectiveCamera:
    """The camera after a turn about the vertical axis through its target."""
    x, y, z = np.subtract(camera.eye, camera.target).tolist()
    c, s = float(np.cos(angle)), float(np.sin(angle))
    eye = np.add(camera.target, (c * x + s * z, y, c * z - s * x)).tolist()
    return camera.model_copy(update={"eye": (eye[0], eye[1], eye[2])})


def with_lines(picture: NDArray[np.uint8], image: Image, camera: PerspectiveCamera, boxes: Array) -> NDArray[np.uint8]:
    """The picture with the edges of ``boxes`` (n, 6) over it, but for what is hidden."""
    width, height = SIZE
    right, up, forward = camera.frame()
    ends = (boxes.reshape(-1, 2, 3)[:, CORNERS, np.arange(3)])[:, EDGES].reshape(-1, 2, 3)
    # Twice as many points as an edge across the picture has pixels leave no gap.
    along = np.linspace(0.0, 1.0, 2 * width)[:, None]
    half = np.tan(np.radians(camera.fov) / 2.0)
    drawn = np.zeros((height, width), bool)
    for start, end in ends:
        seen = start + along * (end - start) - camera.eye
        ahead = seen @ forward
        seen, ahead = seen[ahead > 0.0], ahead[ahead > 0.0]
        column = np.floor(width / 2.0 + (seen @ right) / ahead / half * height / 2.0).astype(int)
        row = np.floor(height / 2.0 - (seen @ up) / ahead / half * height / 2.0).astype(int)
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        row, column, distance = row[inside], column[inside], np.linalg.norm(seen[inside], axis=1)
        # Boxes touch what they hold; a per cent lets those edges show.
        before = distance < 1.01 * image.depth[row, column]
        drawn[row[before], column[before]] = True
    return np.where(drawn[..., None], 0.35 * picture + 0.65 * LINE, picture).astype(np.uint8)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "turntable.webp")
