"""The sweep of the octree's options: all trees give the same bits, and one that does not is reported."""

import dataclasses

import numpy as np
import pytest

from renderer import Mesh, Octree
from validation.benchmark.measures import tree_options
from validation.benchmark.measures.tree_options import DEFAULT, LEAF_SIZES, SWEEPS, differing_rays, measure
from validation.efficiency.hits import turned_mesh
from validation.hits.rays import RayFamily, random_rays


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return turned_mesh(2)


@pytest.fixture(scope="module")
def rays(mesh: Mesh) -> RayFamily:
    return random_rays(mesh.triangles, 300, np.random.default_rng(1))


def test_no_option_changes_a_bit(mesh: Mesh, rays: RayFamily) -> None:
    record = measure(mesh, (rays,), 1)
    points = {p["name"]: p for p in record["points"]}
    assert record["differing_rays"] == 0 and DEFAULT.name in points
    assert {name for names in record["sweeps"].values() for name in names} <= set(points)
    assert [len(names) for names in record["sweeps"].values()] == [len(row) for row in SWEEPS.values()]
    assert len({p["bytes"] for p in points.values()}) > len(LEAF_SIZES)  # they are different trees
    best = min(points, key=lambda name: points[name]["ns_per_ray"][rays.name])
    assert best in record["fronts"][rays.name]


def test_a_tree_that_answers_otherwise_is_reported(
    mesh: Mesh, rays: RayFamily, monkeypatch: pytest.MonkeyPatch
) -> None:
    moved, built = Mesh(np.nextafter(mesh.vertices, np.inf), mesh.faces), tree_options._built
    monkeypatch.setattr(tree_options, "_built", lambda m, t: built(moved if t.leaf_size == 8 else m, t))
    record = measure(mesh, (rays,), 1)
    differing = {p["name"]: p["differing_rays"] for p in record["points"]}
    assert record["differing_rays"] == sum(differing.values()) > 450
    assert {name for name, count in differing.items() if count} == {
        "midpoint, leaf 8, depth 32",
        "sah, leaf 8, depth 32",
    }


@pytest.mark.parametrize("field", ["t", "face", "u", "v"])
def test_one_changed_bit_of_any_field_is_counted(mesh: Mesh, rays: RayFamily, field: str) -> None:
    hits = Octree.from_mesh(mesh).closest_hit(rays.origins, rays.directions)
    changed = getattr(hits, field).copy()
    changed.view(np.int64)[int(hits.hit.argmax())] ^= 1
    assert differing_rays(hits, hits) == 0
    assert differing_rays(hits, dataclasses.replace(hits, **{field: changed})) == 1
