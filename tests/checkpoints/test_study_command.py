"""``octree-render study``: its results are those of the library, in each format, and survive a kill."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from cases import cases
from PIL import Image as Pillow
from plyfile import PlyData

from renderer import Octree, load_mesh
from renderer.checkpoints import study as studies
from renderer.cli.main import main
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box
from renderer.studies import face_points, sky_view_factor, sun_hours
from validation.benchmark.measures.meshes import named

pytestmark = pytest.mark.judges(
    "octree-render study", "octree-render study --camera", "octree-render study --cluster",
    "octree-render study --definition", "octree-render study --distance", "octree-render study --faces",
    "octree-render study --grid", "octree-render study --output", "octree-render study --patches",
    "octree-render study --points", "octree-render study --resolution", "octree-render study --samples",
    "octree-render study --suns", "octree-render study kind", "octree-render study mesh",
)  # fmt: skip


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("city") / "city.ply"
    save_ply(named("city_300"), path)
    return path


def _run(*arguments: object) -> int:
    return main(["study", *map(str, arguments), "--quiet"])


def test_faces_have_what_the_library_says(city: Path, tmp_path: Path) -> None:
    assert _run("sky", city, "-o", tmp_path / "sky.npy") == 0
    octree = Octree.from_mesh(load_mesh(city))
    points, normals, faces = face_points(octree.mesh)
    expected = np.full(len(octree.mesh.faces), np.nan)
    expected[faces] = sky_view_factor(octree, points, normals, leaving=faces)
    np.testing.assert_array_equal(np.load(tmp_path / "sky.npy"), expected)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["sky.npy"]


def test_sun_hours_of_a_file_of_suns(city: Path, tmp_path: Path) -> None:
    (tmp_path / "suns.txt").write_text("# x y z hours\n1, 0, 1, 2.5\n\n-1 0 1 1.5  \n")
    assert _run("sun", city, "--suns", tmp_path / "suns.txt", "-o", tmp_path / "sun.npy") == 0
    octree = Octree.from_mesh(load_mesh(city))
    points, normals, faces = face_points(octree.mesh)
    expected = sun_hours(octree, points, normals, [[1, 0, 1], [-1, 0, 1]], [2.5, 1.5], leaving=faces)
    np.testing.assert_array_equal(np.load(tmp_path / "sun.npy")[faces], expected)


def test_points_of_a_file_lie_on_no_face(city: Path, tmp_path: Path) -> None:
    octree = Octree.from_mesh(load_mesh(city))
    above = octree.mesh.bounds[1] + [0.0, 0.0, 1.0]
    np.save(tmp_path / "p.npy", np.array([above, above - [0.0, 0.0, 50.0]]))
    assert _run("sky", city, "--points", tmp_path / "p.npy", "--patches", 577, "-o", tmp_path / "sky.npy") == 0
    found = np.load(tmp_path / "sky.npy")
    assert found[0] == 1.0 and found.shape == (2,)
    np.save(tmp_path / "p.npy", np.array([[*above, 0.0, 0.0, -1.0]]))
    assert _run("sky", city, "--points", tmp_path / "p.npy", "-o", tmp_path / "down.ply") == 0
    vertex = PlyData.read(tmp_path / "down.ply")["vertex"]
    assert vertex["value"].tolist() == [0.0] and vertex["z"].tolist() == [above[2]]


def test_a_grid_lies_on_what_is_seen_from_above(tmp_path: Path) -> None:
    """A cube on a plate: its roof sees all, and points on the plate lie at its height."""
    plate, cube = box((-4, -4, -1), (4, 4, 0)), box((-1, -1, 0), (1, 1, 2))
    vertices = np.concatenate([plate.vertices, cube.vertices])
    faces = np.concatenate([plate.faces, cube.faces + len(plate.vertices)])
    save_ply(type(plate)(vertices, faces), tmp_path / "m.ply")
    assert _run("sky", tmp_path / "m.ply", "--grid", 0.5, "-o", tmp_path / "g.ply") == 0
    vertex = PlyData.read(tmp_path / "g.ply")["vertex"]
    assert len(vertex["x"]) == 16 * 16
    roof = (np.abs(vertex["x"]) < 1) & (np.abs(vertex["y"]) < 1)
    assert roof.sum() == 16 and (vertex["z"][roof] == 2.0).all() and (vertex["z"][~roof] == 0.0).all()
    assert (vertex["value"][roof] == 1.0).all() and (vertex["value"][~roof] < 1.0).any()


def test_a_coloured_mesh_and_a_picture_with_a_legend(city: Path, tmp_path: Path) -> None:
    assert _run("sky", city, "-o", tmp_path / "faces.ply") == 0
    assert _run("sky", city, "--vertices", "-o", tmp_path / "vertices.ply") == 0
    faces, vertices = PlyData.read(tmp_path / "faces.ply"), PlyData.read(tmp_path / "vertices.ply")
    mesh = load_mesh(city)
    assert len(faces["face"]["value"]) == len(mesh.faces) and len(vertices["vertex"]["value"]) == len(mesh.vertices)
    low, high = (np.nanargmin(faces["face"]["value"]), np.nanargmax(faces["face"]["value"]))
    assert [faces["face"][c][low] for c in ("red", "green", "blue")] == [68, 1, 84]
    assert [faces["face"][c][high] for c in ("red", "green", "blue")] == [253, 231, 37]
    assert np.nanmin(faces["face"]["value"]) <= np.nanmin(vertices["vertex"]["value"])
    assert _run("sky", city, "-o", tmp_path / "sky.png", "--resolution", "200x150") == 0
    picture = np.array(Pillow.open(tmp_path / "sky.png"))
    assert picture.shape == (150 + 28, 200, 3)
    legend = picture[150:159]
    assert legend[0, 0].tolist() == [68, 1, 84] and legend[0, -1].tolist() == [253, 231, 37]
    assert (picture[:150] != 255).any(axis=2).mean() > 0.2


@cases(
    "arguments, said",
    [
        (["sky", "-o", "a.txt"], "--output: expected one of .npy, .ply, .png"),
        (["sky", "--grid", "1", "-o", "a.png"], "--output: expected .npy or .ply for points"),
        (["sky", "--grid", "0", "-o", "a.npy"], "--grid: expected a number > 0"),
        (["sky", "--grid", "nan", "-o", "a.npy"], "--grid: expected a number > 0"),
        (["sky", "--grid", "1e-9", "-o", "a.npy"], "--grid: expected a spacing with at most"),
        (["sun", "-o", "a.npy"], "--suns: expected a file for the kind sun"),
        (["sky", "--suns", "none.txt", "-o", "a.npy"], "--suns: expected none, as it is the kind sun's"),
        (["ao", "--patches", "577", "-o", "a.npy"], "--patches: expected none, as it is the kind sky's"),
        (["ao", "--definition", "cosine", "-o", "a.npy"], "--definition: expected none, as it is the kind sky's"),
        (["sky", "--samples", "9", "-o", "a.npy"], "--samples: expected none, as it is the kind ao's"),
        (["sky", "--patches", "0", "-o", "a.npy"], "patches: expected"),
        (["sky", "--distance", "-1", "-o", "a.npy"], "distance: expected"),
        (["sky", "--points", "none.npy", "-o", "a.npy"], "none.npy"),
        (["sky", "--camera", "s.toml", "-o", "a.npy"], "--camera: expected a .png"),
        (["sky", "-o", "none/a.npy"], "none/a.npy"),
    ],
)
def test_bad_arguments_are_told_on_one_line(
    city: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    arguments: list[str], said: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert _run(arguments[0], city, *arguments[1:]) == 2
    text = capsys.readouterr().err
    assert said in text and text.count("\n") == 1
    assert not list(tmp_path.rglob("*.npy"))


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


def test_a_run_that_is_killed_goes_on_and_ends_with_the_same_bits(tmp_path: Path) -> None:
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
        "study.Study.plan.__defaults__, own, most = (64,), parts.Parts.write, int(sys.argv[1])\n"
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
    whole = subprocess.run([sys.executable, "-c", program, "99", *arguments], check=False)
    assert whole.returncode == 0 and not folder.exists()
    expected = sky_view_factor(octree, points, [0.0, 0.0, 1.0])
    assert np.load(result).tobytes() == expected.tobytes()


def test_a_local_cluster_gives_the_same_bits(city: Path, tmp_path: Path) -> None:
    assert _run("ao", city, "--samples", 64, "-o", tmp_path / "here.npy") == 0
    assert _run("ao", city, "--samples", 64, "--cluster", "local", "--threads", 1, "-o", tmp_path / "there.npy") == 0
    assert (tmp_path / "here.npy").read_bytes() == (tmp_path / "there.npy").read_bytes()
