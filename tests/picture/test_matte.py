"""Pictures without their background: known coverages, and the picture again where the background is put back."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from cases import cases
from PIL import Image as Pillow
from varied import BASE, picture, scene_of, write_meshes

from renderer import OrthographicCamera, Phong, Scene, SceneObject, prepare, srgb
from renderer.cli.main import main
from renderer.mesh.shapes import box, grid
from renderer.picture.exposure import exposed
from renderer.picture.matte import cut_out, matte_of

# No colour is brighter than white, which a PNG file cannot hold: the edges of such a surface would be darker.
SUN = {"type": "directional", "direction": [-0.6, -1.0, -0.5], "irradiance": 0.2}
DIM: Any = BASE | {"ambient": 0.1, "lights": [SUN]}
SKY: Any = {"lights": 0, "zenith": [0.1, 0.2, 0.6], "horizon": [0.6, 0.5, 0.2], "ground": [0.2, 0.1, 0.1]}


def decoded(codes: Any) -> Any:
    """IEC 61966-2-1's inverse: 8-bit sRGB to linear."""
    x = codes / 255.0
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def pixels(scene: Scene, samples: int, stops: float = 0.0, filter: str = "box") -> Any:
    """The transparent picture as floats, its radiance, and its matte."""
    ready = prepare(scene)
    chosen = scene.render.model_copy(update={"samples": samples, "filter": filter})
    image, matte = picture(scene, samples=samples, filter=filter), matte_of(ready, scene.camera, chosen, 1)
    radiance, matte = exposed(image.radiance, stops), matte.exposed(stops)
    return cut_out(radiance, matte), radiance, matte


def test_alpha_is_the_share_of_a_pixel_that_a_box_covers() -> None:
    """The whole of one, three quarters, a quarter, and none; its colour is its own in each."""
    camera = OrthographicCamera(eye=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), height=1.0)
    parts = [((-2.0, -0.5), (1.0, 1.0)), ((-1.0, -0.5), (0.75, 1.0)), ((0.0, -0.5), (0.5, 0.5))]
    boxes = [
        SceneObject(mesh=box(), material="red", scale=(*size, 1.0), translate=(*corner, 0.0)) for corner, size in parts
    ]
    red = Phong(diffuse=0, ambient=(0.5, 0.2, 0.0))
    scene = Scene(camera=camera, materials={"red": red}, objects=boxes, ambient=1, background=(0.1, 0.4, 0.9))
    scene = scene.altered(render=scene.render.model_copy(update={"resolution": (4, 1)}))
    found, _, matte = pixels(scene, 16)
    assert matte.hits.tolist() == [[16, 12, 4, 0]]
    assert found[0, :, 3].tolist() == [255, 192, 64, 0] and not found[0, 3].any()
    # Alpha is up to a 255th too large, by which the background shows in the colours.
    assert np.abs(decoded(found[0, :3, :3]) - (0.5, 0.2, 0.0)).max() < 1 / 255
    assert found[0, 0, :3].tolist() == srgb([0.5, 0.2, 0.0]).tolist()


@cases("samples", [1, 9])
def test_alpha_of_what_is_partly_there_is_its_opacity_unless_something_is_behind(samples: int) -> None:
    camera = OrthographicCamera(eye=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), height=1.0)
    pane = SceneObject(mesh=grid(1, 1), material="pane", rotate=(90, 0, 0), translate=(-1.0, 0.5, 1.0), scale=2)
    wall = SceneObject(mesh=box(), material="red", translate=(0.0, -0.5, -1.0))
    materials = {"pane": Phong(diffuse=0.5, opacity=0.3), "red": Phong(diffuse=0, ambient=(0.5, 0.2, 0.0))}
    scene = Scene(camera=camera, materials=materials, objects=[pane, wall], ambient=1, background=(0.1, 0.4, 0.9))
    scene = scene.altered(render=scene.render.model_copy(update={"resolution": (2, 1)}))
    found, radiance, _ = pixels(scene, samples)
    assert found[0, :, 3].tolist() == [77, 255]
    behind = (1 - found[0, :, 3:] / 255) * (0.1, 0.4, 0.9)
    np.testing.assert_allclose(decoded(found[0, :, :3]) * found[0, :, 3:] / 255 + behind, radiance[0], atol=0.004)


