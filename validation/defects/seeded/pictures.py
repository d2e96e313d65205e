"""Defects of scenes, shading and images."""

from collections.abc import Callable
from typing import Any

import numpy as np

from validation.defects.changes import Change, Constant, Function, Rule, Wrapped, after
from validation.defects.edits import argument, call, choice, compare, drop, element, operand, value, without
from validation.defects.seeded.defect import Defect


def _on_film(change: Callable[[Any], None]) -> Wrapped:
    """A picture whose planes ``change`` alters in place."""
    return after("PreparedScene.picture", change)


def _holed(sound: Any, vertices: Any, faces: Any) -> Any:
    if len(faces) > 5000:
        hole = int(np.argmin(np.linalg.norm(vertices[faces].mean(axis=1) - (-0.68, 1.0, 1.72), axis=1)))
        faces[hole] = faces[hole, 0]
    return sound(vertices, faces)


def _denser(rows: Any) -> None:
    from renderer.materials.columns import IOR

    rows[:, IOR] *= 1.501 / 1.5


def _shifted(pixels: float) -> Callable[[Any], None]:
    """The rows of a perspective film, shifted along its own."""

    def shift(rows: Any) -> None:
        rows[3] -= pixels * rows[4]

    return shift


def _wider(sound: Any, camera: Any, width: int, height: int) -> Any:
    rows = sound(camera, width, height)
    rows[0] -= 0.005 * width * rows[1]
    rows[1] *= 1.01
    return rows


def _wider_angle(sound: Any, camera: Any, width: int, height: int) -> Any:
    return sound(camera.model_copy(update={"fov": camera.fov + 0.3}), width, height)


def _scaled(index: Any, factor: Any) -> Callable[[Any], None]:
    """Multiplies a part of an array in place."""

    def scale(array: Any) -> None:
        array[index] *= factor

    return scale


def _moved_light(rows: Any) -> None:
    rows[-1:, 1] += 0.05


def _packed(change: Callable[[Any], Any]) -> Wrapped:
    """A packed scene whose arrays ``change`` gives anew."""
    return after("pack.pack", lambda packed: (packed[0], change(packed[1])))


def _shallow(settings: Any) -> Any:
    return settings._replace(max_depth=min(settings.max_depth, 5))


def _light_ends(settings: Any) -> Any:
    return settings._replace(min_weight=max(settings.min_weight, 0.05))


def _far_bounded(sound: Any, offset: Any) -> Any:
    return sound(0.01) if offset == "bounded" else sound(offset)


def _far_fixed(sound: Any, offset: Any) -> Any:
    rule = sound(offset)
    return rule if isinstance(offset, str) else rule._replace(epsilon=100.0 * rule.epsilon)


def _encoded_twice(sound: Any, linear: Any) -> Any:
    return sound(sound(linear) / 255.0)


def _dithered(image: Any) -> None:
    from renderer.picture.camera_rays import TILE

    columns = np.arange(image.radiance.shape[1])[2 * TILE :]
    image.radiance[:, 2 * TILE :] *= 1.0 + 2e-4 * np.array([0, 1, -1])[columns % 3, None]


def _last_of_tile(image: Any) -> None:
    from renderer.picture.camera_rays import TILE

    image.radiance[TILE - 1 :: TILE, TILE - 1 :: TILE] *= 1.01


def _shown_miss(image: Any) -> None:
    from renderer.picture.camera_rays import TILE

    image.face[:, 2 * TILE :][image.face[:, 2 * TILE :] < 0] = 0


def _encoded_radiance(image: Any) -> None:
    image.radiance[...] = np.clip(image.radiance, 0, 1) ** (1 / 2.2)


def _exchanged_channels(image: Any) -> None:
    image.radiance[...] = image.radiance[..., ::-1].copy()


def _earlier_faces(image: Any) -> None:
    image.face[image.face > 0] -= 1


def _depth_along_axis(sound: Any, prepared: Any, camera: Any, chosen: Any, *rest: Any, **options: Any) -> Any:
    from renderer.scene.camera import primary_rays

    image, (width, height) = sound(prepared, camera, chosen, *rest, **options), chosen.resolution
    cosines = primary_rays(camera, width, height)[1] @ camera.frame()[2]
    if image.depth.size:
        image.depth[...] *= cosines.reshape(height, width)
    return image


def _turned_in_another_order(sound: Any, placed: Any) -> Any:
    from renderer.scene.scene import _rotation

    x, y, z = (_rotation(axis, degrees) for axis, degrees in enumerate(placed.rotate))
    matrix = sound(placed)
    matrix[:3, :3] = x @ np.diag(placed.scale) @ y @ z
    return matrix


