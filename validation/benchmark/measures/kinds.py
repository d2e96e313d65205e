"""The kinds of queries: how a peer is asked, and which of its answers differ from ours by more than rounding."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import face_normals
from renderer.octree import Octree
from validation.benchmark.peers.contender import Family, HitLists, Peer, Points, Query

Bools = NDArray[np.bool_]
Asked = Family | Points
# A peer in float32 rounds each number that it computes with by up to 2^-24 of the largest coordinate, and a hit or a
# distance takes a dozen of them. Seen at up to 5 million faces: 2^-23. A wrong face or a wrong side is off by more: by
# the size of a face, or by twice the distance.
DIGITS = 20


class Kind(NamedTuple):
    """A kind of query.

    name       as in the record
    said       for people
    families   of rays or points that ask it
    closed     whether the mesh must be closed
    share      of a run's rays or points that ask it
    ask        the query of a peer
    hit        of answers: which rays hit, or which points are inside, or found
    differing  of octree, rays or points, our answers and theirs: which differ from ours beyond rounding
    """

    name: str
    said: str
    families: tuple[str, ...]
    closed: bool
    share: float
    ask: Callable[[Peer, Any], Query | None]
    hit: Callable[[Any], Bools]
    differing: Callable[[Octree, Any, Any, Any], Bools]


def rounding(octree: Octree, *arrays: NDArray[np.float64]) -> float:
    """The length by which an answer in float32 may be off: 2^-``DIGITS`` of the largest coordinate."""
    return 2.0**-DIGITS * max(float(np.abs(a).max()) for a in (*octree.mesh.bounds, *arrays))


def _flags(octree: Octree, rays: Family, ours: Any, theirs: Any) -> Bools:
    """Rays that hit for one only."""
    return np.not_equal(ours, theirs)


def _misses(octree: Octree, rays: Family, ours: Any, theirs: Any) -> Bools:
    return _flags(octree, rays, np.isfinite(ours), np.isfinite(theirs))


def _lists(octree: Octree, rays: Family, ours: HitLists, theirs: HitLists) -> Bools:
    """Rays with another number of hits, or with a hit that is farther from the plane of our face than rounding."""
    differing: Bools = ours.counts != theirs.counts
    ray, same = (np.repeat(np.arange(len(rays)), hits.counts) for hits in (ours, theirs))
    kept, kept_theirs = ~differing[ray], ~differing[same]
    face, ray = ours.face[kept], ray[kept]
    off = (theirs.t[kept_theirs] - ours.t[kept])[:, None] * rays.directions[ray]
    limit = rounding(octree, rays.origins)
    # Few are so far off along the ray; most of these because the ray grazes its face.
    far = np.flatnonzero(np.linalg.norm(off, axis=1) > limit)
    normals = face_normals(octree.mesh.vertices[octree.mesh.faces[face[far]]])
    wrong = np.abs(np.einsum("ij,ij->i", normals, off[far])) > limit
    differing[ray[far[wrong]]] = True
    return differing


def _sides(octree: Octree, points: Points, ours: Bools, theirs: Bools) -> Bools:
    """Points on another side, unless rounding may have brought them there."""
    differing: Bools = ours != theirs
    rows = np.flatnonzero(differing)
    place = points.points[rows]
    differing[rows] = ~octree.closest_point(place, rounding(octree, points.points)).found
    return differing


def _distances(octree: Octree, points: Points, ours: Any, theirs: Any) -> Bools:
    """Points at another distance, or on another side and not near the surface."""
    # Also where theirs is no number.
    return ~(np.abs(theirs - ours) <= rounding(octree, points.points))


_RAYS = ("camera", "shadow", "random", "bounce", "misses", "short")
_THROUGH, _WIDE, _BESIDE = ("random",), ("wide",), ("box", "near")
# Kinds that ask for a first hit, and those families whose users ask no more than whether there is one: on meshes of
# other kinds than the series, only these ask for any hit.
FIRST, _ENDED = ("closest", "any"), ("shadow", "short")
KINDS = {
    kind.name: kind
    for kind in (
        Kind("closest", "closest hit", _RAYS, False, 1.0, lambda p, rays: p.closest(rays), np.isfinite, _misses),
        Kind("any", "any hit", _RAYS, False, 1.0, lambda p, rays: p.any(rays), lambda hit: hit, _flags),
        Kind("all", "all hits", _THROUGH, False, 1.0, lambda p, rays: p.all(rays), lambda h: h.counts > 0, _lists),
        Kind("count", "number of hits", _THROUGH, False, 1.0, lambda p, rays: p.count(rays), lambda n: n > 0, _flags),
        Kind("contains", "inside", _WIDE, True, 1.0, lambda p, at: p.contains(at), lambda inside: inside, _sides),
        # A tenth, because a point asks a hundred times as many faces as a ray.
        Kind("nearest", "closest point", _BESIDE, False, 0.1, lambda p, at: p.nearest(at), np.isfinite, _distances),
        Kind("signed", "signed distance", _BESIDE, True, 0.1, lambda p, at: p.signed(at), lambda d: d < 0, _distances),
    )
}


def briefly(family: str, kind: Kind) -> bool:
    """Whether this query is measured on meshes of other kinds than the series too."""
    return kind.name == "closest" or (kind.name == "any" and family in _ENDED)


def title(family: str, query: str) -> str:
    """A family and a kind of query for people: "camera rays, closest hit"."""
    return f"{family} {'rays' if family in _RAYS else 'points'}, {KINDS[query].said}"
