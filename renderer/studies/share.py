"""Shared by all studies: checked arguments, tiles on threads, and results."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument, real_argument
from renderer.arguments.limits import LONGEST, SHORTEST
from renderer.arguments.points import check_points, farthest_of
from renderer.arguments.types import ArrayLike
from renderer.distance.on_surface import check_on, on_surface
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.ordering.morton import order_along_curve
from renderer.queryable import Built, Queries
from renderer.rayscene.built import BuiltScene
from renderer.rayscene.queries import SceneQueries
from renderer.rayscene.scene import RayScene
from renderer.studies.density import are_dense
from renderer.studies.sweep import TILE, Answers, Places, Sky, make_sweep_scratch, sweep
from renderer.studies.through import PaneArrays, make_through_scratch, sweep_through, with_more_room
from renderer.studies.translucent import divided
from renderer.system.terminal import progress_bar
from renderer.system.threads import checked_threads, for_chunks
from renderer.trace.batch import check_faces

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
# Looks from the points in some rows, with the steps of the curve to them, and yields where it can be stopped.
Look = Callable[[Integers, Integers], Iterator[None]]

# Rays that are written down together: a tenth of a second of tracing, some dozens of megabytes.
ROWS = 1 << 18
# Points that are sorted together: 16 bytes each, and a second of work.
_BLOCK = 1 << 22
# The points of a chunk: at most, and at least if there are enough for all threads.
_MOST, _LEAST = 64 * TILE, 16
# The bits of a chunk behind which translucent faces are looked through: 8 MB for each thread.
_BITS = 1 << 26


class Panes(NamedTuple):
    """The translucent faces of a study: their mesh and tree, what each lets through, and the face of them that each
    point lies on, (n,) int64, -1 for none.
    """

    built: Built
    shares: Floats
    leaving: Integers


class StudyRequest(NamedTuple):
    """A study's scene, its points (n, 3), their shape as given, its threads and progress, and its transmittances."""

    octree: Queries
    places: Places
    shape: tuple[int, ...]
    threads: int
    progress: bool
    panes: Panes | None = None


class Snapshot(SceneQueries):
    """A scene at one moment: all rays of a study see the same, whatever moves meanwhile."""

    def __init__(self, scene: RayScene) -> None:
        self.threads, self._at = scene.threads, scene._built

    @property
    def _built(self) -> BuiltScene:
        return self._at


def snapshot_of(octree: Queries | RayScene) -> Queries | Snapshot:
    """The object that traces the rays of a study. Raises ``ValueError`` for one that takes no queries."""
    good = isinstance(octree, Queries | RayScene)
    expect(good, "octree", "an Octree, a BruteForce or a RayScene", type(octree).__name__)
    return Snapshot(octree) if isinstance(octree, RayScene) else octree


def octree_of(octree: Queries | RayScene) -> Queries:
    """The octree of a study, which for a scene is that of its merged mesh. Raises as ``snapshot_of``."""
    found = snapshot_of(octree)
    return found if isinstance(found, Queries) else found._built.merged


def check_request(
    octree: Queries | RayScene,
    points: ArrayLike,
    normals: ArrayLike | None,
    leaving: ArrayLike | None,
    threads: int | None,
    progress: bool,
    transmittance: ArrayLike | None = None,
) -> StudyRequest:
    """Check the arguments that all studies have."""
    octree = octree_of(octree)
    rows, shape = check_points("points", points, farthest_of(octree.tree.scale))
    faces = check_faces("leaving", -1 if leaving is None else leaving, shape, len(octree.mesh.faces))
    check_on(octree.mesh, "points", rows, faces)
    workers = octree.threads if threads is None else checked_threads(threads)
    places = Places(rows, _check_normals(normals, shape), faces, np.empty(0, np.int64), np.empty((0, 3)))
    request = StudyRequest(octree, places, shape, workers, flag_argument("progress", progress))
    return request if transmittance is None else _through(request, transmittance)


