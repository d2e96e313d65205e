"""Each option of ``octree-render study``: what it takes, its default, and what it changes."""

import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow
from plyfile import PlyData

from renderer import Mesh, Octree, load_mesh, load_scene, render
from renderer.cli.main import main
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box
from renderer.studies import face_points, sky_view_factor, sun_hours
from renderer.studies.points import on_grid
from renderer.system.threads import available_threads
from validation.benchmark.measures.meshes import named

pytestmark = pytest.mark.judges(
    "octree-render study --camera", "octree-render study --cluster", "octree-render study --definition",
    "octree-render study --distance", "octree-render study --faces", "octree-render study --grid",
    "octree-render study --output", "octree-render study --patches", "octree-render study --points",
    "octree-render study --quiet", "octree-render study --resolution", "octree-render study --samples",
    "octree-render study --suns", "octree-render study --threads", "octree-render study --vertices",
    "octree-render study kind", "octree-render study mesh",
)  # fmt: skip


SCENE = """
ambient = 1.0
[camera]
eye = {eye}
target = {target}
fov = 40
[materials.grey]
diffuse = 0.5
[[objects]]
mesh = "city.ply"
material = "grey"
"""


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("options") / "city.ply"
    save_ply(named("city_300"), path)
    return path


def study(*arguments: object) -> None:
    assert main(["study", *map(str, arguments)]) == 0


def on_faces(city: Path, of: Any, *arguments: Any, **options: Any) -> Any:
    """What the library answers for the middles of faces."""
    octree = Octree.from_mesh(load_mesh(city))
    points, normals, faces = face_points(octree.mesh)
    found = np.full(len(octree.mesh.faces), np.nan)
    found[faces] = of(octree, points, normals, *arguments, leaving=faces, **options)
    return found


def test_suns_have_an_hour_each_unless_told_and_the_mesh_hides_as_far_as_told(city: Path, tmp_path: Path) -> None:
    (tmp_path / "suns.txt").write_text("1 0 0.2\n-1 0 0.2\n")
    study("sun", city, "--suns", tmp_path / "suns.txt", "--distance", 0.05, "-o", tmp_path / "sun.npy", "--quiet")
    suns, found = [[1, 0, 0.2], [-1, 0, 0.2]], np.load(tmp_path / "sun.npy")
    np.testing.assert_array_equal(found, on_faces(city, sun_hours, suns, distance=0.05))
    assert (found != on_faces(city, sun_hours, suns)).any()


