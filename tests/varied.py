"""A small scene in which every field shows, and another value for each field of the scene's classes, to vary alone.

A field that is added without another value here fails the tests that vary all of them.
"""

import copy
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from PIL import Image as Pillow

from renderer import (
    DirectionalLight,
    EquirectangularCamera,
    FisheyeCamera,
    Image,
    Mesh,
    OpenCVCamera,
    OpenCVFisheyeCamera,
    OrthographicCamera,
    PerspectiveCamera,
    PinholeCamera,
    PointLight,
    Scene,
    ThinLensCamera,
    load_scene,
    render,
)
from renderer.arguments.fields import Fields
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box, icosphere
from renderer.picture.image import CutWarning
from renderer.scene.scene import Floor, RenderSettings, SceneObject
from renderer.scene.sky import Sky

Table = dict[str, Any]
# A key of a scene file: names of tables, and places in lists.
Keys = tuple[str | int, ...]

_CAMERA: Table = {"eye": [2.5, 2.0, 4.0], "target": [0.0, 0.4, 0.0], "up": [0.1, 1.0, 0.0]}
PERSPECTIVE = {"type": "perspective", **_CAMERA, "fov": 40.0}
ORTHOGRAPHIC = {"type": "orthographic", **_CAMERA, "height": 3.5}
_FILM: Table = {"width": 20, "height": 16, "fx": 22.0, "fy": 20.0, "cx": 9.0, "cy": 8.5, "skew": 1.0}
PINHOLE = {"type": "pinhole", **_CAMERA, **_FILM}
FISHEYE = {"type": "fisheye", **_CAMERA, "fov": 70.0}
OPENCV = {"type": "opencv", **_CAMERA, **_FILM, "k1": 0.1, "k2": 0.02, "p1": 0.02, "p2": 0.03, "k3": 0.01}
OPENCV_FISHEYE = {"type": "opencv_fisheye", **_CAMERA, **_FILM, "k1": 0.1, "k2": 0.02, "k3": 0.03, "k4": 0.01}
EQUIRECTANGULAR = {"type": "equirectangular", **_CAMERA}
THIN_LENS = {"type": "thin_lens", **_CAMERA, "fov": 40.0, "aperture": 0.3, "focus": 4.0}
_SUN = {"type": "directional", "direction": [-0.6, -1.0, -0.5], "irradiance": [0.6, 0.7, 0.5]}
_LAMP = {"type": "point", "position": [0.5, 3.0, 1.5], "intensity": [3.0, 2.0, 4.0]}
_WAX = {
    "type": "phong", "diffuse": [0.3, 0.5, 0.2], "ambient": [0.3, 0.2, 0.1], "specular": [0.4, 0.3, 0.4],
    "shininess": 6.0, "reflectance": [0.3, 0.2, 0.3], "transmittance": [0.3, 0.4, 0.5], "ior": 1.3,
}  # fmt: skip
_STEEL = {"type": "mirror", "reflectance": [0.8, 0.7, 0.6]}
_GLASS = {"type": "dielectric", "ior": 1.4, "reflectance": [0.9, 0.8, 0.7], "transmittance": [0.7, 0.8, 0.9]}
_CHALK = _WAX | {"diffuse": [0.8, 0.7, 0.6], "ambient": [0.2, 0.4, 0.3]}

# Few rays a pixel, and a weight that ends some of them: so that these settings show too.
BASE: Table = {
    "ambient": [0.3, 0.2, 0.4],
    "background": [0.2, 0.4, 0.6],
    "camera": PERSPECTIVE,
    "materials": {"wax": _WAX, "steel": _STEEL, "glass": _GLASS, "chalk": _CHALK},
    "lights": [_SUN, _LAMP, _SUN | {"direction": [0.9, -0.6, 0.2]}],
    "objects": [
        {"mesh": "ball.ply", "material": "wax", "normals": "flat", "scale": [0.6, 0.8, 0.7],
         "rotate": [10.0, 20.0, 30.0], "translate": [-0.2, 0.4, 0.2]},
        {"mesh": "cube.ply", "material": "steel", "normals": "flat", "scale": [2.4, 2.0, 0.3],
         "rotate": [0.0, 20.0, 0.0], "translate": [-1.2, -1.2, -1.2]},
        {"mesh": "cube.ply", "material": "glass", "normals": "flat", "scale": [0.6, 0.7, 0.5],
         "rotate": [0.0, 30.0, 0.0], "translate": [0.2, 0.01, 0.4]},
    ],
    "floor": {"min": [-2.0, -2.0], "max": [2.0, 2.0], "materials": ["chalk", "wax"], "squares": [3, 4]},
    "render": {"resolution": [10, 8], "samples": 4, "max_depth": 3, "min_weight": 0.02, "max_rays": 14,
               "shadows": True},
}  # fmt: skip

