"""``octree-render study`` of several mesh files: their values, those left out, and the axis that points up."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from cases import cases
from PIL import Image as Pillow

from renderer import Mesh, Octree, load_mesh
from renderer.cli.main import main
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box
from renderer.studies import ambient_occlusion, face_points, grid_points, sky_view_factor, sun_hours

GROUND = Mesh([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2], [0, 2, 3]])
BODIES = {"low.ply": box((0, 0, 0), (2, 2, 1)), "high.obj": box((3, 0, 0), (4, 3, 5)), "ground.ply": GROUND}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of three files, which is the current one."""
    for name, mesh in BODIES.items():
        if name.endswith(".obj"):
            lines = [
                *("v {} {} {}".format(*v) for v in mesh.vertices),
                *("f {} {} {}".format(*f + 1) for f in mesh.faces),
            ]
            (tmp_path / name).write_text("\n".join(lines))
        else:
            save_ply(mesh, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def study(*words: object) -> None:
    assert main(["study", *map(str, words)]) == 0


def sky_of(mesh: Mesh, up: str = "z") -> np.ndarray:
    points, normals, faces = face_points(mesh)
    return sky_view_factor(Octree.from_mesh(mesh), points, normals, leaving=faces, up=up)


@pytest.mark.judges("octree-render study mesh", "octree-render study --hide")
class TestFiles:
    def test_values_are_those_of_all_meshes_in_one_and_follow_in_the_files_order(
        self, folder: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        study("sky", *BODIES, "-o", "a.npy", "-o", "a.ply")
        values = sky_of(Mesh.concatenate(BODIES.values()))
        assert np.load("a.npy").tobytes() == values.tobytes()
        read = trimesh.load("a.ply", process=False)
        assert read.metadata["_ply_raw"]["face"]["data"]["value"].ravel().tobytes() == values.tobytes()
        head, *lines = (line.split() for line in capsys.readouterr().out.splitlines()[1:])
        assert head == ["rows", "mean", "by", "area", "least", "greatest", "file"]
        for line, (name, mesh), (begin, end) in zip(lines, BODIES.items(), [(0, 12), (12, 24), (24, 26)], strict=True):
            own, area = values[begin:end], trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).area_faces
            told = ((own * area).sum() / area.sum(), own.min(), own.max())
            assert line == [f"{begin}:{end}", *(f"{value:.4g}" for value in told), name]

    def test_rows_of_vertices_are_vertices_and_a_grids_values_are_counted_where_they_lie(
        self, folder: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        study("sky", *BODIES, "-o", "a.npy", "--vertices")
        said = capsys.readouterr().out
        assert all(rows in said for rows in ("0:8 ", "8:16 ", "16:20 ")) and len(np.load("a.npy")) == 20
        study("sky", *BODIES, "-o", "a.npy", "--grid", "0.5")
        head, *lines = (line.split() for line in capsys.readouterr().out.splitlines()[1:])
        assert head == ["points", "mean", "least", "greatest", "file"]
        octree = Octree.from_mesh(Mesh.concatenate(BODIES.values()))
        places = grid_points(octree, 0.5)
        owner = np.searchsorted([12, 24], places.faces, side="right")
        values = sky_view_factor(octree, places.points, places.normals, leaving=places.faces)
        assert np.load("a.npy").tobytes() == values.tobytes()
        assert [line[:2] for line in lines] == [
            [f"{(owner == k).sum()}", f"{values[owner == k].mean():.4g}"] for k in range(3)
        ]

    def test_nothing_is_said_of_files_by_points_of_none_or_of_one_file(
        self, folder: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        for words in (["ground.ply"], [*BODIES, "--grid", "2", "--height", "0.5"], [*BODIES, "--quiet"]):
            study("sky", *words, "-o", "a.npy")
            assert capsys.readouterr().out.count("\n") == ("--quiet" not in words)

    def test_a_file_that_sees_no_point_of_a_grid_has_no_values(
        self, folder: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        save_ply(box((0.5, 0.5, 0.25), (1, 1, 0.5)), folder / "hidden.ply")
        study("sky", "low.ply", "hidden.ply", "-o", "a.npy", "--grid", "0.5")
        assert capsys.readouterr().out.splitlines()[-1].split() == ["0", "nan", "nan", "nan", "hidden.ply"]

    @cases("hidden", [["high.obj"], ["h*.obj"], ["./high.obj"], ["*.obj", "hi*"]])
    def test_hidden_files_are_as_if_they_were_not_given(self, folder: Path, hidden: list[str]) -> None:
        words = [word for name in hidden for word in ("--hide", name)]
        study("sky", *BODIES, *words, "-o", "a.npy", "--quiet")
        study("sky", "low.ply", "ground.ply", "-o", "b.npy", "--quiet")
        assert Path("a.npy").read_bytes() == Path("b.npy").read_bytes()
        assert np.load("a.npy").tobytes() == sky_of(Mesh.concatenate([BODIES["low.ply"], GROUND])).tobytes()

    def test_a_folders_files_are_given_in_the_order_of_their_names(
        self, folder: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        (folder / "notes.txt").write_text("no mesh")
        study("sky", folder, "-o", "a.npy", "--hide", "low.*")
        lines = capsys.readouterr().out.splitlines()[-2:]
        assert [line.split()[-1] for line in lines] == [str(folder / name) for name in ("ground.ply", "high.obj")]
        study("sky", "ground.ply", "high.obj", "-o", "b.npy", "--quiet")
        assert Path("a.npy").read_bytes() == Path("b.npy").read_bytes()
        assert main(["study", "sky", ".", "-o", "low.ply"]) == 2
        assert capsys.readouterr().err == "octree-render: --output: expected a file that is not an input, got low.ply\n"

    def test_a_file_given_twice_is_refused(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["study", "sky", "low.ply", "./low.ply", "-o", "a.npy"]) == 2
        assert capsys.readouterr().err == "octree-render: mesh: expected each file once, got low.ply, low.ply\n"


@pytest.mark.judges("octree-render study --bounds", "octree-render study --height", "octree-render study --grid")
def test_a_grid_is_that_of_grid_points_with_the_options_arguments(folder: Path) -> None:
    octree = Octree.from_mesh(load_mesh("low.ply"))
    for words, more in (
        (["--height", "-0.5"], {"height": -0.5}),
        (["--bounds", *["-0.5", "0", "0", "1", "1", "0"]], {"bounds": [[-0.5, 0, 0], [1, 1, 0]]}),
        (["--up", "x"], {"up": "x"}),
        (["--up", "x", "--height", "3", "--bounds", *["0", "0", "0", "0", "1", "1"]],
         {"up": "x", "height": 3, "bounds": [[0, 0, 0], [0, 1, 1]]}),
    ):  # fmt: skip
        study("sky", "low.ply", "--grid", "0.3", *words, "-o", "a.npy", "-o", "a.ply", "--quiet")
        places = grid_points(octree, 0.3, **more)  # type: ignore[arg-type]
        raw = trimesh.load("a.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]
        assert np.array_equal(np.stack([raw[axis].ravel() for axis in "xyz"], axis=1), places.points)
        expected = sky_view_factor(
            octree, places.points, places.normals, leaving=places.faces, up=more.get("up", "z")  # type: ignore[arg-type]
        )  # fmt: skip
        assert np.load("a.npy").tobytes() == expected.tobytes()


@pytest.mark.judges("octree-render study --up")
class TestUp:
    def glb(self, folder: Path, name: str) -> str:
        mesh = BODIES["high.obj"]
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(folder / name)
        return name

    def test_y_is_up_in_glb_files_and_z_in_others_of_which_one_line_says_so(
        self, folder: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        """A .glb was taken as z-up, though its format says y."""
        note = "not say which axis points up: z was taken; --up x|y|z changes it\n"
        high, all_of_them = BODIES["high.obj"], Mesh.concatenate(BODIES.values())
        for files, words, mesh, up, said in (
            ([self.glb(folder, "high.glb")], [], high, "y", ""),
            (["high.glb"], ["--up", "x"], high, "x", ""),
            (["high.obj"], [], high, "z", f"octree-render: high.obj does {note}"),
            (["high.obj"], ["--up", "y"], high, "y", ""),
            (["high.obj"], ["--quiet"], high, "z", ""),
            (list(BODIES), [], all_of_them, "z", f"octree-render: the mesh files do {note}"),
        ):
            study("sky", *files, *words, "-o", "a.npy")
            assert np.load("a.npy").tobytes() == sky_of(mesh, up).tobytes()
            assert capsys.readouterr().err == said

    def test_files_of_two_formats_that_disagree_need_an_axis(
        self, folder: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        files = [self.glb(folder, "a.glb"), "low.ply"]
        assert main(["study", "sky", *files, "-o", "a.npy"]) == 2
        said = (
            "octree-render: --up: expected an axis for .glb and .gltf files, whose y is up, beside others, got none\n"
        )
        assert capsys.readouterr().err == said
        study("sky", *files, "-o", "a.npy", "--up", "z")
        study("sky", *files, "-o", "a.npy", "--hide", "a.glb")

    def test_nothing_is_said_where_no_axis_is_taken(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        (folder / "suns.txt").write_text("0 0 1 1\n")
        for kind, words, taken in (
            ("ao", [], False), ("sun", ["--suns", "suns.txt"], False), ("ao", ["--grid", "1"], True),
            ("ao", ["-o", "a.png", "--resolution", "9x9"], True),
        ):  # fmt: skip
            study(kind, "low.ply", "-o", "a.npy", *words)
            assert bool(capsys.readouterr().err) == taken

    def test_suns_below_the_horizon_count_only_without_an_axis(self, folder: Path) -> None:
        suns, hours = [[0.0, 0.5, 1.0], [0.2, 0.0, -1.0], [1.0, 0.1, 0.0]], [2.0, 3.0, 4.0]
        (folder / "suns.txt").write_text(
            "".join(f"{x} {y} {z} {h}\n" for (x, y, z), h in zip(suns, hours, strict=True))
        )
        octree = Octree.from_mesh(BODIES["low.ply"])
        points, normals, faces = face_points(octree.mesh)
        for words, count in (([], [0, 1, 2]), (["--up", "z"], [0]), (["--up", "y"], [0, 2]), (["--up", "x"], [1, 2])):
            study("sun", "low.ply", "--suns", "suns.txt", "-o", "a.npy", "--quiet", *words)
            kept = [suns[k] for k in count], [hours[k] for k in count]
            assert np.load("a.npy").tobytes() == sun_hours(octree, points, normals, *kept, leaving=faces).tobytes()
        assert (sun_hours(octree, points, None, [[0, 0, -1.0]], up="z") == np.zeros(len(points))).all()

    def test_a_picture_of_a_mesh_with_y_up_is_that_of_the_mesh_with_z_up(self, folder: Path) -> None:
        """But for rounding at the edges of bodies."""
        city, turn = Mesh.concatenate(BODIES.values()), np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
        pictures = []
        for name, up, by in (("z", "z", np.eye(3)), ("y", "y", turn)):
            save_ply(Mesh(city.vertices @ by.T, city.faces), folder / f"{name}.ply")
            np.savetxt("suns.txt", [by @ [0.3, -0.5, 0.7], by @ [-0.8, 0.1, 0.5]])
            words = [f"{name}.ply", "--suns", "suns.txt", "--up", up, "--resolution", "120x150"]
            study("sun", *words, "-o", f"{name}.png", "--quiet")
            with Pillow.open(f"{name}.png") as picture:
                pictures.append(np.asarray(picture).astype(int))
        first, second = pictures
        assert (np.abs(first - second).max(axis=2) > 1).mean() < 0.01
        assert len(np.unique(first.reshape(-1, 3), axis=0)) > 5

    def test_points_without_normals_look_along_it(self, folder: Path) -> None:
        np.save("p.npy", [[5.0, 1.0, 0.5], [-3.0, 1.0, 0.5]])
        octree = Octree.from_mesh(BODIES["high.obj"])
        study("ao", "high.obj", "--points", "p.npy", "--up", "y", "-o", "a.npy", "--quiet")
        study("sky", "high.obj", "--points", "p.npy", "--up", "y", "-o", "b.npy", "--quiet")
        assert np.load("b.npy").tobytes() == sky_view_factor(octree, np.load("p.npy"), up="y").tobytes()
        assert np.load("a.npy").tobytes() == ambient_occlusion(octree, np.load("p.npy"), [0, 1, 0]).tobytes()
