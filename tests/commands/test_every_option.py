"""Each option of ``octree-render render``, ``info``, ``view`` and ``compile``, given alone: what the library is asked.

An option that is added without a case here, or in the file named beside it, fails.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from cases import cases
from PIL import Image as Pillow
from varied import BASE, Table, picture, scene_of, write_meshes
from watched import results_here

from renderer import Octree, load_scene, srgb
from renderer.cli.cluster import on_cluster
from renderer.cli.main import main, make_parser
from renderer.jit.levels import LEVELS
from renderer.picture.image import PLANES
from renderer.picture.pack import pack

# What a picture is told: the words, and the argument of ``render``.
PICTURES: dict[str, tuple[str, Any]] = {
    "--resolution": ("7x5", {"resolution": (7, 5)}),
    "--max-depth": ("1", {"max_depth": 1}),
    "--samples": ("9", {"samples": 9}),
    "--filter": ("tent", {"filter": "tent"}),
    "--min-weight": ("0.25", {"min_weight": 0.25}),
    "--max-rays": ("5", {"max_rays": 5}),
    "--accelerator": ("brute", {"accelerator": "brute"}),
    "--split": ("midpoint", {"split": "midpoint"}),
    "--threads": ("1", {"threads": 1}),
}
# Those that change no bit.
BITLESS = {"--accelerator", "--split", "--threads"}
# The options that other tests give alone. Those of ``study`` are in tests/checkpoints/test_every_option.py, those of
# ``radiosity`` in test_radiosity_command.py.
HERE = {
    "render": {*PICTURES, "scene", "--output", "--write-scene", "--quiet", "--cluster", "--window"},
    "info": {"scene", "--split"},
    "view": {"scene", "--up", "--write-scene", "--host", "--port", "--no-browser"},
    "compile": {"--queries", "--pictures", "--all", "--level", "--output", "--quiet"},
}
# tests/scene/test_every_change.py, tests/scene/test_up.py, tests/picture/test_matte.py, test_tone.py, test_turntable.py
ELSEWHERE = {"render": {"--change", "--up", "--exposure", "--transparent", "--tone", "--frames"}}


def commands() -> dict[str, argparse.ArgumentParser]:
    """The parser of each command."""
    (choice,) = (action for action in make_parser()._actions if isinstance(action, argparse._SubParsersAction))
    return dict(choice.choices)


def options_of(command: str) -> set[str]:
    """The longest word of each option of a command, or the name of what has none."""
    actions = [action for action in commands()[command]._actions if action.dest != "help"]
    return {max(action.option_strings, key=len, default=action.dest) for action in actions}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("options")
    write_meshes(folder)
    scene_of(folder, BASE)
    return folder


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """What ``render`` and ``render_on`` are asked, which answer as ever, the cluster in this process."""
    asked: list[dict[str, Any]] = []

    def told(of: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *scene, **options: asked.append(options) or of(*scene, **options)

    pictures = import_module("renderer.cluster.pictures")
    monkeypatch.setattr(pictures, "results", results_here)
    monkeypatch.setattr("renderer.cluster.render_on", told(pictures.render_on))
    monkeypatch.setattr("renderer.cli.cluster.on_cluster", lambda options: nullcontext())
    module = import_module("renderer.picture.render")
    monkeypatch.setattr(module, "render", told(module.render))
    return asked


@pytest.fixture
def viewed(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What the viewer is asked for; it ends at once."""
    asked: list[Any] = []

    class Viewing:
        url = "http://here/"

        def open_browser(self) -> None:
            asked.append("browser")

        def wait(self) -> None:
            asked.append("wait")

    @contextmanager
    def view(scene: Path, **options: Any) -> Iterator[Viewing]:
        asked.append((scene, options))
        yield Viewing()

    monkeypatch.setattr("renderer.viewer.view.view", view)
    return asked


def rendered(scene: Path, output: Path, *words: object) -> None:
    assert main(["render", *map(str, (scene, "-o", output, "--quiet", *words))]) == 0


def test_every_option_has_a_case() -> None:
    assert commands().keys() - {"study", "radiosity"} == HERE.keys()
    for command, here in HERE.items():
        assert options_of(command) == here | ELSEWHERE.get(command, set()), command


@pytest.mark.parametrize("where", [[], ["--cluster"]], ids=["here", "cluster"])
@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_that_of_render_with_the_options_argument(
    folder: Path, tmp_path: Path, asked: list[dict[str, Any]], name: str, where: list[str]
) -> None:
    word, given = PICTURES[name]
    for words in ([], [name, word]):
        rendered(folder / "scene.toml", tmp_path / "a.npy", *words, *where)
    usual, told = asked
    # A cluster's threads are its own.
    assert told == usual | (given if not (where and name == "--threads") else {})
    scene = load_scene(folder / "scene.toml")
    found, expected = np.load(tmp_path / "a.npy"), picture(scene, **given).radiance
    assert found.tobytes() == expected.tobytes()
    assert (found.tobytes() != picture(scene).radiance.tobytes()) == (name not in BITLESS)


