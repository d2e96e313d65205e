"""``octree-render study``: what it says, writes and refuses, and that it survives a kill.

Its answers are in test_every_option.py, the files that it writes in test_written_files.py.
"""

import os
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow
from plyfile import PlyData

from renderer import Mesh, Octree, load_mesh
from renderer.checkpoints import study as studies
from renderer.cli.main import main
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box
from renderer.studies import sky_view_factor
from renderer.system.threads import available_threads
from validation.benchmark.measures.meshes import named

pytestmark = pytest.mark.judges(
    "octree-render study", "octree-render study --output", "octree-render study --quiet",
    "octree-render study --suns", "octree-render study --threads", "octree-render study mesh",
)  # fmt: skip


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("city") / "city.ply"
    save_ply(named("city_300"), path)
    return path


def study(*arguments: object) -> None:
    assert main(["study", *map(str, arguments)]) == 0


def _run(*arguments: object) -> int:
    return main(["study", *map(str, arguments), "--quiet"])


@cases(
    "arguments, said",
    [
        (["sky", "-o", "a.txt"], "--output: expected one of .npy, .ply, .png"),
        (["sky", "--grid", "1", "-o", "a.png"], "--output: expected .npy or .ply, as a picture"),
        (["sky", "--grid", "0", "-o", "a.npy"], "--grid: expected a number > 0"),
        (["sky", "--grid", "nan", "-o", "a.npy"], "--grid: expected a number > 0"),
        (["sky", "--grid", "1e-9", "-o", "a.npy"], "--grid: expected a spacing with at most"),
        (["sun", "-o", "a.npy"], "--suns: expected a file for the kind sun"),
        (["sky", "--suns", "none.txt", "-o", "a.npy"], "--suns: expected none but for the kind sun"),
        (["ao", "--patches", "577", "-o", "a.npy"], "--patches: expected none but for the kind sky"),
        (["ao", "--definition", "cosine", "-o", "a.npy"], "--definition: expected none but for the kind sky"),
        (["sky", "--samples", "9", "-o", "a.npy"], "--samples: expected none but for the kind ao"),
        (["sky", "--patches", "0", "-o", "a.npy"], "patches: expected"),
        (["sky", "--max-distance", "-1", "-o", "a.npy"], "max_distance: expected"),
        (["sky", "--points", "none.npy", "-o", "a.npy"], "none.npy"),
        (["sky", "--camera", "s.toml", "-o", "a.npy"], "--camera: expected an output that ends in .png"),
        (["sun", "--suns", "suns.txt", "-o", "a.npy"], "weights: expected"),
        (["sky", "-o", "none/a.npy"], "--output: expected a path in an existing folder, got none/a.npy"),
        (["sky", "--resolution", "20", "-o", "a.npy"], "--resolution: expected an output that ends in .png"),
        (["sky", "--height", "1", "-o", "a.npy"], "--height: expected none without --grid"),
        (["sky", "--bounds", *"000111", "-o", "a.npy"], "--bounds: expected none without --grid"),
        (["sky", "--grid", "1", "--height", "nan", "-o", "a.npy"], "--height: expected a finite number, got nan"),
        (["sky", "--grid", "1", "--bounds", *"010101", "-o", "a.npy"], "--bounds: expected the least corner, then"),
        (["sky", "--hide", "tree*", "-o", "a.npy"], "--hide: expected the name of a mesh file, or a pattern of names"),
        (["sky", "--hide", "c?ty.ply", "-o", "a.npy"], "--hide: expected one file at least that is left, got none"),
    ],
)
def test_bad_arguments_are_told_on_one_line(
    city: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    arguments: list[str], said: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "suns.txt").write_text("0 0 1 -1")
    assert _run(arguments[0], city, *arguments[1:]) == 2
    text = capsys.readouterr().err
    assert said in text and text.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["suns.txt"]


