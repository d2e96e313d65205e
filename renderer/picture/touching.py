"""The faces of a scene that touch: see ``shade.touching``."""

import numpy as np
from numpy.typing import NDArray

from renderer.scene.needs import Features
from renderer.shade.surface import SceneArrays
from renderer.shade.touching import mark_touching
from renderer.system.threads import for_chunks
from renderer.trace.layout import Tree
from renderer.trace.walk import stack_size

_CHUNK = 4096


def find_touching(tree: Tree, arrays: SceneArrays, needs: Features, threads: int) -> SceneArrays:
    """``arrays`` with ``touching``."""
    return arrays._replace(touching=touching_faces(tree, arrays, threads)) if needs.refraction else arrays


def touching_faces(tree: Tree, arrays: SceneArrays, threads: int, every: bool = False) -> NDArray[np.uint8]:
    """``SceneArrays.touching``; with ``every``, whether or not one of two faces passes light."""
    touching = np.zeros(len(arrays.faces), np.uint8)

    def mark(begin: int, end: int) -> None:
        mark_touching(tree.descriptor, arrays, begin, end, every, np.empty(stack_size(tree.depth), np.int64), touching)

    for_chunks(mark, len(tree.faces), _CHUNK, threads)
    return touching if touching.any() else touching[:0]
