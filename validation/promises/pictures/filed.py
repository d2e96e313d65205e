"""Materials of mesh files in pictures: a square in a GLB file, whose look is known from the file's values."""

import io
import json
import struct
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from PIL import Image as Pillow

from renderer.scene.light import DirectionalLight
from renderer.scene.scene import Scene
from validation.promises.pictures.glowing import Floats, from_above, shown
from validation.promises.pictures.textured import close, linear
from validation.promises.row import row

Bools = NDArray[np.bool_]
_BY = "the file's values"
_CORNERS = np.array([[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]], "<f4")
# The origin of a file's texture coordinates is the image's upper left corner.
_COORDINATES = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "<f4")
_FACES = np.array([0, 1, 2, 2, 3, 0], "<u2")
_SIZE = 4
_BEHIND = np.array([0.25, 0.5, 1.0])
_BASE = (0.75, 0.5, 0.25)


def check_filed(rng: Generator) -> list[dict[str, Any]]:
    """Squares seen from above before a background, in files of their own."""
    with TemporaryDirectory(prefix="promises-") as name:
        path = Path(name) / "a.glb"
        return [
            row("an unlit file shows its base colour, texture and colours of vertices", _BY, _unlit(path, rng)),
            row("a file's emission is its factor by its strength and texture", _BY, _emissive(path, rng)),
            row("a file's alpha is ignored, a mask or a share, by its mode", _BY, _alpha(path, rng)),
            row("metal scatters, shines and mirrors in its colour, by its roughness", "documented formulas",
                _metal(path)),
        ]  # fmt: skip


def _write(path: Path, material: dict[str, Any], image: NDArray[np.uint8] | None, colors: Any = None) -> None:
    """A square with one material, whose texture 0 is the image."""
    attributes = {"POSITION": _CORNERS, "TEXCOORD_0": _COORDINATES}
    if colors is not None:
        attributes["COLOR_0"] = np.asarray(colors, "<f4")
    arrays = [*attributes.values(), _FACES]
    parts = [array.tobytes() for array in arrays]
    if image is not None:
        file = io.BytesIO()
        Pillow.fromarray(image).save(file, "PNG")
        parts.append(file.getvalue())
    parts = [part + b"\0" * (-len(part) % 4) for part in parts]
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    views = [{"buffer": 0, "byteOffset": start, "byteLength": len(part)}
             for start, part in zip(starts[:-1], parts, strict=True)]  # fmt: skip
    document = {"buffers": [{"byteLength": starts[-1]}], "bufferViews": views, "materials": [material],
                **_described(list(attributes), arrays)}  # fmt: skip
    if image is not None:
        # Nearest, so that each pixel shows one texel.
        document |= {"images": [{"bufferView": len(arrays), "mimeType": "image/png"}],
                     "samplers": [{"magFilter": 9728}], "textures": [{"source": 0, "sampler": 0}]}  # fmt: skip
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = b"".join(struct.pack("<I4s", len(data), kind) + data
                      for kind, data in ((b"JSON", text), (b"BIN\0", b"".join(parts))))  # fmt: skip
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def _described(names: list[str], arrays: list[NDArray[Any]]) -> dict[str, Any]:
    """The parts of a document about its square: the last of the arrays has the faces, the others are attributes."""
    accessors = [{"bufferView": k, "componentType": 5126, "count": len(array), "type": f"VEC{array.shape[1]}"}
                 for k, array in enumerate(arrays[:-1])]  # fmt: skip
    accessors.append({"bufferView": len(names), "componentType": 5123, "count": len(arrays[-1]), "type": "SCALAR"})
    accessors[0] |= {"min": [0, 0, 0], "max": [1, 0, 1]}
    primitive = {"attributes": {name: k for k, name in enumerate(names)}, "indices": len(names), "material": 0}
    return {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [primitive]}], "accessors": accessors}  # fmt: skip


