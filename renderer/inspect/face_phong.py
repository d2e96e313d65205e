"""One colour a face, as seen from an eye: Phong at the face's centroid, without shadows and without bounces.

k_a I_a + sum over lights [k_d (N.L)+ + k_s (R.V)+^n] I_light, with N the geometric normal that faces the eye.
"""

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.kernels.jit import inlined, kernel
from renderer.kernels.simd import get, larger, pointer, smaller
from renderer.kernels.vec3 import add, cross, dot, normalized, row3, scale, sub, three, times
from renderer.picture.image import srgb, srgb_steps
from renderer.process.parallel import checked_threads, for_chunks
from renderer.scene.camera import checked_vector
from renderer.shade.records import (
    AMBIENT,
    DIFFUSE,
    DIRECTIONAL,
    KIND,
    LAMBERT,
    LIGHT_COLUMNS,
    REFLECTANCE,
    TRANSMITTANCE,
)
from renderer.shade.surface import SceneArrays, phong, scene_pointers

# 1 to 2 ms of work: little beside a frame, much beside taking a chunk.
_CHUNK = 8192
# Parts of [0, 1] of which most hold no more than one step of sRGB: the steps are 3e-4 apart and more.
_PLACES = 4096
# How much of the light around it a matte stand-in for a mirror or glass sends back: a middle grey for clear glass.
_STAND_IN = 0.5


def face_colors(arrays: SceneArrays, eye: ArrayLike, threads: int | None = None) -> NDArray[np.uint8]:
    """The colour of each face of ``arrays`` seen from ``eye`` (3,), as (F, 3) uint8 sRGB.

    A material with no colour of its own, as mirrors and glass have none, would be black without bounces. It shows as a
    matte surface instead, whose colour is half of what it reflects or lets through, whichever is more: middle grey
    for clear glass, tinted where the glass is.

    A face of no area has no normal and shows its ambient light alone. Only lights in ``arrays`` shine: a arrays packed
    for a scene on which no light falls (``needs.shadows`` False) has none. The same bits for any number of threads.
    Raises ``ValueError`` naming the argument.
    """
    at = checked_vector("eye", eye)
    seen = arrays._replace(materials=_with_stand_ins(arrays.materials))
    colors = np.empty((len(arrays.faces), 3), np.uint8)

    def shade(begin: int, end: int) -> None:
        _shade(seen, at, colors, _table(), begin, end)

    for_chunks(shade, len(colors), _CHUNK, checked_threads(threads))
    return colors


@cache
def _table() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Where the sRGB code changes: the least radiance of codes 1 to 255 and an infinity, (256,); and the code at the
    beginning of each of _PLACES equal parts of [0, 1], and at 1.

    A power for each value, as in the formula of sRGB, would take three times as long as all the rest here.
    """
    first = srgb(np.arange(_PLACES + 1) / _PLACES).astype(np.int64)
    return np.append(srgb_steps(), np.inf), first


def _with_stand_ins(materials: NDArray[np.float64]) -> NDArray[np.float64]:
    """``materials`` with matte rows in the place of those that have no ambient, diffuse or specular colour."""
    rows = materials.copy()
    colorless = ~rows[:, AMBIENT:REFLECTANCE].any(axis=1)
    passed_on = np.maximum(rows[:, REFLECTANCE : REFLECTANCE + 3], rows[:, TRANSMITTANCE : TRANSMITTANCE + 3])
    for column in (AMBIENT, DIFFUSE):
        rows[colorless, column : column + 3] = _STAND_IN * passed_on[colorless]
    rows[colorless, KIND] = LAMBERT
    return rows


@inlined
def _add_light(arrays, light, p, n, d, m):
    """What the surface p of normal n and material row m sends against d of the light's."""
    row = light * LIGHT_COLUMNS
    towards, arriving = three(arrays.lights, row + 1), three(arrays.lights, row + 4)
    directional = get(arrays.lights, row) == DIRECTIONAL
    if not directional:
        towards = sub(towards, p)
    if dot(n, towards) <= 0.0:
        return (0.0, 0.0, 0.0)
    if not directional:
        arriving = scale(arriving, 1.0 / dot(towards, towards))
        towards = normalized(towards)
    return times(phong(arrays, m, n, d, towards), arriving)


@inlined
def _encoded(x, table):
    """The sRGB code of x: how many steps of ``_table`` it reaches, counted from those that its place does."""
    steps, first = table
    x = smaller(larger(x, 0.0), 1.0)
    code = get(first, np.int64(x * _PLACES))
    while get(steps, code) <= x:
        code += 1
    return code


@kernel
def _shade(arrays, eye, colors, table, begin, end):
    """Colour the faces from ``begin`` to ``end``."""
    seen, table = scene_pointers(arrays), (pointer(table[0]), pointer(table[1]))
    for face in range(begin, end):
        a, b, c = row3(seen.faces, face)
        p0, p1, p2 = row3(seen.vertices, a), row3(seen.vertices, b), row3(seen.vertices, c)
        p, n = scale(add(add(p0, p1), p2), 1.0 / 3.0), normalized(cross(sub(p1, p0), sub(p2, p0)))
        d, m = normalized(sub(p, eye)), get(seen.material, face)
        n = scale(n, -1.0) if dot(d, n) > 0.0 else n
        color = times(three(seen.materials, m + AMBIENT), row3(seen.colors, 0))
        for light in range(seen.light_count):
            color = add(color, _add_light(seen, light, p, n, d, m))
        for k in range(3):
            colors[face, k] = _encoded(color[k], table)
