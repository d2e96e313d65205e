"""Materials, lights and objects as a page changes them, and the scene file that it saves."""

import json
import math
import shlex
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow
from viewer_client import PATIENCE, SIZE, Client, fetched, looking, rendered
from viewer_page import SCENE

import renderer
from renderer import DirectionalLight, Mirror, Phong, PointLight, Scene, SceneObject, load_scene
from renderer.cli.main import main
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import icosphere
from renderer.picture.image import srgb
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.hide import object_names, without
from renderer.scene.scene import Floor
from renderer.viewer import session
from renderer.viewer.commands import saved as camera_text
from renderer.viewer.commands import scene_text
from renderer.viewer.protocol import Edits, SaveCamera, SaveScene
from renderer.viewer.shown import ShownScene, edited, open_file
from renderer.viewer.viewpoint import camera_of

COMMENTED = f"# kept\n{SCENE.replace('shininess = 40', 'shininess = 40 # like wax')}"
RED = Phong(diffuse=(0.1, 0.2, 0.9), specular=0.6, shininess=9.0, reflectance=0.3)
LAMP = PointLight(position=(1.0, 3.0, 2.0), intensity=(5.0, 4.0, 3.0))


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("edited") / "blocks.toml"
    path.write_text(COMMENTED)
    return path


def described(client: Client, url: str) -> dict[str, Any]:
    return json.loads(fetched(url, f"scene?id={client.told('scene')['id']}"))


def plain(fields: Any) -> Any:
    """As JSON has it."""
    return fields.model_dump(mode="json", exclude_none=True)


@pytest.mark.parametrize(
    ("materials", "lights"),
    [
        ({"glass": Phong(diffuse=0.4), "stone": Phong(diffuse=(0.2, 0.6, 0.2))}, None),  # nothing bounces any more
        ({"stone": Mirror(), "red": RED}, [LAMP, DirectionalLight(direction=(0, -1, 0.2), irradiance=0.4)]),
        ({"red": Mirror(), "glass": Mirror(), "stone": Mirror()}, None),  # which no light falls on
        ({}, []),
    ],
)
def test_the_picture_is_that_of_the_scene_with_these_materials_and_lights(
    client: Client, scene: Path, materials: dict[str, Any], lights: list[Any] | None
) -> None:
    edits: dict[str, Any] = {"materials": {name: plain(material) for name, material in materials.items()}}
    edits |= {} if lights is None else {"lights": [plain(light) for light in lights]}
    seen = client.final(settings={"edits": edits}).rgb
    loaded = load_scene(scene)
    changes = {"materials": {**loaded.materials, **materials}}
    changed = loaded.model_copy(update=changes | ({} if lights is None else {"lights": tuple(lights)}))
    np.testing.assert_array_equal(seen, srgb(rendered(changed).radiance))
    # The scene itself is as it was.
    np.testing.assert_array_equal(client.final().rgb, srgb(rendered(loaded).radiance))


