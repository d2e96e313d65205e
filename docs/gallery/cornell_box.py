"""
The Cornell box by radiosity
============================

Surfaces light each other: the only light is the lamp's emission. The red and the green wall colour what stands
beside them, and no picture after the first costs more than its rays.
"""

import os

import matplotlib.pyplot as plt

from renderer import PerspectiveCamera, load_scene, render
from renderer.radiosity import lit_scene

SIZE = int(os.environ.get("GALLERY_SIZE", "320"))

scene = load_scene("../../scenes/cornell_box.toml")
lit = lit_scene(scene, edge=40, rtol=0.05)

# The box as published, and two other places within it: the lit scene stays the same.
corner = PerspectiveCamera(eye=(30, 500, 20), target=(330, 150, 330), fov=70)
ground = PerspectiveCamera(eye=(500, 40, 30), target=(200, 180, 400), fov=65)
figure, axes = plt.subplots(1, 3, figsize=(12, 4.2), layout="constrained")
for ax, camera in zip(axes, (scene.camera, corner, ground), strict=True):
    image = render(lit, camera=camera, resolution=SIZE, samples=4)
    ax.imshow(image.toned("aces").srgb)
    ax.axis("off")
figure.suptitle(f"{sum(part.faces for part in lit.instances):,} patches")
plt.show()