def _through(request: StudyRequest, transmittance: ArrayLike) -> StudyRequest:
    """The request for a mesh whose faces let a share of the light through."""
    division, faces = divided(request.octree, transmittance), request.places.leaving
    places = request.places._replace(leaving=division.in_opaque[faces])
    panes = None
    if division.panes is not None:
        panes = Panes(division.panes._built, division.shares, division.in_panes[faces])
    return request._replace(octree=division.opaque, places=places, panes=panes)


def _check_normals(normals: ArrayLike | None, shape: tuple[int, ...]) -> Floats:
    """One normal a point, or one for all; none for None."""
    if normals is None:
        return np.empty((0, 3))
    given, own = check_points("normals", normals)
    fits = own in (shape, ())
    expect(fits, "normals", f"shape {(*shape, 3)} as points have, or (3,)", f"shape {(*own, 3)}")
    bad = ~given.any(axis=1)
    if bad.any():
        expect(False, "normals", "vectors that are not zero", f"{given[bad][0].tolist()} in row {int(bad.argmax())}")
    return given


def check_directions(argument: str, directions: ArrayLike) -> Floats:
    """Directions (k, 3), k >= 1, in the range of those of rays. Raises ``ValueError`` naming argument and row."""
    rows, shape = check_points(argument, directions)
    expect(len(shape) == 1 and len(rows) > 0, argument, "shape (k, 3), k >= 1", f"shape {(*shape, 3)}")
    largest = np.abs(rows).max(axis=1)
    bad = ~((largest >= SHORTEST) & (largest <= LONGEST))
    if bad.any():
        row = int(bad.argmax())
        expected = f"finite, non-zero vectors, the largest component from {SHORTEST:.3g} to {LONGEST:.3g}"
        expect(False, argument, expected, f"{rows[row].tolist()} in row {row}")
    return rows


def check_weights(argument: str, weights: ArrayLike | None, count: int) -> Floats:
    """Weights (k,) >= 0 and finite, one a direction; ones for None. Raises ``ValueError`` naming argument and row."""
    if weights is None:
        return np.ones(count)
    given = real_argument(argument, weights)
    expect(given.shape == (count,), argument, f"shape ({count},), one a direction", f"shape {given.shape}")
    rows: Floats = np.array(given, np.float64)
    bad = ~((rows >= 0.0) & (rows < np.inf))
    if bad.any():
        row = int(bad.argmax())
        expect(False, argument, "finite numbers >= 0", f"{rows[row]} in row {row}")
    return rows


def lengths_of(directions: Floats) -> Floats:
    """The lengths of vectors (k, 3), without overflow."""
    largest = np.abs(directions).max(axis=1, keepdims=True)
    return largest[:, 0] * np.sqrt(((directions / largest) ** 2).sum(axis=1))


def check_reach(max_distance: float, distance: float | None) -> float:
    """The farthest distance that counts; ``distance`` is the former name of the argument."""
    name, value = ("max_distance", max_distance) if distance is None else ("distance", distance)
    one = distance is None or (np.ndim(max_distance) == 0 and max_distance == np.inf)
    expect(one, "distance", "max_distance alone, which is its name now", "both")
    given = real_argument(name, value)
    expect(given.ndim == 0 and bool(given >= 0.0), name, "a number >= 0", repr(value))
    return float(given)


def limits_of(distance: float, directions: Floats) -> Floats:
    """The t at which rays in these directions have gone ``distance``."""
    return distance / lengths_of(directions)


def evaluate(request: StudyRequest, sky: Sky, *, hidden: bool, share: bool) -> Floats:
    """The sums over the hidden or open directions of each point, or their shares; see ``Answers``."""
    sums = np.empty(len(request.places.points))
    run(request, sky, Answers(sums, np.empty((0, 1), np.uint8), hidden, share))
    return sums.reshape(request.shape)