def test_no_tree_is_built_for_other_materials(url: str, client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    from importlib import import_module

    built: list[object] = []
    for place in ("renderer.picture.prepare", "renderer.viewer.shown"):
        module, name = import_module(place), "build_octree"
        monkeypatch.setattr(module, name, lambda *arguments: built.append(arguments))
    before = client.final().rgb
    after = client.final(settings={"edits": {"materials": {"red": plain(RED)}}}).rgb
    assert not built and (before != after).any()


@pytest.mark.parametrize(
    ("edits", "said"),
    [
        ({"materials": {"gold": {"type": "phong"}}}, "edits.materials: expected names among"),
        ({"materials": {"red": {"type": "wood"}}}, "settings.edits.materials.red"),
        ({"lights": [{"type": "directional", "direction": [0, 0, 0]}]}, "settings.edits.lights.0"),
        ({"camera": {}}, "settings.edits.camera"),
        ({"ambient": [0, -1, 0]}, "settings.edits.ambient.1: Input should be greater than or equal to 0, got -1"),
        ({"sky": {"lights": 5000}}, "settings.edits.sky.lights: Input should be less than or equal to 4096, got 5000"),
        ({"sky": {}, "background": [1, 1, 1]}, "background: expected none beside a sky, got (1.0, 1.0, 1.0)"),
    ],
)
def test_what_is_no_edit_is_refused_on_one_line(client: Client, edits: dict[str, Any], said: str) -> None:
    client.view(settings={"edits": edits})
    told = client.told("error")["message"]
    assert said in told and "\n" not in told
    client.final()  # goes on


def test_what_is_hidden_is_neither_seen_nor_hit(client: Client, url: str, scene: Path) -> None:
    hidden = ["objects.1", "floor"]
    client.send(type="hide", hidden=hidden)
    told = described(client, url)
    assert [part["name"] for part in told["objects"] if not part["shown"]] == hidden
    smaller = without(load_scene(scene), hidden)
    assert told["faces"] == sum(len(part.mesh.faces) for part in smaller.instances)
    assert told["name"] == "blocks.toml" and len(told["objects"]) == 3
    np.testing.assert_array_equal(client.final().rgb, srgb(rendered(smaller).radiance))
    pixels = rendered(smaller).face
    y, x = np.argwhere(pixels >= 0)[7].tolist()
    client.send(**{"type": "pick", "seq": 9, "x": x, "y": y, **SIZE, **looking((0.5, 2.6, 5.5))})
    assert client.told("pick")["face"] == pixels[y, x]
    client.send(type="hide", hidden=[])
    assert all(part["shown"] for part in described(client, url)["objects"])
    np.testing.assert_array_equal(client.final().rgb, srgb(rendered(load_scene(scene)).radiance))


def test_objects_hidden_in_one_page_are_seen_in_another(client: Client, url: str, scene: Path) -> None:
    client.send(type="hide", hidden=["floor"])
    client.told("scene")
    with Client(url) as other:
        other.send(type="hello")
        assert all(part["shown"] for part in described(other, url)["objects"])
        np.testing.assert_array_equal(other.final().rgb, srgb(rendered(load_scene(scene)).radiance))


@pytest.mark.parametrize(
    ("hidden", "said"),
    [
        (["objects.9"], "hide: expected objects among"),
        (["x > 1e"], "hide: expected objects among"),
        (["x > -100"], "expected at least one face"),
        (["objects.0", "objects.1", "floor"], "at least one face"),
        (["x" * 41], "hidden.0"),
        ("floor", "hidden"),
    ],
)
def test_what_cannot_be_hidden_is_said(client: Client, hidden: Any, said: str) -> None:
    client.send(type="hide", hidden=hidden)
    assert said in client.told("error")["message"]
    client.final()


def test_a_page_that_comes_back_has_hidden_what_it_had(client: Client, url: str) -> None:
    client.send(type="hello")
    server = described(client, url)["server"]
    for hidden, expected in ((["floor"], ["floor"]), (["floor", "objects.7"], ["floor"])):
        client.send(type="hello", file="blocks.toml", server=server, hidden=hidden)
        told = described(client, url)["objects"]
        assert [part["name"] for part in told if not part["shown"]] == expected
    client.send(type="hello", file="blocks.toml", server=server, hidden=["objects.0", "objects.1", "floor"])
    assert all(part["shown"] for part in described(client, url)["objects"])  # or nothing would be seen


def test_an_edited_file_is_shown_without_what_was_hidden(tmp_path: Path) -> None:
    path = tmp_path / "blocks.toml"
    path.write_text(SCENE)
    with renderer.view(path, browser=False) as viewing, Client(viewing.url) as client:
        client.send(type="hide", hidden=["objects.1"])
        client.told("scene")
        client.final()
        path.write_text(SCENE.replace("0.45, 0.62, 0.82", "0.9, 0.5, 0.1"))
        told = described(client, viewing.url)
        assert [part["shown"] for part in told["objects"]] == [True, False, True] and told["background"][0] == 0.9


def saved(client: Client, **settings: Any) -> dict[str, Any]:
    own = {"samples": 1, "max_depth": 3, **settings}
    client.send(**{"type": "save", **looking((0.5, 2.6, 5.5)), "settings": own})
    return client.told("saved")


def test_a_scene_without_edits_is_saved_as_it_is(tmp_path: Path) -> None:
    """The camera of the page is that of the file but for rounding."""
    text = COMMENTED.replace("target = [0.0, 0.5, 0.0]", "target = [0.0, 0.5, 0.0] # the middle")
    (tmp_path / "blocks.toml").write_text(text)
    with renderer.view(tmp_path / "blocks.toml", browser=False) as viewing, Client(viewing.url) as client:
        told = saved(client)
    assert told["text"] == text and told["diff"] == "" and told["name"] == "blocks.toml"


def test_what_is_edited_is_saved_and_the_rest_stays_as_it_is_written(client: Client, scene: Path) -> None:
    edits = {"materials": {"red": plain(RED), "stone": plain(load_scene(scene).materials["stone"])}}
    told = saved(client, samples=4, shadows=False, edits=edits, light=[0.0, -1.0, 0.25])
    lines = [line for line in told["diff"].splitlines() if line[0] in "+-" and line[:3] not in ("+++", "---")]
    assert sorted(lines) == sorted([
        "-diffuse = [0.7, 0.1, 0.1]", "+diffuse = [0.1, 0.2, 0.9]", "-specular = 0.4", "+specular = [0.6, 0.6, 0.6]",
        "-shininess = 40 # like wax", "+shininess = 9.0 # like wax", "+reflectance = [0.3, 0.3, 0.3]", "+samples = 4",
        "+shadows = false", "-direction = [-0.6, -1.4, -0.8]", "+direction = [0.0, -1.0, 0.25]",
    ])  # fmt: skip
    assert told["text"].startswith("# kept\n")
    # It is the file of the picture that is seen.
    copy = scene.parent / "copy.toml"
    copy.write_text(told["text"])
    again = load_scene(copy)
    copy.unlink()
    assert (
        again.materials["red"] == RED and again.render.samples == 4 and again.lights[0].direction == (0.0, -1.0, 0.25)
    )
    assert again.camera == load_scene(scene).camera and again.objects == load_scene(scene).objects


@pytest.mark.parametrize("number", [0, 3])
def test_lights_that_come_and_go_are_saved(client: Client, scene: Path, number: int) -> None:
    told = saved(client, edits={"lights": [plain(LAMP)] * number})
    copy = scene.parent / "lights.toml"
    copy.write_text(told["text"])
    again = load_scene(copy)
    copy.unlink()
    assert again.lights == (LAMP,) * number and again.floor == load_scene(scene).floor


AROUND = ["ambient = 0.1", "background = [0.45, 0.62, 0.82]"]
NO_SKY = SCENE.replace("\n".join(AROUND), "[sky] # mine\nlights = 8")


@cases(
    ("text", "edits", "lines"),
    [
        (SCENE, {"sky": {"lights": 0}}, ["+[sky]", "-background"]),
        (SCENE, {"background": [0.5, 0.25, 0.0]}, ["+background = [0.5, 0.25, 0.0]", "-background"]),
        (NO_SKY, {"background": [0.5, 0.25, 0.0]}, ["+background = [0.5, 0.25, 0.0]", "-[sky]", "-lights = 8"]),
        (NO_SKY, {"background": [0.0, 0.0, 0.0]}, ["-[sky]", "-lights = 8"]),
        (NO_SKY, {"sky": {"lights": 9}, "ambient": [0.5, 0.25, 0.0]}, ["+ambient", "+lights = 9", "-lights = 8"]),
    ],
)
def test_what_is_around_the_scene_is_saved(tmp_path: Path, text: str, edits: dict[str, Any], lines: list[str]) -> None:
    """In the tables of the file, before the first of which other keys stand."""
    file = tmp_path / "a.toml"
    file.write_text(text)
    shown = open_file(file)
    after, diff = text_of(shown, looking((0.5, 2.6, 5.5)), edits)
    changed = [line for line in diff.splitlines() if line[0] in "+-" and line[:3] not in ("+++", "---")]
    for line in lines:
        assert any(found.startswith(line) for found in changed), (line, diff)
    file.write_text(after)
    assert load_scene(file) == edited(shown.scene, Edits.model_validate_json(json.dumps(edits)))


def test_a_mesh_file_is_saved_as_the_scene_that_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "ball.ply"
    save_ply(icosphere(2), path)
    with renderer.view(path, browser=False) as viewing, Client(viewing.url) as client:
        told = saved(client)
    copy = tmp_path / told["name"]
    assert copy.name == "ball.toml" and all(line[0] in "+-@" for line in told["diff"].splitlines())
    copy.write_text(told["text"])
    again, made = load_scene(copy), load_scene(path)
    np.testing.assert_allclose(again.camera.eye, (0.5, 2.6, 5.5))
    assert again.sky == made.sky and again.floor == made.floor and again.objects[0].crease == made.objects[0].crease


def test_a_scene_without_a_file_and_one_edited_meanwhile_are_not_saved(tmp_path: Path) -> None:
    ball = SceneObject(mesh=icosphere(1), material="grey")
    eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
    made = Scene(camera=eye, materials={"grey": Phong()}, objects=[ball])
    with renderer.view(made, browser=False) as viewing, Client(viewing.url) as client:
        client.send(**{"type": "save", **looking((0.5, 2.6, 5.5))})
        assert "save: expected a scene file or a mesh file" in client.told("error")["message"]
    path = tmp_path / "blocks.toml"
    path.write_text(SCENE)
    with renderer.view(path, browser=False) as viewing, Client(viewing.url) as client:
        path.unlink()
        client.send(**{"type": "save", **looking((0.5, 2.6, 5.5))})
        assert "save: expected the file as it was loaded" in client.told("error")["message"]


def text_of(shown: ShownScene, view: dict[str, Any], edits: dict[str, Any] | None = None) -> tuple[str, str]:
    """The scene's file as it is saved for that view, and the diff."""
    settings = {"max_depth": 3, "edits": edits or {}}
    asked = SaveScene.model_validate_json(json.dumps({"type": "save", **view, "settings": settings}))
    return scene_text(shown, asked)[1:]


RED_TABLE = """[materials.red]
diffuse = [0.7, 0.1, 0.1]
specular = 0.4
shininess = 40
"""
RED_DOTTED = "red.diffuse = [0.7, 0.1, 0.1] # d\nred.specular = 0.4\n"


@cases(
    "text",
    [
        SCENE.replace(RED_TABLE, f"[materials]\n{RED_DOTTED}red.shininess = 40\n"),
        SCENE.replace(RED_TABLE, f"[materials]\n{RED_DOTTED}blue.diffuse = 0.2\nred.shininess = 40\n"),
        SCENE.replace(RED_TABLE, "[materials]\nred.diffuse = 0.3\n"),
        SCENE.replace(RED_TABLE, "[materials]\nred = {diffuse = 0.3, specular = 0.4}\n"),
        SCENE.replace(RED_TABLE, "").replace(
            "ambient", f"materials.{RED_DOTTED.replace(chr(10) + 'red', chr(10) + 'materials.red')}ambient", 1
        ),
    ],
)
def test_a_material_in_dotted_keys_becomes_one_of_another_type(tmp_path: Path, text: str) -> None:
    """tomlkit failed, and that ended the connection."""
    file = tmp_path / "a.toml"
    file.write_text(text)
    before = load_scene(file)
    mirror = Mirror(reflectance=0.25)
    after, _ = text_of(open_file(file), looking((0.5, 2.6, 5.5)), {"materials": {"red": plain(mirror)}})
    file.write_text(after)
    again = load_scene(file)
    assert again.materials == {**before.materials, "red": mirror} and again.ambient == before.ambient


def test_a_file_that_tomlkit_cannot_change_is_refused(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rather than saved with other values, or not answered."""
    import tomlkit

    shown, edits = open_file(scene), {"materials": {"red": plain(RED)}}
    expected = "save: expected a file whose values can be changed one by one, got one "
    for dumps, says in ((lambda _document: "a = 1", "that would hold"), (lambda _document: [][1], "on which tomlkit")):
        monkeypatch.setattr(tomlkit, "dumps", dumps)
        with pytest.raises(ValueError, match=expected + says):
            text_of(shown, looking((0.5, 2.6, 5.5)), edits)


def test_a_file_that_may_not_be_read_any_more_is_told_of(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """It ended the connection."""

    def refused(*_: Any, **_options: Any) -> Any:
        raise PermissionError(13, "Permission denied")

    for name in ("read_text", "read_bytes"):
        monkeypatch.setattr(Path, name, refused)
    client.send(**{"type": "save", **looking((0.5, 2.6, 5.5))})
    assert client.told("error")["message"].endswith("blocks.toml: cannot be read: Permission denied")
    client.final()


def test_others_are_answered_while_a_scene_is_saved(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing else was done meanwhile, half a second for a file of 300 kB."""
    answered = threading.Event()

    def slow(*arguments: Any) -> tuple[str, str]:
        assert answered.wait(PATIENCE)
        return scene_text(*arguments)

    monkeypatch.setattr(session, "scene_text", slow)
    with Client(url) as one, Client(url) as other:
        one.send(**{"type": "save", **looking((0.5, 2.6, 5.5))})
        assert other.final(w=64, h=48).last and one.final(w=64, h=48).last
        answered.set()
        assert one.told("saved")["name"] == "blocks.toml"


@cases("end", ["\n", "\r\n"])
@cases("mark", ["", "\ufeff"])
def test_ends_of_lines_and_the_mark_of_the_encoding_stay(tmp_path: Path, mark: str, end: str) -> None:
    """Each line ended in a line feed, which the diff did not show."""
    file = tmp_path / "a.toml"
    written = mark + COMMENTED.replace("\n", end)
    file.write_bytes(written.encode())
    shown = open_file(file)
    assert text_of(shown, looking((0.5, 2.6, 5.5))) == (written, "")
    after, diff = text_of(
        shown, looking((0.5, 2.6, 5.5)), {"materials": {"red": plain(RED)}, "lights": [plain(LAMP)] * 2}
    )
    assert after.startswith(mark) and after.count("\n") == after.count(end) > 0
    assert "+reflectance = [0.3, 0.3, 0.3]" in diff.split("\n") and "\r" not in diff
    file.write_bytes(after.encode())
    assert load_scene(file).lights == (LAMP, LAMP)


def places(far: float) -> Iterator[tuple[float, float, float]]:
    rng = np.random.default_rng(5)
    for x, y, z in rng.uniform((-6.0, 0.5, 3.0), (6.0, 5.0, 7.0), (12, 3)).tolist():
        yield x + far, y, z - far


@cases("far", [0.0, 5.4e6])
@cases("film", [{}, {"height": 3.0}])
def test_a_saved_camera_has_the_rays_of_the_picture_to_the_bit(
    tmp_path: Path, film: dict[str, Any], far: float
) -> None:
    """Its target was set farther away, and pixels seen through glass were others by its rounding."""
    file = tmp_path / "a.toml"
    text = SCENE.replace("[-0.8, 0.0, -0.3]", f"[{far - 0.8}, 0.0, {-far - 0.3}]").partition("[floor]")[0]
    file.write_text(text.replace("[0.8, 0.01, 0.6]", f"[{far + 0.8}, 0.01, {0.6 - far}]"))
    shown, middle = open_file(file), np.array([far, 0.5, -far])
    for eye in places(far):
        right, up, forward = PerspectiveCamera(eye=eye, target=middle.tolist()).frame()
        view = {"m": [*right, 0.0, *up, 0.0, *-forward, 0.0, *eye, 1.0], "fovy": 0.7, **film}
        rows = camera_of(view["m"], view["fovy"], height=view.get("height")).rows(72, 54)
        file.with_name("b.toml").write_text(text_of(shown, view)[0])
        again = load_scene(file.with_name("b.toml")).camera
        assert again.rows(72, 54).tobytes() == rows.tobytes()
        distance = math.dist(again.target, again.eye)
        assert distance == pytest.approx(math.dist(eye, middle), rel=0.5)
        asked = SaveCamera.model_validate_json(json.dumps({"type": "camera", **view}))
        assert f"target = {list(again.target)!r}\n" in camera_text(shown, asked)


FAR = (5e5, 100.0, 5.4e6)


@pytest.mark.parametrize("turn", [0.0, 1e-9, 4e-6])
def test_a_small_turn_far_from_the_origin_is_no_rounding(tmp_path: Path, turn: float) -> None:
    """Directions were compared by the size of coordinates."""
    x, y, z = FAR
    text = SCENE.replace("eye = [0.5, 2.6, 5.5]", f"eye = [{x + 0.5}, {y + 2.6}, {z + 5.5}]")
    text = text.replace("target = [0.0, 0.5, 0.0]", f"target = [{x}, {y + 0.5}, {z}]")
    (tmp_path / "a.toml").write_text(text)
    shown = open_file(tmp_path / "a.toml")
    own = shown.scene.camera
    right, up, forward = own.frame()
    right, forward = (
        right * math.cos(turn) + forward * math.sin(turn),
        forward * math.cos(turn) - right * math.sin(turn),
    )
    m = [*right, 0.0, *up, 0.0, *-forward, 0.0, *own.eye, 1.0]
    _, diff = text_of(shown, {"m": m, "fovy": math.radians(38.0)})
    assert (diff == "") == (turn == 0.0)


def test_the_command_leaves_out_what_is_hidden(client: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    client.send(type="hide", hidden=["objects.1", "floor"])
    client.told("scene")
    seen = client.final().rgb
    client.send(**{"type": "command", "mode": "octree", **looking((0.5, 2.6, 5.5)), **SIZE})
    words = shlex.split(client.told("command")["text"])
    monkeypatch.chdir(tmp_path)
    assert main([*words[1:], "--quiet"]) == 0
    with Pillow.open(tmp_path / "blocks.png") as written:
        np.testing.assert_array_equal(np.asarray(written)[..., :3], seen)


def test_names_of_objects() -> None:
    ball = SceneObject(mesh=icosphere(1), material="grey")
    eye = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
    made = Scene(camera=eye, materials={"grey": Phong()}, objects=[ball, ball])
    assert object_names(made) == ("objects.0", "objects.1")
    tiled = Scene(camera=eye, materials={"grey": Phong()}, floor=Floor(min=(0, 0), max=(1, 1), materials=["grey"]))
    assert object_names(tiled) == ("floor",) and without(tiled, ["floor"]).instances == ()