def test_several_outputs_are_of_one_study(city: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs, asked = import_module("renderer.checkpoints.study"), []
    own = runs.run
    monkeypatch.setattr(runs, "run", lambda *told, **options: asked.append(told) or own(*told, **options))
    np.save(tmp_path / "p.npy", load_mesh(city).vertices)
    for where, names in (((), ("a.npy", "a.ply", "a.png")), (("--points", tmp_path / "p.npy"), ("b.npy", "b.ply"))):
        study("sky", city, *where, *(word for name in names for word in ("-o", tmp_path / name)), "--quiet")
    assert len(asked) == 2
    assert {path.name for path in tmp_path.iterdir()} == {"a.npy", "a.ply", "a.png", "b.npy", "b.ply", "p.npy"}
    for name, element in (("a", "face"), ("b", "vertex")):
        values = PlyData.read(tmp_path / f"{name}.ply")[element]["value"]
        np.testing.assert_array_equal(np.load(tmp_path / f"{name}.npy"), values)


def test_what_is_read_is_not_written_over(city: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points = tmp_path / "p.npy"
    np.save(points, load_mesh(city).vertices)
    before = points.read_bytes(), city.read_bytes()
    for output, where in ((points, ("--points", points)), (city, ())):
        told = ["study", "sky", city, *where, "-o", tmp_path / "a.npy", "-o", output, "--quiet"]
        assert main([str(word) for word in told]) == 2
        assert "--output: expected another file" in capsys.readouterr().err
    assert (points.read_bytes(), city.read_bytes()) == before and not (tmp_path / "a.npy").exists()


def test_vertices_have_means_of_their_faces_by_area(city: Path, tmp_path: Path) -> None:
    study("sky", city, "--vertices", "-o", tmp_path / "v.npy", "--quiet")
    mesh, values = load_mesh(city), on_faces(city, sky_view_factor)
    total, area = np.zeros((2, len(mesh.vertices)))
    for corners, value in zip(mesh.faces, values, strict=True):
        a, b, c = mesh.vertices[corners]
        size = float(np.linalg.norm(np.cross(b - a, c - a)))
        if np.isfinite(value):
            total[corners] += size * value
            area[corners] += size
    np.testing.assert_allclose(np.load(tmp_path / "v.npy"), total / area, rtol=1e-12)


def test_a_picture_has_the_camera_of_a_scene_and_the_size_that_it_is_told(city: Path, tmp_path: Path) -> None:
    lower, upper = load_mesh(city).bounds
    target = (lower + upper) / 2
    eye = target + np.array([0.0, 0.0, 1.5 * float((upper - lower).max())])
    path = city.with_name("scene.toml")
    path.write_text(SCENE.format(eye=eye.tolist(), target=target.tolist()))
    study("sky", city, "-o", tmp_path / "a.png", "--quiet")
    study("sky", city, "-o", tmp_path / "b.png", "--camera", path, "--resolution", "120x80", "--quiet")
    default, seen = (np.array(Pillow.open(tmp_path / name)) for name in ("a.png", "b.png"))
    assert default.shape[1] == 960 and 720 < default.shape[0] < 800
    # A pixel is the mean of four.
    faces = render(load_scene(path), resolution=(240, 160), samples=1, planes=("face",)).face
    shown = (faces >= 0).reshape(80, 2, 120, 2).any(axis=(1, 3))
    assert seen.shape[1] == 120 and ((seen[:80] != 255).any(axis=2) == shown).all()
    assert 0.1 < float(shown.mean()) < 0.9


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


@cases(
    "arguments",
    [
        ["sky", "m.ply"],
        ["stars", "m.ply", "-o", "a.npy"],
        ["sky", "-o", "a.npy"],
        [],
        ["sky", "m.ply", "-o", "a.npy", "--faces", "--vertices"],
        ["sky", "m.ply", "-o", "a.npy", "--grid", "x"],
        ["sky", "m.ply", "-o", "a.npy", "--grid", "1", "--points", "p.npy"],
        ["sky", "m.ply", "-o", "a.npy", "--faces", "--grid", "1"],
        ["sky", "m.ply", "-o", "a.npy", "--vertices", "--points", "p.npy"],
        ["sky", "m.ply", "-o", "a.npy", "--patches", "x"],
        ["sky", "m.ply", "-o", "a.npy", "--definition", "x"],
        ["ao", "m.ply", "-o", "a.npy", "--samples", "x"],
        ["sky", "m.ply", "-o", "a.npy", "--distance", "x"],
        ["sky", "m.ply", "-o", "a.png", "--resolution", "x"],
        ["sky", "m.ply", "-o", "a.npy", "--threads", "x"],
    ],
)
def test_arguments_that_make_no_sense_are_usage_errors(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["study", *arguments])
    assert stopped.value.code == 2 and "usage: octree-render study" in capsys.readouterr().err


def test_without_a_cluster_dask_is_not_imported(city: Path, tmp_path: Path) -> None:
    arguments = ["study", "sky", str(city), "-o", str(tmp_path / "a.npy"), "--quiet"]
    program = (
        "import sys\nfrom renderer.cli.main import main\n"
        f"code = main({arguments!r})\nsys.exit(code or ('dask' in sys.modules or 'distributed' in sys.modules) * 9)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_a_cluster_that_does_not_answer_is_one_line(
    city: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(import_module("renderer.cluster.clients"), "SECONDS", 0.5)
    told = ["study", "sky", str(city), "-o", str(tmp_path / "a.npy"), "--cluster", "tcp://127.0.0.1:9", "--quiet"]
    assert main(told) != 0
    assert "127.0.0.1:9" in capsys.readouterr().err and not (tmp_path / "a.npy").exists()


@pytest.mark.parametrize(("kind", "option"), [("sky", "--points"), ("sun", "--suns")])
def test_a_file_that_cannot_be_read_is_told_with_its_option(
    city: Path, tmp_path: Path, kind: str, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for missing, why in ((tmp_path / "none", "No such file or directory"), (tmp_path, "Is a directory")):
        assert main(["study", kind, str(city), option, str(missing), "-o", str(tmp_path / "a.npy"), "--quiet"]) == 2
        said = f"octree-render: {option}: expected a file that can be read, got {missing}: {why}\n"
        assert capsys.readouterr().err == said


@cases(
    "wrong",
    [
        ["--distance", "-1"],
        ["--samples", "0"],
        ["-o", "{folder}"],
        ["-o", "{folder}.png", "--resolution", "0x9"],
        ["--resolution", "9x0"],
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
    try:
        assert main([*command, *wrong]) == 2
    except SystemExit as end:  # of the parser
        assert end.code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["s.npy"]
    assert main(command) == 0


@cases(
    ("kind", "wrong"),
    [("sky", ["--patches", "0"]), ("sky", ["--samples", "4"]), ("sun", ["--suns", "{file}"]), ("sun", [])],
)
def test_kinds_refuse_their_options_before_any_part(city: Path, tmp_path: Path, kind: str, wrong: list[str]) -> None:
    suns = tmp_path / "suns.txt"
    suns.write_text("0 0 1 -1")
    wrong = [word.format(file=suns) for word in wrong]
    assert main(["study", kind, str(city), "-o", str(tmp_path / "a.npy"), "--quiet", *wrong]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["suns.txt"]


@pytest.mark.parametrize("size", ["1x1", "8192x1"])
def test_the_smallest_picture_and_the_widest(city: Path, tmp_path: Path, size: str) -> None:
    output = tmp_path / "a.png"
    assert main(["study", "sky", str(city), "-o", str(output), "--resolution", size, "--quiet"]) == 0
    with Pillow.open(output) as picture:  # below it stands a legend
        assert picture.width == int(size.partition("x")[0])


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


def test_a_grids_points_at_the_meshs_edge_are_on_it(tmp_path: Path) -> None:
    corners = [[0, 0, 0], [1.5, 0, 0], [1.5, 1.5, 0], [0, 1.5, 0]]
    found = on_grid(Octree(corners, [[0, 1, 2], [0, 2, 3]]), 1.0).points.points
    assert sorted(map(tuple, found[:, :2].tolist())) == [(0.5, 0.5), (0.5, 1.5), (1.5, 0.5), (1.5, 1.5)]


def test_one_of_several_outputs_may_be_a_picture_by_a_camera(city: Path, tmp_path: Path) -> None:
    scene = city.with_name("above.toml")
    scene.write_text(SCENE.format(eye=[0, 0, 500], target=[0, 0, 0]).replace("fov = 40", "fov = 40\nup = [0, 1, 0]"))
    outputs = "-o", tmp_path / "a.npy", "-o", tmp_path / "b.PNG"
    study("ao", city, *outputs, "--camera", scene, "--resolution", "9x9", "--samples", 4, "--quiet")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npy", "b.PNG"]


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
    assert "--output: expected another file than those that are read" in capsys.readouterr().err
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
