"""Leak test: a sweep over closed meshes, placements, sizes and tree builds in which every ray must hit.

From points inside a closed mesh every ray hits, so each miss is a leak, and no reference's arithmetic is needed. The
rays are aimed in float64 at points of edges and at vertices, where neighbours must agree to the last bit.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any, NamedTuple, get_args

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.arguments.split import Split
from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere, torus
from renderer.octree import Octree
from renderer.rayscene.scene import RayScene
from validation.gates import Gate
from validation.hits.rays import RayFamily, float32_exact
from validation.meshes import AWAY, TURN, hilly, integer_box
from validation.references.embree import Embree
from validation.scenes import SCENES

Floats = NDArray[np.float64]

SEED = 2027
OFFSETS = (0.0, 1e2, 1e4, 1e6)
SCALES = (1e-6, 1.0, 1e6)
# Weight of placements whose float32 boxes cannot separate the faces: each ray meets all faces, and fewer rays take as
# long.
CROWDED = 0.1
KINDS = ("edge", "vertex")


class ClosedMesh(NamedTuple):
    """A closed mesh, and a function of a generator and n that gives points (n, 3) inside it."""

    name: str
    mesh: Mesh
    inside: Callable[[Generator, int], Floats]


class BuildOptions(NamedTuple):
    """Options of ``Octree``."""

    split: Split
    leaf_size: int
    max_depth: int


SPLITS: tuple[Split, ...] = get_args(Split)
BUILDS = tuple(BuildOptions(*options) for options in product(SPLITS, (1, 4, 32), (1, 8, 32)))


@dataclass(frozen=True)
class LeakEffort:
    """Total rays of each kind, number of ``BUILDS`` for each placement, and rays of each kind for Embree."""

    rays: int
    builds: int
    embree: int


class LeakCount(NamedTuple):
    """Leak count for one (kernel, mesh, ray kind, placement, build); the build's options are of our kernel alone."""

    kernel: str
    mesh: str
    kind: str
    offset: float
    scale: float
    split: str
    leaf_size: int
    max_depth: int
    rays: int
    leaks: int


QUICK = LeakEffort(rays=100_000, builds=1, embree=500)
FULL = LeakEffort(rays=1_000_000, builds=3, embree=5_000)


@dataclass(frozen=True)
class Placement:
    """A closed mesh, possibly rotated, then scaled, then moved; ``place`` transforms any point alike."""

    closed: ClosedMesh
    turned: bool
    offset: float
    scale: float

    def place(self, points: Floats) -> Floats:
        """Transform points (n, 3) of the mesh's own frame into this placement."""
        return self._turn(points) * self.scale + self.offset * AWAY

    def vertices(self) -> Floats:
        """The placed vertices, rounded to float64; with the same faces the mesh is still closed."""
        return self.place(self.closed.mesh.vertices)

    def rays(self, kind: str, count: int, rng: Generator) -> RayFamily:
        """``count`` rays from inside, aimed at the placed vertices or at the edges between them."""
        return aimed(kind, self.vertices(), self.closed.mesh.faces, self.place(self.closed.inside(rng, count)), rng)

    def keeps_sides(self, vertices: Floats) -> bool:
        """Whether the rounded ``vertices`` leave every face an area, with its orientation unchanged."""
        before = _area_vectors(self._turn(self.closed.mesh.vertices), self.closed.mesh.faces)
        after = _area_vectors(vertices, self.closed.mesh.faces)
        return bool(((before * after).sum(axis=1) > 0).all())

    @property
    def weight(self) -> float:
        """Weight in the share of rays: ``CROWDED`` where float32's ulp is as large as the mesh."""
        return CROWDED if self.scale <= self.offset * 2.0**-23 else 1.0

    def record(self) -> dict[str, object]:
        """The placement, for JSON."""
        return {"mesh": self.closed.name, "turned": self.turned, "offset": self.offset, "scale": self.scale}

    def _turn(self, points: Floats) -> Floats:
        return points @ TURN.T if self.turned else points


