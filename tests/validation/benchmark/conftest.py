"""A small mesh of the series, with its octree and its rays."""

import pytest

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.benchmark.measures.families import families
from validation.benchmark.measures.meshes import displaced_spheres
from validation.benchmark.peers.contender import Family


@pytest.fixture(scope="session")
def mesh() -> Mesh:
    return displaced_spheres(1_000)


@pytest.fixture(scope="session")
def octree(mesh: Mesh) -> Octree:
    return Octree.from_mesh(mesh)


@pytest.fixture(scope="session")
def rays(octree: Octree) -> tuple[Family, ...]:
    return families(octree, 600)
