"""Blocks of triangles: the vertices of the faces in each, in the smallest type that represents them exactly."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import kernel
from renderer.numerics.simd import float32_pointer, float64_pointer, store
from renderer.system.threads import for_chunks
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, cache_aligned, locked

# Vertices and blocks per chunk: a tenth of a millisecond, beside which taking a chunk costs nothing.
_VERTICES, _BLOCKS = 1 << 16, 1 << 12


@kernel
def _fill(vertices, faces, block_faces, address, wide, begin, end):
    """Copy the vertices of each face of blocks ``begin:end`` into its rows; unused places get NaN, which no ray hits.

    The blocks are at ``address``, float64 if ``wide``, else float32: one kernel for both.
    """
    doubles, floats = float64_pointer(address), float32_pointer(address)
    for place in range(begin * BLOCK_FACES, end * BLOCK_FACES):
        face = block_faces[place]
        base = place // BLOCK_FACES * BLOCK_WORDS + place % BLOCK_FACES
        for corner in range(3):
            for axis in range(3):
                at = base + BLOCK_FACES * (3 * corner + axis)
                x = vertices[faces[face, corner], axis] if face >= 0 else np.nan
                if wide:
                    store(doubles, at, x)
                else:
                    store(floats, at, np.float32(x))


def fill_blocks(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], block_faces: NDArray[np.int32], threads: int
) -> NDArray[Any]:
    """The blocks with the faces ``block_faces``: float32 if that represents every vertex exactly, else float64."""
    inexact: list[int] = []

    def check(begin: int, end: int) -> None:
        part = vertices[begin:end]
        with np.errstate(over="ignore"):  # what float32 cannot hold becomes inf
            if not inexact and (part.astype(np.float32) != part).any():
                inexact.append(begin)

    for_chunks(check, len(vertices), _VERTICES, threads)
    count = len(block_faces) // BLOCK_FACES
    blocks = cache_aligned(count * BLOCK_WORDS, np.float64 if inexact else np.float32)
    address, wide, block_faces = blocks.ctypes.data, blocks.dtype == np.float64, locked(block_faces)

    # The default argument keeps the blocks alive as long as ``fill``, which their address does not.
    def fill(begin: int, end: int, _held: NDArray[Any] = blocks) -> None:
        _fill(vertices, faces, block_faces, address, wide, begin, end)

    for_chunks(fill, count, _BLOCKS, threads)
    return blocks
