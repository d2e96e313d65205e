"""The faces of a mesh that count: of those at one place the first, and none with a corner that is not finite.

trimesh lists what coincides once, so that a body whose faces are there twice, or from both sides, still has an inside.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Odd numbers that mix the bits of coordinates: a digest that finds candidates, which are then compared.
_MIXING = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


def placed_faces(vertices: Floats, faces: Integers) -> Integers:
    """The rows of faces that have a place: all their corners are finite."""
    finite = np.asarray(np.isfinite(vertices).all(axis=1))
    return np.arange(len(faces)) if finite.all() else np.flatnonzero(finite[faces].all(axis=1))


def distinct_faces(vertices: Floats, faces: Integers, rows: Integers) -> Integers:
    """Those of the faces in ``rows`` whose three corner positions no face before them has."""
    again = _repeated(vertices, faces, rows)
    return rows[~again] if again.any() else rows


def _repeated(vertices: Floats, faces: Integers, rows: Integers) -> NDArray[np.bool_]:
    """Which of the faces in ``rows`` stand, in whatever order of corners, where one before them does."""
    with np.errstate(over="ignore"):
        bits = (vertices + 0.0).view(np.uint64) * _MIXING
        words = bits[:, 0] ^ (bits[:, 1] >> np.uint64(7)) ^ (bits[:, 2] << np.uint64(9))
        words *= _MIXING[0]
        words ^= words >> np.uint64(29)
        # A sum does not depend on the order of corners.
        digests = (words * _MIXING[1])[faces[rows]].sum(axis=1)
    again, order = np.zeros(len(rows), np.bool_), np.argsort(digests, kind="stable")
    equal = np.flatnonzero(digests[order][1:] == digests[order][:-1])
    if len(equal):
        some = np.unique(np.concatenate([order[equal], order[equal + 1]]))
        corners = vertices[faces[rows[some]]] + 0.0
        turned = np.lexsort((corners[:, :, 2], corners[:, :, 1], corners[:, :, 0]), axis=1)
        places = np.take_along_axis(corners, turned[:, :, None], axis=1).reshape(-1, 9)
        _, first = np.unique(places, axis=0, return_index=True)
        again[some] = True
        again[some[first]] = False
    return again


def standing_together(triples: Integers) -> tuple[Integers, Integers]:
    """A number (f,) for each set of three numbers, in any order, and the number of faces with that set."""
    _, place, count = np.unique(np.sort(triples, axis=1), axis=0, return_inverse=True, return_counts=True)
    return place.reshape(-1), count[place.reshape(-1)]
