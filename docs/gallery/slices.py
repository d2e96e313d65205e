"""
Slices by all hits
==================

All hits of parallel rays, not the first alone: pairs of hits are where a ray is within the body. Laid side by side they
are slices, and their lengths added up are an X-ray picture.
"""

import os

import matplotlib.pyplot as plt
import numpy as np

from renderer import Octree, load_mesh

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

octree = Octree.from_mesh(load_mesh("../../scenes/models/torus_knot.ply"))
low, high = octree.mesh.vertices.min(axis=0) - 0.1, octree.mesh.vertices.max(axis=0) + 0.1
x, y, z = (np.linspace(low[k], high[k], SIZE) for k in range(3))


def along_z(x, y):
    """All hits of rays along z; every ray of a closed body has an even number."""
    origins = np.stack([*np.broadcast_arrays(x, y, low[2] - 1.0)], axis=-1)
    hits = octree.all_hits(origins, [0.0, 0.0, 1.0])
    assert (hits.counts % 2 == 0).all()
    return hits


figure, plots = plt.subplots(2, 2, figsize=(8, 7), layout="constrained")
for axes, height in zip(plots.flat, np.linspace(low[1], high[1], 5)[1:4], strict=False):
    hits = along_z(x, height)
    axes.vlines(hits.points[::2, 0], hits.points[::2, 2], hits.points[1::2, 2], linewidth=500 / SIZE)
    axes.set_title(f"y = {height:.2f}")
    axes.set_aspect("equal")
hits = along_z(x, y[:, None])
thick = np.zeros(SIZE * SIZE)
np.add.at(thick, hits.ray[::2], hits.t[1::2] - hits.t[::2])
plots[1, 1].imshow(thick.reshape(SIZE, SIZE), origin="lower", cmap="bone", extent=(x[0], x[-1], y[0], y[-1]))
plots[1, 1].set_title("lengths added up")
plt.show()
