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
from make_car_park import TURN, car_park, drawn

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

begin, park, points, colors = time.perf_counter(), car_park(), [], []
for frame in range(SIZE // 4):
    park.move(TURN * frame)
    cloud = park.scan(TURN * frame, columns=SIZE * 64 // 25)
    # Each point knows its object and instance: of the cars that drive, those of the last turn are shown.
    shown = ~park.drives(cloud) | (frame == SIZE // 4 - 1)
    points.append(cloud.points[shown])
    colors.append(park.colors(cloud.objects[shown]) * (0.5 + 0.5 * cloud.cosines[shown, None]))
print(f"{park.scene}: {sum(map(len, points)):,} points in {time.perf_counter() - begin:.0f} s")
points.append(park.scanner(np.linspace(0.0, TURN * len(colors), 999))[:, :, 3])
colors.append(np.ones((999, 3)))  # white: the way of the lidar

camera = PerspectiveCamera(eye=(-33.0, -37.0, 20.0), target=(8.0, -3.0, -3.0), up=(0.0, 0.0, 1.0), fov=32.0)
figure, plots = plt.subplots(2, 1, figsize=(9, 9.1), layout="constrained")
plots[0].imshow(park.picture(camera, SIZE * 5 // 2, SIZE * 5 // 4))
plots[1].imshow(drawn(np.concatenate(points), np.concatenate(colors), camera, SIZE * 5 // 2, SIZE * 5 // 4))
for axes in plots:
    axes.axis("off")
plt.show()
