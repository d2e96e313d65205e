"""One colour for each face, seen from an eye: Phong at the face's centroid, without shadows and bounces.

k_a I_a + sum over lights [k_d (N.L)+ + k_s (R.V)+^n] I_light, with N the geometric normal that faces the eye.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.materials.columns import AMBIENT, DIFFUSE, KIND, LAMBERT, REFLECTANCE, TRANSMITTANCE
from renderer.picture.image import srgb, srgb_steps
from renderer.scene.vectors import checked_vector
from renderer.shade.face_colors import PLACES, shade_faces
from renderer.shade.surface import SceneArrays
from renderer.system.threads import checked_threads, for_chunks

# Faces per chunk, 1 to 2 ms of work: little beside a frame, much beside taking a chunk.
_CHUNK = 8192
# The share of light that a matte stand-in for a mirror or glass sends back: a middle grey for clear glass.
_STAND_IN = 0.5


def face_colors(arrays: SceneArrays, eye: ArrayLike, threads: int | None = None) -> NDArray[np.uint8]:
    """The colour of each face of ``arrays`` seen from ``eye`` (3,), as (F, 3) uint8 sRGB.

    A material with no colour of its own, as mirrors and glass have none, would be black without bounces. It shows as a
    matte surface instead, whose colour is half of what it reflects or lets through, whichever is more: middle grey
    for clear glass, tinted where the glass is.

    A face of no area has no normal and shows its ambient light alone. Only lights in ``arrays`` shine: arrays packed
    for a scene on which no light falls (``needs.shadows`` False) has none. The same bits for any number of threads.
    Raises ``ValueError`` naming the argument.
    """
    at = checked_vector("eye", eye)
    seen = arrays._replace(materials=_with_stand_ins(arrays.materials))
    colors, table = np.empty((len(arrays.faces), 3), np.uint8), _code_table()

    def shade(begin: int, end: int) -> None:
        shade_faces(seen, at, colors, table.steps, table.first, begin, end)

    for_chunks(shade, len(colors), _CHUNK, checked_threads(threads))
    return colors


class CodeTable(NamedTuple):
    """sRGB codes as a table; computing a power for each value would quadruple the time.

    steps  (256,) the least radiance of codes 1 to 255, and an infinity
    first  (PLACES + 1,) the code at the start of each of PLACES equal parts of [0, 1], and at 1
    """

    steps: NDArray[np.float64]
    first: NDArray[np.int64]


@cache
def _code_table() -> CodeTable:
    first = srgb(np.arange(PLACES + 1) / PLACES).astype(np.int64)
    return CodeTable(np.append(srgb_steps(), np.inf), first)


def _with_stand_ins(materials: NDArray[np.float64]) -> NDArray[np.float64]:
    """``materials`` with matte rows in place of those without ambient, diffuse or specular colour."""
    rows = materials.copy()
    colorless = ~rows[:, AMBIENT:REFLECTANCE].any(axis=1)
    passed_on = np.maximum(rows[:, REFLECTANCE : REFLECTANCE + 3], rows[:, TRANSMITTANCE : TRANSMITTANCE + 3])
    for column in (AMBIENT, DIFFUSE):
        rows[colorless, column : column + 3] = _STAND_IN * passed_on[colorless]
    rows[colorless, KIND] = LAMBERT
    return rows
