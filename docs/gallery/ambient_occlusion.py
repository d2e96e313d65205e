"""
Ambient occlusion on a scan
===========================

A simulated scanner samples a surface. At each point, the share of even light from all sides that arrives shows the
dents.
"""

import os

import matplotlib.pyplot as plt

from renderer import Octree, PerspectiveCamera, load_mesh
from renderer.scene.camera import primary_rays
from renderer.studies import ambient_occlusion, scan

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

octree = Octree.from_mesh(load_mesh("../../scenes/models/torus_knot.ply"))
eye = (0.5, 2.0, 6.0)
_, directions = primary_rays(PerspectiveCamera(eye=eye, target=(0.0, 1.0, 0.0), fov=24.0), SIZE, SIZE)
cloud = scan(octree, eye, directions)
light = ambient_occlusion(octree, cloud.points, cloud.normals, leaving=cloud.faces)
print(f"{len(cloud.points):,} points, light from {light.min():.3f} to {light.max():.3f}")

plt.figure(figsize=(6, 5)).add_subplot(facecolor="lightsteelblue")
plt.scatter(*cloud.points[:, :2].T, c=light, s=1600 / SIZE, cmap="bone", linewidths=0)
plt.colorbar(label="share of even light")
plt.axis("equal")
plt.title("Ambient occlusion of scanned points")
plt.show()
