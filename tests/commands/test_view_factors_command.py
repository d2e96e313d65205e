"""``octree-render study viewfactors``: surfaces, options and files are those of the functions, and errors one line."""

import csv
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from furnished import MATERIALS, OBJECTS, room_objects, same_bits, write_room

from renderer import Mesh, Octree, load_mesh
from renderer.cli import view_factors as command
from renderer.cli.main import main
from renderer.errors import extra_hint
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box
from renderer.studies import ViewFactors, view_factors
from renderer.studies.factors import saved

pytest.importorskip("scipy")
pytestmark = pytest.mark.judges(
    "octree-render study --groups", "octree-render study --max-rays", "octree-render study --rtol",
    "octree-render study --sides", "octree-render study kind",
    "studies.ViewFactors.load", "studies.ViewFactors.matrix", "studies.ViewFactors.save",
)  # fmt: skip
# Of a unit cube: a wall to the one opposite (Howell C-11) and to one beside it (C-14).
OPPOSITE, BESIDE = 0.19982489569838746, 0.20004377607540316
PAIR = "--transmittance: expected NAME=VALUE with a number from 0 to 1, or an .npy file"
# Few rays, as of which nothing is said here.
FEW = ("--rtol", "0.5", "--max-rays", "256")


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_room(tmp_path_factory.mktemp("room"))


REMEDY = (
    "which does not count; something stands on it, or the faces that it sees are turned the wrong way: turn them, "
    "or use --sides both"
)


def study(*words: object) -> int:
    return main(["study", "viewfactors", *map(str, words), "--quiet"])


def found_of(output: Path, *words: object) -> ViewFactors:
    """What the command writes to ``output``, and nothing beside it."""
    assert study(*words, "-o", output) == 0
    assert [path.name for path in output.parent.iterdir() if path.name.startswith(output.name)] == [output.name]
    return ViewFactors.load(output)


def test_walls_of_a_room_have_the_factors_of_howell(tmp_path: Path) -> None:
    found = found_of(tmp_path / "f.npz", write_room(tmp_path, column=False), "--groups", "objects")
    assert found.names == tuple(OBJECTS)[:6]
    matrix = found.matrix.toarray()
    assert abs(matrix[4, 5] - OPPOSITE) < 1e-9 and abs(matrix[4, 0] - BESIDE) < 1e-9
    assert found.areas.round(12).tolist() == [1.0] * 6 and (found.sky == 0.0).all()


# The words of the command, and the arguments of the function.
ASKED: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "nothing": ((), {}),
    "--groups": (("--groups", "faces"), {}),
    "--sides": (("--sides", "both"), {"sides": "both"}),
    "--rtol": (("--rtol", "0.9"), {"rtol": 0.9}),
    "--max-rays": (("--max-rays", "1024"), {"max_rays": 1024}),
    "--threads": (("--threads", "1"), {"threads": 1}),
}


@cases("name", ASKED)
def test_the_result_is_that_of_the_function_with_the_options_argument(room: Path, tmp_path: Path, name: str) -> None:
    words, given = ASKED[name]
    octree, usual = Octree.from_mesh(load_mesh(room)), {"rtol": 0.02, "max_rays": 512}
    expected = view_factors(octree, **(usual | given))
    told = {"--rtol": 0.02, "--max-rays": 512} | dict([words] if words else [])
    found = found_of(tmp_path / "f.npz", room, *(word for option in told.items() for word in option))
    assert same_bits(found, expected) and found.names is None
    changes = name in ("--sides", "--rtol", "--max-rays")
    assert same_bits(found, view_factors(octree, **usual)) == (not changes)


def test_without_options_it_is_as_accurate_as_the_function(tmp_path: Path) -> None:
    save_ply(Mesh.concatenate([Mesh(*walls) for walls in list(room_objects().values())[4:]]), tmp_path / "some.ply")
    octree = Octree.from_mesh(load_mesh(tmp_path / "some.ply"))
    assert same_bits(found_of(tmp_path / "f.npz", tmp_path / "some.ply"), view_factors(octree))


