"""Contacts of a line with a mesh, in exact rational arithmetic: the judge of ``all_hits`` and ``count_hits``."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from validation.oracle.exact import mesh_determinants

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
    of_faces, unit = mesh_determinants(vertices, faces, origin, direction)
    for face, (u, v, w, depth) in enumerate(of_faces):
        signs, whole = [(x > 0) - (x < 0) for x in (u, v, w)], u + v + w
        if {-1, 1} <= set(signs) or whole == 0 or (depth < 0 < whole) or (whole < 0 < depth):
            continue
        # On the edge opposite to a corner that corner's weight is 0.
        corners = (vertices[faces[face]] + 0.0).tolist()
        part = frozenset(tuple(corner) for corner, sign in zip(corners, signs, strict=True) if sign)
        places.setdefault((face if 0 not in signs else -1, part), []).append((Fraction(depth, whole) * unit, face))
    found = [Contact(rows[0][0], tuple(face for _, face in rows)) for rows in places.values()]
    return sorted(found, key=lambda contact: (contact.t, contact.faces))


def hits(found: Sequence[Contact]) -> list[tuple[Fraction, int]]:
    """Each hit of some contacts, by t, then face."""
    return sorted((contact.t, face) for contact in found for face in contact.faces)
