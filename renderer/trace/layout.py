"""The layout in memory of nodes and of blocks of triangles, which the kernels and the builder share."""

from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.lazy import lazy

T = TypeVar("T", bound=np.generic)

CACHE_LINE = 64
# The bytes of an int64 or a float64.
WORD_BYTES = 8

# A node is NODE_WORDS 32-bit words, four cache lines. Words 0-47 are six rows of eight float32, one value per octant:
# lower x, upper x, lower y, upper y, lower z, upper z. Words CHILDREN to CHILDREN + 7 are its children, words ORDERS to
# ORDERS + 7 orders of them, as int32 (the same memory seen through ``links``). An empty octant has lower = +inf and
# upper = -inf, which no ray enters (but see UNUSED), and the link UNUSED.
NODE_WORDS = 64
CHILDREN = 48
# An order has the octants' numbers as octal digits, that of the farthest last, for rays whose directions have the signs
# of its place: 1, 2 and 4 are set in it where x, y and z are negative. See ``tree.order``.
ORDERS = 56
ANY_ORDER = 0o76543210
# To be raised when the memory of a node changes: pickles of another form are refused.
FORM = 2

# A child >= 0 is a node. A child < 0 is a leaf: ~child holds its first block and, in the low three bits, its number
# of blocks less one.
LEAF_BITS = 3
MAX_LEAF_BLOCKS = 1 << LEAF_BITS

# The link of an empty octant. A ray with a NaN may enter one, because comparisons with NaN are false. As a child, the
# link is a leaf of one block, the first of the tree or of a subtree. So every path through a tree is finite, and every
# hit is on a face of the mesh.
UNUSED = -1

# A block is nine rows of four values, one value per triangle: p0 x, p0 y, p0 z, p1 x, ... p2 z. An unused slot of a
# block has face -1 and NaN for all its coordinates, a triangle that no ray hits: every comparison with NaN is false.
BLOCK_FACES = 4
BLOCK_WORDS = 36

# A tree as kernels read it, int64: addresses of its arrays, the number of blocks, the levels of nodes, whether vertices
# are float64, and the bits of its scale.
NODES, BLOCKS, FACES, BLOCK_COUNT, DEPTH, WIDE, SCALE, TREE_WORDS = range(8)

# All bits of a mask. A ray that has them may hit every instance whose mask is not 0.
MASK_BITS = (1 << 32) - 1


@dataclass(frozen=True, eq=False)
class Tree:
    """A mesh for tracing: nodes and blocks of triangles.

    nodes   (N * NODE_WORDS,) float32, rounded outwards from the float64 vertices; without nodes, every block is tested
    blocks  (B * BLOCK_WORDS,) float32 when every vertex is exactly a float32, else float64
    faces   (B * BLOCK_FACES,) int32, the face in each slot of each block, -1 where unused
    depth   the levels of nodes, 0 without nodes
    scale   the power of two by which the vertices were multiplied
    """

    nodes: NDArray[np.float32]
    blocks: NDArray[np.float32] | NDArray[np.float64]
    faces: NDArray[np.int32]
    depth: int
    scale: float = 1.0

    @property
    def has_nodes(self) -> bool:
        """Whether the tree has nodes; if not, every ray is tested against every block."""
        return self.depth > 0

    @property
    def links(self) -> NDArray[np.int32]:
        """The memory of ``nodes`` as int32."""
        return self.nodes.view(np.int32)

    @lazy
    def descriptor(self) -> NDArray[np.int64]:
        """(TREE_WORDS,) int64: the tree as kernels read it. It holds addresses, valid as long as the tree is kept."""
        words = np.zeros(TREE_WORDS, np.int64)
        words[NODES], words[BLOCKS], words[FACES] = (a.ctypes.data for a in (self.nodes, self.blocks, self.faces))
        words[BLOCK_COUNT], words[DEPTH] = len(self.faces) // BLOCK_FACES, self.depth
        words[WIDE] = self.blocks.dtype == np.float64
        words[SCALE] = np.float64(self.scale).view(np.int64)
        return words

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle without the addresses, which are those of this object's arrays."""
        return _restored, (self.nodes, self.blocks, self.faces, self.depth, self.scale, FORM)


def root_box(nodes: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lower and upper corner, (3,), of the box around the octants of the root; inf and -inf if it has none."""
    rows = nodes[:CHILDREN].reshape(3, 2, 8)
    return rows[:, 0].min(axis=1).astype(np.float64), rows[:, 1].max(axis=1).astype(np.float64)


def _restored(
    nodes: NDArray[Any], blocks: NDArray[Any], faces: NDArray[np.int32], depth: int, scale: float, form: int = 1
) -> Tree:
    expect(form == FORM, "pickle", "an octree of this release", "one of an earlier release; build it again")
    return Tree(_aligned(nodes), _aligned(blocks), faces, depth, scale)


def _aligned(array: NDArray[Any]) -> NDArray[Any]:
    copy = cache_aligned(len(array), array.dtype.type)
    copy[:] = array
    return copy


def cache_aligned(count: int, dtype: type[np.generic]) -> NDArray[Any]:
    """An uninitialised array of ``count`` values that begins on a cache line, as do all its records of 64 bytes."""
    size = count * np.dtype(dtype).itemsize
    memory = np.empty(size + CACHE_LINE, np.uint8)
    start = -memory.ctypes.data % CACHE_LINE
    return memory[start : start + size].view(dtype)


def locked(array: NDArray[T]) -> NDArray[T]:
    """A read-only view.

    Numba compiles a kernel again for read-only arrays, such as those of a mapped file. So kernels get all arrays of a
    kind read-only.
    """
    view = array.view()
    view.flags.writeable = False
    return view