@cases("groups, names", [("objects", tuple(OBJECTS)), ("materials", tuple(MATERIALS))])
def test_surfaces_are_objects_or_materials(room: Path, tmp_path: Path, groups: str, names: tuple[str, ...]) -> None:
    faces = [name for name, (_, own) in room_objects().items() for _ in own]
    numbers = [names.index(name if groups == "objects" else OBJECTS[name]) for name in faces]
    found = found_of(tmp_path / "f.npz", room, "--groups", groups, *FEW)
    expected = view_factors(Octree.from_mesh(load_mesh(room)), numbers, rtol=0.5, max_rays=256)
    assert found.names == names and same_bits(found, expected)


def test_objects_of_several_files_are_the_files(tmp_path: Path) -> None:
    files = []
    for name, (vertices, faces) in room_objects().items():
        files.append(tmp_path / f"{name}.ply")
        save_ply(Mesh(vertices, faces), files[-1])
    words = ("--groups", "objects", "--hide", "col*", *FEW)
    found = found_of(tmp_path / "f.npz", *files, *words)
    assert found.names == tuple(OBJECTS)[:6] and abs(found.exchange.toarray()[4, 5] - OPPOSITE) < 1e-9


def test_faces_without_a_material_are_a_surface(tmp_path: Path) -> None:
    """Names that are empty or come again get numbers."""
    vertices, faces = room_objects(column=False)["floor"]
    lines = [*("v {} {} {}".format(*v) for v in vertices), "f 1 2 3", "mtllib m.mtl", "usemtl a"]
    lines += ["f {} {} {}".format(*f) for f in faces + 1]
    (tmp_path / "m.obj").write_text("\n".join(lines))
    (tmp_path / "m.mtl").write_text("newmtl a\n")
    found = found_of(tmp_path / "f.npz", tmp_path / "m.obj", "--groups", "materials", "--sides", "both", *FEW)
    assert set(found.names or ()) == {"a", "no material"} and len(found.areas) == 2
    assert command._distinct(["", "wall", "wall", "object 0", "wall 2"], "object") == [
        "object 0", "wall", "wall 2", "object 0 2", "wall 2 2",
    ]  # fmt: skip


@cases(
    "words, through",
    [
        (["glass=0.5"], {"north": 0.5}),
        (["column=0.25"], {"column": 0.25}),
        (["room.obj=0.1"], dict.fromkeys(OBJECTS, 0.1)),
        (["{}=0.1"], dict.fromkeys(OBJECTS, 0.1)),
        (["*rth=0.1", "*st=0.2", "west=0"], {"north": 0.1, "east": 0.2}),
        (["wood=0.3", "floor=0.2"], {"column": 0.3, "floor": 0.2}),
    ],
)
def test_what_is_let_through_is_named(room: Path, tmp_path: Path, words: list[str], through: dict[str, float]) -> None:
    shares = [through.get(name, 0.0) for name, (_, faces) in room_objects().items() for _ in faces]
    given = [word for share in words for word in ("--transmittance", share.replace("{}", str(room)))]
    found = found_of(tmp_path / "f.npz", room, *given, "--sides", "both", *FEW)
    octree = Octree.from_mesh(load_mesh(room))
    expected = view_factors(octree, sides="both", transmittance=shares, rtol=0.5, max_rays=256)
    assert same_bits(found, expected)
    np.save(tmp_path / "shares.npy", shares)
    words = ["--transmittance", str(tmp_path / "shares.npy"), "--sides", "both", *FEW]
    assert same_bits(found_of(tmp_path / "f.npz", room, *words), expected)


