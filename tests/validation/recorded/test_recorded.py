"""A gate on recorded hits: what passes, what fails and where the picture shows it, and the errors of bad files."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from renderer.mesh.ply import format_ply
from renderer.mesh.shapes import icosphere
from validation import __main__ as command
from validation.recorded.rays import make_rays

pytestmark = pytest.mark.judges(
    "octree-validate --compare", "octree-validate --record", "octree-validate --tolerance", "octree-validate meshes"
)
GAINED, LOST, MOVED = (60, 120, 255), (230, 50, 40), (255, 160, 20)
BALL = icosphere(3)


class Folder:
    """A folder with a recorded sphere, and the command on other meshes in it."""

    def __init__(self, path: Path) -> None:
        self.path, self.record, self.mesh = path, path / "hits.json", path / "ball.ply"
        self.save(BALL)
        assert command.main(["--record", str(self.record), str(self.mesh)]) == 0

    def save(self, mesh: Mesh) -> None:
        self.mesh.write_bytes(format_ply(mesh))

    def compare(self, *more: str) -> int:
        return command.main(["--compare", str(self.record), *more])

    @property
    def found(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads((self.path / "hits-compared.json").read_text(encoding="utf-8"))
        return found

    @property
    def picture(self) -> NDArray[np.uint8]:
        return np.asarray(Image.open(self.path / "hits-compared.png"))


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    return Folder(tmp_path)


def marked(picture: NDArray[np.uint8], colour: tuple[int, int, int]) -> NDArray[np.int64]:
    """Rows and columns of the pixels with a colour."""
    return np.argwhere((picture == colour).all(axis=-1))


def test_the_same_mesh_passes_and_no_pixel_is_marked(folder: Folder, capsys: pytest.CaptureFixture[str]) -> None:
    assert folder.compare() == 0
    assert "PASS, 16,384 rays hit as recorded" in capsys.readouterr().out
    assert folder.found["passed"] and folder.found["same_mesh"] and folder.found["listed"] == []
    assert not any(len(marked(folder.picture, colour)) for colour in (GAINED, LOST, MOVED))
    assert folder.record.stat().st_size < 200_000


def test_a_vertex_that_moved_fails_and_is_marked_in_its_place(
    folder: Folder, capsys: pytest.CaptureFixture[str]
) -> None:
    vertices = BALL.vertices.copy()
    top = int(np.argmax(vertices[:, 2]))
    vertices[top] *= 0.9
    folder.save(Mesh(vertices, BALL.faces))
    assert folder.compare() == 1
    found = folder.found
    assert 0 < found["differ"] < 200 and not found["same_mesh"]
    assert "validation: FAIL, " in capsys.readouterr().out
    # By up to 0.1 along z, of the diagonal of a cube of side 2; rays aslant see more.
    assert 0.05 < found["largest_shift"] * np.sqrt(12.0) < 0.3
    # The sphere from +z is the last of three squares, below: its centre is the vertex.
    height, width = folder.picture.shape[:2]
    places = marked(folder.picture, MOVED)
    last = places[places[:, 1] > 2 * width / 3]
    assert len(last) and np.abs(last.mean(axis=0) - [0.745 * height, 0.83 * width]).max() < 12
    # Nothing is marked above, where the mesh stands as it was recorded.
    assert places[:, 0].min() > height / 2


def test_lost_and_gained_hits_have_colours_of_their_own(folder: Folder) -> None:
    folder.save(BALL.transformed(np.diag([1.0, 1.0, 0.8, 1.0])))
    assert folder.compare() == 1
    assert folder.found["lost"] > 0 == folder.found["gained"] and len(marked(folder.picture, LOST))
    folder.save(BALL.transformed(np.diag([1.0, 1.0, 1.02, 1.0])))
    assert folder.compare() == 1
    assert folder.found["gained"] > 0 == folder.found["lost"] and len(marked(folder.picture, GAINED))


def test_faces_in_another_order_pass(folder: Folder, capsys: pytest.CaptureFixture[str]) -> None:
    folder.save(Mesh(BALL.vertices, BALL.faces[np.random.default_rng(1).permutation(len(BALL.faces))]))
    assert folder.compare("--tolerance", "1e-12") == 0
    assert folder.found["other_face"] > 1000 and not folder.found["same_mesh"]
    assert "PASS, the mesh changed, but 16,384 rays hit as recorded" in capsys.readouterr().out


def test_the_tolerance_is_a_share_of_the_meshs_size(folder: Folder) -> None:
    folder.save(Mesh(BALL.vertices + np.array([0.0, 0.0, 1e-9]), BALL.faces))
    assert folder.compare() == 1
    assert folder.compare("--tolerance", "1e-10") == 1
    assert folder.compare("--tolerance", "1e-7") == 0


def test_a_part_beyond_all_rays_is_seen_by_the_bounds(folder: Folder) -> None:
    far = Mesh([[900.0] * 3, [901.0, 900.0, 900.0], [900.0, 901.0, 900.0]], [[0, 1, 2]])
    folder.save(Mesh.concatenate([BALL, far]))
    assert folder.compare() == 1
    assert folder.found["differ"] == 0 and folder.found["bounds_shift"] > 100


def test_another_mesh_and_another_folder_can_be_named(folder: Folder) -> None:
    other = folder.mesh.rename(folder.path / "other.ply")
    assert folder.compare(str(other), "--output", str(folder.path / "new" / "out")) == 0
    assert {path.name for path in (folder.path / "new" / "out").iterdir()} == {
        "hits-compared.png", "hits-compared.json"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"version": 1', '"version": 2', "version: Input should be 1; write it again with --record"),
        ('"side": 64', '"side": 65', "t: expected 16771 values, got 16384; write it again with --record"),
        ('"t": "', '"t": "?', "t: expected a compressed array"),
        ('"lower"', '"least"', "got another file: lower: Field required"),
        ("ball.ply", "none.ply", "another one goes after it: --compare"),
    ],
)
def test_a_bad_record_is_one_line_and_exit_code_2(
    old: str, new: str, words: str, folder: Folder, capsys: pytest.CaptureFixture[str]
) -> None:
    text = folder.record.read_text(encoding="utf-8")
    assert old in text
    folder.record.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert folder.compare() == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("validation: ") and words in line
    assert not (folder.path / "hits-compared.png").exists()


def test_files_that_are_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--compare", str(tmp_path / "none.json")]) == 2
    assert (
        capsys.readouterr().err == f"validation: {tmp_path / 'none.json'}: cannot be read: No such file or directory\n"
    )
    assert command.main(["--record", str(tmp_path / "a.json"), str(tmp_path / "none.ply")]) == 2
    assert "none.ply: cannot be read" in capsys.readouterr().err and not list(tmp_path.iterdir())


def test_places_that_cannot_be_written_are_named(folder: Folder, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--record", str(folder.path / "none" / "a.json"), str(folder.mesh)]) == 2
    assert folder.compare("--output", str(folder.mesh)) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("validation: --record: expected a file that can be written, got ")
    assert second.startswith("validation: --output: expected a folder that can be made, got ")


def test_no_reference_is_imported(folder: Folder) -> None:
    program = f"""
