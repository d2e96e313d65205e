"""What the browser's tests of the viewer share: a server, Chromium, and a page that is opened once for many tests."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from viewer_page import SCENE, Viewer, chromium, served


@pytest.fixture(scope="session")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene, another one and one that cannot be loaded."""
    folder = tmp_path_factory.mktemp("scenes")
    (folder / "blocks.toml").write_text(SCENE)
    (folder / "other.toml").write_text(SCENE.replace("[0.45, 0.62, 0.82]", "[0.9, 0.5, 0.1]"))
    (folder / "broken.toml").write_text(SCENE.replace("fov = 38", "fov = 400"))
    return folder


@pytest.fixture(scope="session")
def url(scenes: Path) -> Iterator[str]:
    with served(scenes / "blocks.toml") as address:
        yield address


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    pytest.importorskip("uvicorn", reason="the extra viewer is not installed")
    with chromium() as started:
        yield started


@pytest.fixture(scope="session")
def opened(browser: Any, url: str) -> Iterator[Viewer]:
    """The page that most tests share, because opening one takes a second."""
    with Viewer(browser, url).open() as page:
        yield page


@pytest.fixture
def viewer(opened: Viewer) -> Viewer:
    """The shared page as it was when it opened."""
    opened.restart()
    return opened


@pytest.fixture(autouse=True)
def no_faults() -> Iterator[None]:
    """No page may complain on its console, nor leave this machine."""
    Viewer.faults.clear()
    yield
    assert Viewer.faults == []
