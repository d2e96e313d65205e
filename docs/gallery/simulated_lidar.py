"""
Simulated lidar
===============

A scanner with 32 rings in a street of boxes: the point cloud without noise, coloured by height.
"""

import os

import matplotlib.pyplot as plt
import numpy as np

from renderer import Mesh, Octree
from renderer.mesh.shapes import box
from renderer.studies import scan

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

rng = np.random.default_rng(3)
houses = [
    box((x, side, 0.0), (x + rng.uniform(6, 9), side + rng.uniform(6, 9), rng.uniform(5, 12)))
    for x in np.arange(-50, 50, 11.0)
    for side in (-16.0, 7.0)
]
cars = [
    box((x, y, 0.2), (x + 4.2, y + 1.8, 1.6))
    for x, y in zip(rng.uniform(-40, 40, 12), rng.choice([-5.0, 3.2], 12), strict=True)
]
octree = Octree.from_mesh(Mesh.concatenate([box((-60, -60, -1), (60, 60, 0)), *houses, *cars]))

azimuth, elevation = np.meshgrid(np.linspace(-np.pi, np.pi, 4 * SIZE), np.radians(np.linspace(-25.0, 15.0, 32)))
pattern = np.stack(
    [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
)
cloud = scan(octree, (0.0, 0.0, 1.9), pattern.reshape(-1, 3), distance=60.0)
print(f"{len(cloud.points):,} of {azimuth.size:,} rays met something within 60 m")

plt.figure(figsize=(9, 4))
plt.scatter(*cloud.points[:, :2].T, c=cloud.points[:, 2], s=2.5, cmap="turbo", linewidths=0)
plt.colorbar(label="height, m", shrink=0.8)
plt.gca().set_aspect("equal")
plt.xlim(-45.0, 45.0)
plt.ylim(-17.0, 17.0)
plt.title("Point cloud from above")
plt.show()
