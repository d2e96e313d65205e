"""Defects of textures, masks, colours of vertices, materials of files and distortion."""

from validation.defects.changes import Change, Rule
from validation.defects.edits import argument, call, choice, compare, drop, element, value, without
from validation.defects.seeded.defect import Defect

_CHANGES: dict[str, Change] = {
    "textures upside down": Rule("row-of-texels", call("_wrapped", "_call(_0, _2 - 1 - _1, _2)")),
    "linear textures half a texel off": Rule("texels-around", value("(_[0] + 0.5, _[1])")),
    "mirrored textures repeat": Rule("mirrored-texture", choice(then="1.0 - (_)")),
    "the last texel is not beside the first": Rule("repeated-texture", choice(then="0")),
    "textures are not skewed": Rule("moved-texture", without("+", 1)),
    "mip maps a level too coarse": Rule("mip-level", argument(0, "2.0 * (_)")),
    "mip maps as wide as an ellipse is long": Rule("mips-along-ellipse", choice(otherwise="1")),
    "mip maps of one texel in four": Rule("mean-of-texels", value("first")),
    "codes of images taken as linear": Rule("linear-of-srgb", value("False")),
    "the curve of sRGB without its toe": Rule("toe-of-srgb", call("where", "_2")),
    "floats of images taken as sRGB": Rule("floats-are-linear", without("and", 1)),
    "checkers begin with their second colour": Rule("checker", call("array", "_call(_0[::-1])")),
    "a map replaces its colour": Rule("colour-by-map", call("times", "_1")),
    "ambient light without the map of diffuse light": Rule("ambient-by-diffuse-map", value("None")),
    "colours of vertices left out": Rule("colours-of-vertices", value("False")),
    "sRGB colours of vertices taken as linear": Rule("space-of-vertex-colours", choice(test="False")),
    "normals of mirrored textures turned the wrong way": Rule("mirrored-tangents", choice(otherwise="1.0")),
    "mirrored textures grow along the wrong tangent": Rule("tangent-along-u", choice(otherwise="1.0")),
    "the strength of a map of normals ignored": Rule("strength-of-normals", value("1.0")),
    "maps of normals with y down": Rule("normal-of-texel", element(1, "-(_)")),
    "maps of normals taken as sRGB": Rule("maps-of-data", argument(1, "True")),
    "a mask is not there at its cutoff": Rule("mask-at-cutoff", compare(">", nth=1)),
    "rays stop at the holes of masks": Rule("holes-for-rays", value("False")),
    "shadows without the holes of masks": Rule("holes-in-shadows", value("True")),
    "opacity by the red of its map": Rule("alpha-of-opacity-map", call("extract", "_call(_0, 0)")),
    "images without alpha": Rule("alpha-of-image", drop),
    "nothing behind what is partly there": Rule("rest-of-blend", value("0.0")),
    "what is partly there shows all its light": Rule("share-of-blend", drop),
    "nothing emits": Rule("emission", call("add", "_0")),
    "metal mirrors like plastic": Rule("mirrored-by-metal", without("+", 1)),
    "every file's cutoff is a half": Rule("cutoff-of-file", choice(then="0.5")),
    "opaque files with their alpha": Rule("opaque-file", value("False")),
    "unlit files are lit": Rule("unlit-file", value("False")),
    "emission of files without its strength": Rule("emissive-strength", value("1.0")),
    "distortion without k2": Rule("distortion", element(2, "0.0")),
    "tangential distortion along the radius left out": Rule("distortion", without("+", 1)),
    "tangential distortion across the radius left out": Rule("tangential-distortion", without("+", 1)),
    "distortion of a fish-eye without k2": Rule("fisheye-distortion", element(2, "0.0")),
    "OpenCV's pixels begin at their corners": Rule("opencv-pixels", without("+", 1)),
}
LOOKS = tuple(Defect("pictures", name, change) for name, change in _CHANGES.items())
