"""
An octree, level by level
=========================

The boxes of nodes and leaves. Each box fits its contents tightly, so rays through the gaps test nothing.
"""

import os

import matplotlib.pyplot as plt
from matplotlib.collections import PatchCollection
from matplotlib.patches import Rectangle

from renderer import Octree, load_mesh
from renderer.diagnostics.tree_boxes import boxes_at, levels

DEEPEST = 6 if int(os.environ.get("GALLERY_SIZE", "400")) >= 400 else 2

octree = Octree.from_mesh(load_mesh("../../scenes/models/torus_knot.ply"))
print(f"{octree.stats.faces:,} faces, {octree.stats.nodes:,} nodes, {levels(octree)} levels")
figure, plots = plt.subplots(2, 3, figsize=(9, 6), layout="constrained")
for level, axes in enumerate(plots.flat):
    boxes = boxes_at(octree, min(level, DEEPEST))  # (n, 6): lower x, y, z, upper x, y, z
    frames = [Rectangle((b[0], b[1]), b[3] - b[0], b[4] - b[1]) for b in boxes]
    axes.add_collection(PatchCollection(frames, facecolor="none", edgecolor="tab:blue", linewidth=2 / (level + 1)))
    axes.set_title(f"level {min(level, DEEPEST)}: {len(boxes):,} boxes", fontsize=9)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.axis("off")
plt.show()
