"""A picture in bands of rows: the bits of the whole, whatever the bands, and a folder that knows what it is of."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import (
    Dielectric,
    Image,
    Mesh,
    PerspectiveCamera,
    PointLight,
    PreparedScene,
    Scene,
    SceneObject,
    load_scene,
    needs_of,
    prepare,
    render,
)
from renderer.checkpoints.pictures import Picture, PictureRun, band_of, digest_of_scene
from renderer.mesh.shapes import icosphere
from renderer.picture.image import PLANES
from renderer.picture.render import checked_view

SIZE = (41, 37)
# So few rays that some pixels are cut: their number is part of the picture.
OPTIONS: dict[str, Any] = {"resolution": SIZE, "samples": 4, "max_rays": 9}


@pytest.fixture(scope="module")
def glass() -> Scene:
    return load_scene("scenes/glass.toml")


@pytest.fixture(scope="module")
def ready(glass: Scene) -> PreparedScene:
    return prepare(glass)


def picture_of(scene: Scene, planes: Any = PLANES, camera: Any = None, offset: Any = "bounded", **more: Any) -> Picture:
    view = checked_view(scene, camera, offset, planes, OPTIONS | more)
    return Picture(view, digest_of_scene(scene, needs_of(scene)))


def assert_same(image: Image, expected: Image) -> None:
    for name in PLANES:
        ours, theirs = getattr(image, name), getattr(expected, name)
        assert (ours.shape, ours.dtype) == (theirs.shape, theirs.dtype) and ours.tobytes() == theirs.tobytes(), name
    assert image.cut == expected.cut


@cases("band, planes", [(1, PLANES), (5, ("depth", "rays")), (8, ()), (36, PLANES), (99, PLANES)])
def test_bands_of_rows_make_the_picture_of_all(
    ready: PreparedScene, tmp_path: Path, band: int, planes: tuple[str, ...]
) -> None:
    with pytest.warns(match="pixels miss rays"):
        expected = render(ready, planes=planes, **OPTIONS)
    run = PictureRun(tmp_path / "parts", picture_of(ready.scene, planes), band)
    assert len(run.parts.missing()) == -(-37 // band) and expected.cut > 0
    for part in reversed(run.parts.missing()):
        run.parts.write(part, run.picture.rows(ready, *run.parts.plan.span(part), threads=1))
    image = PictureRun(tmp_path / "parts", picture_of(ready.scene, planes), band).image(2.5)
    assert_same(image, expected)
    assert image.render_seconds == 2.5
    run.remove()
    assert not (tmp_path / "parts").exists()


def test_a_picture_that_lacks_a_part_is_none(ready: PreparedScene, tmp_path: Path) -> None:
    run = PictureRun(tmp_path / "parts", picture_of(ready.scene), 20)
    run.parts.write(0, run.picture.rows(ready, 0, 20, threads=2))
    with pytest.raises(OSError, match=r"00000001\.part: expected a whole part of the run, got none"):
        run.image()


def test_a_folder_of_another_picture_is_refused(glass: Scene, tmp_path: Path) -> None:
    """That of the scene's own camera is the same whoever names it; tests/cluster/test_every_frame.py varies all."""
    PictureRun(tmp_path / "parts", picture_of(glass), 8)
    camera = PerspectiveCamera(eye=(1, 2, 9), target=(0, 0, 0))
    with pytest.raises(ValueError, match=r"expected the parts of this run, got those of another, whose .*camera"):
        PictureRun(tmp_path / "parts", picture_of(glass, camera=camera), 8)
    PictureRun(tmp_path / "parts", picture_of(glass.altered(camera=camera), camera=glass.camera), 8)


def test_one_body_in_another_is_no_body_of_both() -> None:
    """They had one digest, as their faces are the same: around the eye are two media, or one."""
    outer = icosphere(1)
    inner = Mesh(0.5 * outer.vertices, outer.faces)
    both = Mesh(np.concatenate([outer.vertices, inner.vertices]), np.concatenate([outer.faces, inner.faces + 42]))
    camera = PerspectiveCamera(eye=(0.0, 0.1, 0.1), target=(0.2, -0.4, -1.0))
    scenes = [
        Scene(camera=camera, materials={"glass": Dielectric()}, background=(0.2, 0.4, 0.6),
              lights=[PointLight(position=(0, 3, 0))], objects=[SceneObject(mesh=m, material="glass") for m in bodies])
        for bodies in ((outer, inner), (both,))
    ]  # fmt: skip
    first, second = (render(scene, resolution=(4, 3)).radiance.tobytes() for scene in scenes)
    assert first != second
    assert len({digest_of_scene(scene, needs_of(scene)) for scene in scenes}) == 2


def test_each_change_of_what_stands_in_a_scene_changes_its_digest(glass: Scene) -> None:
    ball = icosphere(2)
    up, out = (
        Mesh(ball.vertices, ball.faces, normals) for normals in ([[0, 1, 0]] * len(ball.vertices), ball.vertices)
    )
    holed = Mesh(ball.vertices, ball.faces[1:], ball.vertices)
    moved = {"translate": (0, 1, 0)}
    pairs = [
        [(out, {}), (ball, {})], [(ball, {}), (out, {})], [(out, {}), (out, {})], [(up, {}), (ball, {})],
        [(holed, {}), (ball, {})], [(out, {}), (ball, moved)], [(out, {}), (ball, {"crease": 20.0})],
        [(out, {}), (ball, {"normals": "flat"})], [(out, {})], [(out, {}), (ball, {}), (out, {})],
        [(out, {}), (ball, {}), (ball, {})],
    ]  # fmt: skip
    digests = set()
    for pair in pairs:
        things = [SceneObject(mesh=mesh, material="glass", **{"normals": "smooth"} | more) for mesh, more in pair]
        scene = Scene(camera=glass.camera, materials={"glass": Dielectric()}, objects=things)
        digests.add(digest_of_scene(scene, needs_of(scene)))
    assert len(digests) == len(pairs)


@cases(
    "resolution, samples, rows",
    [((512, 512), 1, 512), ((640, 480), 16, 24), ((16384, 16384), 1, 16), ((16384, 16384), 64, 8), ((9, 3), 1, 3)],
)
def test_bands_have_a_quarter_of_a_million_camera_rays(
    glass: Scene, resolution: tuple[int, int], samples: int, rows: int
) -> None:
    assert band_of(picture_of(glass, resolution=resolution, samples=samples).view) == rows


@cases("band", [0, -8, 2.5, "8", True, float("nan")])
def test_a_band_that_is_no_number_of_rows_is_refused(glass: Scene, tmp_path: Path, band: Any) -> None:
    with pytest.raises(ValueError, match="band: expected an integer >= 1 or None"):
        PictureRun(tmp_path / "parts", picture_of(glass), band)


def test_a_folder_that_cannot_be_written_is_told_before_any_work(glass: Scene, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        PictureRun(tmp_path / "file" / "parts", picture_of(glass), 8)
    assert np.array_equal(np.sort([p.name for p in tmp_path.iterdir()]), ["file"])
