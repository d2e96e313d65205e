"""
Slices by all hits
==================

Find all hits of parallel rays, not only the first. Each pair of hits is a stretch inside the body. Side by side these
stretches form slices; their lengths added up form an X-ray picture.
"""

import os

import matplotlib.pyplot as plt
import numpy as np

from renderer import Octree, load_mesh

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

octree = Octree.from_mesh(load_mesh("../../scenes/models/torus_knot.ply"))
low, high = octree.mesh.vertices.min(axis=0) - 0.1, octree.mesh.vertices.max(axis=0) + 0.1
x, y = (np.linspace(low[k], high[k], SIZE) for k in range(2))
origins = np.stack([*np.meshgrid(x, y), np.full((SIZE, SIZE), low[2] - 1.0)], axis=-1)
hits = octree.all_hits(origins, [0.0, 0.0, 1.0])
assert (hits.counts % 2 == 0).all()  # a ray that enters a closed body leaves it
ray, enters, leaves = hits.ray[::2], hits.points[::2], hits.points[1::2]

figure, plots = plt.subplots(2, 2, figsize=(8, 6), layout="constrained")
for axes, row in zip(plots.flat, (SIZE // 4, SIZE // 2, 3 * SIZE // 4), strict=False):
    z = np.linspace(low[2], high[2], SIZE)[:, None]
    one = ray // SIZE == row  # these rays lie in a plane of one height
    within = (enters[one, 2] <= z) & (z < leaves[one, 2])  # (SIZE, pairs of hits)
    body = np.zeros((SIZE, SIZE), dtype=int)
    np.add.at(body, (slice(None), ray[one] % SIZE), within)
    axes.imshow(body, origin="lower", cmap="Blues", vmax=1, extent=(low[0], high[0], low[2], high[2]))
    axes.set_title(f"y = {y[row]:.2f}")
thick = np.bincount(ray, leaves[:, 2] - enters[:, 2], minlength=SIZE * SIZE).reshape(SIZE, SIZE)
plots[1, 1].imshow(thick, origin="lower", cmap="bone", extent=(low[0], high[0], low[1], high[1]))
plots[1, 1].set_title("lengths added up")
plt.show()
