"""
Simulated lidar
===============

A scanner with 32 rings in a street of boxes: a point cloud without noise, coloured by height.
"""

import os

import matplotlib.pyplot as plt
import numpy as np

from renderer import Mesh, Octree
from renderer.shapes import box
from renderer.studies import scan

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

rng = np.random.default_rng(3)
boxes = [box((-60, -60, -1), (60, 60, 0))]  # the ground, then houses and cars on both sides
for x in np.arange(-50.0, 50.0, 11.0):
    for side, lane in ((-16.0, -5.0), (7.0, 3.2)):
        boxes.append(box((x, side, 0), (x + rng.uniform(6, 9), side + rng.uniform(6, 9), rng.uniform(5, 12))))
        boxes.append(box((x + 2, lane, 0.2), (x + 6.2, lane + 1.8, 1.6)))
octree = Octree.from_mesh(Mesh.concatenate(boxes))

azimuth, height = np.meshgrid(np.linspace(-np.pi, np.pi, 4 * SIZE), np.tan(np.radians(np.linspace(-25, 15, 32))))
directions = np.stack([np.cos(azimuth), np.sin(azimuth), height], axis=-1).reshape(-1, 3)
cloud = scan(octree, (0.0, 0.0, 1.9), directions / np.linalg.norm(directions, axis=1, keepdims=True), distance=60.0)
print(f"{len(cloud.points):,} of {azimuth.size:,} rays hit something within 60 m")

plt.figure(figsize=(9, 4))
plt.scatter(*cloud.points[:, :2].T, c=cloud.points[:, 2], s=2.5, cmap="turbo", linewidths=0)
plt.colorbar(label="height, m", shrink=0.8)
plt.gca().set(aspect="equal", xlim=(-45.0, 45.0), ylim=(-17.0, 17.0))
plt.title("Point cloud from above")
plt.show()