@cases("samples", [1, 4, 9, 25])
@cases(("stops", "filter"), [(0.0, "box"), (-2.0, "box"), (0.5, "tent"), (0.0, "gaussian"), (-2.0, "mitchell")])
@cases("table", [DIM, {key: DIM[key] for key in DIM if key != "background"} | {"sky": SKY}])
def test_over_its_background_it_is_the_picture_again(
    tmp_path: Path, table: Any, samples: int, stops: float, filter: str
) -> None:
    """Within a code of sRGB, also before glass and mirrors, and where alpha is no whole number of 255ths."""
    write_meshes(tmp_path)
    scene = scene_of(tmp_path, table | {"render": table["render"] | {"resolution": [40, 32]}})
    found, radiance, matte = pixels(scene, samples, stops, filter)
    alpha, misses = found[..., 3:] / 255.0, (matte.samples - matte.hits)[..., None]
    behind = np.divide(matte.background * matte.samples, misses, where=misses > 0, out=np.zeros_like(radiance))
    if "background" in table:
        expected = exposed(np.float32(table["background"]), stops)
        seen, lobes = (matte.hits > 0) & (matte.hits < samples), filter == "mitchell"  # whose sums nearly cancel
        some = seen if lobes else matte.hits < samples
        assert np.allclose(behind[some], expected, rtol=1e-4 if lobes else 1e-6, atol=0)
    over = alpha * decoded(found[..., :3]) + (1.0 - alpha) * behind
    whole = ((found[..., :3] > 0) & (found[..., :3] < 255)).all(axis=2) | (filter != "mitchell")  # else clipped
    assert np.abs(srgb(over).astype(int) - srgb(radiance))[whole].max() <= 1
    assert ((found[..., 3] == 0) == (matte.hits == 0)).all()
    assert srgb(radiance).max() < 255 and (samples == 1 or ((matte.hits > 0) & (matte.hits < samples)).any())


@pytest.mark.judges("octree-render render --transparent", "octree-render render --exposure")
def test_the_command_takes_its_filter_for_both(tmp_path: Path) -> None:
    write_meshes(tmp_path)
    scene_of(tmp_path, DIM | {"render": DIM["render"] | {"resolution": [20, 16]}})
    words = ["render", str(tmp_path / "scene.toml"), "--transparent", "--quiet", "--samples", "16"]
    assert main([*words, "--filter", "gaussian", "-o", str(tmp_path / "a.png")]) == 0
    assert main([*words, "--change", "render.filter = 'gaussian'", "-o", str(tmp_path / "b.png")]) == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_the_command_writes_it(tmp_path: Path) -> None:
    write_meshes(tmp_path)
    scene = scene_of(tmp_path, DIM)
    told = ["render", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "a.png"), "--samples", "9", "--quiet"]
    for stops in (0.0, -1.5):
        for words, expected in (
            (["--transparent"], pixels(scene, 9, stops)[0]),
            ([], srgb(picture(scene, samples=9).radiance * np.float32(2.0**stops))),
        ):
            assert main([*told, *words, f"--exposure={stops}"]) == 0
            with Pillow.open(tmp_path / "a.png") as read:
                assert np.array_equal(np.asarray(read), expected)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-o", "a.exr", "--transparent"], "--transparent: expected a .png file, got 'a.exr'"),
        (["--transparent", "--cluster"], "--transparent: expected a picture of this machine, got --cluster"),
        (["--exposure", "nan"], "expected a number from -100 to 100, got 'nan'"),
    ],
)
def test_what_it_cannot_write_is_refused_before_it_renders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(tomlkit.dumps(DIM))
    try:
        code = main(["render", "scene.toml", *words])
    except SystemExit as ended:
        code = ended.code  # type: ignore[assignment]
    assert code == 2 and said in capsys.readouterr().err
    assert not list(tmp_path.glob("*.png"))
