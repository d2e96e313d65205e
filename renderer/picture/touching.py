"""The faces of a scene that touch: see ``shade.touching``."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from renderer.rayscene.built import SceneTree
from renderer.shade.surface import SceneArrays
from renderer.shade.touching import mark_touching
from renderer.system.threads import for_chunks
from renderer.trace.instances import SLOT_BITS
from renderer.trace.layout import Tree
from renderer.trace.walk import stack_size

_CHUNK = 4096


def touching_faces(tree: Tree | SceneTree, arrays: SceneArrays, threads: int, every: bool = False) -> NDArray[np.uint8]:
    """``SceneArrays.touching``; with ``every``, whether or not one of two faces passes light."""
    touching = np.zeros(len(arrays.material), np.uint8)
    for first, count in _slots(tree):

        def mark(begin: int, end: int, first: int = first) -> None:
            stack = np.empty(stack_size(tree.depth), np.int64)
            mark_touching(tree.descriptor, arrays, first + begin, first + end, every, stack, touching)

        for_chunks(mark, count, _CHUNK, threads)
    return touching if touching.any() else touching[:0]


def _slots(tree: Tree | SceneTree) -> Iterator[tuple[int, int]]:
    """The first of the places in the blocks of each mesh, and their number."""
    if not isinstance(tree, SceneTree):
        yield 0, len(tree.faces)
        return
    for member in tree.members:
        rows = tree.members.rows(member)
        for number in range(rows.start + 1, rows.stop + 1):
            yield number << SLOT_BITS, len(member.built.tree.faces)
