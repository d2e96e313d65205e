"""
Thickness
=========

The distance straight inwards to the next surface, for each point that a camera sees: what moulds and 3D prints need to
know.
"""

import os

import matplotlib.pyplot as plt
import numpy as np

from renderer import Octree, OrthographicCamera, load_mesh
from renderer.scene.camera import primary_rays

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

octree = Octree.from_mesh(load_mesh("../../scenes/models/teapot.ply"))
center = octree.mesh.vertices.mean(axis=0)
camera = OrthographicCamera(eye=(center[0], center[1], 9.0), target=tuple(center), height=2.4)
hits = octree.closest_hit(*primary_rays(camera, SIZE, SIZE))
inward = octree.closest_hit(hits.points[hits.hit], -hits.normals[hits.hit], leaving=hits.face[hits.hit])
thickness = np.full(hits.hit.shape, np.nan)
thickness[hits.hit] = np.where(inward.hit, inward.t, np.nan)  # in scene units, because normals have unit length

plt.imshow(thickness.reshape(SIZE, SIZE), cmap="plasma")
plt.colorbar(label="thickness", shrink=0.6)
plt.title(f"from {np.nanmin(thickness):.3f} to {np.nanmax(thickness):.3f}")
plt.axis("off")
plt.show()
