"""Steps of the search for closest hits: against the visits that the picture of a ray's boxes draws."""

import numpy as np
import pytest
from meshes import make_mesh, rays_at

from renderer import BruteForce, Mesh, Octree
from renderer.diagnostics.tree_boxes import visited
from renderer.mesh.shapes import icosphere
from renderer.trace.layout import BLOCK_FACES

pytestmark = pytest.mark.judges("BruteForce", "Octree.count_steps", "Steps")


@pytest.mark.parametrize("kind", ["lattice", "soup"])
def test_each_ray_takes_the_steps_that_are_drawn(kind):
    vertices, faces = make_mesh(kind, 5, 400)
    octree = Octree(vertices, faces)
    origins, directions = rays_at(vertices, faces, 7, 60)
    steps = octree.count_steps(origins, directions)
    for i, ray in enumerate(zip(origins, directions, strict=True)):
        visits = visited(octree, *ray)
        # The root is entered to see that none of its boxes is met; there the drawing has nothing.
        assert steps.nodes[i] == max(1, sum(not visit.is_leaf for visit in visits))
        leaves = sum(visit.is_leaf for visit in visits)
        assert leaves <= steps.triangles[i] <= leaves * 32 and (steps.triangles[i] > 0) == (leaves > 0)
    assert steps.triangles.max() > BLOCK_FACES


def faces_by_leaf(octree):
    """The number of faces of each leaf, by the corners of its box: the words of nodes as ``trace.layout`` has them."""
    words, links = octree.tree.nodes.reshape(-1, 64), octree.tree.links.reshape(-1, 64)
    found = {}
    for node, place in zip(*np.nonzero((words[:, :8] <= words[:, 8:16]) & (links[:, 48:56] < 0)), strict=True):
        code = ~int(links[node, 48 + place])
        first, blocks = code >> 3, (code & 7) + 1
        faces = octree.tree.faces[4 * first : 4 * (first + blocks)]
        box = tuple(float(words[node, 16 * axis + side + place]) for side in (0, 8) for axis in range(3))
        found.setdefault(box, set()).add(int((faces >= 0).sum()))
    return found


@pytest.mark.parametrize("leaf_size", [1, 4, 32])
def test_each_ray_tests_the_faces_of_the_leaves_that_it_opens(leaf_size):
    vertices, faces = make_mesh("soup_float32", 5, 400)
    octree = Octree(vertices, faces, leaf_size=leaf_size)
    leaves, told = faces_by_leaf(octree), 0
    origins, directions = rays_at(vertices, faces, 7, 60)
    steps = octree.count_steps(origins, directions)
    for i, ray in enumerate(zip(origins, directions, strict=True)):
        opened = [leaves[(*visit.lower, *visit.upper)] for visit in visited(octree, *ray) if visit.is_leaf]
        if all(len(sizes) == 1 for sizes in opened):  # of leaves with one box, which was opened is not known
            assert steps.triangles[i] == sum(sum(sizes) for sizes in opened)
            told += 1
    assert told > 0.9 * len(origins)


def test_brute_force_tests_all_and_misses_nothing():
    # 317 faces do not fill the last block.
    for mesh in (icosphere(2), Mesh(icosphere(2).vertices, icosphere(2).faces[:-3])):
        steps = BruteForce.from_mesh(mesh).count_steps(np.zeros((2, 5, 3)), [0.0, 0.0, 1.0])
        assert steps.nodes.shape == (2, 5) and not steps.nodes.any() and (steps.triangles == len(mesh.faces)).all()
