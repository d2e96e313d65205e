"""Settings for tests that draw many pictures of the same meshes."""

from collections.abc import Iterator
from typing import Any

import pytest

from renderer.picture import prepare


@pytest.fixture(scope="module")
def built_once() -> Iterator[None]:
    """Pictures of the same meshes share an octree, which none of them changes."""
    built: dict[Any, Any] = {}

    def once(mesh: Any, *how: Any) -> Any:
        asked = mesh.vertices.tobytes(), mesh.faces.tobytes(), how
        if asked not in built:
            built[asked] = build(mesh, *how)
        return built[asked]

    build = prepare.build_octree
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prepare, "build_octree", once)
        yield
