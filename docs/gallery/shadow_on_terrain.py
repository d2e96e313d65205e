"""
Shadow on terrain
=================

Hours of sun for each triangle of a hilly terrain, over one day. All points lie on the surface, and no epsilon is
needed.
"""

import os

import matplotlib.pyplot as plt
import numpy as np

from renderer import Octree
from renderer.mesh.heightfield import heightfield_mesh
from renderer.studies import face_points, sun_hours

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

rng = np.random.default_rng(7)
y, x = np.mgrid[0 : SIZE // 2, 0 : SIZE // 2] / (SIZE // 2)
waves = [(0.1 / k**1.6, *rng.normal(0.0, k, 2), rng.uniform(0.0, 6.3)) for k in range(1, 9)]
heights = sum(high * np.sin(2 * np.pi * (a * x + b * y) + phase) for high, a, b, phase in waves)
octree = Octree.from_mesh(heightfield_mesh(heights, spacing=2.0 / SIZE))

hours = np.linspace(-5.0, 5.0, 41)  # from noon
angle = hours / 12.0 * np.pi
suns = np.stack([-np.sin(angle), -0.6 * np.cos(angle), 0.5 * np.cos(angle) - 0.1], axis=-1)  # a low sun in the south
points, normals, faces = face_points(octree.mesh)
lit = sun_hours(octree, points, normals, suns, weights=np.full(41, 10.0 / 41.0), leaving=faces)

plt.figure(figsize=(6, 5))
plt.tripcolor(*octree.mesh.vertices[:, :2].T, octree.mesh.faces, facecolors=lit, cmap="inferno")
plt.colorbar(label="hours of sun")
plt.axis("equal")
plt.title(f"{len(faces):,} triangles, {len(suns)} positions of the sun")
plt.show()