import sys

class Without:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {{"embreex", "igl", "mitsuba", "skimage", "scipy", "jinja2", "matplotlib"}}:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Without())
from validation.__main__ import main
sys.exit(main(["--compare", {str(folder.record)!r}]))
"""
    subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[3], check=True)


def test_rays_are_the_same_on_every_machine() -> None:
    """Their bits, which no random numbers and no library decide."""
    origins, directions = make_rays(np.zeros(3), np.ones(3), 2, 2)
    assert origins[:4].tolist() == [[1, 0.25, 0.75], [1, 0.75, 0.75], [1, 0.25, 0.25], [1, 0.75, 0.25]]
    assert directions[::4].tolist()[:3] == [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]
    unit, power = [], 1.0
    for _ in range(6):
        power *= 1.0 / 1.1127756842787055
        unit.append((0.5 + 2 * power) % 1.0)
    assert origins[-1].tolist() == [2 * value - 0.5 for value in unit[:3]]
    assert directions[-1].tolist() == [b - (2 * a - 0.5) for a, b in zip(unit[:3], unit[3:], strict=True)]


def test_flat_and_far_meshes_are_recorded(tmp_path: Path) -> None:
    square = Mesh([[1e6, 0, 5], [1e6 + 1, 0, 5], [1e6, 1, 5]], [[0, 1, 2]])
    (tmp_path / "square.ply").write_bytes(format_ply(square))
    record = tmp_path / "square.json"
    assert command.main(["--record", str(record), str(tmp_path / "square.ply")]) == 0
    assert command.main(["--compare", str(record)]) == 0
    assert load_mesh(tmp_path / "square.ply").faces.tolist() == [[0, 1, 2]]
