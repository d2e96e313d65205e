"""The materials of a glTF document with their textures, samplers and images."""

from __future__ import annotations

from typing import Any
from urllib.parse import unquote

import numpy as np

from renderer.errors import MeshError
from renderer.mesh.accessors import Accessors, data_of
from renderer.mesh.material import MeshMaterial
from renderer.mesh.reading import Reading
from renderer.mesh.texture import Texture, Wrap
from renderer.mesh.texture_image import TextureImage

_WRAPS: dict[Any, Wrap] = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
_NEAREST = 9728
_TRANSFORM = "KHR_texture_transform"
# Each has its fields read below.
_READ = ("KHR_materials_unlit", "KHR_materials_transmission", "KHR_materials_ior", "KHR_materials_emissive_strength")
# Extensions by which a texture names an image that Pillow reads.
_IMAGES = ("EXT_texture_webp", "MSFT_texture_dds")


class Materials:
    """The materials of a document, each read once."""

    def __init__(self, document: dict[str, Any], accessors: Accessors, reading: Reading) -> None:
        self._document, self._accessors, self._reading = document, accessors, reading
        self._known: dict[int, MeshMaterial | None] = {}

    def material(self, number: int | None) -> MeshMaterial | None:
        """A material by its number; None for none, and for a malformed one, which is noted."""
        if number is None:
            return None
        if number not in self._known:
            try:
                self._known[number] = self._read(self._document["materials"][number])
            except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
                fault = str(error) if isinstance(error, MeshError) else f"{type(error).__name__}: {error}"
                self._reading.note(f"left out: material {number}, malformed: {' '.join(fault.split())[:120]}")
                self._known[number] = None
        return self._known[number]

    def _read(self, entry: dict[str, Any]) -> MeshMaterial:
        extensions = entry.get("extensions") or {}
        unread = [name for name in extensions if name not in _READ]
        transmission = extensions.get("KHR_materials_transmission") or {}
        if unread:
            self._reading.note("left out of materials:", unread)
        # rule: emissive-strength
        strength = (extensions.get("KHR_materials_emissive_strength") or {}).get("emissiveStrength", 1.0)
        rough = entry.get("pbrMetallicRoughness") or {}
        red, green, blue, alpha = rough.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        through = transmission.get("transmissionFactor", 0.0)
        return MeshMaterial(
            name=str(entry.get("name") or ""),
            base_color=(red, green, blue),
            alpha=alpha,
            base_color_texture=self._texture(rough.get("baseColorTexture")),
            metallic=rough.get("metallicFactor", 1.0),
            roughness=rough.get("roughnessFactor", 1.0),
            metallic_roughness_texture=self._texture(rough.get("metallicRoughnessTexture")),
            normal_texture=self._texture(entry.get("normalTexture"), "scale"),
            occlusion_texture=self._texture(entry.get("occlusionTexture"), "strength"),
            emissive=tuple(strength * factor for factor in entry.get("emissiveFactor", (0.0, 0.0, 0.0))),
            emissive_texture=self._texture(entry.get("emissiveTexture")),
            alpha_mode=str(entry.get("alphaMode", "OPAQUE")).lower(),  # type: ignore[arg-type]  # which is checked
            alpha_cutoff=entry.get("alphaCutoff", 0.5),
            transmission=through,
            transmission_texture=self._texture(transmission.get("transmissionTexture")),
            transmission_color=(red, green, blue) if through else (1.0, 1.0, 1.0),
            ior=(extensions.get("KHR_materials_ior") or {}).get("ior", 1.5),
            double_sided=entry.get("doubleSided", False),
            unlit="KHR_materials_unlit" in extensions,
        )

    def _texture(self, use: dict[str, Any] | None, strength: str = "") -> Texture | None:
        """The texture of a material's entry, whose key ``strength`` says how much it counts."""
        if use is None:
            return None
        moved = (use.get("extensions") or {}).get(_TRANSFORM) or {}
        rows = moved.get("texCoord", use.get("texCoord", 0))
        if rows != 0:
            self._reading.note(f"left out: textures on TEXCOORD_{rows}, as a mesh has one set of coordinates")
            return None
        texture = self._document["textures"][use["index"]]
        image = self._image(texture)
        if image is None:
            return None
        sampler = self._document["samplers"][texture["sampler"]] if "sampler" in texture else {}
        return Texture(
            image,
            transform=_transform(moved),
            wrap=(_WRAPS[sampler.get("wrapS", 10497)], _WRAPS[sampler.get("wrapT", 10497)]),
            filter="nearest" if sampler.get("magFilter") == _NEAREST else "mipmap",
            strength=use.get(strength, 1.0),
        )

    def _image(self, texture: dict[str, Any]) -> TextureImage | None:
        """The image of a texture; None, which is noted, where it cannot be read."""
        extensions = texture.get("extensions") or {}
        sources = [each.get("source") for each in (texture, *(extensions.get(name) or {} for name in _IMAGES))]
        number = next((source for source in sources if source is not None), None)
        if number is None:
            self._reading.note("left out: textures without an image that can be read:", extensions or ["no source"])
            return None
        entry = self._document["images"][number]
        uri = entry.get("uri")
        name = str(entry.get("name") or f"image {number}")
        if uri is None:
            return self._reading.image(TextureImage(self._accessors.content(entry["bufferView"]), name))
        if uri.startswith("data:"):
            return self._reading.image(TextureImage(data_of(uri), name))
        return self._reading.image_file(unquote(uri))


def _transform(moved: dict[str, Any]) -> Any:
    """The rows of an entry of KHR_texture_transform, for coordinates whose v points up.

    A file's v points down: (u, 1 - v) is scaled, turned so that positive angles look counter-clockwise, and offset.
    """
    (x, y), (width, height), turn = (
        moved.get("offset", (0.0, 0.0)), moved.get("scale", (1.0, 1.0)), moved.get("rotation", 0.0),
    )  # fmt: skip
    cos, sin = np.cos(turn), np.sin(turn)
    # rule: turned-with-v-up
    return (
        (cos * width, -sin * height, x + sin * height),
        (sin * width, cos * height, 1.0 - y - cos * height),
    )
