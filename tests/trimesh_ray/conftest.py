"""No test leaves the drop-in installed for those after it, in whichever order they run."""

from collections.abc import Iterator

import pytest
import trimesh

from renderer.trimesh_ray import RayMeshIntersector


@pytest.fixture(autouse=True)
def nothing_is_left_installed() -> Iterator[None]:
    yield
    assert type(trimesh.creation.box().ray) is not RayMeshIntersector
