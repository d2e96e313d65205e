"""The file of ``--record``: the rays' parameters and what a mesh answered."""

import base64
import zlib
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from renderer.checkpoints.parts import digest_of
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.system.files import read_whole, write_atomically
from renderer.version import __version__
from validation.recorded.rays import Rays, make_rays

# Pixels of each picture, wide and high, and rays in all directions.
SIDE, OTHERS = 64, 4096
# The pictures are this share of the mesh's diagonal wider on each side.
_MARGIN = 0.05

_Number = Annotated[float, Field(allow_inf_nan=False)]
_Point = Annotated[list[_Number], Field(min_length=3, max_length=3)]
_Count = Annotated[int, Field(ge=1, le=4096)]


class Record(BaseModel):
    """The file; arrays are little-endian, compressed by zlib and written in base64.

    mesh          path of the mesh as it was given
    digest        of its vertices and faces
    lower, upper  its bounds, from which the rays are made
    t, face       the answers: float64 and int32, inf and -1 on a miss
    """

    model_config = ConfigDict(extra="forbid")

    format: Literal["octree-validate --record"] = "octree-validate --record"
    version: Literal[1] = 1
    renderer: str = __version__
    mesh: str
    digest: str
    lower: _Point
    upper: _Point
    side: _Count = SIDE
    others: _Count = OTHERS
    t: str
    face: str

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lower and upper corner, (2, 3)."""
        return np.array([self.lower, self.upper])

    @property
    def size(self) -> float:
        """The mesh's diagonal; 1 where all its points coincide."""
        return float(np.linalg.norm(self.bounds[1] - self.bounds[0])) or 1.0

    @property
    def frame(self) -> NDArray[np.float64]:
        """The box that the pictures show, (2, 3): the bounds with a margin."""
        margin = _MARGIN * self.size
        return self.bounds + np.array([[-margin], [margin]])

    def rays(self) -> Rays:
        return make_rays(self.frame[0], self.frame[1], self.side, self.others)

    def answers(self) -> "Answers":
        """The recorded answers. Raises ``ValueError`` where there is not one for each ray."""
        count = 3 * self.side**2 + self.others
        return Answers(_unpack("t", self.t, "<f8", count), _unpack("face", self.face, "<i4", count))


class Answers:
    """Closest hits of the rays: ``t`` in units of |direction|, inf on a miss, and ``face``, -1 on a miss."""

    def __init__(self, t: NDArray[np.float64], face: NDArray[np.int32]) -> None:
        self.t, self.face = t, face
        self.hit = np.isfinite(t)


def bounds_of(mesh: Mesh) -> NDArray[np.float64]:
    """Lower and upper corner, (2, 3), of the vertices that faces name."""
    used = mesh.vertices[np.unique(mesh.faces)]
    return np.stack([used.min(axis=0), used.max(axis=0)])


def digest(mesh: Mesh) -> str:
    return digest_of(mesh.vertices, mesh.faces)


def shoot(mesh: Mesh, rays: Rays) -> Answers:
    hits = Octree.from_mesh(mesh).closest_hit(rays.origins, rays.directions)
    return Answers(hits.t, hits.face.astype(np.int32))


def make_record(mesh: Mesh, path: Path) -> Record:
    """Shoot the rays of a mesh at itself."""
    lower, upper = bounds_of(mesh).tolist()
    record = Record(mesh=path.as_posix(), digest=digest(mesh), lower=lower, upper=upper, t="", face="")
    answers = shoot(mesh, record.rays())
    return record.model_copy(update={"t": _pack(answers.t, "<f8"), "face": _pack(answers.face, "<i4")})


def write_record(record: Record, path: Path) -> None:
    text = record.model_dump_json(indent=1) + "\n"
    write_atomically(path, lambda file: file.write(text.encode()))


def read_record(path: Path) -> Record:
    """A checked record. Raises ``ValueError`` that names the key at fault, ``OSError`` for a file that is missing."""
    try:
        content = read_whole(path)
    except OSError as error:
        raise OSError(f"{path}: cannot be read: {error.strerror or error}") from error
    try:
        return Record.model_validate_json(content)
    except ValidationError as error:
        first = error.errors(include_input=False)[0]
        where = ".".join(str(key) for key in first["loc"]) or "top level"
        raise ValueError(
            f"{path}: expected a record of this version of octree-validate, got another file: {where}: {first['msg']}; "
            "write it again with --record"
        ) from None


def _pack(values: NDArray[np.generic], kind: str) -> str:
    return base64.b64encode(zlib.compress(values.astype(kind).tobytes(), 9)).decode()


def _unpack(name: str, text: str, kind: str, count: int) -> NDArray[Any]:
    try:
        values = np.frombuffer(zlib.decompress(base64.b64decode(text, validate=True)), kind)
    except (ValueError, zlib.error) as error:
        raise ValueError(f"{name}: expected a compressed array, got one that cannot be read: {error}") from None
    expect(len(values) == count, name, f"{count} values", len(values))
    return values