def _scaled_when_turned(sound: Any, placed: Any) -> Any:
    matrix = sound(placed)
    matrix[:3, :3] = np.diag(placed.scale) @ matrix[:3, :3] @ np.diag(1 / np.array(placed.scale))
    return matrix


_TEXTBOOK = """
def refract(d, n, n1, n2):
    eta = n1 / n2
    dn = dot(d, n)
    cos2 = 1.0 - eta * eta * (1.0 - dn * dn)
    if cos2 < 0.0:
        return -1.0, d
    cos_t = math.sqrt(cos2)
    return cos_t, sub(scale(sub(d, scale(n, dn)), eta), scale(n, cos_t))
"""
_IN_AIR = """
def _innermost_ior(scene, media, count):
    return 1.0
"""
_MEAN = """
def _goes_on(weight, min_weight):
    mean = (weight[0] + weight[1] + weight[2]) / 3.0
    return mean > 0.0 and mean >= min_weight
"""
_CLAMPED = """
def specular(d, n, light, shininess):
    return sound(d, n, light, min(shininess, 50.0))
"""

_CHANGES: dict[str, Change] = {
    "one triangle of a sphere missing": Wrapped("pack.Mesh", _holed),
    "ior 1.501 for 1.5": after("pack._materials", _denser),
    "film shifted by half a pixel": after("PerspectiveCamera.rows", _shifted(0.5)),
    "the budget of rays is not kept": Rule("ray-budget", compare(">", "2 * _")),
    "eyes beyond the limit are let through": Rule("eye-within-limit", value("False")),
    "film shifted by 0.1 pixel": after("PerspectiveCamera.rows", _shifted(0.1)),
    "camera rays 0.1 pixel off their pixel's centre": Rule("place-in-pixel", element(0, "_ + 0.1")),
    "orthographic film 1 % too wide": Wrapped("OrthographicCamera.rows", _wider),
    "field of view + 0.3 degrees": Wrapped("PerspectiveCamera.rows", _wider_angle),
    "principal point half a pixel off": after("PinholeCamera.rows", _shifted(0.5)),
    "a fish-eye is stereographic": Rule("equidistant", value("2.0 * np.arctan(0.5 * (_))")),
    "a lens 2 % too wide": Rule("point-on-lens", value("1.02 * (_)")),
    "a light missing": after("light_rows", lambda rows: rows[:-1]),
    "point light + 5 %": after("light_rows", _scaled(np.s_[-1:, 4:], 1.05)),
    "light moved by 0.05": after("light_rows", _moved_light),
    "gain 1.10": _on_film(lambda image: _scaled(..., 1.1)(image.radiance)),
    "gain 1.001": _on_film(lambda image: _scaled(..., 1.001)(image.radiance)),
    "red and blue exchanged": _on_film(_exchanged_channels),
    "flat instead of smooth normals": _packed(lambda arrays: arrays._replace(smooth=np.zeros_like(arrays.smooth))),
    "depth 5 for 6": after("kernel_settings_of", _shallow),
    "rays end below a weight of 0.05": after("kernel_settings_of", _light_ends),
    "offset 1e-2": Wrapped("render._offset", _far_bounded),
    "sRGB applied twice": Wrapped("image._encoded", _encoded_twice),
    "sRGB cut off instead of rounded": Rule("rounded-encoding", without("+", 1)),
    "Reinhard's curve by the brightest channel": Rule(
        "tone-by-luminance", value("np.maximum(red, np.maximum(green, blue))")
    ),
    "the curve of ACES without its toe": Rule("aces-fit", value("_ + 0.1 * x / (1.0 + x)")),
    "radiance already in sRGB": _on_film(_encoded_radiance),
    "background 2 % darker": _packed(lambda arrays: arrays._replace(colors=arrays.colors * [[1.0], [0.98]])),
    "no ambient light": _packed(lambda arrays: arrays._replace(colors=arrays.colors * [[0.0], [1.0]])),
    "the lamp a little redder": after("light_rows", _scaled(np.s_[1:, 4:], 1.0 + 5e-5 * np.array([1.0, 0.0, -1.0]))),
    "dither left in the tiles from the third on": _on_film(_dithered),
    "one stuck pixel in 8,192": _on_film(lambda image: _scaled(np.s_[8192::8192], 0.95)(image.radiance.reshape(-1, 3))),
    "the last pixel of a tile 1 % brighter": _on_film(_last_of_tile),
    "a fixed offset 100 times too long": Wrapped("render._offset", _far_fixed),
    "depth along the view axis": Wrapped("PreparedScene.picture", _depth_along_axis),
    "faces numbered from 1": _on_film(_earlier_faces),
    "objects turned the other way": Wrapped("scene._rotation", lambda sound, axis, degrees: sound(axis, -degrees)),
    "objects moved 0.1 % too far": after("SceneObject.matrix", _scaled(np.s_[:3, 3], 1.001)),
    "vertex normals of equal weights": Rule("weight-by-angle", without("*", 1)),
    "normals of the film point inwards": _on_film(lambda image: _scaled(..., -1)(image.normal)),
    "a miss shows face 0 in the tiles from the third on": _on_film(_shown_miss),
    "n1 and n2 swapped": Rule("refraction", call("refract", "refract(_0, _1, _3, _2)")),
    "Fresnel of one polarisation": Rule("both-polarisations", without("+", 1)),
    "total internal reflection lost": Rule("total-reflection", choice(then="0.0")),
    "every medium stands in air": Function("_innermost_ior", _IN_AIR),
    "refraction by the textbook's formula": Function("shading.refract", _TEXTBOOK),
    "no shadows": Rule("shadows", value("True")),
    "shadow rays pass the light": Constant("SHORT_OF_LIGHT", "2.0"),
    "lights shine through from behind": Rule("light-in-front", compare("<=", "-np.inf")),
    "light falls off as 1 / r": Rule("inverse-square", argument(1, "np.sqrt(_)")),
    "clamped specular: shininess at most 50": Function("phong.specular", _CLAMPED),
    "highlights left out below R.V = 0.5": Rule("highlight-in-front", compare("<=", "0.5")),
    "interpolated normals not normalised": Rule("unit-shading-normal", call("normalized", "_0")),
    "rays leave a face from its other side": Rule("side-of-start", choice(then="-1", otherwise="1")),
    "spawned rays start on their surface": Rule("spawn-offset", argument(1, "0.0 * _")),
    "the tint of glass lost": Rule("tint-of-glass", element(1, "(_[0], _[0], _[0])")),
    "all samples of a pixel at one place": after("sample_offsets", lambda places: np.full_like(places, 0.5)),
    "filters as narrow as a pixel": after("film_samples", lambda found: (np.clip(found[0], 0.0, 1.0), found[1])),
    "samples of all filters count the same": after("film_samples", lambda found: (found[0], np.ones_like(found[1]))),
    "objects turned about y and z before x": Wrapped("SceneObject.matrix", _turned_in_another_order),
    "objects scaled after they are turned": Wrapped("SceneObject.matrix", _scaled_when_turned),
    "the floor begins with its other colour": Rule("floor-colour", operand("%", 0, "_ + 1")),
    "min_weight judged by the mean of the channels": Function("_goes_on", _MEAN),
    "leaving a medium forgets its outermost entry": Rule("innermost-entry", call("range", "range(_0 + 1)")),
    "an eye within media is in the outermost": Rule("media-by-volume", call("sorted", "sorted(_0)")),
    "lights that are not red do not shine": Rule("shining-lights", call("any", "_0[0] > 0.0")),
    "another camera's eye is in the media of the scene's": Rule("media-at-eye", value("False")),
    "light passes an opaque face that glass touches": Rule("opaque-stops-light", drop),
    "bodies that touch have air between them": Rule("touching-bodies", compare(">=", "0")),
    "points hit are where they are rounded to": Rule("room-around-hit", value("0.0")),
    "a point on an edge is in both faces": Rule("one-of-neighbours", choice(otherwise="0")),
    "a ray that leaves bodies hits the next at once": Rule("beyond-all-level", argument(3, "0.0")),
    "a ray leaves a body that it is not in": Rule("leave-own-body", value("False")),
    "where bodies touch a ray comes from air": Rule("medium-of-crossing", element(2, "1.0")),
    "the sky upside down": Rule("sky-gradient", value("-_")),
    "a light of the sky missing": after("Sky.directional", lambda lights: lights[:-1]),
    "light passes what is opaque": Rule("clear-shadows", value("False")),
    "a soft terminator is hard": Rule("soft-terminator", value("0.0 * _")),
    "no edge is too sharp to be smooth": Rule("sharp-edge", value("_ | True")),
    "edges count as the inside of their faces": Rule("slack-on-edges", choice(test="True")),
}
PICTURES = tuple(Defect("pictures", name, change) for name, change in _CHANGES.items())
