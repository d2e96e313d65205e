"""
A lidar in a car park
=====================

A car with a lidar drives through a park of 500 cars and 200 trees, all copies of a few meshes, while others drive, too.
Above is the park as a camera sees it; below are the points of a hundred turns of the lidar, coloured by object.
"""

import os
import sys
import time

import matplotlib.pyplot as plt
import numpy as np

from renderer import PerspectiveCamera

sys.path.append("../../scenes")
from make_car_park import TURN, car_park

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))
FRAMES, WIDTH, HEIGHT = SIZE // 4, SIZE * 5 // 2, SIZE * 5 // 4
camera = PerspectiveCamera(eye=(-33.0, -37.0, 20.0), target=(8.0, -3.0, -3.0), up=(0.0, 0.0, 1.0), fov=32.0)
right, up, ahead = camera.frame()


def in_view(points):
    """Which points the camera has before it, their distances ahead, and their rows and columns in the picture."""
    way = points - camera.eye
    away = np.maximum(way @ ahead, 1.0)
    pixels = HEIGHT / 2.0 / np.tan(np.radians(camera.fov / 2.0)) / away
    column, row = WIDTH / 2.0 + pixels * (way @ right), HEIGHT / 2.0 - pixels * (way @ up)
    inside = (away > 1.0) & (column >= 0.0) & (column < WIDTH - 1.0) & (row >= 0.0) & (row < HEIGHT - 1.0)
    return inside, away[inside], row[inside].astype(int), column[inside].astype(int)


begin, park, seen, count = time.perf_counter(), car_park(), [], 0
for frame in range(FRAMES):
    park.move(TURN * frame)
    cloud = park.scan(TURN * frame, columns=SIZE * 64 // 25)
    # Each point knows its object and instance: of the cars that drive, those of the last turn are shown.
    shown = ~park.drives(cloud) if frame < FRAMES - 1 else np.full(len(cloud.points), True)
    inside, *places = in_view(cloud.points[shown])
    colors = park.colors(cloud.objects[shown][inside]) * (0.5 + 0.5 * cloud.cosines[shown][inside, None])
    seen.append([*places, colors])
    count += len(cloud.points)
print(f"{park.scene}: {FRAMES} turns, {count:,} points in {time.perf_counter() - begin:.0f} s")

# The points as squares of two pixels, from the farthest to the nearest.
away, row, column, colors = (np.concatenate(arrays) for arrays in zip(*seen, strict=True))
order, measured = np.argsort(-away), np.full((HEIGHT, WIDTH, 3), 0.04)
for down, along in np.ndindex(2, 2):
    measured[row[order] + down, column[order] + along] = colors[order]

# What the camera sees, in the sun or in the shade, four rays a pixel.
hits, sun = park.scene.closest_hit(*camera.primary_rays((2 * WIDTH, 2 * HEIGHT))), np.array([0.5, -0.6, 0.65])
lit = np.abs(hits.normals @ sun) * ~park.scene.any_hit(np.nan_to_num(hits.points), sun, leaving=hits)
seen = np.where(hits.hit[..., None], park.colors(hits.object) * (0.35 + 0.65 * lit[..., None]), (0.75, 0.85, 0.95))
print(f"{time.perf_counter() - begin:.0f} s in all")

figure, plots = plt.subplots(2, 1, figsize=(9, 9.1), layout="constrained")
plots[0].imshow(seen.reshape(HEIGHT, 2, WIDTH, 2, 3).mean(axis=(1, 3)).clip(0.0, 1.0))
plots[1].imshow(measured)
path = park.fleets["saloon"].poses(np.zeros(99, int), np.linspace(0.0, TURN * FRAMES, 99))[:, :, 3]
plots[1].plot(*in_view(path)[:1:-1], "w--", linewidth=1)  # the way of the car with the scanner
for axes in plots:
    axes.axis("off")
plt.show()