def aimed(kind: str, vertices: Floats, faces: NDArray[np.int32], origins: Floats, rng: Generator) -> RayFamily:
    """One ray from each of ``origins`` (n, 3) at a random vertex, or at a random point of a random edge.

    Subtract the origin from the corners before a point between them is taken: far from zero that keeps the ray within
    rounding of the edge as the kernel sees it; a rounded point would lie at a distance from the edge.
    """
    count = len(origins)
    corners = vertices[faces[rng.integers(0, len(faces), count)]] - origins[:, None]
    first = rng.integers(0, 3, count)
    start, end = corners[np.arange(count), first], corners[np.arange(count), (first + 1) % 3]
    if kind == "vertex":
        return RayFamily(kind, origins, start)
    along = rng.random((count, 1))
    return RayFamily(kind, origins, (1 - along) * start + along * end)


def leaks(tracer: Octree | RayScene, rays: RayFamily) -> int:
    """Number of rays that closest hit or any hit misses."""
    missed = ~tracer.closest_hit(rays.origins, rays.directions).hit
    missed |= ~tracer.any_hit(rays.origins, rays.directions)
    return int(np.count_nonzero(missed))


def embree_leaks(embree: Embree, rays: RayFamily) -> int:
    """Number of rays that Embree's closest hit misses."""
    return int(np.count_nonzero(embree.closest_hit(rays.origins, rays.directions)[1] < 0))


@cache
def closed_meshes() -> tuple[ClosedMesh, ...]:
    """The closed meshes: convex and not, a knot, and a box of which every number is an integer."""
    balls = (ClosedMesh(f"icosphere {level}", icosphere(level), _cube(0.0, 0.4)) for level in (3, 4, 5, 6))
    ring = torus(1.0, 0.4, 100, 40)
    knot = load_mesh(SCENES / "models" / "torus_knot.ply")
    # Its vertices are ordered by cross-section, 50 each: the mean of a section is in the middle of the tube.
    core = knot.vertices.reshape(-1, 50, 3).mean(axis=1)
    return (
        *balls,
        ClosedMesh("integer box", integer_box(), _cube(4.0, 3.0)),
        ClosedMesh("torus", ring, _in_ring),
        ClosedMesh("hilly sphere", hilly(4), _cube(0.0, 0.2)),
        ClosedMesh("torus knot", knot, lambda rng, count: core[rng.integers(0, len(core), count)]),
    )


def placements(closed: ClosedMesh) -> Iterator[Placement]:
    """All placements of one closed mesh."""
    for turned, offset, scale in product((False, True), OFFSETS, SCALES):
        yield Placement(closed, turned, offset, scale)


class MeshLeaks(NamedTuple):
    """All leaks of one mesh, and the placements that were left out."""

    counts: list[LeakCount]
    left_out: list[dict[str, object]]


def sweep(index: int, quick: bool) -> MeshLeaks:
    """Shoot at one of ``closed_meshes()`` in all placements."""
    effort, found = QUICK if quick else FULL, MeshLeaks([], [])
    meshes = closed_meshes()
    share = effort.rays / effort.builds / sum(p.weight for closed in meshes for p in placements(closed))
    for place, placement in enumerate(placements(meshes[index])):
        if not placement.keeps_sides(placement.vertices()):
            found.left_out.append(placement.record())
            continue
        # Seeded by placement, so that leaving one out changes no other.
        rng = np.random.default_rng([SEED, index, place])
        found.counts.extend(shoot(placement, builds(place, effort.builds), share, rng))
        # For information only: a quick run asks it in every other placement.
        if not (quick and place % 2):
            found.counts.extend(shoot_embree(placement, effort.embree, rng))
    return found


def summary(meshes: Sequence[MeshLeaks]) -> tuple[dict[str, object], list[Gate]]:
    """The sweeps of all meshes: a record for JSON and a gate for each mesh and kind of ray."""
    counts = [count for mesh in meshes for count in mesh.counts]
    record = {
        "meshes": sums(counts, "mesh", "kind"),
        "places": sums(counts, "offset", "scale"),
        "builds": sums([c for c in counts if c.kernel == "ours"], "split", "leaf_size", "max_depth"),
        "left_out": [placement for mesh in meshes for placement in mesh.left_out],
        "seed": SEED,
    }
    return record, gates(counts)


