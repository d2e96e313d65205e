"""Rays that start on surfaces: at corners, on edges, beside them, inside faces; our first hits against the exact law.

Whether a ray is stopped at once depends on the signs of its direction on the planes of the faces that hold its start
alone, so that every ray is judged exactly; what those that go on hit is judged on a sample. From inside a closed body
none of them may be lost.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.octree import Octree
from validation.gates import Gate
from validation.hits.bodies import Body, bodies
from validation.job import Job
from validation.oracle.starts import First, Start, Surface, stopped
from validation.oracle.vectors import cross, difference, dot, rational, whole_vector

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

SEED = 2033
# A float64 product of three terms with a rounded normal errs by 5 u of their sizes at most.
_SIGN_ROUNDINGS = 8 * 2.0**-53
# t of the sample, relative and in units of the largest coordinate over the direction's part along the normal: an answer
# beyond is another hit. A start inside a face is moved by up to 2^-38 of the face. How exact t is, other gates judge.
_RELATIVE, _ABSOLUTE = 1e-9, 2.0**-37
# As such a ray may pass any edge on either side, starts are left out that are nearer than this, by the size of their
# face, to an edge of another face, and farther from those of their own than from where rays start exactly.
_MOVE, _EXACTLY = 2.0**-36, 2.0**-30
# Near its start, by the size of the face, a ray is judged exactly, but for what is beyond the pairs of float64 that
# decide: edge functions of less than this share of their terms. Farther off, as any ray, it may pass an edge on either
# side that it passes by no more than its start is moved.
_CLOSEST, _NEAR = Fraction(1, 1 << 84), 2.0**-30
_REASON = "exact arithmetic decides"


@dataclass(frozen=True)
class StartEffort:
    """Rays in all, and how many of those that go on are judged by exact arithmetic to their end."""

    rays: int
    exact: int


QUICK = StartEffort(rays=30_000, exact=3_000)
FULL = StartEffort(rays=1_300_000, exact=40_000)


class Batch(NamedTuple):
    """Rays from few starts: ``which`` start each is from; all leave their faces alike: to ``side``, ``through`` or not.

    ``t`` and ``face`` are the answers.
    """

    starts: list[Start]
    which: Ints
    directions: Floats
    sides: Ints
    through: bool
    t: Floats
    face: Ints


class Wrong(NamedTuple):
    """Counts of rays: all, those judged to their end; stopped or not against the law where a face is named and where
    none is; lost, wrong in the sample.
    """

    rays: int
    exact: int
    at_once: int
    unnamed: int
    lost: int
    sample: int


def steps() -> int:
    """Number of calls of ``job.step``."""
    return len({body.family for body in bodies()})


def check_starts(job: Job, effort: StartEffort | None = None, make: Callable[..., Any] = Octree) -> Any:
    """Trace rays at every body; returns records for JSON, one a family, and the gates. ``make`` builds the tracer."""
    effort = effort or (QUICK if job.quick else FULL)
    all_bodies = list(bodies())
    share = StartEffort(-(-effort.rays // len(all_bodies)), -(-effort.exact // len(all_bodies)))
    totals: dict[str, Counter[str]] = {}
    for number, body in enumerate(all_bodies):
        if body.family not in totals:
            job.step(f"starts: {body.family}")
        found = check_body(body, share, np.random.default_rng([SEED, number]), make)
        totals.setdefault(body.family, Counter()).update(found._asdict())
    records = [{"family": family, **{key: total[key] for key in Wrong._fields}} for family, total in totals.items()]
    return records, [gate for record in records for gate in _gates(record)]


def _gates(record: dict[str, Any]) -> list[Gate]:
    subject = f"{record['family']}, {record['rays']:,} rays that start on them"
    quantities = [
        ("rays that wrongly stop or pass at their start", "at_once", _REASON),
        ("rays without leaving that wrongly stop or pass", "unnamed", _REASON),
        ("rays that escape from inside", "lost", "a closed body has no holes"),
        ("wrong hits from surfaces in the exact sample", "sample", _REASON),
    ]
    return [Gate("hits", subject, name, float(record[key]), "at most", 0.0, why) for name, key, why in quantities]


def check_body(body: Body, effort: StartEffort, rng: Generator, make: Callable[..., Any] = Octree) -> Wrong:
    """Ask one body in all ways to start."""
    tracer, surface = make(body.mesh.vertices, body.mesh.faces), Surface(body.mesh.vertices, body.mesh.faces)
    total = Wrong(0, 0, 0, 0, 0, 0)
    batches = list(_batches(body, tracer, surface, effort.rays, rng))
    for batch in batches:
        found = judge(body, surface, batch, -(-effort.exact // len(batches)), rng)
        total = Wrong(*(a + b for a, b in zip(total, found, strict=True)))
    return total


# ------------------------------------------------------------------------------------------------------- the rays


def _batches(body: Body, tracer: Any, surface: Surface, rays: int, rng: Generator) -> Iterator[Batch]:
    """Rays that leave faces named with a side and without, nothing named, hits, and hits that they went through."""
    each = -(-rays // 6)
    # Many rays share a start, whose faces exact arithmetic finds.
    count = max(4, each // 60)
    origins, faces = _origins(body, count, rng)
    starts = [surface.start_near(face, origin) for face, origin in zip(faces.tolist(), origins, strict=True)]
    for side in (-1, 1, 0):
        which = np.arange(each) % count
        directions = _directions(body, faces[which], origins[which], rng)
        hits = tracer.closest_hit(origins[which], directions, leaving=faces[which], side=np.full(each, side))
        yield Batch(starts, which, directions, np.full(each, side), False, hits.t, hits.face)

    # Nothing is named: where vertices are.
    corners = body.mesh.vertices[body.mesh.faces[faces, 0]]
    directions = _directions(body, faces, corners, rng)
    hits = tracer.closest_hit(corners, directions)
    free = [Start(tuple(map(Fraction, corner))) for corner in corners.tolist()]  # type: ignore[arg-type]
    yield Batch(free, np.arange(count), directions, np.zeros(count, np.int64), False, hits.t, hits.face)

    # Hits of rays that are aimed at the starts, from without and within.
    targets = origins[np.arange(each) // 30 % count]
    centre, size = body.mesh.vertices.mean(axis=0), np.ptp(body.mesh.vertices, axis=0).max()
    froms = centre + size * rng.normal(size=(count, 3)) * rng.choice([0.05, 2.0], (count, 1))
    froms = froms[np.arange(each) // 30 % count]
    met = tracer.closest_hit(froms, targets - froms).hit
    if not met.any():
        return
    first = tracer.closest_hit(froms[met], (targets - froms)[met])
    rows = np.stack([first.face, first.u.view(np.int64), first.v.view(np.int64)], axis=1)
    _, one, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    starts = [surface.start_on(int(first.face[k]), first.u[k], first.v[k]) for k in one]
    directions = _directions(body, first.face, first.points, rng)
    for leaving, through in ((first, False), (first.through(), True)):
        hits = tracer.closest_hit(first.points, directions, leaving=leaving)
        sides = np.asarray(leaving.side, np.int64)
        yield Batch(starts, which.ravel(), directions, sides, through, hits.t, hits.face)


def _origins(body: Body, count: int, rng: Generator) -> tuple[Floats, Ints]:
    """Points and the faces that they leave: at corners, on edges, in faces, and 1e-16 to 1e-6 beside the first two."""
    faces = rng.integers(0, len(body.mesh.faces), count)
    corners = body.mesh.vertices[body.mesh.faces[faces]]
    weights = rng.dirichlet([1.0, 1.0, 1.0], count)
    kind = np.arange(count) % 5
    at_corner, at_edge = np.isin(kind, (0, 3)), np.isin(kind, (1, 4))
    weights[at_edge, rng.integers(0, 3, at_edge.sum())] = 0.0
    weights[at_edge] /= weights[at_edge].sum(axis=1, keepdims=True)
    weights[at_corner] = np.eye(3)[rng.integers(0, 3, at_corner.sum())]
    points = np.einsum("nk,nkx->nx", weights, corners)
    beside = 10.0 ** rng.uniform(-16, -6, (count, 1)) * np.ptp(corners, axis=1).max(axis=1)[:, None]
    points += np.where(kind[:, None] > 2, beside * rng.normal(size=(count, 3)), 0.0)
    return points, faces


def _directions(body: Body, faces: Ints, origins: Floats, rng: Generator) -> Floats:
    """All around, along faces and along edges to rounding, at corners, and of small whole numbers."""
    count = len(faces)
    corners = body.mesh.vertices[body.mesh.faces[faces]]
    size = np.ptp(body.mesh.vertices, axis=0).max()
    sides = corners[:, 1:] - corners[:, :1]
    ways = [
        rng.normal(size=(count, 3)),
        rng.normal(size=(count, 3)),
        np.einsum("nk,nkx->nx", rng.normal(size=(count, 2)), sides) / size,
        np.where(rng.random((count, 1)) < 0.5, 1.0, -1.0) * sides[np.arange(count), rng.integers(0, 2, count)],
        body.mesh.vertices[body.mesh.faces[rng.integers(0, len(body.mesh.faces), count), 0]] - origins,
        rng.integers(-2, 3, (count, 3)).astype(np.float64),
    ]
    found: Floats = np.stack(ways)[rng.integers(0, len(ways), count), np.arange(count)]
    found[~found.any(axis=1)] = (0.25, 0.5, -1.0)
    return found


# ---------------------------------------------------------------------------------------------------- the verdicts


def judge(body: Body, surface: Surface, batch: Batch, exact: int, rng: Generator) -> Wrong:
    """Count the rays of a batch that are wrong; ``exact`` of those that go on are judged to their end."""
    at_once, goes_on = judged_at_once(surface, batch)
    inside = (batch.sides < 0) & body.closed
    lost = goes_on & inside & (batch.face < 0)
    sample = np.flatnonzero(goes_on)
    sample = rng.permutation(sample)[:exact]
    starts = [batch.starts[k] for k in batch.which[sample]]
    firsts = surface.each(starts, batch.directions[sample], batch.sides[sample].tolist(), [batch.through] * len(sample))
    wrong = [
        not is_right(surface, start, batch.directions[row], (batch.t[row], int(batch.face[row])), found)
        for row, start, found in zip(sample.tolist(), starts, firsts, strict=True)
    ]
    named = batch.starts[0].face >= 0
    stopped_wrong = int(at_once.sum()) * named, int(at_once.sum()) * (not named)
    return Wrong(len(batch.t), len(sample), *stopped_wrong, int(lost.sum()), sum(wrong))


def judged_at_once(surface: Surface, batch: Batch) -> tuple[Bools, Bools]:
    """Masks of rays stopped, or not, at t = 0 against the law, or by another face; and of rays that should go on."""
    wrong, goes_on = np.zeros((2, len(batch.t)), np.bool_)
    order = np.argsort(batch.which, kind="stable")
    ends = np.searchsorted(batch.which[order], np.arange(len(batch.starts) + 1))
    beside = [_is_beside_another(surface, start) for start in batch.starts]
    for number, start in enumerate(batch.starts):
        rows = order[ends[number] : ends[number + 1]]
        if not len(rows) or _is_beside_an_edge(surface, start) or beside[number]:
            continue
        held = surface.holding(start.place)
        regions = surface.regions(held)
        normals = [cone.normal for cone in regions.cones.values()]
        at = np.isin(batch.face[rows], [face for face, _ in held])
        signs = exact_signs(normals, batch.directions[rows])
        # Rays of equal signs and side are stopped alike.
        keys = np.concatenate([signs, batch.sides[rows, None]], axis=1)
        _, one, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        for k, row in enumerate(rows[one]):
            some, way = group.ravel() == k, whole_vector(batch.directions[row])
            stops = _stops(surface, regions, start, (way, int(batch.sides[row]), batch.through))
            t, face, here = batch.t[rows[some]], batch.face[rows[some]], at[some]
            stopped_right = (t == 0.0) & np.isin(face, [stop for stop in stops if stop is not None])
            right = stopped_right | ((None in stops) & ~here & (t > 0.0))
            wrong[rows[some]] = ~right if not right.all() and not _runs_along(regions, way) else False
            goes_on[rows[some]] = (None in stops) & ~stopped_right
    return wrong, goes_on


def _runs_along(regions: Any, way: tuple[int, int, int]) -> bool:
    """Whether a direction is along an edge at the start, but for what is beyond the pairs of float64 that decide."""
    borders = [side for cone in regions.cones.values() for side in (cone.first, cone.last) if side is not None]
    size = max(map(abs, way))
    return any(max(map(abs, cross(side, way))) <= _CLOSEST * size * max(map(abs, side)) for side in borders)


def _is_beside_an_edge(surface: Surface, start: Start) -> bool:
    """Whether a start is in its face, and so near to an edge that pairs of float64 put it on that."""
    if start.face < 0:
        return False
    corners = rational(surface.corners(start.face))
    normal = cross(difference(corners[1], corners[0]), difference(corners[2], corners[0]))
    for k in range(3):
        along = difference(corners[(k + 1) % 3], corners[k])
        if 0 < dot(normal, cross(along, difference(start.place, corners[k]))) <= _CLOSEST * dot(normal, normal):
            return True
    return False


def _is_beside_another(surface: Surface, start: Start) -> bool:
    """Whether a start inside its face, far from its edges, is as near to an edge of another as the ray may be moved."""
    if start.face < 0:
        return False
    place, size = np.array([float(x) for x in start.place]), surface.size(start.face)
    if _from_edges(np.array([surface.corners(start.face)]), place).min() <= _EXACTLY * size:
        return False
    return bool(_from_edges(surface.triangles, place).min() <= _MOVE * size)


def _from_edges(triangles: Floats, place: Floats) -> Floats:
    """Distances (n, 3) of a place from the edges of triangles (n, 3, 3)."""
    along, way = np.roll(triangles, -1, axis=1) - triangles, place - triangles
    share = np.einsum("nex,nex->ne", along, way) / np.maximum(np.einsum("nex,nex->ne", along, along), 2.0**-1000)
    distances: Floats = np.linalg.norm(way - np.clip(share, 0.0, 1.0)[..., None] * along, axis=2)
    return distances


def _stops(surface: Surface, regions: Any, start: Start, ray: tuple[Any, int, bool]) -> set[int | None]:
    way, side, through = ray
    if start.face < 0:
        crossed = [face for face, cone in regions.cones.items() if cone.side(way)]
        return {min(crossed)} if crossed else {None}
    return stopped(regions, start.face, way, side, through) if side else {None}


def exact_signs(normals: Sequence[tuple[int, int, int]], directions: Floats) -> NDArray[np.int8]:
    """The sign of each direction (n, 3) on each of k whole normals, (n, k); float64 decides where rounding cannot."""
    rounded = np.array([[float(x) for x in normal] for normal in normals]).reshape(-1, 3)
    products = directions @ rounded.T
    sizes = np.abs(directions) @ np.abs(rounded).T
    signs = np.sign(products).astype(np.int8)
    for ray, k in zip(*np.nonzero(~(np.abs(products) > _SIGN_ROUNDINGS * sizes + 2.0**-1000)), strict=True):
        value = dot(normals[k], whole_vector(directions[ray]))
        signs[ray, k] = (value > 0) - (value < 0)
    return signs


def is_right(
    surface: Surface, start: Start, direction: Floats, answer: tuple[float, int], law: Sequence[First]
) -> bool:
    """Whether an answer, t and face, is one of the law's; or a neighbour's at the same t, past an edge by rounding."""
    t, face = answer
    for first in law:
        if first.t is None or face < 0:
            if first.t is None and face < 0:
                return True
            continue
        if first.t == 0:
            if t == 0.0 and face in first.faces[:1]:
                return True
            continue
        held = {number for number, _ in surface.holding(start.place)} if start.face >= 0 else set()
        possible = face in first.faces or face in surface.possible([start.place], direction[None])[0]
        reach = max(_reach(surface, first, direction, number) for number in (first.face, face))
        if face not in held and possible and abs(t - float(first.t)) <= reach:
            return True
    faces = {face, *(first.face for first in law)} - {-1}
    ends = [t, *(float(first.t) for first in law if first.t is not None)]
    size = min(surface.size(number) for number in faces | ({start.face} - {-1}))
    near = min(ends) * float(np.abs(direction).max()) <= _NEAR * size
    return any(_is_closer(surface, number, start, direction, near) for number in faces)


def _is_closer(surface: Surface, face: int, start: Start, direction: Floats, near: bool) -> bool:
    """Whether a ray passes an edge of a face closer than ours tells, near its start or farther off."""
    corners = [[Fraction(x) - y for x, y in zip(p, start.place, strict=True)] for p in surface.corners(face)]
    way = [Fraction(x) for x in direction.tolist()]
    for k in range(3):
        one, other = corners[k], corners[(k + 1) % 3]
        size = max(map(abs, one)) * max(map(abs, other)) * _CLOSEST
        if not near:
            size = max(map(abs, difference(other, one))) * Fraction(_ABSOLUTE * surface.largest)
        if abs(dot(way, cross(one, other))) <= max(map(abs, way)) * size:
            return True
    return False


def _reach(surface: Surface, first: First, direction: Floats, face: int) -> float:
    """The largest error of t that is right, by the slope of a face."""
    normal = np.array([float(x) for x in surface.normal(face)])
    along = abs(float(normal @ direction)) / float(np.abs(normal).max())
    return _RELATIVE * float(first.t or 0) + (_ABSOLUTE * surface.largest / along if along else np.inf)
