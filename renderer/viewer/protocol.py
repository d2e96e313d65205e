"""The messages between page and server on the WebSocket: the page's are checked, the server's packed."""

import struct
from typing import Annotated, Literal, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, field_validator, model_validator

from renderer.arguments.fields import FiniteVector
from renderer.arguments.limits import FARTHEST
from renderer.scene.camera import sample_offsets
from renderer.scene.scene import AnyLight, AnyMaterial
from renderer.scene.sky import Sky

# The longest side of a picture and the most pixels, those of a screen called 4K, 3840 x 2160, and some more.
MAX_SIDE, MAX_PIXELS = 4096, 1 << 23
# The most materials and lights that a page may change, and objects that it may hide.
MAX_EDITS, MAX_HIDDEN = 1024, 4096
# A view with so many of them, their numbers as long as they get: 500 bytes a material, and 200 a light.
MAX_MESSAGE_BYTES = 1 << 20
# An 8 x 8 grid per pixel: of a million pixels, 67 million camera rays, the most that are worth the wait.
MAX_SAMPLES = 64
# Below a thousandth of a radian neighbouring rays differ by less than a page's float32 matrices resolve; above 3.1
# almost all of the picture is its rim.
MIN_FOVY, MAX_FOVY = 0.001, 3.1
# Stops of either sign: from a thirtieth to thirty times as bright.
MAX_EXPOSURE = 5.0

# A turn in steps of a degree; and the pixels of all its frames together, those of 72 of 4096 x 720, the most that the
# page offers, and some more: a GIF is a byte a pixel while it is encoded, 270 MB.
MAX_FRAMES, MAX_FRAME_PIXELS = 360, 1 << 28

RGBA, JPEG, FACE_COLORS, PROOF, FILE = 1, 2, 3, 4, 5
# kind, seq, step, last, w, h, first row and rows of the whole as uint32, then milliseconds and million rays per second
# as float32, little-endian.
HEADER = struct.Struct("<8I2f")

_Number = Annotated[float, Field(allow_inf_nan=False)]
_Channel = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
_Color = tuple[_Channel, _Channel, _Channel]
_Sequence = Annotated[int, Field(ge=0, lt=2**32)]
_Side = Annotated[int, Field(ge=1, le=MAX_SIDE)]
_Matrix = Annotated[list[_Number], Field(min_length=16, max_length=16)]
_Fovy = Annotated[float, Field(ge=MIN_FOVY, le=MAX_FOVY)]
_Height = Annotated[float, Field(gt=0.0, le=FARTHEST)] | None
_FileName = Annotated[str, Field(max_length=255)]  # the longest file name
_Hidden = Annotated[list[Annotated[str, Field(max_length=40)]], Field(max_length=MAX_HIDDEN)]

Mode = Literal["gl", "phong", "brute", "octree", "proof"]
MODES: tuple[Mode, ...] = ("gl", "phong", "brute", "octree", "proof")
# Modes whose pictures may take minutes.
SLOW: tuple[Mode, ...] = ("brute", "proof")


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def _not_zero(direction: FiniteVector) -> FiniteVector:
    if not any(direction):
        raise ValueError("expected a direction of non-zero length")
    return direction


class _Sized(_Message):
    w: _Side
    h: _Side

    @model_validator(mode="after")
    def _not_too_large(self) -> Self:
        if self.w * self.h > MAX_PIXELS:
            raise ValueError(f"expected at most {MAX_PIXELS} pixels, got {self.w} x {self.h}")
        return self


class Edits(_Message):
    """The page's changes of the file: materials by their names, and for each of the others null for the file's. A
    background takes the place of the file's sky, and a sky that of its background.
    """

    materials: Annotated[dict[str, AnyMaterial], Field(max_length=MAX_EDITS)] = {}
    lights: Annotated[tuple[AnyLight, ...], Field(max_length=MAX_EDITS)] | None = None
    ambient: _Color | None = None
    background: _Color | None = None
    sky: Sky | None = None

    @property
    def any(self) -> bool:
        """Whether there are changes."""
        return self != Edits()


