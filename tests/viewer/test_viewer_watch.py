"""Files that are watched: an edited scene is shown anew, once, after its editor has written it whole."""

import asyncio
import json
import os
import threading
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from viewer_client import PATIENCE, Client, rendered
from viewer_page import MODELS, SCENE

import renderer
from renderer import load_scene
from renderer.picture.image import srgb
from renderer.viewer import app, shown, watch
from renderer.viewer.app import Viewer
from renderer.viewer.session import Connection, Session
from renderer.viewer.shown import ShownScene, open_file
from renderer.viewer.watch import Watch, follow

OTHER = SCENE.replace("[0.7, 0.1, 0.1]", "[0.1, 0.1, 0.7]")


def test_an_edit_is_told_once_after_it_has_rested(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(SCENE)
    scene, files = open_file(file), Watch()
    assert files.edited([scene]) == set()
    file.write_text(SCENE + "\n")
    assert files.edited([scene]) == set()  # which may be the half of it
    file.write_text(SCENE + "\n# and more")
    assert files.edited([scene]) == set()
    assert files.edited([scene, scene]) == {scene}
    assert files.edited([scene]) == set()  # where it cannot be loaded, that is said once
    file.write_text(SCENE + "\n# and yet more")
    assert [files.edited([scene]) for _ in range(3)] == [set(), {scene}, set()]
    file.unlink()
    assert [files.edited([scene]) for _ in range(3)] == [set(), {scene}, set()]


def test_a_scene_that_is_not_shown_any_more_is_forgotten(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(SCENE)
    scene, files = open_file(file), Watch()
    file.write_text(SCENE + "\n")
    files.edited([scene])
    files.edited([])
    assert files.edited([scene]) == set() and files.edited([scene]) == {scene}


def test_an_edited_scene_is_shown_by_itself(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text(SCENE)
    with renderer.view(file, browser=False) as viewing, Client(viewing.url) as client:
        before = client.final()
        file.write_text(SCENE.replace("shininess = 40", "shininess = forty"))
        assert "a.toml" in client.told("error")["message"]
        assert client.final().payload == before.payload
        file.write_text(SCENE.replace("[0.7, 0.1, 0.1]", "[0.1, 0.1, 0.7]"))
        assert client.told("scene")["id"]
        after = client.final()
        assert np.array_equal(after.rgb, srgb(rendered(load_scene(file)).radiance))
        assert after.payload != before.payload


def test_a_mesh_that_changes_while_its_scene_is_loaded_counts_as_edited(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its mark was taken after it was read, and the page showed the old one for ever."""
    mesh, file = tmp_path / "block.ply", tmp_path / "a.toml"
    mesh.write_bytes((MODELS / "block.ply").read_bytes())
    file.write_text(SCENE.replace(str(MODELS / "block.ply"), "block.ply"))
    assert not open_file(file).edited

    def slow(path: Path, **options: Any) -> Any:
        scene = load_scene(path, **options)
        mesh.write_bytes((MODELS / "stairs.ply").read_bytes())
        return scene

    monkeypatch.setattr(shown, "load_scene", slow)
    assert open_file(file).edited


class Page:
    """A session without a socket: what it was told, and what it did about its scene, in order."""

    def __init__(self, file: Path) -> None:
        self.viewer, self.told, self.done = Viewer(open_file(file)), [], []
        self.session = Session(self.viewer, Connection(self._hear, self._hear), self.viewer._threads)
        self.viewer.sessions.add(self.session)
        self._answer, self.session._wanted = self.session._wanted, self._noting  # type: ignore[method-assign]

    async def _hear(self, message: Any) -> None:
        self.told.append(json.loads(message))

    async def _noting(self, wanted: Any) -> ShownScene:
        try:
            return await self._answer(wanted)
        finally:
            self.done.append(type(wanted).__name__)

    async def ask(self, **message: Any) -> None:
        await self.session.receive(json.dumps(message))

    async def did(self, number: int) -> None:
        """Wait until so many wishes are fulfilled or refused, and what comes of the last is shown."""
        async with asyncio.timeout(PATIENCE):
            while len(self.done) < number:
                await asyncio.sleep(0.001)
            await asyncio.sleep(0.001)


def lives(file: Path, scenario: Callable[[Page], Awaitable[None]], begun: bool = True) -> Page:
    """The page that shows ``file`` after the scenario, in which its session runs, or from its end on."""

    async def all_of_it() -> Page:
        page = Page(file)
        running = asyncio.create_task(page.session.run()) if begun else None
        await scenario(page)
        if running is None:
            running = asyncio.create_task(page.session.run())
            await page.did(1)
        running.cancel()
        with suppress(asyncio.CancelledError):
            await running
        await page.viewer.stop()
        return page

    return asyncio.run(all_of_it())


def folder_of(tmp_path: Path, *names: str) -> Path:
    for name in names:
        (tmp_path / name).write_text(SCENE)
    return tmp_path / names[0]


def test_an_edit_while_another_scene_is_opened_does_not_bring_the_old_one_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The edit was noted with the scene that was shown by then, which came after the one that was asked for."""
    file = folder_of(tmp_path, "a.toml", "b.toml")
    begun, edited = threading.Event(), threading.Event()
    open_one = app.open_file

    def slow(path: Path, up: Any) -> ShownScene:
        begun.set()
        assert edited.wait(PATIENCE)
        return open_one(path, up)

    async def scenario(page: Page) -> None:
        monkeypatch.setattr(app, "open_file", slow)
        await page.ask(type="scene", file="b.toml")
        await asyncio.to_thread(begun.wait, PATIENCE)
        file.write_text(OTHER)
        page.session.reload()
        edited.set()
        await page.did(2)

    page = lives(file, scenario)
    assert page.session.shown.name == "b.toml"
    assert [message["type"] for message in page.told] == ["scene"]  # which was not edited


@pytest.mark.parametrize("asked", [{"type": "scene", "file": "b.toml"}, {"type": "hide", "hidden": ["floor"]}])
def test_an_edit_takes_no_wish_of_the_page_away(tmp_path: Path, asked: dict[str, Any]) -> None:
    file = folder_of(tmp_path, "a.toml", "b.toml")

    async def scenario(page: Page) -> None:
        await page.ask(**asked)
        file.write_text(OTHER)
        page.session.reload()

    shown = lives(file, scenario, begun=False).session.shown
    assert (shown.name, shown.hidden) == (asked.get("file", "a.toml"), tuple(asked.get("hidden", ())))


def test_an_edit_is_shown_where_the_wish_that_came_first_is_refused(tmp_path: Path) -> None:
    file = folder_of(tmp_path, "a.toml")

    async def scenario(page: Page) -> None:
        file.write_text(OTHER)
        page.session.reload()
        await page.ask(type="scene", file="none.toml")
        await page.did(2)

    page = lives(file, scenario)
    assert [message["type"] for message in page.told] == ["error", "scene"] and page.done[-1] == "Reload"
    assert page.session.shown.scene.materials["red"].diffuse == (0.1, 0.1, 0.7)


def test_a_scene_beside_that_is_gone_is_told_of_and_stays(tmp_path: Path) -> None:
    """The server's own was shown in its place, without a word."""
    file = folder_of(tmp_path, "a.toml", "b.toml")

    async def scenario(page: Page) -> None:
        await page.ask(type="scene", file="b.toml")
        await page.did(1)
        (tmp_path / "b.toml").unlink()
        page.session.reload()
        await page.did(2)

    page = lives(file, scenario)
    assert page.session.shown.name == "b.toml"
    assert [message["type"] for message in page.told] == ["scene", "error"]
    assert "b.toml: cannot be read" in page.told[-1]["message"] and page.told[-1]["stays"]


def test_a_scene_whose_name_is_no_text_is_shown_anew(tmp_path: Path) -> None:
    """Its name was no message's, and from then on no page saw an edit."""
    try:
        file = folder_of(tmp_path, os.fsdecode(b"caf\xe9.toml"))
    except OSError:
        pytest.skip("this file system takes text alone")

    async def scenario(page: Page) -> None:
        file.write_text(OTHER)
        page.session.reload()
        await page.did(1)

    page = lives(file, scenario)
    assert page.session.shown.scene.materials["red"].diffuse == (0.1, 0.1, 0.7)


def test_one_session_that_fails_leaves_the_other_pages_watched(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    class Watched:
        shown, reloads = object(), 0

        def reload(self) -> None:
            self.reloads += 1
            raise ValueError("what no page has done yet")

    looks = 0

    def edited(_watch: Watch, scenes: list[object]) -> set[object]:
        nonlocal looks
        looks += 1
        if looks == 2:
            raise OSError("no file can be looked at")
        return set(scenes)

    monkeypatch.setattr(Watch, "edited", edited)
    monkeypatch.setattr(watch, "PERIOD", 0.001)
    pages = [Watched(), Watched()]

    async def some_looks() -> None:
        following = asyncio.create_task(follow(set(pages)))  # type: ignore[arg-type]
        async with asyncio.timeout(PATIENCE):
            while looks < 4 and not following.done():
                await asyncio.sleep(0.001)
        following.cancel()

    asyncio.run(some_looks())
    assert looks == 4 and all(page.reloads >= 2 for page in pages)
    assert "could not be looked at" in caplog.text and "could not be loaded again" in caplog.text
