"""Each setting of the page and each field of the scene's file, alone, in each way in which the viewer answers."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
import tomlkit
from cases import cases
from varied import BASE, VARIATIONS, Table, Variation, picture, scene_of, written
from viewer_client import decoded
from viewer_ways import (
    INSIDE,
    WAYS,
    WRITTEN,
    Case,
    a_still,
    a_turntable,
    brute,
    click,
    command,
    octree,
    page_of,
    same,
    save,
    save_camera,
)

from renderer import Scene, srgb
from renderer.diagnostics.false_color import false_color, shades_of
from renderer.diagnostics.ray_cost import camera_steps
from renderer.picture.pack import media_around
from renderer.viewer import compare, passes
from renderer.viewer import shown as shown_module
from renderer.viewer.compare import compared
from renderer.viewer.passes import passes_of
from renderer.viewer.protocol import Edits, ViewSettings
from renderer.viewer.shown import UNSEEN, ShownScene, open_file


def dark(color: str) -> Callable[[Table], None]:
    """No material has the colour any more."""

    def change(table: Table) -> None:
        for material in table["materials"].values():
            material |= {color: 0.0} if color in material else {}

    return change


def into(*keys: Any, value: Any) -> Callable[[Table], None]:
    """The value stands there."""

    def change(table: Table) -> None:
        place = table
        for key in keys[:-1]:
            place = place[key]
        place[keys[-1]] = value

    return change


GLASS, MIRROR = BASE["materials"]["glass"], BASE["materials"]["steel"]
SUN, LAMP = BASE["lights"][:2]
EDITS: Table = {
    "materials": {"wax": GLASS, "glass": MIRROR},
    "lights": [LAMP],
    "ambient": [0.5, 0.1, 0.2],
    "background": [0.8, 0.1, 0.3],
}
TURNED = [0.7, -0.9, -0.2]
DARK = SUN | {"irradiance": [0.0, 0.0, 0.0]}
# Settings that differ from those that a page begins with, and how the file has to say so.
SETTINGS: dict[str, tuple[Table, Callable[[Table], None]]] = {
    "max_depth": ({"max_depth": 1}, into("render", "max_depth", value=1)),
    "samples": ({"samples": 9}, into("render", "samples", value=9)),
    "shadows": ({"shadows": False}, into("render", "shadows", value=False)),
    "reflection": ({"reflection": False}, dark("reflectance")),
    "refraction": ({"refraction": False}, dark("transmittance")),
    "light": ({"light": TURNED}, into("lights", 0, "direction", value=TURNED)),
    "edits": (
        {"edits": EDITS},
        lambda table: table.update(EDITS | {"materials": table["materials"] | EDITS["materials"]}),
    ),
    # The first that shines is turned.
    "dark": (
        {"light": TURNED, "edits": {"lights": [LAMP, DARK, SUN, SUN]}},
        into("lights", value=[LAMP, DARK, SUN | {"direction": TURNED}, SUN]),
    ),
}
# Settings of some ways alone, each with a test of its own below.
OWN = {"refine", "aov", "pair", "exposure"}
# tests/viewer/test_viewer_server.py: a JPEG file looks like the picture.
ELSEWHERE = {"pixels"}
# Those that no file of a scene has, nor a command's.
UNWRITTEN = {"reflection", "refraction"}


@pytest.fixture(scope="module")
def shown(folder: Path) -> ShownScene:
    """The scene, in a file that stays as it is."""
    (folder / "shown.toml").write_text(tomlkit.dumps(BASE))
    return open_file(folder / "shown.toml")


@cache
def with_setting(folder: Path, shown: ShownScene, name: str) -> Case:
    given, change = SETTINGS[name]
    table = deepcopy(BASE)
    change(table)
    return Case(shown, page_of(shown.scene) | given, scene_of(folder, table)).seen()


# The ways


def shows(way: Any, name: str) -> bool:
    """Whether the way's answer has the setting: files and commands know no switches, a saved camera no materials."""
    return not (way in WRITTEN and name in UNWRITTEN) and (way is not save_camera or name != "edits")


