"""
Turntable
=========

Eight pictures around a scene. The tree is built once.
"""

import os

import matplotlib.pyplot as plt
import numpy as np

from renderer import PerspectiveCamera, load_scene, prepare, render, srgb

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

ready = prepare(load_scene("../../scenes/three_models.toml"))
figure, plots = plt.subplots(2, 4, figsize=(10, 4), layout="constrained")
for axes, turn in zip(plots.flat, np.arange(8) / 8, strict=True):
    eye = (9.5 * np.sin(2 * np.pi * turn), 4.0, 9.5 * np.cos(2 * np.pi * turn))
    image = render(
        ready, camera=PerspectiveCamera(eye=eye, target=(0.0, 1.0, 0.0), fov=40.0), resolution=(SIZE // 2, SIZE // 3)
    )
    axes.imshow(srgb(image.radiance))
    axes.set_title(f"{360 * turn:.0f}°", fontsize=9)
    axes.axis("off")
plt.show()
