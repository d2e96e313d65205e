"""Settings for tests that draw many pictures of the same meshes."""

from collections.abc import Iterator

import pytest
from remembered import remembered

from renderer.picture import prepare


@pytest.fixture(scope="module")
def built_once() -> Iterator[None]:
    """Pictures of the same meshes share an octree, which none of them changes."""
    once = remembered(prepare.build_octree, lambda mesh, *how: (mesh.vertices.tobytes(), mesh.faces.tobytes(), how))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prepare, "build_octree", once)
        yield