def test_every_setting_has_a_case() -> None:
    here = {key for given, _ in SETTINGS.values() for key in given}
    assert ViewSettings.model_fields.keys() == here | OWN | ELSEWHERE


@cases(("name", "way"), [(n, way) for n in SETTINGS for way in (*WAYS, *WRITTEN) if shows(way, n)])
def test_a_setting_is_as_if_the_file_said_so(folder: Path, shown: ShownScene, name: str, way: Any) -> None:
    case = with_setting(folder, shown, name)
    assert same(way(case))
    assert case.picture().radiance.tobytes() != Case(shown, {}, shown.scene).seen().picture().radiance.tobytes()


@cases("way", [octree, brute, a_still, click])
@cases("name", SETTINGS)
def test_a_setting_holds_for_an_eye_in_two_bodies(folder: Path, shown: ShownScene, name: str, way: Any) -> None:
    case = with_setting(folder, shown, name).seen(m=INSIDE)
    assert len(media_around(shown.scene, case.scene.camera)) == 2
    assert same(way(case))


EDITED = [v for v in VARIATIONS if v.keys[0] in Edits.model_fields and v.keys[2:] not in [(n,) for n in UNSEEN]]


@cases("other", EDITED)
def test_each_field_that_is_edited_is_shown_and_written(folder: Path, shown: ShownScene, other: Variation) -> None:
    """A saved camera has the lights too, but no materials. A sky takes the place of the file's background."""
    table, kind = other.varied(), other.keys[0]
    edits = {kind: {other.keys[1]: table[kind][other.keys[1]]} if kind == "materials" else table[kind]}
    case = Case(shown, page_of(shown.scene) | {"edits": edits}, scene_of(folder, table)).seen()
    for way in (octree, command, save, *([save_camera] if kind == "lights" else [])):
        assert same(way(case)), way


SKY = [other for other in EDITED if other.keys[0] == "sky"]


@pytest.fixture(scope="module")
def under_sky(folder: Path) -> ShownScene:
    """The scene with a sky, in a file that stays as it is."""
    (folder / "sky.toml").write_text(tomlkit.dumps(SKY[-1].table))
    return open_file(folder / "sky.toml")


@cases("other", SKY)
def test_each_field_of_a_sky_is_shown_and_written(folder: Path, under_sky: ShownScene, other: Variation) -> None:
    table = other.varied()
    case = Case(under_sky, page_of(under_sky.scene) | {"edits": {"sky": table["sky"]}}, scene_of(folder, table)).seen()
    for way in (octree, command, save):
        assert same(way(case)), way


@cases("way", [*WAYS, command, save])
def test_a_background_takes_the_place_of_the_files_sky(folder: Path, under_sky: ShownScene, way: Any) -> None:
    edits = {"background": BASE["background"]}
    case = Case(under_sky, page_of(under_sky.scene) | {"edits": edits}, scene_of(folder, BASE)).seen()
    assert same(way(case))


@cases("other", [v for v in VARIATIONS if v.keys[0] == "render"])
def test_the_files_settings_hold(folder: Path, other: Variation) -> None:
    case = of_file(folder, other)
    for way in (*WAYS, *WRITTEN):
        assert same(way(case)), way


@cases("other", [v for v in VARIATIONS if v.keys[0] not in ("render", "camera")])
def test_the_picture_is_that_of_the_file(folder: Path, other: Variation) -> None:
    assert same(octree(of_file(folder, other)))


@cases("mode", ["octree", "brute"])
@cases("other", [v for v in VARIATIONS if v.keys[0] == "render"])
def test_the_files_settings_hold_in_every_band(
    folder: Path, monkeypatch: pytest.MonkeyPatch, other: Variation, mode: str
) -> None:
    """Where pictures before the last have fewer rays than the file allows."""
    monkeypatch.setattr(passes, "BAND_PIXELS", 1)
    monkeypatch.setattr(shown_module, "SOON", 2)
    case = of_file(folder, other).seen(h=70)
    bands = [p for p in passes_of(case.message("view", seq=1, mode=mode)) if p.band is not None]
    assert len(bands) == 3
    payload = b"".join(case.answer(mode, number) for number in range(-3, 0))
    found = np.frombuffer(payload, np.uint8).reshape(*case.size[::-1], 4)[..., :3]
    samples = {} if mode == "octree" else {"samples": 1}
    assert np.array_equal(found, srgb(case.picture(**samples).radiance))


