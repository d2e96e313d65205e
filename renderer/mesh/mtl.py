"""Reading MTL, the materials beside Wavefront OBJ.

Own code, because trimesh takes the options of a map for a part of its name, keeps one map of each material, and drops
faults in silence. The format: Alias/Wavefront, "MTL material format", 1995; the metallic and rough values are those
that Blender writes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from renderer.mesh.material import MeshMaterial
from renderer.mesh.texture import Texture
from renderer.mesh.texture_image import TextureImage

_COLORS = {"kd": "base_color", "ks": "specular", "ka": "ambient", "ke": "emissive", "tf": "transmission_color"}
_SCALARS = {"ns": "shininess", "ni": "ior", "pr": "roughness", "pm": "metallic", "d": "alpha"}
_MAPS = {
    "map_kd": "base_color_texture", "map_ks": "specular_texture", "map_ke": "emissive_texture",
    "map_d": "alpha_texture", "norm": "normal_texture", "map_bump": "bump_texture", "bump": "bump_texture",
}  # fmt: skip
# Blender writes these for all materials, mostly 0.
_IDLE_AT_0 = ("ps", "pc", "pcr", "aniso", "anisor")
# Options of maps: the most words behind each.
_OPTIONS = {"-blendu": 1, "-blendv": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-texres": 1, "-type": 1, "-bm": 1,
            "-boost": 1, "-mm": 2, "-o": 3, "-s": 3, "-t": 3}  # fmt: skip
_READ = ("-o", "-s", "-bm", "-clamp")
_REFRACTING = (6, 7)
_CLEAR = (4, 6, 7, 9)


@dataclass
class _Entry:
    """A material as far as it is read."""

    name: str
    fields: dict[str, Any] = field(default_factory=dict)
    illum: int | None = None
    clear: float | None = None  # Tr


def rest_of(line: str) -> str:
    """The rest of a line behind its keyword, without a comment. Names may have blanks, and # within words."""
    words = re.split(r"(?:^|\s)#", line)[0].split(None, 1)
    return " ".join(words[1].split()) if len(words) > 1 else ""


def parse_mtl(content: bytes, image: Callable[[str], TextureImage | None]) -> tuple[dict[str, MeshMaterial], list[str]]:
    """The materials in a file by name, and what of the file has no place in them, in words.

    Numbers are linear; ``image`` finds the image of a map by its name. A map multiplies its colour, but black beside
    ``map_Kd`` counts as white, since programs that write it show the map alone. ``d`` counts where ``Tr`` differs.
    ``illum`` 0 is unlit, 3 to 8 mirror, and with 4, 6, 7 and 9 what is not opaque is glass. ``map_d`` is a mask.
    """
    entries: list[_Entry] = []
    left_out: list[str] = []
    for line in re.split(r"\r\n|\r|\n", content.decode("utf-8", "replace")):
        words = line.split(None, 1)
        if not words or words[0].startswith("#"):
            continue
        keyword, rest = words[0].lower(), rest_of(line)
        if keyword == "newmtl":
            entries.append(_Entry(rest))
        elif not entries:
            left_out.append(words[0])
        else:
            try:
                left_out += _read_statement(keyword, rest, entries[-1], image)
            except (ValueError, OverflowError):
                left_out.append(f"{words[0]} {rest}")
    found: dict[str, MeshMaterial] = {}
    for entry in entries:
        found.setdefault(entry.name, _material(entry))
    return found, left_out


def _read_statement(
    keyword: str, rest: str, entry: _Entry, image: Callable[[str], TextureImage | None]
) -> Iterator[str]:
    """Read one into the entry; yields what has no place there. Raises ``ValueError`` for a bad value."""
    if keyword in _MAPS:
        texture, options = _texture(rest.split(), image)
        yield from (f"{keyword} {option}" for option in options)
        _give(entry, _MAPS[keyword], texture)
    elif keyword in _COLORS:
        values = [_number(word) for word in rest.split()]
        if len(values) not in (1, 3):
            raise ValueError
        _give(entry, _COLORS[keyword], tuple(values * (3 // len(values))))
    elif keyword in _SCALARS:
        _give(entry, _SCALARS[keyword], _number(rest.removeprefix("-halo ")))
        if rest.startswith("-halo "):
            yield "d -halo"
    elif keyword == "tr":
        MeshMaterial(alpha=_number(rest))
        entry.clear = _number(rest)
    elif keyword == "illum":
        entry.illum = int(rest)
        if not 0 <= entry.illum <= 9:
            yield f"illum {entry.illum}"
    elif keyword not in _IDLE_AT_0 or _number(rest):
        yield keyword


def _number(word: str) -> float:
    if "_" in word:  # Python takes 1_000 for a number
        raise ValueError
    return float(word)


def _give(entry: _Entry, name: str, value: Any) -> None:
    MeshMaterial(**{name: value})  # refuses what is out of range
    entry.fields[name] = value


def _texture(words: list[str], image: Callable[[str], TextureImage | None]) -> tuple[Texture | None, list[str]]:
    """The texture of a map's words, and its options that are not read."""
    given: dict[str, list[str]] = {}
    while len(words) > 1 and words[0].lower() in _OPTIONS:
        option, end = words[0].lower(), 1
        most = min(_OPTIONS[option], len(words) - 2)
        while end <= most and (end == 1 or _is_number(words[end])):
            end += 1
        given[option], words = words[1:end], words[end:]
    if not words:
        raise ValueError
    found = image(" ".join(words))
    options = [option for option in given if option not in _READ]
    if found is None:
        return None, options
    scale, offset = (
        [*map(_number, given.get(option, [])), *rest][:2] for option, rest in (("-s", (1, 1)), ("-o", (0, 0)))
    )
    clamped = "".join(given.get("-clamp", [])).lower() == "on"
    texture = Texture(
        found,
        transform=((scale[0], 0.0, offset[0]), (0.0, scale[1], offset[1])),
        wrap=("clamp", "clamp") if clamped else ("repeat", "repeat"),
        strength=_number("".join(given.get("-bm", ["1"]))),
    )
    return texture, options


def _is_number(word: str) -> bool:
    try:
        _number(word)
    except ValueError:
        return False
    return True


def _material(entry: _Entry) -> MeshMaterial:
    fields, illum = dict(entry.fields), entry.illum
    if entry.clear is not None:
        fields.setdefault("alpha", 1.0 - entry.clear)
    if fields.get("base_color_texture") and not any(fields.get("base_color", (1.0,))):
        fields["base_color"] = (1.0, 1.0, 1.0)
    alpha = fields.get("alpha", 1.0)
    if illum in _CLEAR and alpha < 1.0:
        fields |= {"transmission": 1.0 - alpha, "alpha": 1.0}
    elif illum in _REFRACTING:
        fields["transmission"] = 1.0
    elif alpha < 1.0:
        fields["alpha_mode"] = "blend"
    if fields.get("alpha_texture") and "alpha_mode" not in fields:
        fields["alpha_mode"] = "mask"
    fields |= {"unlit": illum == 0, "mirror": illum is not None and 3 <= illum <= 8, "double_sided": True}
    return MeshMaterial(entry.name, **fields)