def _seen(path: Path, *towards: Floats) -> NDArray[np.float32]:
    """A file from above, lit from some directions by light of 0.5."""
    lights = tuple(DirectionalLight(direction=tuple(-way), irradiance=0.5) for way in towards)
    camera, background = from_above((0.5, 9.0, 0.5), 1.0), tuple(_BEHIND)
    scene = {"camera": camera, "materials": {}, "objects": [{"mesh": path}], "lights": lights, "background": background}
    return shown(Scene.model_validate(scene), (_SIZE, _SIZE))


def _pixels(rng: Generator, channels: int) -> NDArray[np.uint8]:
    found: NDArray[np.uint8] = rng.integers(0, 256, (_SIZE, _SIZE, channels), np.uint8)
    return found


def _rough(base: Any, **more: Any) -> dict[str, Any]:
    return {"pbrMetallicRoughness": {"baseColorFactor": base, **more}}


def _unlit(path: Path, rng: Generator) -> Bools:
    """With and without a light, which changes nothing."""
    kept, image, tint = [], _pixels(rng, 3), (0.5, 1.0, 0.25)
    material = _rough((*_BASE, 1.0), baseColorTexture={"index": 0}) | {"extensions": {"KHR_materials_unlit": {}}}
    for colors, share in ((None, 1.0), ([tint] * 4, np.array(tint))):
        _write(path, material, image, colors)
        for towards in ((), (np.array([0.0, 1.0, 0.0]),)):
            kept.append(close(_seen(path, *towards), linear(image / 255.0) * _BASE * share))
    return np.concatenate(kept)


def _emissive(path: Path, rng: Generator) -> Bools:
    image = _pixels(rng, 3)
    strong = {"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3.0}}}
    kept = []
    for more, factor in (({}, 1.0), (strong, 3.0)):
        _write(path, {"emissiveFactor": _BASE, "emissiveTexture": {"index": 0}, **more}, image)
        kept.append(close(_seen(path), linear(image / 255.0) * _BASE * factor))
    return np.concatenate(kept)


def _alpha(path: Path, rng: Generator) -> Bools:
    """The factor times the alpha of the image, a cutoff of its own, and the usual one."""
    image, kept = _pixels(rng, 4), []
    color = linear(image[..., :3] / 255.0) * _BASE
    alpha = (0.75 * image[..., 3] / 255.0)[..., None]
    base = _rough((*_BASE, 0.75), baseColorTexture={"index": 0}) | {"extensions": {"KHR_materials_unlit": {}}}
    for mode, share in (
        ({}, 1.0), ({"alphaMode": "OPAQUE"}, 1.0), ({"alphaMode": "MASK"}, alpha >= 0.5),
        ({"alphaMode": "MASK", "alphaCutoff": 0.25}, alpha >= 0.25), ({"alphaMode": "BLEND"}, alpha),
    ):  # fmt: skip
        _write(path, base | mode, image)
        kept.append(close(_seen(path), share * color + (1.0 - np.asarray(share, float)) * _BEHIND))
    return np.concatenate(kept)


def _metal(path: Path) -> Bools:
    """Metal, half metal and none, from smooth to rough, lit from straight above and aslant."""
    kept, base = [], np.array(_BASE)
    for metallic in (0.0, 0.5, 1.0):
        for roughness in (0.0, 0.125, 0.5, 0.75, 1.0):
            _write(path, _rough((*_BASE, 1.0), metallicFactor=metallic, roughnessFactor=roughness), None)
            scattered = base * (1.0 - metallic * (1.0 - roughness))
            straight = 0.04 * (1.0 - metallic) + base * metallic * (1.0 - roughness)
            exponent = min(2.0 / roughness**4 - 2.0, 1e4) if roughness else 1e4
            mirrored = np.minimum(straight * max(0.0, 1.0 - roughness / 0.25), 1.0)
            for towards in ((0.0, 1.0, 0.0), (0.6, 0.8, 0.0)):
                shine = np.minimum(straight * (exponent + 2.0) / 2.0, 1.0) * towards[1] ** exponent
                expected = 0.5 * (scattered * towards[1] + shine) + mirrored * _BEHIND
                kept.append(close(_seen(path, np.array(towards)), expected))
    return np.concatenate(kept)
