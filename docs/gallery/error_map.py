"""
Error map against Mitsuba
=========================

One scene, drawn by this renderer and by a Whitted ray tracer over Mitsuba's hits, materials and lights. Mitsuba traces
in float32, which explains the difference; a silhouette may also fall on the other side of a pixel's centre.
"""

import os
from importlib.util import find_spec

import matplotlib.pyplot as plt
import numpy as np

from renderer import load_scene, render

SIZE = int(os.environ.get("GALLERY_SIZE", "400")) // 3

if find_spec("mitsuba") is None:
    print("skipped: Mitsuba is not installed (pip install '.[validate]')")
else:
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    from validation.references.mitsuba.whitted import whitted

    scene = load_scene("../../scenes/glass.toml")
    ours = render(scene, resolution=(SIZE, SIZE), max_depth=6, samples=1, min_weight=0.0, offset="mitsuba")
    theirs = whitted(scene, SIZE, SIZE, max_depth=6)
    error = np.abs(ours.radiance - theirs).max(axis=-1)
    print(f"error: at most {error.max():.2g}, mean {error.mean():.2g}, above 0.01 in {(error > 0.01).sum()} pixels")

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    left.imshow(ours.radiance.clip(0.0, 1.0) ** (1 / 2.2))
    shown = right.imshow(np.log10(error + 1e-9), vmin=-8, vmax=0, cmap="magma")
    figure.colorbar(shown, label="log10 of the absolute error")
    left.set(title="ours", xticks=[], yticks=[])
    right.set(title="difference from Mitsuba", xticks=[], yticks=[])
    plt.show()