_PLACE: Table = {"eye": [1.5, 2.5, 3.5], "target": [0.2, 0.6, 0.1], "up": [-0.2, 1.0, 0.1]}
# A larger film of the same shape, up to a pixel, as the pictures are of the least one.
_OTHER_FILM: Table = {"width": 21, "height": 17, "fx": 30.0, "fy": 30.0, "cx": 12.0, "cy": 11.0, "skew": 4.0}
# By class and field. That of ``type`` stands for its whole table, as another type has other fields; the eye's is within
# two bodies, from where rays begin otherwise.
OTHERS: dict[type[Fields], Table] = {
    PerspectiveCamera: {"type": ORTHOGRAPHIC, "eye": [0.28, 0.4, 0.5], "target": [0.2, 0.6, 0.1],
                        "up": [-0.2, 1.0, 0.1], "fov": 50.0},
    OrthographicCamera: {"type": PERSPECTIVE, "eye": [-2.5, 2.5, 3.5], "target": [0.2, 0.6, 0.1],
                         "up": [-0.2, 1.0, 0.1], "height": 2.5},
    PinholeCamera: {"type": PERSPECTIVE, **_PLACE, **_OTHER_FILM},
    FisheyeCamera: {"type": PERSPECTIVE, **_PLACE, "fov": 90.0},
    OpenCVCamera: {"type": PERSPECTIVE, **_PLACE, **_OTHER_FILM, "k1": -0.3, "k2": 0.3, "p1": 0.2, "p2": -0.2,
                   "k3": 0.3},
    OpenCVFisheyeCamera: {"type": PERSPECTIVE, **_PLACE, **_OTHER_FILM, "k1": -0.3, "k2": 0.3, "k3": -0.3, "k4": 0.3},
    EquirectangularCamera: {"type": PERSPECTIVE, **_PLACE},
    ThinLensCamera: {"type": PERSPECTIVE, **_PLACE, "fov": 50.0, "aperture": 0.8, "focus": 1.5},
    Phong: {"type": _GLASS, "diffuse": [0.9, 0.1, 0.4], "ambient": [0.9, 0.7, 0.2], "specular": [0.9, 0.1, 0.7],
            "shininess": 40.0, "reflectance": [0.6, 0.5, 0.1], "transmittance": [0.8, 0.1, 0.2], "ior": 1.7,
            "emission": [0.2, 0.4, 0.1], "opacity": 0.4, "cutoff": 0.5, "vertex_colors": "srgb",
            **{name: "spots.png" for name in Phong.model_fields if name.endswith("_map")}},
    Mirror: {"type": _CHALK, "reflectance": [0.3, 0.9, 0.4]},
    Dielectric: {"type": _CHALK, "ior": 1.9, "reflectance": [0.5, 0.9, 0.2], "transmittance": [0.9, 0.3, 0.5]},
    DirectionalLight: {"type": _LAMP, "direction": [0.7, -0.9, -0.2], "irradiance": [0.9, 0.2, 0.4]},
    PointLight: {"type": _SUN, "position": [-1.5, 2.0, 2.5], "intensity": [6.0, 1.0, 2.0]},
    SceneObject: {"mesh": "other.ply", "material": "chalk", "normals": "smooth", "crease": 20.0,
                  "scale": [0.5, 0.6, 0.9], "rotate": [40.0, 10.0, 60.0], "translate": [0.3, 0.9, 0.4]},
    Floor: {"min": [-2.5, -1.0], "max": [1.0, 2.5], "materials": ["chalk", "steel"], "squares": [5, 2]},
    RenderSettings: {"resolution": [9, 7], "samples": 9, "filter": "mitchell", "max_depth": 0, "min_weight": 0.25,
                     "max_rays": 5, "shadows": False, "glass_shadows": "clear", "terminator": "soft"},
    Sky: {"zenith": [0.9, 0.1, 0.2], "horizon": [0.1, 0.6, 0.3], "ground": [0.6, 0.1, 0.5], "lights": 5,
          "sun": [0.6, -0.7, 0.1], "sun_irradiance": [0.9, 0.2, 0.6], "sun_angle": 40.0, "sun_lights": 2},
    Scene: {"ambient": [0.7, 0.1, 0.2], "background": [0.8, 0.1, 0.3], "sky": {"lights": 4}, "up": "z"},
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Variation:
    """One field of a scene, and the value that it gets instead.

    table   the scene, as its file has it
    record  the class that has the field
    keys    where in the table it stands
    value   the other value
    """

    table: Table
    record: type[Fields]
    keys: Keys
    value: Any

    def __str__(self) -> str:
        return f"{'.'.join(map(str, self.keys))} of {self.table['camera']['type']}"

    def varied(self) -> Table:
        """The scene's table with this field changed alone."""
        table = copy.deepcopy(self.table)
        place: Any = table
        *above, last = self.keys[:-1] if self.keys[-1] == "type" else self.keys
        for key in above:
            place = place[key]
        place[last] = copy.deepcopy(self.value)
        return table


def write_meshes(folder: Path) -> None:
    """The meshes that the scene names, and another one."""
    for name, mesh in {"ball": icosphere(1), "cube": box(), "other": icosphere(0)}.items():
        xyz = mesh.vertices
        save_ply(Mesh(xyz, mesh.faces, colors=np.abs(xyz) % 1.0, texcoords=xyz[:, :2]), folder / f"{name}.ply")
    spots = np.random.default_rng(1).integers(0, 256, (4, 4, 4), np.uint8)
    Pillow.fromarray(spots).save(folder / "spots.png")


# The text of each table that was written: most are written several times.
_TEXTS: dict[str, str] = {}


def scene_of(folder: Path, table: Table) -> Scene:
    """The scene of a file that holds the table, beside its meshes."""
    return load_scene(written(folder, table))


def written(folder: Path, table: Table) -> Path:
    """A file that holds the table."""
    path, told = folder / "scene.toml", repr(table)
    if told not in _TEXTS:
        _TEXTS[told] = tomlkit.dumps(table)
    path.write_text(_TEXTS[told])
    return path


def _variations(table: Table) -> Iterator[Variation]:
    """Each field of the scene and of all that is in it, varied alone."""
    loaded = [thing | {"mesh": box()} for thing in table["objects"]]
    return _walk(table, Scene.model_validate(table | {"objects": loaded}), ())


def _walk(table: Table, value: Any, keys: Keys) -> Iterator[Variation]:
    """Those of a record's fields, and of a list's or table's records."""
    if not isinstance(value, Fields):
        for key, entry in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _walk(table, entry, (*keys, key))
        return
    for name in type(value).model_fields:
        field = getattr(value, name)
        parts = list(field.values()) if isinstance(field, dict) else field if isinstance(field, tuple) else [field]
        if parts and all(isinstance(part, Fields) for part in parts):
            yield from _walk(table, field, (*keys, name))
        else:
            yield Variation(_where_seen(table, keys, name), type(value), (*keys, name), OTHERS[type(value)][name])


def _where_seen(table: Table, keys: Keys, name: str) -> Table:
    """A table in which a field shows that does not show in ``table``."""
    table = copy.deepcopy(table)
    if name == "crease":
        table["objects"][keys[1]]["normals"] = "smooth"
    if name == "terminator":
        table["objects"][0]["normals"] = "smooth"
    if name == "cutoff":
        table["materials"][keys[1]]["opacity"] = 0.4
    if name == "vertex_colors":  # which a floor has not
        table["objects"][0]["material"], table["floor"]["materials"] = keys[1], ["steel"]
    if name == "sky":
        del table["background"]
    return table


# In place of the background.
_SKY = {"zenith": [0.1, 0.2, 0.5], "horizon": [0.5, 0.4, 0.3], "ground": [0.2, 0.1, 0.1], "lights": 3,
        "sun": [-0.5, -1.0, -0.3], "sun_irradiance": [0.4, 0.5, 0.3], "sun_angle": 10.0, "sun_lights": 3}  # fmt: skip
_UNDER_SKY = {name: value for name, value in BASE.items() if name != "background"} | {"sky": _SKY}

# All of a scene, those of its camera where that is of another type, and those of a sky.
VARIATIONS = list(_variations(BASE))
VARIATIONS += [other for other in _variations(_UNDER_SKY) if other.keys[0] == "sky"]
for _kind in (ORTHOGRAPHIC, PINHOLE, FISHEYE, OPENCV, OPENCV_FISHEYE, EQUIRECTANGULAR, THIN_LENS):
    VARIATIONS += [other for other in _variations(BASE | {"camera": _kind}) if other.keys[0] == "camera"]


def picture(scene: Scene, **options: Any) -> Image:
    """What ``render`` gives, whether rays were cut or not."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CutWarning)
        return render(scene, **options)
