"""
Heat in a room with a column
============================

The floor of a room is warm, its ceiling is cool, and a column stands in the way. View factors say which share of what
each surface radiates arrives at which other; the balance of all says what each loses.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np

from renderer import Mesh, Octree
from renderer.radiosity import net_heat
from renderer.shapes import box
from renderer.studies import view_factors

NAMES = ["west", "east", "south", "north", "floor", "ceiling", "column"]
room, column = box((0, 0, 0), (5, 4, 3)), box((2, 1.5, 0), (2.6, 2.1, 3))
sides = column.faces[column.face_normals()[:, 2] == 0]
octree = Octree.from_mesh(Mesh.concatenate(Mesh(room.vertices, room.faces[:, ::-1]), Mesh(column.vertices, sides)))
# Two faces of the box are a wall, in the order of x, y and z.
groups = np.repeat(np.arange(7), [2] * 6 + [len(sides)])
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # the floor under the column sees its backs
    factors = view_factors(octree, groups, rtol=0.005)
heat = net_heat(factors, emissivity=0.9, temperature=np.array([20, 20, 20, 20, 28, 18, 21]) + 273.15)
print(", ".join(f"{name} {watts:.0f} W" for name, watts in zip(NAMES, heat.net, strict=True)))
print(f"sum {abs(heat.net.sum()):.0e} W")

picture = plt.figure(figsize=(6, 5)).add_subplot().imshow(factors.matrix.toarray())
plt.xticks(range(7), NAMES, rotation=45)
plt.yticks(range(7), NAMES)
plt.colorbar(picture, label="view factor from row to column")
plt.title("View factors of a room with a column")
plt.show()
