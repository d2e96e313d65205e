"""A script of a user of trimesh, which knows nothing of the octree: prints its answers as JSON."""

import json
import sys

import numpy as np
import trimesh

# A wall in a city, in metres of its country's grid; a ray that leaves it by a centimetre.
wall = trimesh.Trimesh(
    [[528980.85, 183526.1, 0], [528980.85, 183526.1, 3], [528982.3, 183523.55, 0], [528982.3, 183523.55, 3]],
    [[1, 0, 2], [1, 2, 3]],
    process=False,
)
normal = trimesh.unitize(np.cross(wall.vertices[1] - wall.vertices[0], wall.vertices[2] - wall.vertices[0]))
start = wall.vertices[[0, 2]].mean(axis=0) + [0, 0, 1] + 0.01 * normal
leaves = wall.ray.intersects_any([start], [normal]).tolist()

# A sheet of metal, 10 micrometres thick, and rays straight through it, at its edges and diagonal too.
sheet = trimesh.creation.box(extents=[100, 100, 1e-5])
above = np.array([[x, y, 1.0] for x in range(-50, 51, 10) for y in range(-50, 51, 10)])
_, rays = sheet.ray.intersects_id(above, np.tile([0.0, 0.0, -1.0], (len(above), 1)), multiple_hits=True)
passes = np.bincount(rays, minlength=len(above))

# A bottle with a wall of a tenth of a micrometre: a grid of points within it and around.
bottle, hollow = trimesh.creation.icosphere(subdivisions=2), trimesh.creation.icosphere(subdivisions=2, radius=1 - 1e-7)
hollow.invert()
bottle = trimesh.util.concatenate([bottle, hollow])
axis = np.linspace(-1.2, 1.2, 9)
inside = bottle.contains(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3))

# A bead of a nanometre, in metres, and points half a radius outside and inside.
bead = trimesh.creation.icosphere(subdivisions=3, radius=1e-9)
near = trimesh.proximity.signed_distance(bead, [[1.5e-9, 0, 0], [0, 0.5e-9, 0]])

print(json.dumps({"arguments": sys.argv[1:], "name": __name__, "leaves": leaves, "passes": passes.tolist(),
                  "inside": inside.tolist(), "near": near.tolist()}))  # fmt: skip
