"""
Visible faces
=============

Which triangles does an eye see? On the left the view from this eye; on the right the same mesh from the side, where
unseen faces are red.
"""

import os

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import to_rgb

from renderer import Octree, PerspectiveCamera, load_mesh
from renderer.scene.camera import primary_rays
from renderer.studies import visible_faces

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

octree = Octree.from_mesh(load_mesh("../../scenes/models/teapot.ply"))
eye, target = (0.0, 2.0, 7.0), (0.1, 0.8, 0.0)
seen = visible_faces(octree, eye, cuts=2)
colors = np.where(seen[:, None], to_rgb("tab:green"), to_rgb("tab:red"))

figure, plots = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for axes, place, title in ((plots[0], eye, "from the eye"), (plots[1], (7.0, 3.0, -1.0), "from the side")):
    origins, directions = primary_rays(PerspectiveCamera(eye=place, target=target, fov=19.0), SIZE, SIZE)
    hits = octree.closest_hit(origins, directions)
    slope = np.abs((hits.normals * directions).sum(axis=-1, keepdims=True))
    picture = np.where(hits.hit[:, None], colors[hits.face] * (0.3 + 0.7 * slope), 1.0)
    axes.imshow(np.nan_to_num(picture).clip(0, 1).reshape(SIZE, SIZE, 3))
    axes.set_title(f"{title}: {seen.mean():.0%} of the faces are seen")
    axes.axis("off")
plt.show()
