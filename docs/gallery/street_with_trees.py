"""
Radiant temperature in a street with trees
==========================================

What a person in a street feels of the sun-warmed walls, the cool sky and the crowns of trees: view factors in the six
directions of a cube, weighed as a body that stands receives them.
"""

import matplotlib.pyplot as plt
import numpy as np

from renderer import Mesh, Octree
from renderer.shapes import box
from renderer.studies import view_factors_from

ground = Mesh([[-30, -60, 0], [30, -60, 0], [30, 60, 0], [-30, 60, 0]], [[0, 1, 2], [0, 2, 3]])
houses = [box((-22, -50, 0), (-8, 50, 12)), box((8, -50, 0), (22, 50, 12))]
crowns = [box((2, y, 3), (6, y + 4, 8)) for y in range(-30, 30, 12)]
parts = [ground, *houses, *crowns]
# Three surfaces: the ground, the walls, and the leaves, of which each face lets half of the light through.
groups = np.repeat([0, 1, 1, *[2] * len(crowns)], [len(part.faces) for part in parts])
across = np.linspace(-7, 7, 29)
people = np.stack([across, np.zeros(29), np.full(29, 1.1)], axis=1)
normals, weights = np.concatenate([np.eye(3), -np.eye(3)]), [0.22, 0.22, 0.06] * 2
kelvin = np.array([310.0, 305.0, 298.0])  # ground, walls, leaves

for count, label in ((3, "without trees"), (len(parts), "with trees")):
    octree = Octree.from_mesh(Mesh.concatenate(parts[:count]))
    own, total = groups[: len(octree.mesh.faces)], np.zeros(29)
    for normal, weight in zip(normals, weights, strict=True):
        seen = view_factors_from(octree, people, normal, own, transmittance=np.where(own == 2, 0.5, 0.0), rtol=0.003)
        total += weight * (seen.matrix @ kelvin[: own.max() + 1] ** 4 + seen.sky * 270.0**4)
    plt.plot(across, total**0.25 - 273.15, label=label)
plt.xlabel("place across the street, m")
plt.ylabel("mean radiant temperature, long wave, °C")
plt.legend()
plt.show()
