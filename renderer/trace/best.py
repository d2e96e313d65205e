"""Hits inside kernels: the best hit of a search, and a hit on a known face."""

from typing import NamedTuple

import numpy as np

from renderer.jit.decorators import inlined

NO_FACE = np.iinfo(np.int32).max


class FaceHit(NamedTuple):
    """A hit on a face: t, NaN for none, and the barycentrics u / w and v / w."""

    t: float
    u: float
    v: float
    w: float


class Best(NamedTuple):
    """The best hit of a search so far: the smallest t, then the lowest face. NO_FACE means none; t is then the limit of
    the search. The barycentrics are u / w and v / w; only those of the final hit are divided.
    """

    t: float
    face: int
    u: float
    v: float
    w: float


@inlined
def no_hit(t_max):
    """The ``Best`` of a search that has found nothing up to ``t_max``."""
    return Best(t_max, np.int32(NO_FACE), 0.0, 0.0, 1.0)


@inlined
def hit_on(face, hit):
    """The ``Best`` that a ``FaceHit`` on a face makes."""
    return Best(hit.t, face, hit.u, hit.v, hit.w)


@inlined
def admits_all(tree, w, dz):
    """``Ways.admits`` of a mesh: no face is culled."""
    return True


@inlined
def may_hit_all(tree, place, mask, ignored):
    """``Ways.may_hit`` of a mesh."""
    return True


@inlined
def side_of(w, dz):
    """The side of a face that a ray came from, 1 that of the normal, -1 the other: by the sign of a hit's w and that of
    the ray's ``Shear.direction_z``.
    """
    return 1 if (w > 0.0) == (dz > 0.0) else -1


@inlined
def is_better(t, face, t_min, best):
    """Whether a hit counts and comes before the best one: a smaller t, or the same t and a lower face."""
    return t >= t_min and (t < best.t or (t == best.t and face < best.face))
