"""Contacts of a line with a mesh, in exact rational arithmetic: the judge of ``all_hits`` and ``count_hits``."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from validation.oracle.exact import determinants

Floats = NDArray[np.float64]
# The corners, by position, of the face's part that the line meets: one of a corner, two of an edge, three of a face.
Part = frozenset[tuple[float, ...]]


@dataclass(frozen=True)
class Contact:
    """The faces, ascending, that a line meets at one edge or corner of the surface, or one face met between them."""

    t: Fraction
    faces: tuple[int, ...]


def contacts(vertices: Floats, faces: NDArray[np.int32], origin: Floats, direction: Floats) -> list[Contact]:
    """All contacts of the ray from ``origin`` on, t >= 0, by t, then lowest face."""
    places: dict[tuple[int, Part], list[tuple[Fraction, int]]] = {}
    for face, corners in enumerate(vertices[faces]):
        u, v, w, t = determinants(corners, origin, direction)
        signs, whole = [(x > 0) - (x < 0) for x in (u, v, w)], u + v + w
        if {-1, 1} <= set(signs) or whole == 0 or t / whole < 0:
            continue
        # On the edge opposite to a corner that corner's weight is 0.
        part = frozenset(tuple(corner) for corner, sign in zip((corners + 0.0).tolist(), signs, strict=True) if sign)
        places.setdefault((face if 0 not in signs else -1, part), []).append((t / whole, face))
    found = [Contact(rows[0][0], tuple(face for _, face in rows)) for rows in places.values()]
    return sorted(found, key=lambda contact: (contact.t, contact.faces))


def hits(found: Sequence[Contact]) -> list[tuple[Fraction, int]]:
    """Each hit of some contacts, by t, then face."""
    return sorted((contact.t, face) for contact in found for face in contact.faces)