class ViewSettings(_Message):
    """The settings of the panel. ``light`` is the direction in which the first directional light travels, null for the
    scene's own; ``aov`` the value that a pixel shows; ``exposure`` the stops by which colours are brighter than in the
    scene; ``pixels`` the format in which pictures are sent; ``pair`` what a proof compares: the octree and "brute"
    force, few and many "samples", or the octree and the reference of that name; ``refine`` the samples per pixel up to
    which the picture of a camera at rest grows; ``edits`` what of the scene differs from the file.
    """

    max_depth: Annotated[int, Field(ge=0, le=64)] = 6
    samples: Annotated[int, Field(ge=1, le=MAX_SAMPLES)] = 1
    shadows: bool = True
    reflection: bool = True
    refraction: bool = True
    refine: Annotated[int, Field(ge=1, le=MAX_SAMPLES)] = 1
    aov: Literal["color", "depth", "normal", "face", "cost", "nodes", "triangles"] = "color"
    light: FiniteVector | None = None
    exposure: Annotated[float, Field(ge=-MAX_EXPOSURE, le=MAX_EXPOSURE)] = 0.0
    pixels: Literal["rgba", "jpeg"] = "rgba"
    pair: Annotated[str, Field(min_length=1, max_length=40)] = "samples"
    edits: Edits = Edits()

    @field_validator("samples", "refine")
    @classmethod
    def _square(cls, value: int) -> int:
        sample_offsets(value)
        return value

    @field_validator("light")
    @classmethod
    def _shines_somewhere(cls, value: FiniteVector | None) -> FiniteVector | None:
        return None if value is None else _not_zero(value)


class CameraMessage(_Sized):
    """A view to show: ``m`` camera to world as in ``viewpoint``, ``fovy`` in radians, ``w`` x ``h`` pixels.

    A ``height``, in scene units, makes the camera an orthographic one.
    """

    type: Literal["view"]
    seq: _Sequence
    mode: Mode
    m: _Matrix
    fovy: _Fovy
    height: _Height = None
    settings: ViewSettings = ViewSettings()


class Ack(_Message):
    """The page has drawn picture ``step`` of view ``seq`` and is ready for the next."""

    type: Literal["ack"]
    seq: _Sequence
    step: _Sequence


class Cancel(_Message):
    """Stop the picture under way."""

    type: Literal["cancel"]


class Pixel(_Sized):
    """Pixel (``x``, ``y``) of a view, counted from the top left."""

    x: Annotated[int, Field(ge=0, lt=MAX_SIDE)]
    y: Annotated[int, Field(ge=0, lt=MAX_SIDE)]
    m: _Matrix
    fovy: _Fovy
    height: _Height = None

    @model_validator(mode="after")
    def _inside(self) -> Self:
        if not (self.x < self.w and self.y < self.h):
            raise ValueError(f"expected a pixel of a picture of {self.w} x {self.h}, got ({self.x}, {self.y})")
        return self


class Pick(Pixel):
    """A click on a pixel, that asks for its ray and all that this spawns; and for the pixel's values in the proof of
    view ``proof``.
    """

    type: Literal["pick"]
    seq: _Sequence
    proof: _Sequence | None = None
    settings: ViewSettings = ViewSettings()


class Probe(Pixel):
    """Send the value that this pixel of a traced picture shows."""

    type: Literal["probe"]
    seq: _Sequence
    mode: Literal["brute", "octree"]
    settings: ViewSettings = ViewSettings()


class Measure(_Message):
    """Send the surface points that one or two pixels see, and the distance of two; the pixels may be of two views."""

    type: Literal["measure"]
    seq: _Sequence
    pixels: Annotated[list[Pixel], Field(min_length=1, max_length=2)]


class Hello(_Message):
    """A page that begins, or has lost its connection, wants to know its scene: ``file``, loaded anew only if it was
    edited, where it had that from this ``server`` and it is offered still; else the server's own. Of the objects
    ``hidden`` those that the scene has are left out.
    """

    type: Literal["hello"]
    file: _FileName = ""
    hidden: _Hidden = []
    server: Annotated[str, Field(max_length=64)] = ""


class OpenScene(_Message):
    """Load one of the offered scene files again."""

    type: Literal["scene"]
    file: _FileName


class HideObjects(_Message):
    """Leave these objects of the scene out, and show all others."""

    type: Literal["hide"]
    hidden: _Hidden


class SaveScene(_Message):
    """Write the scene's file with this camera and these settings, and what of it differs from the file."""

    type: Literal["save"]
    m: _Matrix
    fovy: _Fovy
    height: _Height = None
    settings: ViewSettings = ViewSettings()


