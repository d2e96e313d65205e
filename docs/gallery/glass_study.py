"""
Glass study
===========

A glass ball with a growing index of refraction: reflections and the image inside the ball change by the laws of Snell
and Fresnel.
"""

import os

import matplotlib.pyplot as plt

from renderer import (
    Dielectric,
    DirectionalLight,
    Floor,
    PerspectiveCamera,
    Phong,
    Scene,
    SceneObject,
    load_mesh,
    render,
    srgb,
)

SIZE = int(os.environ.get("GALLERY_SIZE", "400"))

ball = load_mesh("../../scenes/models/sphere.ply")
figure, plots = plt.subplots(2, 2, figsize=(7, 7), layout="constrained")
for axes, ior in zip(plots.flat, (1.05, 1.33, 1.5, 2.4), strict=True):
    scene = Scene(
        camera=PerspectiveCamera(eye=(0.0, 2.2, 5.0), target=(0.0, 0.9, 0.0), fov=38.0),
        materials={"glass": Dielectric(ior=ior), "light": Phong(diffuse=0.75), "dark": Phong(diffuse=0.1)},
        lights=[DirectionalLight(direction=(0.4, -1.0, -0.5), irradiance=1.0)],
        objects=[SceneObject(mesh=ball, material="glass", normals="smooth", translate=(0.0, 1.05, 0.0))],
        floor=Floor(min=(-6.0, -6.0), max=(6.0, 6.0), squares=(16, 16), materials=["light", "dark"]),
        ambient=0.1,
        background=(0.55, 0.68, 0.85),
    )
    axes.imshow(srgb(render(scene, resolution=(SIZE // 2, SIZE // 2), samples=9, max_depth=8).radiance))
    axes.set(title=f"index {ior}", xticks=[], yticks=[])
plt.show()
