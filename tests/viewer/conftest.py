"""What tests of the viewer share: a scene's file, a server that shows it, and a client that is its page."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from viewer_page import SCENE

import renderer


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("with space") / "blocks.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture(scope="module")
def url(scene: Path) -> Iterator[str]:
    with renderer.view(scene, browser=False) as viewing:
        yield viewing.url


@pytest.fixture
def client(url: str) -> Iterator[Any]:
    from viewer_client import Client  # which needs the extra viewer

    with Client(url) as client:
        yield client
