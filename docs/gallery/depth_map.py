"""
Depth map of an STL
===================

A mesh file in, an image of distances out. The distances have the same bits as those of a rendered picture.
"""

import os
import tempfile

import matplotlib.pyplot as plt
import trimesh

from renderer import Octree, PerspectiveCamera, load_mesh
from renderer.studies import depth_map

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

with tempfile.TemporaryDirectory() as folder:  # with an STL file of your own, load it instead
    trimesh.load("../../scenes/models/teapot.ply").export(f"{folder}/teapot.stl")
    octree = Octree.from_mesh(load_mesh(f"{folder}/teapot.stl"))

camera = PerspectiveCamera(eye=(2.0, 3.5, 6.0), target=(0.1, 0.7, 0.0), fov=16.0)
depth = depth_map(octree, camera, SIZE, SIZE * 3 // 4)  # inf for the background

plt.imshow(depth, cmap="viridis_r")
plt.colorbar(label="distance from the camera", shrink=0.8)
plt.title("Depth map")
plt.axis("off")
plt.show()
