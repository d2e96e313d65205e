"""
Heat in a room with a column
============================

The floor of a room is warm, its ceiling is cool, and a column stands in the way. View factors say which share of the
heat that each wall radiates arrives at which other; the balance of all says what each must be given or takes.
"""

import matplotlib.pyplot as plt
import numpy as np

from renderer import Mesh, Octree
from renderer.radiosity import net_heat
from renderer.shapes import box
from renderer.studies import view_factors

NAMES = ["west", "east", "south", "north", "floor", "ceiling", "column"]
X, Y, Z = [0, 2, 2.6, 5], [0, 1.5, 2.1, 4], [0, 3]


def rectangle(axis, at, low, high, up):
    """Two faces across an axis, seen from the side that ``up`` says."""
    (a, b), (c, d) = low, high
    corners = np.insert(np.array([[a, b], [c, b], [c, d], [a, d]], float), axis, at, axis=1)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return Mesh(corners, faces if up == (axis != 1) else faces[:, ::-1])


parts, walls = [], []
for wall, (axis, at, low, high, up) in enumerate([
    (0, 0, (0, 0), (4, 3), True), (0, 5, (0, 0), (4, 3), False), (1, 0, (0, 0), (5, 3), True), (1, 4, (0, 0), (5, 3), False),
]):
    parts.append(rectangle(axis, at, low, high, up))
    walls.append(wall)
# Floor and ceiling have a hole where the column stands.
for i in range(3):
    for j in range(3):
        if (i, j) != (1, 1):
            cell = (X[i], Y[j]), (X[i + 1], Y[j + 1])
            parts += [rectangle(2, 0, *cell, True), rectangle(2, 3, *cell, False)]
            walls += [4, 5]
column = box((2, 1.5, 0), (2.6, 2.1, 3))
sides = column.faces[column.face_normals()[:, 2] == 0]
parts.append(Mesh(column.vertices, sides))
octree = Octree(Mesh.concatenate(parts))

groups = [*np.repeat(walls, 2), *[6] * len(sides)]
factors = view_factors(octree, groups, rtol=0.005)
celsius = np.array([20.0, 20, 20, 20, 28, 18, 21])
heat = net_heat(factors, emissivity=0.9, temperature=celsius + 273.15)
for name, watts in zip(NAMES, heat.net, strict=True):
    print(f"{name:8} {watts:8.1f} W")
print(f"sum      {heat.net.sum():8.1f} W")

figure, axes = plt.subplots(figsize=(6, 5))
picture = axes.imshow(factors.matrix.toarray(), cmap="viridis")
axes.set_xticks(range(7), NAMES, rotation=45)
axes.set_yticks(range(7), NAMES)
figure.colorbar(picture, label="view factor from row to column")
axes.set_title("View factors of a room with a column")
plt.show()
