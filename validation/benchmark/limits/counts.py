"""What the rays of a family read and test, a ray on average: in our tree, and in the model of Embree's BVH8.

``python -m validation.benchmark.limits.counts MESH`` prints it with the bounds that follow.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.trace.ray_lanes import WIDTH
from validation.benchmark.limits import machine, roofline
from validation.benchmark.limits.caches import Caches, caches, reads
from validation.benchmark.limits.trees import PlainTree, bvh8_of, octree_of
from validation.benchmark.limits.walks import (
    BEAM_NODES,
    BLOCKS,
    LEAF_BOXES,
    NODES,
    PACKETS,
    TRIANGLES,
    walk,
)
from validation.benchmark.measures.families import families
from validation.benchmark.measures.meshes import named
from validation.benchmark.peers.contender import Family

# Rays in a row that are followed: the first half warms the caches, the second is counted. They read some hundred
# megabytes, more than the last cache of most machines.
RAYS = 1 << 16


def measure(mesh: Mesh, count: int, of: Caches, step: Callable[[str], None]) -> list[dict[str, Any]]:
    """A row for each family of ``count`` rays: ``ours`` and ``embree``, counts a ray as in ``counted``."""
    step(f"{mesh.name}: what rays read")
    octree = Octree.from_mesh(mesh)
    trees = {"ours": octree_of(octree), "embree": bvh8_of(octree)}
    rows = []
    for family in families(octree, count):
        some = in_a_row(family, RAYS)
        rows.append(
            {"mesh": mesh.name, "faces": len(mesh.faces), "family": family.name}
            | {name: counted(octree, tree, some, of, name == "ours") for name, tree in trees.items()}
        )
    return rows


def counted(octree: Octree, tree: PlainTree, rays: Family, of: Caches, together: bool) -> dict[str, Any]:
    """Counts a ray, those of packets shared by their sixteen rays.

    nodes, blocks, triangles  that a ray is tested against alone; a node is eight boxes, a block four triangles
    beams, leaf_boxes         nodes and boxes of leaves that sixteen rays are tested against together
    packed                    the share of rays that begin in a packet
    lines                     cache lines read
    from_, waits              lines, and records, from each cache and from memory
    """
    found = walk(tree, octree.mesh.triangles, rays, together)
    half = len(rays) // 2
    warm, counts = int(found.ends[half - 1]), found.sums / len(rays)
    read = reads(tree, found.records, warm, of.levels)
    return {
        "nodes": counts[NODES], "blocks": counts[BLOCKS], "triangles": counts[TRIANGLES],
        "beams": counts[BEAM_NODES], "leaf_boxes": counts[LEAF_BOXES], "packed": WIDTH * counts[PACKETS],
        "lines": read.lines / (len(rays) - half), "from": [int(n) / (len(rays) - half) for n in read.from_],
        "waits": [int(n) / (len(rays) - half) for n in read.waits],
    }  # fmt: skip


def in_a_row(family: Family, count: int) -> Family:
    """Rays that follow each other in the middle of the family, as a thread traces them."""
    begin = max(0, (len(family) - count) // 2) // WIDTH * WIDTH
    part = slice(begin, begin + count)
    return Family(family.name, family.origins[part], family.directions[part], family.t_max, family.beyond)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the counts and bounds of one mesh."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark.limits.counts", description=__doc__)
    parser.add_argument("mesh", help="number of faces of spheres, another kind and its faces (city_100k), or a file")
    parser.add_argument("--rays", type=int, default=1_000_000, metavar="N", help="rays of a family")
    options = parser.parse_args(arguments)
    of = caches()
    rates = machine.rates(of)
    print("rates in ns:", ", ".join(f"{name} {_text(value)}" for name, value in rates.items()))
    for row in measure(named(options.mesh), options.rays, of, lambda _: None):
        for name in ("ours", "embree"):
            print(f"{row['mesh']} {row['family']:7} {name:6}", *(f"{k} {_text(v)}" for k, v in row[name].items()))
        bounds = roofline.bounds(row["ours"], rates)
        print("  bounds in ns, one thread:", ", ".join(f"{name} {value:.0f}" for name, value in bounds.items()))
    return 0


def _text(value: Any) -> str:
    return "/".join(f"{v:.2f}" for v in value) if isinstance(value, list) else f"{value:.2f}"


if __name__ == "__main__":
    sys.exit(main())