def test_a_table_has_a_row_for_each_surface(room: Path, tmp_path: Path) -> None:
    """Beside an array file of the same run, and of the same numbers."""
    table, arrays = tmp_path / "f.csv", tmp_path / "f.NPZ"
    assert study(room, "--groups", "objects", "-o", table, "-o", arrays, "--hide", "none*", *FEW) == 2
    assert study(room, "--groups", "objects", "-o", table, "-o", arrays, *FEW) == 0
    with table.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    found = ViewFactors.load(arrays)
    assert head == ["surface", "area", *OBJECTS, "sky", "backs", "error"]
    assert [row[0] for row in rows] == list(OBJECTS)
    values = np.array([row[1:] for row in rows], float)
    np.testing.assert_array_equal(values[:, 0], found.areas)
    np.testing.assert_array_equal(values[:, 1:8], found.matrix.toarray())
    np.testing.assert_allclose(values[:, 1:10].sum(axis=1), 1.0, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(values[:, 10], found.errors.toarray().max(axis=1))
    assert values[:, 10].max() > 0.0
    with np.load(arrays) as file:
        assert set(file.files) == {
            "areas", "sky", "backs", "rays", "names", "matrix_data",
            *(f"{name}_{part}" for name in ("exchange", "errors") for part in ("data", "indices", "indptr")),
        }  # fmt: skip
        assert file["matrix_data"].tobytes() == found.matrix.data.tobytes()


def test_it_says_what_it_wrote_unless_quiet(room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["study", "viewfactors", str(room), "-o", str(tmp_path / "f.npz"), *FEW]
    assert main([*words, "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert main(words) == 0
    said = capsys.readouterr()
    assert f"{tmp_path / 'f.npz'}: view factors of 24 surfaces in " in said.out and said.out.count("\n") == 1


@cases(
    "words, said",
    [
        (["--groups", "materials"], "--groups: expected a mesh file with materials, got none in {}/plain.ply"),
        (["-o", "{}/f.npy"], "--output: expected a file that ends in .npz or .csv, got '{}/f.npy'"),
        (["-o", "{}/f.NPZ.gz"], "--output: expected a file that ends in .npz or .csv, got '{}/f.NPZ.gz'"),
        (["-o", "{}/f.npz"], "--output: expected each file once, got {}/f.npz, {}/f.npz"),
        (["-o", "{}/none/f.npz"], "--output: expected a path in an existing folder, got {}/none/f.npz"),
        (["--rtol", "0"], "rtol: expected a number above 0, got 0.0"),
        (["--max-rays", "9"], "max_rays: expected an integer from 256 to 16777216, got 9"),
        (["--transmittance", "tree=0.5"], "--transmittance: expected the name of a material, an object or a mesh file, "
         "or a pattern, got 'tree'"),
        *((["--transmittance", word], f"{PAIR}, got '{word}'") for word in ("plain=1.5", "plain", "=0.5", "plain=nan")),
        (["--transmittance", "{}/none.npy"], "--transmittance: expected a file that can be read, got {}/none.npy: No "
         "such file or directory"),
        (["--patches", "9"], "--patches: expected none but for the kind sky, got one for the kind viewfactors"),
        (["--grid", "9"], "--grid: expected none for the kind viewfactors, got one"),
        (["--vertices"], "--vertices: expected none for the kind viewfactors, got one"),
        (["--max-distance", "9"], "--max-distance: expected none for the kind viewfactors, got one"),
        (["--up", "y"], "--up: expected none for the kind viewfactors, got one"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_on_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    save_ply(box(), tmp_path / "plain.ply")
    told = [word.replace("{}", str(tmp_path)) for word in words]
    assert study(tmp_path / "plain.ply", "-o", tmp_path / "f.npz", *told) == 2
    error = capsys.readouterr().err
    assert error == f"octree-render: {said.replace('{}', str(tmp_path))}\n"
    assert [path.name for path in tmp_path.iterdir()] == ["plain.ply"]


def test_options_of_view_factors_are_for_them_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_ply(box(), tmp_path / "plain.ply")
    for words in (["--groups", "faces"], ["--sides", "both"], ["--rtol", "1"], ["--max-rays", "256"]):
        command = ["study", "sky", str(tmp_path / "plain.ply"), "-o", str(tmp_path / "a.npy"), *words]
        assert main(command) == 2
        said = f"{words[0]}: expected none but for the kind viewfactors, got one for the kind sky"
        assert capsys.readouterr().err == f"octree-render: {said}\n"
    with pytest.raises(SystemExit):
        study(tmp_path / "plain.ply", "--groups", "walls", "-o", tmp_path / "f.npz")
    assert "argument --groups: invalid choice: 'walls'" in capsys.readouterr().err


def test_without_scipy_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    save_ply(box(), tmp_path / "plain.ply")
    for name in [name for name in sys.modules if name.partition(".")[0] == "scipy"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "scipy", None)
    assert study(tmp_path / "plain.ply", "-o", tmp_path / "f.npz") == 2
    error = capsys.readouterr().err
    assert error == f"octree-render: view factors need SciPy; {extra_hint('radiosity')}\n"
    assert [path.name for path in tmp_path.iterdir()] == ["plain.ply"]


def test_a_table_wider_than_a_spreadsheet_is_refused(
    room: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(saved, "MOST_COLUMNS", 23)
    assert study(room, "-o", tmp_path / "f.csv", *FEW) == 2
    said = f"--output: expected an .npz for more than 23 surfaces, got {tmp_path / 'f.csv'} for 24\n"
    assert capsys.readouterr().err == f"octree-render: {said}"
    monkeypatch.setattr(saved, "MOST_COLUMNS", 24)
    assert study(room, "-o", tmp_path / "f.csv", *FEW) == 0


@cases("spoil", ["empty", "text", "array", "other", "index", "length"])
def test_files_that_are_none_of_view_factors_are_refused(tmp_path: Path, spoil: str) -> None:
    path = tmp_path / "f.npz"
    view_factors(Octree.from_mesh(box()), max_rays=256).save(path)
    with np.load(path) as file:
        arrays = dict(file)
    if spoil == "array":
        np.save(tmp_path / "f.npy", np.zeros(3))
        (tmp_path / "f.npy").rename(path)
    elif spoil in ("empty", "text"):
        path.write_text("" if spoil == "empty" else "no archive")
    elif spoil == "other":
        np.savez(path, areas=np.ones(3))
    elif spoil == "index":
        ones = {"exchange_data": np.ones(1), "exchange_indices": [99], "exchange_indptr": np.arange(13) > 0}
        np.savez(path, **(arrays | ones))
    else:
        np.savez(path, **(arrays | {"errors_indptr": np.zeros(3, int)}))
    with pytest.raises(ValueError, match=r"f\.npz: expected view factors that ViewFactors\.save wrote"):
        ViewFactors.load(path)


def test_backs_that_are_seen_are_named_with_the_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The ceiling faces down and the plate below it too: half of the ceiling's rays at most end on its back."""
    (tmp_path / "p.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\no plate\nf 1 3 2\no ceiling\nf 4 6 5\n"
    )
    found = found_of(tmp_path / "f.npz", tmp_path / "p.obj", "--groups", "objects", *FEW)
    said = f"1 of 2 surfaces see backs of faces, surface ceiling most: {100 * found.backs[1]:.3g} % of what it sends"
    assert capsys.readouterr().err == f"octree-render: {said}, {REMEDY}\n"
    found_of(tmp_path / "f.npz", tmp_path / "p.obj", "--groups", "objects", "--sides", "both", *FEW)
    assert capsys.readouterr().err == ""


def test_names_and_bits_come_back_from_a_file(room: Path, tmp_path: Path) -> None:
    found = found_of(tmp_path / "f.npz", room, "--groups", "materials", *FEW)
    found.save(tmp_path / "again.npz")
    again = ViewFactors.load(tmp_path / "again.npz")
    assert same_bits(found, again) and again.names == tuple(MATERIALS)
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "f.npz").read_bytes()
    with pytest.raises(FileNotFoundError):
        ViewFactors.load(tmp_path / "none.npz")
    with pytest.raises(ValueError, match=r"path: expected a file that ends in \.npz or \.csv, got .*f\.txt"):
        found.save(tmp_path / "f.txt")
    rays = view_factors(Octree.from_mesh(load_mesh(room)), form="rays", max_rays=8)
    with pytest.raises(ValueError, match="form: expected view factors with form='matrix', got form='rays'"):
        rays.save(tmp_path / "f.npz")