@pytest.mark.judges("octree-render render --window")
@pytest.mark.parametrize("transparent", [[], ["--transparent"]])
def test_a_window_has_the_pixels_of_the_whole_picture(
    folder: Path, tmp_path: Path, asked: list[dict[str, Any]], transparent: list[str]
) -> None:
    found = []
    for words in ([], ["--window", "3", "2", "9", "7"]):
        rendered(folder / "scene.toml", tmp_path / "a.png", *transparent, *words)
        with Pillow.open(tmp_path / "a.png") as read:
            found.append(np.asarray(read))
    np.testing.assert_array_equal(found[1], found[0][2:7, 3:9])
    assert [told["window"] for told in asked] == [None, [3, 2, 9, 7]]


@cases(
    ("words", "said"),
    [
        (["9", "2", "3", "7"], "window: expected left < right, top < bottom, four integers within 10 x 8 pixels"),
        (["0", "0", "11", "8"], "within 10 x 8 pixels, got"),
        (["-1", "0", "4", "8"], "within 10 x 8 pixels, got"),
        (["3", "2", "9", "7", "--cluster"], "--window: expected a picture of this machine, got --cluster"),
    ],
)
def test_a_window_that_is_none_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    output = tmp_path / "a.npy"
    assert main(["render", str(folder / "scene.toml"), "-o", str(output), "--quiet", "--window", *words]) == 2
    assert said in capsys.readouterr().err and not output.exists()