def of_file(folder: Path, other: Variation) -> Case:
    """The scene of a file with that field, with the settings that a page takes over."""
    path = folder / "other.toml"
    path.write_text(written(folder, other.varied()).read_text())
    shown = open_file(path)
    return Case(shown, page_of(shown.scene), shown.scene).seen()


@pytest.mark.parametrize("refine", [16, 64])
def test_a_picture_grows_to_as_many_samples_as_are_asked_for(shown: ShownScene, refine: int) -> None:
    case = Case(shown, page_of(shown.scene) | {"refine": refine}, shown.scene).seen()
    assert np.array_equal(case.colors("octree"), srgb(case.picture(samples=refine).radiance))


@cases("aov", get_args(ViewSettings.model_fields["aov"].annotation))
def test_a_value_is_drawn_in_its_colours(shown: ShownScene, aov: Any) -> None:
    case = Case(shown, page_of(shown.scene) | {"aov": aov}, shown.scene).seen()
    if aov in ("nodes", "triangles"):
        counts = getattr(camera_steps(shown.prepared, case.scene.camera, case.size, lambda share: None), aov)
        expected = shades_of(counts, counts.min(), counts.max())
    else:
        plain = {} if aov in ("color", "cost") else {"max_depth": 0, "shadows": False}
        expected = false_color(case.picture(**plain), aov)
    for way in (octree, a_still, a_turntable):
        assert np.array_equal(way(case)[0], expected)


@cases("way", [octree, brute, a_still, a_turntable, command])
def test_colours_are_exposed_and_nothing_else(shown: ShownScene, way: Any) -> None:
    case = Case(shown, page_of(shown.scene) | {"exposure": 1.5}, shown.scene).seen()
    samples = {"samples": 1} if way is brute else {}
    expected = srgb(case.picture(**samples).radiance * np.float32(2.0**1.5))
    assert np.array_equal(way(case)[0], expected)
    if way is not command:
        plain, exposed = (replace(case, settings=case.settings | {"aov": "depth", "exposure": s}) for s in (0.0, 5.0))
        assert np.array_equal(way(plain)[0], way(exposed)[0])


def test_both_pictures_of_a_proof_are_exposed_and_their_difference_is_not(shown: ShownScene) -> None:
    case = Case(shown, page_of(shown.scene), shown.scene).seen()
    plain, exposed = (replace(case, settings={"exposure": s}).answer("proof") for s in (0.0, -2.0))
    found = list(map(decoded, files(exposed)))
    compared = [case.picture(samples=n, max_depth=6).radiance for n in (compare.FEW, compare.MANY)]
    assert all(np.array_equal(one, srgb(radiance / 4)) for one, radiance in zip(found, compared, strict=False))
    assert np.array_equal(found[2], decoded(files(plain)[2]))


def files(payload: bytes) -> list[bytes]:
    """The three files of a proof."""
    found = []
    while payload:
        size = int.from_bytes(payload[:4], "little")
        found.append(payload[4 : 4 + size])
        payload = payload[4 + size :]
    return found


@cases("name", SETTINGS)
def test_another_renderer_is_asked_for_the_picture_with_the_setting(
    folder: Path, shown: ShownScene, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Bounces and size are told beside the scene; what others cannot switch off is refused."""

    def reference(told: str, scene: Scene, size: Any, max_depth: int, finished: Any) -> Any:
        assert told == "other"
        return picture(scene, resolution=size, samples=1, max_depth=max_depth).radiance

    monkeypatch.setattr(compare, "reference_picture", reference)
    case = with_setting(folder, shown, name)
    view = replace(case, settings=case.settings | {"pair": "other"}).message("view", seq=1, mode="proof")
    if name in UNWRITTEN:
        with pytest.raises(ValueError, match=f"comparison: expected {name} as the materials have it"):
            compared(shown, view, case.size, lambda share: None)
        return
    for found in compared(shown, view, case.size, lambda share: None).pictures:
        assert found.tobytes() == case.picture(samples=1).radiance.tobytes()
