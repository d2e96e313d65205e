"""The files that a study writes, as other programs read them: values, colours, and what has no value."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
import trimesh
from cases import cases
from PIL import Image as Pillow
from scenery import scenery

from renderer import Phong, Scene, SceneObject, load_mesh, load_scene, render
from renderer.cli.main import main
from renderer.diagnostics.false_color import shades_of
from renderer.diagnostics.mesh_values import legend, legend_rows
from renderer.mesh.load import save_ply
from renderer.scene.camera import Camera
from renderer.scene.overview import from_above

pytestmark = pytest.mark.judges(
    "octree-render study --camera", "octree-render study --grid", "octree-render study --points",
    "octree-render study --resolution", "octree-render study --vertices",
)  # fmt: skip

GREY = [128, 128, 128]
CAMERA = {"eye": [3.0, -4.0, 5.0], "target": [0.0, 0.0, 0.5], "up": [0.0, 0.0, 1.0], "fov": 50.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("files")
    save_ply(scenery(), folder / "mesh.ply")
    np.save(folder / "points.npy", [[0.5, 0.5, 0.25], [-1.0, 0.75, 0.5], [0.1, 0.2, 2.0]])
    (folder / "scene.toml").write_text(tomlkit.dumps({"camera": CAMERA, "materials": {}}))
    return folder


def study(folder: Path, *words: object) -> None:
    told = [str(word).replace("{}", str(folder)) for word in words]
    assert main(["study", "sky", str(folder / "mesh.ply"), "--quiet", *told]) == 0


def colors_of(values: Any) -> Any:
    """Viridis from the least to the greatest number, grey where there is none."""
    known = np.isfinite(values)
    colors = np.tile(np.array(GREY, np.uint8), (len(values), 1))
    colors[known] = shades_of(values[known], values[known].min(), values[known].max())
    return colors


@cases(
    ("where", "element"),
    [
        ([], "face"),
        (["--faces"], "face"),
        (["--vertices"], "vertex"),
        (["--points", "{}/points.npy"], "vertex"),
        (["--grid", "0.7"], "vertex"),
    ],
)
def test_trimesh_reads_values_and_colours_of_a_ply(
    folder: Path, tmp_path: Path, where: list[str], element: str
) -> None:
    study(folder, *where, "-o", tmp_path / "a.npy", "-o", tmp_path / "a.ply")
    values, read = np.load(tmp_path / "a.npy"), trimesh.load(tmp_path / "a.ply", process=False)
    raw = read.metadata["_ply_raw"]
    assert raw[element]["data"]["value"].ravel().tobytes() == values.tobytes()
    mesh = load_mesh(folder / "mesh.ply")
    if isinstance(read, trimesh.PointCloud):
        assert "face" not in raw and len(set(values)) > 1
        colors = read.colors
    else:
        assert np.array_equal(read.vertices, mesh.vertices) and np.array_equal(read.faces, mesh.faces)
        # The face without an area, and the vertex of no other.
        assert np.flatnonzero(np.isnan(values)).tolist() == [32 if element == "face" else 20]
        colors = read.visual.face_colors if element == "face" else read.visual.vertex_colors
    assert np.array_equal(colors[:, :3], colors_of(values))
    if where[:1] == ["--grid"]:
        places = mesh.bounds[0][:2] + 0.7 * (np.arange(6)[:, None] + 0.5)
        for a in (0, 1):
            assert np.array_equal(np.unique(raw["vertex"]["data"]["xy"[a]]), places[:, a])
    if where[:1] == ["--points"]:
        assert np.array_equal(read.vertices, np.load(folder / "points.npy"))


@cases(
    ("where", "camera", "size"),
    [("--faces", None, (48, 72)), ("--vertices", "{}/scene.toml", (30, 55)), ("--faces", "{}/scene.toml", (48, 72))],
)
def test_a_picture_has_the_values_colours_where_its_camera_sees_them(
    folder: Path, tmp_path: Path, where: str, camera: str | None, size: tuple[int, int]
) -> None:
    """A pixel is the mean of four places, walls are darker than ground, and beside the mesh it is white."""
    words = ["--camera", camera] if camera else []
    study(
        folder, where, *words, "--resolution", "{}x{}".format(*size), "-o", tmp_path / "a.npy", "-o", tmp_path / "a.png"
    )
    mesh, values = load_mesh(folder / "mesh.ply"), np.load(tmp_path / "a.npy")
    if where == "--vertices":
        values = values[mesh.faces].mean(axis=1)
    rows = legend_rows(size[1])
    assert rows == (28 if size[1] == 72 else 0)
    whole, size = size, (size[0], size[1] - rows)
    eye: Camera = load_scene(folder / "scene.toml").camera if camera else from_above(mesh, size)
    thing = SceneObject(mesh=mesh, material="grey")
    seen = render(
        Scene(camera=eye, materials={"grey": Phong()}, objects=[thing]), resolution=(2 * size[0], 2 * size[1])
    )
    places = np.full((*seen.face.shape, 3), 255.0)
    hit = seen.face >= 0
    lit = 0.8 + 0.2 * np.abs(seen.normal[hit][:, 2:])
    places[hit] = np.floor(colors_of(values)[seen.face[hit]] * lit + 0.5)
    expected = np.floor(places.reshape(size[1], 2, size[0], 2, 3).mean(axis=(1, 3)) + 0.5)
    with Pillow.open(tmp_path / "a.png") as read:
        picture = np.asarray(read)
    assert np.array_equal(picture[: size[1]], expected) and 0.2 < hit.mean() < 0.95
    scale = float(np.nanmin(values)), float(np.nanmax(values))
    assert picture.shape == (whole[1], whole[0], 3)
    assert rows == 0 or np.array_equal(picture[size[1] :], legend(size[0], rows, scale, "sky view factor"))