@pytest.mark.judges("octree-render render --quiet")
@pytest.mark.parametrize("where", [[], ["--cluster"]], ids=["here", "cluster"])
@pytest.mark.parametrize("quiet", [True, False])
def test_a_bar_is_shown_unless_quiet(
    folder: Path, tmp_path: Path, asked: list[dict[str, Any]], where: list[str], quiet: bool,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    words = ["render", folder / "scene.toml", "-o", tmp_path / "a.npy", "--max-rays", 999, *where]
    assert main([*map(str, words), *(["--quiet"] if quiet else [])]) == 0
    assert [told["progress"] for told in asked] == [not quiet]
    assert (capsys.readouterr() == ("", "")) == quiet


@pytest.mark.parametrize("where", [[], ["--cluster"]], ids=["here", "cluster"])
@pytest.mark.parametrize(
    ("words", "most"), [([], 14), (["--max-rays", "5"], 5), (["--change", "render.max_rays=4"], 4)]
)
def test_what_is_said_of_cut_pixels_names_the_rays_that_held(
    folder: Path, tmp_path: Path, asked: list[Any], capsys: pytest.CaptureFixture[str], where: list[str],
    words: list[str], most: int,
) -> None:  # fmt: skip
    rendered(folder / "scene.toml", tmp_path / "a.npy", *words, *where)
    cut = picture(load_scene(folder / "scene.toml"), max_rays=most).cut
    said = f"octree-render: {cut} of 80 pixels miss rays: a sample reached max_rays = {most}."
    assert capsys.readouterr().err.startswith(said)


@pytest.mark.parametrize(
    ("where", "png", "npy", "exr"), [([], "PNG", "NPY", "EXR"), (["--cluster"], "png", "npy", "exr")]
)
def test_each_format_is_read_by_others_as_the_picture(
    folder: Path, tmp_path: Path, asked: list[dict[str, Any]], where: list[str], png: str, npy: str, exr: str
) -> None:
    openexr = pytest.importorskip("OpenEXR")
    expected = picture(load_scene(folder / "scene.toml"))
    for suffix in (png, npy, exr):
        rendered(folder / "scene.toml", tmp_path / f"a.{suffix}", *where)
    with Pillow.open(tmp_path / f"a.{png}") as read:
        assert np.array_equal(np.asarray(read), srgb(expected.radiance))
    assert np.load(tmp_path / f"a.{npy}").tobytes() == expected.radiance.tobytes()
    layers = {name: layer.pixels for name, layer in openexr.File(str(tmp_path / f"a.{exr}")).channels().items()}
    assert layers["RGB"].tobytes() == expected.radiance.tobytes()
    assert layers["Z"].tobytes() == expected.depth.astype(np.float32).tobytes()
    assert np.stack([layers[f"normal.{axis}"] for axis in "XYZ"], axis=2).tobytes() == expected.normal.tobytes()
    assert [set(told["planes"]) for told in asked] == [{"rays"}, {"rays"}, set(PLANES)]


def test_the_scene_is_that_of_the_file(folder: Path, tmp_path: Path) -> None:
    table: Table = BASE | {"background": [0.9, 0.1, 0.5]}
    other = tmp_path / "other.toml"
    other.write_text(tomlkit.dumps(table | {"objects": [], "floor": BASE["floor"]}))
    for scene in (folder / "scene.toml", other):
        rendered(scene, tmp_path / "a.npy")
        assert np.load(tmp_path / "a.npy").tobytes() == picture(load_scene(scene)).radiance.tobytes()


@pytest.mark.parametrize("command", ["render", "view"])
def test_the_scene_that_is_written_of_a_mesh_is_the_one_that_is_shown(
    folder: Path, tmp_path: Path, viewed: list[Any], command: str
) -> None:
    ball, new = folder / "ball.ply", tmp_path / "new.toml"
    more = ["-o", tmp_path / "a.npy", "--resolution", "6x4", "--quiet"] if command == "render" else []
    assert main([command, str(ball), "--write-scene", str(new), *map(str, more)]) == 0
    expected = picture(load_scene(ball), resolution=(6, 4)).radiance.tobytes()
    assert picture(load_scene(new), resolution=(6, 4)).radiance.tobytes() == expected
    if command == "render":
        assert np.load(tmp_path / "a.npy").tobytes() == expected


@pytest.mark.parametrize(
    ("words", "address", "workers"),
    [(["--cluster"], None, None), (["--cluster", "local", "--threads", "3"], None, 3),
     (["--cluster", "tcp://x:1"], "tcp://x:1", None)],
)  # fmt: skip
def test_the_cluster_is_the_one_that_is_named(
    monkeypatch: pytest.MonkeyPatch, folder: Path, words: list[str], address: str | None, workers: int | None
) -> None:
    class ReachedError(OSError):
        pass

    def connected(*told: Any, **more: Any) -> Any:
        assert (told, more) == ((address,), {"workers": workers})
        raise ReachedError

    monkeypatch.setattr("renderer.cluster.connected", connected)
    options = make_parser().parse_args(["render", str(folder / "scene.toml"), *words])
    with pytest.raises(ReachedError), on_cluster(options):
        pass


@cases("split", [None, "midpoint", "sah"])
@cases("scene", ["scene.toml", "ball.ply"])
def test_what_is_said_of_a_scene_is_of_its_own_tree(
    folder: Path, capsys: pytest.CaptureFixture[str], scene: str, split: Any
) -> None:
    assert main(["info", str(folder / scene), *(["--split", split] if split else [])]) == 0
    stats = Octree.from_mesh(pack(load_scene(folder / scene))[0], split=split or "sah").stats
    told = f"octree ({split or 'sah'}): {stats.nodes} nodes, {stats.leaves} leaves, depth {stats.depth}, "
    said = capsys.readouterr().out
    assert said.startswith(f"{folder / scene}: ") and told in said


@pytest.mark.parametrize(
    ("words", "given"),
    [
        ([], {}),
        (["--host", "0.0.0.0"], {"host": "0.0.0.0"}),
        (["--port", "8123"], {"port": 8123}),
        (["--up", "z"], {"up": "z"}),
    ],
)
@pytest.mark.parametrize("browser", [True, False])
def test_a_viewer_is_shown_where_it_is_told(
    folder: Path, viewed: list[Any], words: list[str], given: dict[str, Any], browser: bool
) -> None:
    assert main(["view", str(folder / "scene.toml"), *words, *([] if browser else ["--no-browser"])]) == 0
    usual = {"up": None, "host": "127.0.0.1", "port": 0, "browser": False}
    assert viewed == [(folder / "scene.toml", usual | given), *(["browser"] if browser else []), "wait"]


@cases("what", [None, "queries", "pictures", "all"])
@cases("output", [None, "kernels"])
@cases("quiet", [True, False])
def test_kernels_are_compiled_that_are_named_where_they_are_to_be(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], what: str | None, output: str | None,
    quiet: bool,
) -> None:  # fmt: skip
    ahead = import_module("renderer.precompile")
    asked: list[Any] = []
    monkeypatch.setattr(ahead, "compile_into", lambda folder: asked.append(folder))
    monkeypatch.setattr(
        ahead, "compile_ahead_in_two", lambda what, folder, began: asked.append((what, folder)) or began("part")
    )
    words = [f"--{what}"] if what else []
    words += ["-o", output] if output else []
    assert main(["compile", *words, *(["--quiet"] if quiet else [])]) == 0
    folder = Path(output) if output else None
    assert asked == [*([folder] if folder else []), (what or "all", folder)]
    said = capsys.readouterr().out
    assert said == "" if quiet else said.startswith("compiled in ") and ("in kernels" in said) == bool(output)


@cases("level", LEVELS)
def test_a_level_is_chosen_before_anything_is_compiled(monkeypatch: pytest.MonkeyPatch, level: str) -> None:
    asked: list[Any] = []
    monkeypatch.setattr("renderer.cli.main.choose_processor", lambda *told: asked.append(told))
    monkeypatch.setattr("renderer.cli.compiling._compile", lambda options: asked.append(options.what))
    assert main(["compile", "--level", level, "-o", "kernels"]) == 0
    assert asked == [(level, Path("kernels")), "all"]