def test_no_axis_is_said_of_a_file_that_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "s.toml").touch()
    assert main(["study", "sky", str(tmp_path / "s.toml"), "-o", str(tmp_path / "a.npy")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_files_that_are_no_points_or_suns_are_refused(
    city: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save(tmp_path / "flat.npy", np.zeros(3))
    np.save(tmp_path / "words.npy", np.array([["a", "b", "c"]]))
    (tmp_path / "text.npy").write_text("0 0 1")
    for name in ("flat", "words", "text"):
        assert _run("sky", city, "--points", tmp_path / f"{name}.npy", "-o", tmp_path / "a.npy") == 2
        assert "--points: expected" in capsys.readouterr().err
    vast = f"{{'descr':'<f8','fortran_order':False,'shape':({10**20},3)}}"
    for header in ("", "{", "'''", "  x\n y", "{[]:1}", vast):
        magic = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") if header else b"PK\x03\x04"
        (tmp_path / "broken.npy").write_bytes(magic + header.encode())
        assert _run("sky", city, "--points", tmp_path / "broken.npy", "-o", tmp_path / "a.npy") == 2
        assert "--points: expected an .npy file" in capsys.readouterr().err
    for text in ("", "1 2\n", "1 2 x\n", "1 2 3\n1 2 3 4\n"):
        (tmp_path / "suns.txt").write_text(text)
        assert _run("sun", city, "--suns", tmp_path / "suns.txt", "-o", tmp_path / "a.npy") == 2
        assert "--suns: expected" in capsys.readouterr().err


def test_a_run_that_is_killed_goes_on_and_ends_with_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh, result = tmp_path / "city.ply", tmp_path / "sky.npy"
    save_ply(named("city_300"), mesh)
    octree = Octree.from_mesh(load_mesh(mesh))
    rng = np.random.default_rng(0)
    points = rng.uniform(*octree.mesh.bounds, (6 * 64, 3))
    np.save(tmp_path / "p.npy", points)
    # Parts of 64 points; a run that shall be killed waits for it once so many parts are there.
    program = (
        "import sys, time\n"
        "from renderer.checkpoints import parts, study\n"
        "study.plan_of.__defaults__, own, most = (64,), parts.Parts.write, int(sys.argv[1])\n"
        "def write(self, *part):\n"
        "    own(self, *part)\n"
        "    while len(list(self.folder.glob('*.part'))) >= most: time.sleep(0.1)\n"
        "parts.Parts.write = write\n"
        "from renderer.cli.main import main\n"
        "sys.exit(main(sys.argv[2:]))"
    )
    arguments = [str(a) for a in ("study", "sky", mesh, "--points", tmp_path / "p.npy", "-o", result, "--quiet")]
    folder = studies.folder_of(result)
    for most in (2, 4):
        child = subprocess.Popen([sys.executable, "-c", program, str(most), *arguments])
        while len(list(folder.glob("*.part"))) < most:
            assert child.poll() is None
            time.sleep(0.02)
        os.kill(child.pid, signal.SIGKILL)
        child.wait()
        assert not result.exists()
    kept = {path.name for path in folder.glob("*.part")}
    assert kept == {f"{part:08d}.part" for part in range(4)}
    (folder / "00000001.part").write_bytes(b"spoilt")
    monkeypatch.setattr(studies.plan_of, "__defaults__", (64,))
    assert main(arguments) == 0 and not folder.exists()
    expected = sky_view_factor(octree, points, [0.0, 0.0, 1.0])
    assert np.load(result).tobytes() == expected.tobytes()


@pytest.mark.parametrize("left", [False, True])
def test_ctrl_c_names_the_parts_that_are_left(
    city: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], left: bool
) -> None:
    def stops(*told: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(studies.Parts if left else studies, "write" if left else "parts_of", stops)
    assert _run("sky", city, "-o", tmp_path / "a.npy") == 130
    said, folder = capsys.readouterr().err, studies.folder_of(tmp_path / "a.npy")
    assert said.startswith("octree-render: interrupted") and said.count("\n") == 1
    assert folder.exists() == (str(folder) in said) == left


def test_several_outputs_are_of_one_study(city: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs, asked = import_module("renderer.checkpoints.study"), []
    own = runs.run
    monkeypatch.setattr(runs, "run", lambda *told, **options: asked.append(told) or own(*told, **options))
    np.save(tmp_path / "p.npy", load_mesh(city).vertices)
    for where, names in (((), ("a.npy", "a.ply", "a.PNG")), (("--points", tmp_path / "p.npy"), ("b.npy", "b.ply"))):
        study("sky", city, *where, *(word for name in names for word in ("-o", tmp_path / name)), "--quiet")
    assert len(asked) == 2
    assert {path.name for path in tmp_path.iterdir()} == {"a.npy", "a.ply", "a.PNG", "b.npy", "b.ply", "p.npy"}
    for name, element in (("a", "face"), ("b", "vertex")):
        values = PlyData.read(tmp_path / f"{name}.ply")[element]["value"]
        np.testing.assert_array_equal(np.load(tmp_path / f"{name}.npy"), values)
    with Pillow.open(tmp_path / "a.PNG") as picture:
        assert picture.size == (960, 720)


@pytest.mark.parametrize("told, threads", [((), available_threads()), (("--threads", 1), 1)])
def test_threads_are_all_processors_unless_told(
    city: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: tuple[object, ...], threads: int
) -> None:
    seen: list[int] = []
    runs = import_module("renderer.checkpoints.study")
    own = runs.run

    def run(octree: Octree, *arguments: Any, **options: Any) -> Any:
        seen.append(octree.threads)
        return own(octree, *arguments, **options)

    monkeypatch.setattr(runs, "run", run)
    study("sky", city, "-o", tmp_path / "a.npy", *told, "--quiet")
    assert seen == [threads]


def test_a_study_says_what_it_wrote_unless_quiet(
    city: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study("sky", city, "-o", tmp_path / "a.npy", "--quiet")
    assert capsys.readouterr() == ("", "")
    study("sky", city, "-o", tmp_path / "a.npy")
    said = "".join(capsys.readouterr())
    count = int(np.isfinite(np.load(tmp_path / "a.npy")).sum())
    assert f"a.npy: sky view factor of {count:,} points in" in said


def test_points_that_see_nothing_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two within the cube, one above it."""
    save_ply(box(), tmp_path / "cube.ply")
    np.save(tmp_path / "p.npy", [[0.5, 0.5, 0.5], [0.25, 0.5, 0.75], [0.5, 0.5, 2.0]])
    (tmp_path / "suns.txt").write_text("0 0 1\n")
    told = [tmp_path / "cube.ply", "--points", tmp_path / "p.npy", "-o", tmp_path / "a.npy"]
    for kind, counted in (("sky", True), ("ao", True), ("sun", False)):
        study(kind, *told, *(("--suns", tmp_path / "suns.txt") if kind == "sun" else ()))
        said = "".join(capsys.readouterr())
        blind = "; 2 see nothing: they face down, are hidden all around or lie inside a body"
        assert (blind in said) == counted and "of 3 points" in said
        assert np.load(tmp_path / "a.npy").tolist() == [0, 0, 1]
    np.save(tmp_path / "p.npy", [[0.5, 0.5, 2.0]])
    study("sky", *told)
    assert "see nothing" not in "".join(capsys.readouterr())


@pytest.mark.parametrize(("kind", "option"), [("sky", "--points"), ("sun", "--suns")])
def test_a_file_that_cannot_be_read_is_told_with_its_option(
    city: Path, tmp_path: Path, kind: str, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "folder.npy").mkdir()
    for missing, why in (
        (tmp_path / "none.npy", "No such file or directory"), (tmp_path / "folder.npy", "Is a directory"),
    ):  # fmt: skip
        assert main(["study", kind, str(city), option, str(missing), "-o", str(tmp_path / "a.npy"), "--quiet"]) == 2
        said = f"octree-render: {option}: expected a file that can be read, got {missing}: {why}\n"
        assert capsys.readouterr().err == said


@cases(
    "wrong",
    [
        ["-o", "{folder}"],
        ["-o", "{folder}.png", "--resolution", "0x9"],
        ["-o", "{folder}.png", "--resolution", "8193x9"],
        ["-o", "{folder}.png", "--resolution", "9x8193"],
        ["-o", "{folder}.ply", "-o", "{folder}/../s.npy.ply"],
        ["-o", "{folder}/link.npy"],  # to the other output
        ["--grid", "1e-300"],
    ],
)
def test_options_that_are_refused_leave_no_parts(city: Path, tmp_path: Path, wrong: list[str]) -> None:
    (tmp_path / "s.npy").mkdir()
    (tmp_path / "s.npy" / "link.npy").symlink_to(tmp_path / "right.npy")
    wrong = [word.format(folder=tmp_path / "s.npy") for word in wrong]
    command = ["study", "ao", str(city), "-o", str(tmp_path / "right.npy"), "--quiet"]
    assert main([*command, *wrong]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["s.npy"]
    assert main(command) == 0


@pytest.mark.parametrize("size", ["1x1", "8192x1", "9x55", "9x56", "321x123"])
def test_a_picture_has_the_size_that_was_asked_for(city: Path, tmp_path: Path, size: str) -> None:
    """The legend came on top: 321x123 gave 321 x 151."""
    output = tmp_path / "a.png"
    assert main(["study", "sky", str(city), "-o", str(output), "--resolution", size, "--quiet"]) == 0
    with Pillow.open(output) as picture:
        assert "{}x{}".format(*picture.size) == size


@cases(
    ("spacing", "got"), [(1e-300, "4e+300"), (1e300, "none"), (float(np.finfo(np.float64).max), "none"), (9.0, "none")]
)
def test_a_grid_over_a_wall_and_one_without_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], spacing: float, got: str
) -> None:
    """No ray from above meets a wall; of a fine grid it had rows without end, and a coarse one stood too far away."""
    wall = Mesh([[0, 0, 0], [4, 0, 0], [4, 0, 2], [0, 0, 2]], [[0, 1, 2], [0, 2, 3]])
    save_ply(wall, tmp_path / "wall.ply")
    output = tmp_path / "a.npy"
    command = ["study", "sky", str(tmp_path / "wall.ply"), "-o", str(output), "--quiet", "--grid", repr(spacing)]
    assert main(command) == 2
    said = capsys.readouterr().err
    assert said.startswith("octree-render: --grid: ") and said.endswith(f"got {got}\n") and len(said) < 120
    assert not output.exists()


@cases("read", ["mesh", "--points", "--suns", "--camera"])
def test_no_output_is_a_file_that_is_read(tmp_path: Path, capsys: pytest.CaptureFixture[str], read: str) -> None:
    """A table of suns and a scene were written over where a link led there."""
    given = {name: tmp_path / f"{name.strip('-')}.ply" for name in ("mesh", "--points", "--suns", "--camera")}
    for file in given.values():
        file.write_text("whole")
    (tmp_path / "link.png").symlink_to(given[read])
    options = [str(word) for item in given.items() if item[0] != "mesh" for word in item]
    if read != "--points":  # which go into no picture
        del options[:2]
    command = ["study", "sun", str(given["mesh"]), *options, "-o", str(tmp_path / "link.png")]
    assert main(command) == 2
    assert "--output: expected a file that is not an input" in capsys.readouterr().err
    assert [file.read_text() for file in given.values()] == ["whole"] * 4


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_pipe_gets_the_whole_array(city: Path, tmp_path: Path) -> None:
    """It got the header, and the message blamed the disk."""
    study("ao", city, "-o", tmp_path / "file.npy", "--samples", 4, "--quiet")
    os.mkfifo(tmp_path / "pipe.npy")
    reader = os.open(tmp_path / "pipe.npy", os.O_RDONLY | os.O_NONBLOCK)
    study("ao", city, "-o", tmp_path / "pipe.npy", "--samples", 4, "--quiet")
    assert os.read(reader, 1 << 16) == (tmp_path / "file.npy").read_bytes()
    os.close(reader)


@pytest.mark.parametrize("option", ["-o", "--points", "mesh"])
def test_a_link_to_itself_is_told_in_one_line(
    city: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    loop = tmp_path / "loop.npy"
    loop.symlink_to(loop)
    given = {"mesh": [str(loop)]}.get(option, [str(city), option, str(loop)])
    output = [] if option == "-o" else ["-o", str(tmp_path / "a.npy")]
    assert main(["study", "sky", *given, *output, "--quiet"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and said.startswith("octree-render: ") and str(loop) in said
