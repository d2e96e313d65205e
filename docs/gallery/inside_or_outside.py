"""
Inside or outside
=================

Slice a knot with a plane of points: which of them lie inside, exactly, and how far is each from the surface?
"""

import os

import matplotlib.pyplot as plt
import numpy as np

from renderer import Octree, load_mesh

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

octree = Octree.from_mesh(load_mesh("../../scenes/models/torus_knot.ply"))
low, high = octree.mesh.vertices.min(axis=0) - 0.1, octree.mesh.vertices.max(axis=0) + 0.1
x, y = np.linspace(low[0], high[0], SIZE), np.linspace(low[1], high[1], SIZE)
points = np.stack([*np.meshgrid(x, y), np.full((SIZE, SIZE), (low[2] + high[2]) / 2)], axis=-1)
inside = octree.contains(points, rule="nonzero")  # (SIZE, SIZE) bool
distance = octree.signed_distance(points)  # negative inside
assert ((distance < 0) == inside).all()

plt.imshow(distance, extent=(low[0], high[0], low[1], high[1]), origin="lower", cmap="RdBu", vmin=-0.5, vmax=0.5)
plt.colorbar(label="signed distance, positive outside")
plt.contour(x, y, inside, [0.5], colors="black", linewidths=1)
plt.title(f"{inside.mean():.1%} of the plane lies inside")
plt.show()