class SaveCamera(_Message):
    """Write this camera as a scene file's table, and with ``settings`` the tables of these. While walking there is
    nothing that it turns about.
    """

    type: Literal["camera"]
    m: _Matrix
    fovy: _Fovy
    height: _Height = None
    walk: bool = False
    settings: ViewSettings | None = None


class AskCommand(_Sized):
    """Send the command line that renders the picture of this view."""

    type: Literal["command"]
    mode: Mode
    m: _Matrix
    fovy: _Fovy
    height: _Height = None
    settings: ViewSettings = ViewSettings()


class Still(_Sized):
    """Make a picture's file of this view, traced by the octree, beside the view that is shown: PNG, PNG with a
    "transparent" background, or EXR.
    """

    type: Literal["still"]
    seq: _Sequence
    m: _Matrix
    fovy: _Fovy
    height: _Height = None
    settings: ViewSettings = ViewSettings()
    format: Literal["png", "transparent", "exr"] = "png"


class Turntable(_Sized):
    """Make an animated file of ``frames`` views, the camera turned once about the line through ``pivot`` along
    ``axis``.
    """

    type: Literal["turntable"]
    seq: _Sequence
    m: _Matrix
    fovy: _Fovy
    height: _Height = None
    settings: ViewSettings = ViewSettings()
    pivot: FiniteVector
    axis: FiniteVector
    frames: Annotated[int, Field(ge=2, le=MAX_FRAMES)] = 36
    format: Literal["webp", "gif"] = "webp"

    @field_validator("axis")
    @classmethod
    def _has_a_direction(cls, value: FiniteVector) -> FiniteVector:
        return _not_zero(value)

    @model_validator(mode="after")
    def _not_too_long(self) -> Self:
        if self.frames * self.w * self.h > MAX_FRAME_PIXELS:
            of = f"{self.frames} frames of {self.w} x {self.h}"
            raise ValueError(f"expected at most {MAX_FRAME_PIXELS} pixels in all frames, got {of}")
        return self


class Stop(_Message):
    """Stop making the file under way."""

    type: Literal["stop"]


Message = (
    CameraMessage
    | Ack
    | Cancel
    | Pick
    | Probe
    | Measure
    | Hello
    | OpenScene
    | HideObjects
    | SaveScene
    | SaveCamera
    | AskCommand
    | Still
    | Turntable
    | Stop
)
_MESSAGE: TypeAdapter[Message] = TypeAdapter(Annotated[Message, Field(discriminator="type")])


# Faults of a message, or of an object in it, that lie in no one value.
_OF_A_WHOLE = ("value_error", "missing", "union_tag_invalid", "union_tag_not_found")


def parse(text: str) -> Message:
    """The message in ``text``. Raises ``ValueError`` with one line: the key, what was expected, and what was given."""
    try:
        return _MESSAGE.validate_json(text)
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        where = ".".join(str(key) for key in fault["loc"]) or "message"
        expected = str(fault["ctx"]["error"]) if fault["type"] == "value_error" else fault["msg"]
        # A value may be long; forty characters show which one it is. Of a whole message they would show nothing.
        whole = isinstance(fault["input"], dict) and fault["type"] in _OF_A_WHOLE
        got = "" if whole else f", got {repr(fault['input'])[:40]}"
        raise ValueError(f"{where}: {expected}{got}") from None


class Rows(NamedTuple):
    """The rows of a picture that a message holds, or the bytes of a file: the ``first``, their ``number``, and that of
    the ``whole``.
    """

    first: int
    number: int
    whole: int


def packed(
    kind: int,
    view: CameraMessage | Still | Turntable,
    step: int,
    last: bool,
    width: int,
    rows: Rows,
    pace: tuple[float, float],
) -> bytes:
    """The header of a picture, of a band of one, of face colours or of a piece of a file; ``pace`` is ms and million
    rays per second.

    40 bytes, which the payload follows: 4 w h bytes row by row from the top for RGBA, a JPEG file, 3 bytes per face, or
    the bytes of the file; for a proof three PNG files, each after its size as a uint32: the picture one way, the other
    way, and the heat map.
    """
    return HEADER.pack(kind, view.seq, step, last, width, rows.number, rows.first, rows.whole, *pace)