def gates(counts: Sequence[LeakCount]) -> list[Gate]:
    """Gates on our leaks, one for each mesh and kind of ray; none is allowed."""
    reason = "a closed mesh has no holes, wherever it lies and however its tree is built"
    found = []
    for row in sums([c for c in counts if c.kernel == "ours"], "mesh", "kind"):
        subject = f"{row['mesh']}, {row['ours_rays']:,} {row['kind']} rays from inside, all places and builds"
        found.append(Gate("stability", subject, "leaks", row["ours"], "at most", 0.0, reason))
    return found


def sums(counts: Sequence[LeakCount], *keys: str) -> list[dict[str, Any]]:
    """Rays and leaks of each kernel in ``counts``, one row for each combination of ``keys`` that occurs.

    Leaks are None where a kernel got no rays.
    """
    kernels = sorted({c.kernel for c in counts}, reverse=True)
    rows: dict[tuple[object, ...], Counter[str]] = {}
    leaked: dict[tuple[object, ...], Counter[str]] = {}
    for c in counts:
        row = tuple(getattr(c, key) for key in keys)
        rows.setdefault(row, Counter())[c.kernel] += c.rays
        leaked.setdefault(row, Counter())[c.kernel] += c.leaks
    found = []
    for row, rays in rows.items():
        columns = {f"{k}_rays": rays[k] for k in kernels} | {k: leaked[row][k] if rays[k] else None for k in kernels}
        found.append(dict(zip(keys, row, strict=True)) | columns)
    return found


def builds(place: int, count: int) -> list[BuildOptions]:
    """``count`` builds for a mesh's placement: with 1 each mesh gets all of them, with 3 at least three times."""
    # The two orientations are half the placements apart, and must take builds of different parity.
    first = place - place // (len(OFFSETS) * len(SCALES))
    return [BUILDS[(first + 2 * i) % len(BUILDS)] for i in range(count)]


def shoot(placement: Placement, built: Sequence[BuildOptions], share: float, rng: Generator) -> Iterator[LeakCount]:
    """Trace our rays in one placement: ``share`` times its weight of each kind through each of the trees ``built``."""
    vertices = placement.vertices()
    count = math.ceil(share * placement.weight)
    for build in built:
        octree = Octree(vertices, placement.closed.mesh.faces, **build._asdict())
        for kind in KINDS:
            lost = leaks(octree, placement.rays(kind, count, rng))
            yield LeakCount("ours", placement.closed.name, kind, placement.offset, placement.scale, *build, count, lost)


def shoot_embree(placement: Placement, count: int, rng: Generator) -> Iterator[LeakCount]:
    """The same by Embree, for information, on float32 vertices and origins, if no face flips in float32."""
    vertices, faces = float32_exact(placement.vertices()), placement.closed.mesh.faces
    if not placement.keeps_sides(vertices):
        return
    embree = {mode: Embree(vertices, faces, robust=mode == "robust") for mode in ("robust", "default")}
    for kind in KINDS:
        origins = float32_exact(placement.place(placement.closed.inside(rng, count)))
        rays = aimed(kind, vertices, faces, origins, rng)
        for mode, scene in embree.items():
            lost = embree_leaks(scene, rays)
            where = placement.closed.name, kind, placement.offset, placement.scale
            yield LeakCount(f"embree_{mode}", *where, "", 0, 0, count, lost)


def _area_vectors(vertices: Floats, faces: NDArray[np.int32]) -> Floats:
    corners = vertices[faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _cube(centre: float, half: float) -> Callable[[Generator, int], Floats]:
    return lambda rng, count: centre + rng.uniform(-half, half, (count, 3))


def _in_ring(rng: Generator, count: int) -> Floats:
    """Points near the circle of radius 1 about the y axis, in the tube of ``torus(1, 0.4)``."""
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    ring = np.stack([np.cos(angle), np.zeros(count), np.sin(angle)], axis=1)
    return ring + rng.uniform(-0.1, 0.1, (count, 3))