def evaluate_bits(request: StudyRequest, sky: Sky) -> NDArray[np.uint8]:
    """For each point a set bit for each hidden direction."""
    width = -(-len(sky.directions) // 8)
    bits = np.zeros((len(request.places.points), width), np.uint8)
    run(request, sky, Answers(np.empty(0), bits, True, False))
    return bits.reshape(*request.shape, width)


def run(request: StudyRequest, sky: Sky, answers: Answers) -> None:
    """Trace all points in all directions on threads, in the order of a curve, and write to ``answers``."""
    if request.panes is not None:
        _run_through(request, request.panes, sky, answers)
        return
    # Once, as a refit on another thread changes it.
    built = request.octree._built
    places = _placed(built, request.places, request.threads)

    def look(rows: Integers, steps: Integers) -> Iterator[None]:
        return _sweep_all(built, places, sky, answers, rows, steps)

    _run_in_order(request, built.mesh, look, _MOST)


def _run_through(request: StudyRequest, panes: Panes, sky: Sky, answers: Answers) -> None:
    """``run`` through translucent faces: opaque faces hide, and the other rays keep a share."""
    built = request.octree._built
    before = _placed(built, request.places, request.threads)
    through = _placed(panes.built, request.places._replace(leaving=panes.leaving), request.threads)
    width = -(-len(sky.directions) // 8)

    def look(rows: Integers, steps: Integers) -> Iterator[None]:
        bits, own = np.zeros((len(rows), width), np.uint8), np.arange(len(rows))
        hidden = Answers(np.empty(0), bits, True, False)
        yield from _sweep_all(built, _places_of(before, rows), sky, hidden, own, steps)
        sums = answers._replace(sums=np.empty(len(rows)))
        yield from _sweep_all_through(panes, _places_of(through, rows), sky, bits, sums)
        answers.sums[rows] = sums.sums

    _run_in_order(request, built.mesh, look, max(1, min(_MOST, _BITS // (8 * width))))


def _placed(built: Built, places: Places, threads: int) -> Places:
    """Places with those of their points that are on the surface of a mesh."""
    mesh, tree = built
    faces, codes, anchors = on_surface(tree, mesh, places.points, places.leaving, threads)
    return places._replace(leaving=faces, codes=codes, anchors=anchors)


def _places_of(places: Places, rows: Integers) -> Places:
    """The places of the points in some rows."""
    points, normals, leaving, codes, anchors = places
    own = normals[rows] if len(normals) > 1 else normals
    return Places(points[rows], own, leaving[rows], codes[rows], anchors[rows])


def _sweep_all(
    built: Built, places: Places, sky: Sky, answers: Answers, rows: Integers, steps: Integers
) -> Iterator[None]:
    """``sweep`` from the points in some rows."""
    mesh, tree = built
    first, k, scratch = 0, 0, make_sweep_scratch(tree.depth)
    while first < len(rows):
        first, k = sweep(
            tree.descriptor, mesh.vertices, mesh.faces, places, sky, answers, rows, steps, first, k, scratch
        )
        yield


def _sweep_all_through(
    panes: Panes, places: Places, sky: Sky, bits: NDArray[np.uint8], answers: Answers
) -> Iterator[None]:
    """``sweep_through`` from all points of ``places``."""
    mesh, tree = panes.built
    arrays = PaneArrays(tree.descriptor, mesh.vertices, mesh.faces, panes.shares)
    rows, scratch = np.arange(len(places.points)), make_through_scratch(tree.depth)
    first, k = 0, 0
    while first < len(rows):
        first, k, is_full = sweep_through(arrays, places, sky, bits, answers, rows, first, k, scratch)
        if is_full:
            scratch = with_more_room(scratch)
        yield


def _run_in_order(request: StudyRequest, mesh: Mesh, look: Look, most: int) -> None:
    """Let all points look, in the order of a curve, in chunks of at most ``most`` on threads."""
    points, count = request.places.points, len(request.places.points)
    with progress_bar(count, "point", request.progress) as update:
        for first in range(0, count, _BLOCK):
            block = points[first : first + _BLOCK]
            order, steps = order_along_curve(block)
            order = first + order
            # With few points the shared walk of a tile costs more than it saves.
            steps = steps if are_dense(block, mesh) else steps[:0]

            def look_at(begin: int, end: int, way: tuple[Integers, Integers] = (order, steps)) -> Iterator[None]:
                return look(way[0][begin:end], way[1][begin:end])

            size = min(most, max(_LEAST, len(order) // (16 * request.threads)))
            for_chunks(look_at, len(order), size, request.threads, update)
