"""The blocks of triangles: the vertices of the faces in each, in the smallest type that holds them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.jit import kernel
from renderer.layout import BLOCK_WORDS, LANES, cache_aligned
from renderer.parallel import for_chunks

# A tenth of a millisecond each, so that taking a chunk costs nothing beside it.
_VERTICES, _BLOCKS = 1 << 16, 1 << 12


@kernel
def _is_float32(vertices, begin, end):
    """Whether float32 holds every vertex in ``begin:end`` exactly."""
    for i in range(begin, end):
        for axis in range(3):
            if np.float64(np.float32(vertices[i, axis])) != vertices[i, axis]:
                return False
    return True


@kernel
def _fill(vertices, faces, block_faces, blocks, begin, end):
    """Copy the vertices of each face of blocks ``begin:end`` into its rows; unused places repeat one vertex."""
    for place in range(begin * LANES, end * LANES):
        face = block_faces[place]
        first = faces[block_faces[place // LANES * LANES], 0]
        base = place // LANES * BLOCK_WORDS + place % LANES
        for corner in range(3):
            vertex = first if face < 0 else faces[face, corner]
            for axis in range(3):
                blocks[base + LANES * (3 * corner + axis)] = vertices[vertex, axis]


def fill_blocks(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], block_faces: NDArray[np.int32], threads: int
) -> NDArray[Any]:
    """The blocks whose faces are ``block_faces``, in float32 when that holds every vertex exactly, else float64."""
    inexact: list[int] = []

    def check(begin: int, end: int) -> None:
        if not inexact and not _is_float32(vertices, begin, end):
            inexact.append(begin)

    for_chunks(check, len(vertices), _VERTICES, threads)
    count = len(block_faces) // LANES
    blocks = cache_aligned(count * BLOCK_WORDS, np.float64 if inexact else np.float32)
    for_chunks(lambda begin, end: _fill(vertices, faces, block_faces, blocks, begin, end), count, _BLOCKS, threads)
    return blocks
