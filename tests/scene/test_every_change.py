"""Each key that ``--change`` can set, changed alone, gives the picture of a scene file that has it."""

import re
from pathlib import Path
from typing import get_args

import numpy as np
import tomlkit
from cases import cases
from varied import BASE, VARIATIONS, Table, Variation, picture, scene_of, written

from renderer import Hits, Mesh, Octree, Phong, RenderSettings, Scene, SceneObject, Sky
from renderer.cli.main import main
from renderer.materials.registry import Material
from renderer.mesh.shapes import icosphere
from renderer.scene.camera import Camera
from renderer.scene.change import _Changes, changed
from renderer.scene.hide import object_names
from renderer.scene.light import Light

DRAWN: dict[str, bytes] = {}
CHANGED = [other for other in VARIATIONS if other.keys[0] in _Changes.model_fields]


def written_by(folder: Path, table: Table, text: str) -> np.ndarray:
    """What the command writes of the scene with a change."""
    words = [str(written(folder, table)), "--change", text, "-o", str(folder / "a.npy"), "--quiet"]
    assert main(["render", *words]) == 0
    return np.load(folder / "a.npy")


def shot(scene: Scene) -> Hits:
    """What the rays of a picture hit."""
    octree = Octree(Mesh.concatenate(part.mesh for part in scene.instances))
    return octree.closest_hit(*(rays.reshape(-1, 3) for rays in scene.camera.primary_rays(48)))


def unchanged(folder: Path, table: Table) -> bytes:
    """The picture of a table, drawn once."""
    told = repr(table)
    if told not in DRAWN:
        DRAWN[told] = picture(scene_of(folder, table)).radiance.tobytes()
    return DRAWN[told]


def text_of(folder: Path, other: Variation) -> str:
    """The change: a material or a key of ``render`` alone, or all that stands under another key."""
    top, *rest = other.keys
    whole = other.varied()[top]
    text = tomlkit.dumps({top: {rest[0]: whole[rest[0]]} if top in ("materials", "render") else whole})
    return text.replace('"spots.png"', repr(str(folder / "spots.png")))


def test_every_table_that_can_be_changed_is_varied_in_each_of_its_types() -> None:
    assert {other.keys[0] for other in CHANGED} == _Changes.model_fields.keys() - {"hide"}
    types = {RenderSettings, Scene, Sky, *get_args(Camera), *get_args(Light), *get_args(Material)}
    assert {other.record for other in CHANGED} == types


@cases("other", CHANGED)
def test_a_change_gives_the_picture_of_a_file_that_has_it(folder: Path, other: Variation) -> None:
    """All other keys stay as they are: none of the file's has its default."""
    found = written_by(folder, other.table, text_of(folder, other))
    assert found.tobytes() == picture(scene_of(folder, other.varied())).radiance.tobytes()
    assert found.tobytes() != unchanged(folder, other.table)


@cases("side", ["x > 0.3", "z < -0.2", "y>.25"])
def test_what_is_cut_off_is_not_seen_and_all_else_is(folder: Path, side: str) -> None:
    """Depths of the picture: as before where the surface that was seen stays, and else of one that lies behind it."""
    axis, sign, at = re.fullmatch("(.) ?(.) ?(.*)", side).groups()  # type: ignore[union-attr]
    scene = scene_of(folder, BASE)
    whole, left = (shot(one) for one in (scene, changed(scene, f'hide = ["{side}"]')))
    stays = (whole.points[:, "xyz".index(axis)] - float(at)) * (1 if sign == ">" else -1) < -1e-9
    assert 0.05 < stays[whole.hit].mean() < 0.95
    np.testing.assert_allclose(left.t[whole.hit & stays], whole.t[whole.hit & stays], rtol=1e-12)
    gone = whole.hit & ~stays
    assert (left.t[gone] > whole.t[gone] - 1e-9).all()
    beyond = left.points[left.hit, "xyz".index(axis)] - float(at)
    assert (beyond * (1 if sign == ">" else -1) <= 1e-9).all()


UNDER_SKY = next(other.table for other in VARIATIONS if other.keys[0] == "sky" and len(other.keys) > 1)
# A table with the one, and a table with the other in its place.
SWAPS = [("background", UNDER_SKY, BASE), ("sky", BASE, UNDER_SKY)]


@cases(("top", "before", "after"), SWAPS)
def test_a_background_takes_the_place_of_a_sky_and_a_sky_of_a_background(
    folder: Path, top: str, before: Table, after: Table
) -> None:
    found = written_by(folder, before, tomlkit.dumps({top: after[top]}))
    assert found.tobytes() == picture(scene_of(folder, after)).radiance.tobytes()


def test_a_smooth_body_keeps_its_normals_at_the_cut() -> None:
    """Those of the faces that are left alone bend towards it."""
    ball = SceneObject(mesh=icosphere(2), material="grey", normals="smooth")
    eye = {"eye": (0, 0, 5), "target": (0, 0, 0)}
    scene = Scene(camera=eye, materials={"grey": Phong()}, objects=[ball])
    (left,) = changed(scene, 'hide = ["x > 0.1"]').instances
    slant = np.einsum("ij,ij->i", left.normals, left.mesh.vertices) / np.linalg.norm(left.normals, axis=1)
    assert (slant / np.linalg.norm(left.mesh.vertices, axis=1)).min() > 0.9999  # of those of the half alone 0.995


@cases("name", ["objects.0", "objects.1", "objects.2", "floor"])
def test_what_is_hidden_gives_the_picture_of_a_file_without_it(folder: Path, name: str) -> None:
    assert name in object_names(scene_of(folder, BASE))
    left = {key: value for key, value in BASE.items() if key != name}
    if name != "floor":
        left["objects"] = [thing for i, thing in enumerate(BASE["objects"]) if f"objects.{i}" != name]
    found = written_by(folder, BASE, f'hide = ["{name}"]')
    assert found.tobytes() == picture(scene_of(folder, left)).radiance.tobytes()
    assert found.tobytes() != picture(scene_of(folder, BASE)).radiance.tobytes()
