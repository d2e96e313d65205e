"""Each option of ``octree-render study``, given alone: what is asked, what a run of it keeps, and what is written."""

import argparse
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from cases import cases
from scenery import scenery
from watched import results_here

from renderer import Octree, load_mesh
from renderer.checkpoints.study import KINDS
from renderer.cli.main import main, make_parser
from renderer.mesh.load import save_ply
from renderer.studies import face_points, sun_directions

CAMERA = {"eye": [3.0, -4.0, 5.0], "target": [0.0, 0.0, 0.5], "up": [0.0, 0.0, 1.0], "fov": 50.0}
FACES = len(scenery().faces)
# The words of a study, and the arguments of its function; {} is the folder of files.
FUNCTIONS: dict[str, tuple[str, list[str], dict[str, Any]]] = {
    "--patches": ("sky", ["--patches", "100"], {"patches": 100}),
    "--definition": ("sky", ["--definition", "geometric"], {"definition": "geometric"}),
    "--max-distance": ("sky", ["--max-distance", "0.6"], {"max_distance": 0.6}),
    "--max-distance of sun": ("sun", ["--suns", "{}/suns.txt", "--max-distance", "0.6"], {"max_distance": 0.6}),
    "--max-distance of ao": ("ao", ["--max-distance", "0.6"], {"max_distance": 0.6}),
    "--distance": ("sky", ["--distance", "0.6"], {"max_distance": 0.6}),
    "--up": ("sky", ["--up", "y"], {"up": "y"}),
    "--up of sun": ("sun", ["--suns", "{}/suns.txt", "--up", "x"], {"up": "x"}),
    "--suns": ("sun", ["--suns", "{}/more.txt"], {"sun_directions": [[1, 0.2, 0.7], [0, 0.5, 0.4]], "weights": [2, 1]}),
    "--suns of angles": (
        "sun",
        ["--suns", "{}/angles.csv"],
        {"sun_directions": sun_directions([90, 180, 0], [45, 45, -30]), "weights": [2, 1, 4], "up": "z"},
    ),
    "--samples": ("ao", ["--samples", "64"], {"samples": 64}),
    "--transmittance": ("sky", ["--transmittance", "mesh.ply=0.25"], {"transmittance": np.full(FACES, 0.25)}),
    "--transmittance of sun": (
        "sun",
        ["--suns", "{}/suns.txt", "--transmittance", "{}/shares.npy"],
        {"transmittance": np.linspace(0.0, 1.0, FACES)},
    ),
    "--transmittance of ao": ("ao", ["--transmittance", "m*.ply=0.5"], {"transmittance": np.full(FACES, 0.5)}),
}
# What changes neither the points nor what is asked of them, so that parts of a run may be taken over.
BITLESS: dict[str, list[str]] = {
    "--faces": ["--faces"],
    "--vertices": ["--vertices"],
    "--output": ["-o", "{}/more.ply"],
    "--camera": ["-o", "{}/more.png", "--resolution", "9x9", "--camera", "{}/scene.toml"],
    "--resolution": ["-o", "{}/more.png", "--resolution", "30x20"],
    "--cluster": ["--cluster"],
    "--threads": ["--threads", "1"],
    "--quiet": ["--quiet"],
}
# Those of view factors: tests/commands/test_view_factors_command.py.
VIEW_FACTORS = {"--groups", "--max-rays", "--rtol", "--sides"}
# What changes the points: below, in test_written_files.py and in test_several_meshes.py.
PLACES = {"--bounds", "--grid", "--height", "--hide", "--points", "mesh"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that options name."""
    folder = tmp_path_factory.mktemp("study")
    mesh = scenery()
    save_ply(mesh, folder / "mesh.ply")
    (folder / "suns.txt").write_text("1 0.2 0.7 2\n-0.6 0.5 0.4 3.5\n")
    (folder / "more.txt").write_text("1 0.2 0.7 2\n0 0.5 0.4 1\n")
    (folder / "angles.csv").write_text("time,azimuth,elevation,hours\n9:00,90,45,2\n12:00,180,45,1\n24:00,0,-30,4\n")
    np.save(folder / "shares.npy", np.linspace(0.0, 1.0, FACES))
    points = np.array([[0.5, 0.5, 0.25], [-1.0, 0.75, 0.5], [0.1, 0.2, 2.0]])
    np.save(folder / "points.npy", points)
    np.save(folder / "normals.npy", np.hstack([points, [[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]]))
    (folder / "scene.toml").write_text(tomlkit.dumps({"camera": CAMERA, "materials": {}}))
    return folder


@pytest.fixture
def bars() -> list[bool]:
    """Whether runs show a bar."""
    return []


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch: pytest.MonkeyPatch, bars: list[bool]) -> None:
    """The cluster is this process; runs answer as ever."""

    def told(of: Callable[..., Any]) -> Callable[..., Any]:
        def run(*arguments: Any, **options: Any) -> Any:
            bars.append(options["progress"])
            return of(*arguments, **options)

        return run

    here, there = import_module("renderer.checkpoints.study"), import_module("renderer.cluster.studies")
    monkeypatch.setattr(there, "results", results_here)
    monkeypatch.setattr(here, "run", told(here.run))
    monkeypatch.setattr("renderer.cluster.run_on", told(there.run_on))
    monkeypatch.setattr("renderer.cli.study.on_cluster", lambda options: nullcontext())


def study(folder: Path, kind: str, words: Sequence[str], output: Path) -> int:
    """The exit code of the command, of a kind with the usual files and quiet."""
    told = [word.replace("{}", str(folder)) for word in words]
    told += ["--suns", str(folder / "suns.txt")] if kind == "sun" and "--suns" not in words else []
    return main(["study", kind, str(folder / "mesh.ply"), "-o", str(output), "--quiet", *told])


def on_faces(folder: Path, kind: str, **given: Any) -> Any:
    """What the function of a kind says of the middles of faces."""
    octree = Octree.from_mesh(load_mesh(folder / "mesh.ply"))
    points, normals, faces = face_points(octree.mesh)
    suns = {"sun_directions": [[1, 0.2, 0.7], [-0.6, 0.5, 0.4]], "weights": [2, 3.5]} if kind == "sun" else {}
    found = np.full(len(octree.mesh.faces), np.nan)
    found[faces] = KINDS[kind](octree, points, normals, leaving=faces, **(suns | given))
    return found


def test_every_option_has_a_case() -> None:
    (choice,) = (action for action in make_parser()._actions if isinstance(action, argparse._SubParsersAction))
    actions = [action for action in choice.choices["study"]._actions if action.dest != "help"]
    known = {name.partition(" ")[0] for name in (*FUNCTIONS, *BITLESS, *PLACES, *VIEW_FACTORS, "kind")}
    assert {max(action.option_strings, key=len, default=action.dest) for action in actions} == known


@pytest.mark.judges(
    "octree-render study", "octree-render study --definition", "octree-render study --distance",
    "octree-render study --max-distance", "octree-render study --up",
    "octree-render study --faces", "octree-render study --patches", "octree-render study --samples",
    "octree-render study --transmittance",
    "octree-render study kind",
)  # fmt: skip
@cases("where", [[], ["--cluster"]])
@cases("name", [*FUNCTIONS, *KINDS])
def test_the_answers_are_those_of_the_function_with_the_options_argument(
    folder: Path, tmp_path: Path, name: str, where: list[str]
) -> None:
    kind, words, given = FUNCTIONS.get(name, (name, [], {}))
    assert study(folder, kind, [*words, *where], tmp_path / "a.npy") == 0
    found = np.load(tmp_path / "a.npy")
    assert found.tobytes() == on_faces(folder, kind, **given).tobytes()
    assert name in KINDS or found.tobytes() != on_faces(folder, kind).tobytes()


@pytest.mark.parametrize("name", ["points", "normals"])
def test_points_of_a_file_are_answered_with_their_normals(folder: Path, tmp_path: Path, name: str) -> None:
    """Those without normals look up."""
    assert study(folder, "sky", ["--points", f"{{}}/{name}.npy"], tmp_path / "a.npy") == 0
    rows = np.load(folder / f"{name}.npy")
    normals = rows[:, 3:] if name == "normals" else [0.0, 0.0, 1.0]
    expected = KINDS["sky"](Octree.from_mesh(load_mesh(folder / "mesh.ply")), rows[:, :3], normals)
    assert np.load(tmp_path / "a.npy").tobytes() == expected.tobytes()


@pytest.fixture
def killed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands end before they remove the parts of their runs."""
    monkeypatch.setattr("renderer.checkpoints.parts.remove_parts", lambda folder: None)


@pytest.mark.parametrize("name", BITLESS)
def test_a_run_goes_on_whatever_else_is_asked_for(
    folder: Path, tmp_path: Path, killed: None, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """No part is computed again."""
    assert study(folder, "sky", [], tmp_path / "a.npy") == 0
    before = np.load(tmp_path / "a.npy")
    monkeypatch.setattr("renderer.checkpoints.parts.Parts.write", None)
    assert study(folder, "sky", BITLESS[name], tmp_path / "a.npy") == 0
    if name != "--vertices":
        np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), before)


@pytest.mark.parametrize("where", [[], ["--cluster"]], ids=["here", "cluster"])
def test_a_bar_is_shown_unless_quiet(folder: Path, tmp_path: Path, where: list[str], bars: list[bool]) -> None:
    for quiet in ([], ["--quiet"]):
        words = ["study", "sky", str(folder / "mesh.ply"), "-o", str(tmp_path / "a.npy"), *where, *quiet]
        assert main(words) == 0
    assert bars == [True, False]
