"""The command line: what it writes, and one line and an exit code for everything that can go wrong."""

import os
import platform
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow

import renderer
from renderer.cli.compiling import choose_processor
from renderer.cli.main import main
from renderer.mesh.load import load_mesh
from renderer.picture.render import render
from renderer.precompile import compile_ahead
from renderer.scene.scene import load_scene

pytestmark = pytest.mark.judges(
    "__version__", "octree-render --version", "octree-render compile", "octree-render compile --all",
    "octree-render compile --level", "octree-render info", "octree-render info --split",
    "octree-render info scene", "octree-render render",
    "octree-render render --accelerator", "octree-render render --max-depth", "octree-render render --max-rays",
    "octree-render render --min-weight", "octree-render render --output", "octree-render render --resolution",
    "octree-render render --samples", "octree-render render --split", "octree-render render --threads",
    "octree-render render --write-scene", "octree-render render scene", "octree-render view --port",
    "octree-render view scene", "render",
)  # fmt: skip


ROOT = Path(__file__).parents[2]
STAIRS = ROOT / "scenes" / "stairs.toml"


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    """Compile before the tests, which look at what stands on standard error."""
    compile_ahead()


def fails(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The one line on standard error, after checking that it is one, that the code is 2 and that nothing else came."""
    assert main([str(a) for a in arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.endswith("\n") and len(err.splitlines()) == 1
    assert err.startswith("octree-render: ") and "Traceback" not in err
    return err.removeprefix("octree-render: ")


def test_render_says_what_it_wrote(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.npy"
    assert main(["render", str(STAIRS), "-o", str(path), "--resolution", "24X16"]) == 0
    expected = render(load_scene(STAIRS), resolution=(24, 16))
    out, err = capsys.readouterr()
    assert re.match(rf"{re.escape(str(path))}: 24 x 16, {expected.rays.sum()} rays in ", out)
    assert len(out.splitlines()) == 1
    assert err == ""


def test_compile(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compile"]) == 0
    out, err = capsys.readouterr()
    assert re.fullmatch(r"compiled in \d+\.\d s\n", out) and err == ""


def test_info(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(STAIRS)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    lines = out.splitlines()
    lights = len(load_scene(STAIRS).lights)
    assert f"2 meshes, {lights} lights, orthographic camera" in lines[0]
    assert re.match(r"  stairs +44 faces +flat +stone \(phong\)", lines[1]) and re.match(r"  floor +2 faces", lines[2])
    assert lines[3].startswith("octree (sah): ") and "46 references" in lines[3]


@cases("arguments", [["--help"], ["--version"], ["render", "--help"], ["info", "--help"], ["compile", "--help"]])
def test_help_and_version(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    out, err = capsys.readouterr()
    assert caught.value.code == 0 and err == ""
    assert out == f"{renderer.__version__}\n" if arguments == ["--version"] else out.startswith("usage: octree-render")
    assert re.fullmatch(r"\d+\.\d+\.\d+", renderer.__version__)


@cases(
    ("arguments", "says"),
    [
        (["none.toml"], ["none.toml", "No such file"]),
        ([ROOT], ["expected mesh files", "in the folder, got none"]),
        ([STAIRS, "-o", "none/a.png"], ["output", "existing folder"]),
        ([STAIRS, "-o", "a.jpg"], ["output", ".png, .exr or .npy", "a.jpg"]),
        ([STAIRS, "-o", "renderer"], ["output", ".png, .exr or .npy"]),
        ([STAIRS, "--resolution", "0x4"], ["resolution", "0"]),
        ([STAIRS, "--resolution", "4x99999"], ["resolution", "99999"]),
        ([STAIRS, "--samples", "3"], ["samples", "square number", "3"]),
        ([STAIRS, "--samples", "-1"], ["samples", "-1"]),
        ([STAIRS, "--max-depth", "65"], ["max_depth", "65"]),
        ([STAIRS, "--max-depth", "-1"], ["max_depth", "-1"]),
        ([STAIRS, "--min-weight", "nan"], ["min_weight", "nan"]),
        ([STAIRS, "--min-weight", "2"], ["min_weight", "2"]),
        ([STAIRS, "--threads", "0"], ["threads", "0"]),
    ],
)
def test_bad_input_is_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[Any],
    says: list[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    message = fails(capsys, "render", *arguments)
    for words in says:
        assert words in message
    assert "None" not in message
    assert list(tmp_path.iterdir()) == []


def test_bad_scenes_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bad = tmp_path / "bad.toml"
    for text, says in (
        ("x = ", "TOML"),
        ("[camera]\neye = [0, 0, 1]\ntarget = [0, 0, 0]\nspeed = 3\n[materials]\n", "camera.speed: unknown key"),
        ('[camera]\neye = [0, 0, 1]\ntarget = [0, 0, 0]\n[materials."a\\nb"]\nspeed = 3\n', "speed: unknown key"),
        ('[camera]\neye=[0,0,1]\ntarget=[0,0,0]\n[materials.a]\n[[objects]]\nmesh="a.ply"\nmaterial="a"\n', "a.ply"),
        (f"x = {'9' * 5000}", "4300"),
    ):
        bad.write_text(text)
        for command in ("render", "info"):
            message = fails(capsys, command, bad)
            assert str(bad) in message and says in message


def test_info_of_an_empty_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "empty.toml").write_text("[camera]\neye = [0, 0, 1]\ntarget = [0, 0, 0]\n[materials]\n")
    assert "at least one object or a floor" in fails(capsys, "info", tmp_path / "empty.toml")


@cases(
    "arguments",
    [
        [],
        ["paint"],
        ["render"],
        ["info"],
        ["view"],
        ["render", STAIRS, "--max-depth", "1.5"],
        ["render", STAIRS, "--samples", "4.0"],
        ["render", STAIRS, "--min-weight", "x"],
        ["render", STAIRS, "--max-rays", "9.5"],
        ["render", STAIRS, "--threads", "1.0"],
        ["render", STAIRS, "--split", "kd"],
        ["render", STAIRS, "-o", "a.png", "-o", "b.png"],
        ["view", STAIRS, "--port", "0", "--port", "0"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--distance", "1", "--max-distance", "2"],
        ["view", STAIRS, "--port", "0.5"],
        ["render", STAIRS, "--resolution", "512x"],
        ["render", STAIRS, "--resolution", "axb"],
        ["render", STAIRS, "--resolution", "-1x5"],
        ["render", STAIRS, "--samples", "x"],
        ["render", STAIRS, "--accelerator", "bvh"],
        ["render", STAIRS, "--speed", "3"],
        ["info", STAIRS, "--split", "kd"],
        ["study", "sky", "m.ply"],
        ["study", "stars", "m.ply", "-o", "a.npy"],
        ["study", "sky", "-o", "a.npy"],
        ["study"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--faces", "--vertices"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--grid", "x"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--grid", "1", "--points", "p.npy"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--vertices", "--points", "p.npy"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--patches", "x"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--definition", "x"],
        ["study", "ao", "m.ply", "-o", "a.npy", "--samples", "x"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--distance", "x"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--max-distance", "x"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--up", "w"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--grid", "1", "--height", "x"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--grid", "1", "--bounds", "0", "0", "0", "1", "1"],
        ["study", "sky", "m.ply", "-o", "a.npy", "--threads", "x"],
        ["compile", "--level", "x86-64-v9", "-o", "x"],
        ["compile", "--queries", "--pictures"],
        ["compile", "--pictures", "--all"],
        ["compile", "--all", "--queries"],
    ],
)
def test_arguments_that_make_no_sense_are_usage_errors(
    capsys: pytest.CaptureFixture[str], arguments: list[Any]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main([str(a) for a in arguments])
    out, err = capsys.readouterr()
    assert caught.value.code == 2 and out == "" and "error: " in err.splitlines()[-1] and "Traceback" not in err


@pytest.mark.judges("octree-render study --camera", "octree-render study --resolution")
def test_a_calibrated_camera_draws_a_study_as_large_as_its_film(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With a legend below, and where its vertices are projected. Another shape is refused before the work begins."""
    eye, film = "eye = [9, 9, 9]\ntarget = [0, 0, 0]", "width = 160\nheight = 120\nfx = 150\nfy = 150\nk1 = -0.2"
    (tmp_path / "eye.toml").write_text(f'[camera]\ntype = "opencv"\n{eye}\n{film}\n[materials]\n')
    model, scene, output = ROOT / "scenes" / "models" / "block.ply", tmp_path / "eye.toml", tmp_path / "a.png"
    words = ["study", "sky", str(model), "--up", "z", "--camera", str(scene), "-o", str(output), "--quiet"]
    pixels, _ = load_scene(scene).camera.project(load_mesh(model).vertices)
    for more, scale in (([], 1), (["--resolution", "80x60"], 0.5)):
        assert main([*words, *more]) == 0
        with Pillow.open(output) as read:
            drawn = np.asarray(read)
        assert drawn.shape == (120 * scale + 28, 160 * scale, 3)
        rows, columns = (drawn[: int(120 * scale)] != 255).any(axis=2).nonzero()
        seen = [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        np.testing.assert_allclose(seen, [*scale * pixels.min(axis=0), *scale * pixels.max(axis=0)], atol=1.0)
    output.unlink()
    message = fails(capsys, *words, "--resolution", "80x80")
    assert "resolution: expected 160 x 120" in message and not output.exists()


def test_a_disk_that_fills_up_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    message = fails(capsys, "render", STAIRS, "-o", tmp_path / "a.png", "--resolution", "2x2", "--quiet")
    assert "No space left" in message and list(tmp_path.iterdir()) == []


# The command, which presses Ctrl-C when it has traced the first rays of a tile, and says at its end how many seconds it
# computed from then on: the clock's would depend on what else the machine does.
INTERRUPTS_ITSELF = """
import os, signal, sys, time
from renderer.cli import main as cli
from renderer.picture import prepare
traced, pressed = prepare.for_chunks, []

def pressing(work, count, size, threads, finished):
    def told(items):
        if not pressed:
            pressed.append(time.process_time())
            os.kill(os.getpid(), signal.SIGINT)
    traced(work, count, size, threads, told)

prepare.for_chunks = pressing
code = cli.main(sys.argv[1:])
print(time.process_time() - pressed[0])
sys.exit(code)
"""


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
@pytest.mark.parametrize("threads", [1, 2])
def test_control_c_stops_within_seconds_and_writes_nothing(tmp_path: Path, threads: int) -> None:
    """Brute force over 77,000 faces at 1024 x 1024 would take hours."""
    scene, out = str(ROOT / "scenes" / "mirrors.toml"), str(tmp_path / "a.png")
    # Compile here, so that the signal meets the tracing and not the compiler.
    render(load_scene(scene), resolution=(1, 1), accelerator="brute", threads=1)
    arguments = ["render", scene, "-o", out, "--accelerator", "brute", "--resolution", "1024x1024", "--samples", "16"]
    command = [sys.executable, "-c", INTERRUPTS_ITSELF, *arguments, "--threads", str(threads)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 130 and done.stderr == "octree-render: interrupted\n"
    assert list(tmp_path.iterdir()) == []
    # A tile by brute force takes about five seconds, and is left some 10 ms after the signal.
    assert float(done.stdout) < 0.5


def shell(line: str, **more: str) -> "subprocess.CompletedProcess[str]":
    """A line of shell, with ``octree`` for the command."""
    command = f"{sys.executable} -P -m renderer"
    environment = {**os.environ, **more}
    return subprocess.run(
        ["bash", "-c", line.replace("octree", command)],
        capture_output=True, text=True, cwd=ROOT, env=environment, timeout=120, check=False,
    )  # fmt: skip


@cases("closed", ["2>&-", ">&-", "<&-", ">&- 2>&- <&-"])
def test_a_closed_stream_stops_no_picture(tmp_path: Path, closed: str) -> None:
    path = tmp_path / "a.png"
    done = shell(f"octree render {STAIRS} -o {path} --resolution 8x8 {closed}")
    assert done.returncode == 0, done.stderr
    assert path.exists()


def test_who_stops_reading_gets_no_error(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    done = shell(f"octree render {STAIRS} -o {path} --resolution 8x8 | true; exit ${{PIPESTATUS[0]}}")
    assert (done.returncode, done.stderr) == (0, "")
    assert path.exists()


def test_compile_fails_where_nothing_can_be_kept(tmp_path: Path) -> None:
    """A folder that is no folder: an image build must not go on with an empty one."""
    (tmp_path / "file").touch()
    nowhere = str(tmp_path / "file" / "cache")
    script = (
        "import sys, renderer.jit.cache as store, renderer.precompile as ahead\n"
        "store._folders = lambda sources: store.Folders(None, ())\n"
        "from renderer.materials.dielectric import fresnel\n"
        "ahead.PARTS['queries'] = [ahead.Part('light that glass reflects', lambda: fresnel(1.0, 1.0, 1.0, 1.5))]\n"
        "from renderer.cli.main import main; sys.exit(main(['compile', '--queries', '--quiet']))"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", script], capture_output=True, text=True, timeout=120, check=False,
        env={**os.environ, "NUMBA_CACHE_DIR": nowhere}, cwd=ROOT,
    )  # fmt: skip
    assert done.returncode == 2
    assert re.search(r"octree-render: \d+ kernels were compiled but could not be saved", done.stderr)


def test_kernels_for_a_level_need_a_folder(capsys: pytest.CaptureFixture[str]) -> None:
    said = fails(capsys, "compile", "--level", "x86-64-v3")
    assert said.startswith("--output: expected a folder, as kernels for a level are not this machine's")


@cases("under", ["", "more"])
def test_kernels_are_not_kept_in_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str], under: str) -> None:
    (tmp_path / "a.obj").touch()
    said = fails(capsys, "compile", "--queries", "-o", tmp_path / "a.obj" / under)
    assert said.startswith("output: expected a folder") and "a.obj" in said


def test_kernels_for_another_architecture_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = "x86-64-v3" if platform.machine() in ("aarch64", "arm64") else "aarch64"
    said = fails(capsys, "compile", "--level", other, "-o", tmp_path / "kernels")
    assert said.startswith("--level: expected one of this processor's, ")
    assert not (tmp_path / "kernels").exists()


def test_a_level_that_this_machine_cannot_run_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = "aarch64" if platform.machine() in ("aarch64", "arm64") else "x86-64-v2"
    monkeypatch.setattr("llvmlite.binding.get_host_cpu_features", dict)
    said = fails(capsys, "compile", "--level", own, "-o", tmp_path / "kernels")
    assert said.startswith(f"--level: expected one that this machine runs too, got {own}, of which it lacks ")
    assert not (tmp_path / "kernels").exists()


def test_a_level_is_what_numba_will_compile_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    level, name = ("aarch64", "generic") if platform.machine().lower() in ("aarch64", "arm64") else ("x86-64-v2",) * 2
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    for variable in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.setenv(variable, "another")
    choose_processor(level, tmp_path)
    assert (os.environ["NUMBA_CPU_NAME"], os.environ["NUMBA_CPU_FEATURES"]) == (name, "")


@pytest.mark.skipif(sys.getfilesystemencoding() == "ascii", reason="no file can have such a name")
def test_a_path_that_the_terminal_cannot_spell_ends_well(tmp_path: Path) -> None:
    path = tmp_path / "été.png"
    done = shell(f"octree render {STAIRS} -o '{path}' --resolution 8x8", PYTHONIOENCODING="ascii")
    assert done.returncode == 0, done.stderr
    assert "\\xe9t\\xe9.png: 8 x 8" in done.stdout
    assert path.exists()


def test_info_lists_the_materials_of_a_mesh_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl oak\nKd 0.5 0.25 1\nmap_Kd a.ppm\nd 0.5\n")
    (tmp_path / "a.ppm").write_bytes(b"P6 2 1 255 abcdef")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nusemtl oak\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
    assert main(["info", str(tmp_path / "a.obj")]) == 0
    assert "    oak: colour 0.5 0.25 1, alpha blend; textures: base_color 2 x 1\n" in capsys.readouterr().out
