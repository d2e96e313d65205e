"""Error of hit distances against offset, scale, grazing angle and sliver height, judged by exact arithmetic.

Three kernels trace the same rays: ours in float64, and Embree's default and robust modes, whose input is rounded to
float32, as for all their users. Each error is against the exact hit of the float64 input.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.octree import Octree
from validation.gates import Gate
from validation.hits import watertight
from validation.hits.compare import HitArrays
from validation.hits.rays import RayFamily
from validation.meshes import AWAY
from validation.oracle import exact
from validation.oracle.distance import way_from
from validation.oracle.exact import ExactHit
from validation.oracle.rounding import t_bounds
from validation.references.embree import Embree

Floats = NDArray[np.float64]

SEED = 2028
KERNELS = ("ours", "embree_default", "embree_robust")
# Number of random rotations of the triangle in a grazing or sliver sample; they share the rays of a point.
_TURNS = 10


@dataclass(frozen=True)
class Sample:
    """A mesh and the rays to trace."""

    vertices: Floats
    faces: NDArray[np.int32]
    rays: RayFamily


@dataclass(frozen=True)
class Sweep:
    """One curve: the meaning of x, its values, and the function that makes the samples of so many rays at one x."""

    name: str
    label: str
    xs: tuple[float, ...]
    samples: Callable[[float, int, Generator], list[Sample]]


@dataclass(frozen=True)
class SweepEffort:
    """Rays at each x, and leak rays of each kind and mesh."""

    rays: int
    leaks: int


QUICK = SweepEffort(rays=60, leaks=20_000)
FULL = SweepEffort(rays=200, leaks=100_000)


def curve(index: int, quick: bool) -> tuple[dict[str, object], list[Gate]]:
    """Measure one of SWEEPS; returns its record for JSON and two gates, on ours alone."""
    sweep, rays = SWEEPS[index], _effort(quick).rays
    seeded = ((x, np.random.default_rng([SEED, index, i])) for i, x in enumerate(sweep.xs))
    points = [point(sweep, x, rays, rng) for x, rng in seeded]
    return {"label": sweep.label, "points": [p.record() for p in points]}, judge(sweep.name, points)


def leak_rows(quick: bool) -> list[dict[str, object]]:
    """Leaks of spheres of four sizes, by kernel."""
    return [leak_row(level, _effort(quick).leaks) for level in (3, 4, 5, 6)]


def summary(
    curves: Sequence[tuple[dict[str, object], list[Gate]]], leaks: list[dict[str, object]], quick: bool
) -> tuple[dict[str, object], list[Gate]]:
    """All curves, in the order of SWEEPS, and the leaks: a record for JSON and the gates."""
    named = {sweep.name: record for sweep, (record, _) in zip(SWEEPS, curves, strict=True)}
    record = {"rays": _effort(quick).rays, "seed": SEED, **named, "leaks": leaks}
    return record, [gate for _, gates in curves for gate in gates]


def _effort(quick: bool) -> SweepEffort:
    return QUICK if quick else FULL


@dataclass(frozen=True)
class Errors:
    """Results of one kernel at one x over all rays: verdicts, and errors of t where it and exact arithmetic hit."""

    missed: int
    false_hits: int
    wrong_face: int
    beyond_bound: int  # right face, but t farther off than ``rounding.t_bounds`` explains in float64
    relative: Floats
    ulp: Floats

    @property
    def wrong(self) -> int:
        """Number of rays with a wrong verdict."""
        return self.missed + self.false_hits + self.wrong_face

    def record(self, rays: int) -> dict[str, object]:
        """The errors for JSON: medians and maxima, None without a common hit."""
        errors = {"relative": self.relative, "ulp": self.ulp}
        summary: dict[str, object] = {f"{k}_median": float(np.median(v)) if len(v) else None for k, v in errors.items()}
        summary |= {f"{k}_max": float(v.max()) if len(v) else None for k, v in errors.items()}
        counts = {"missed": self.missed, "false_hits": self.false_hits, "wrong_face": self.wrong_face}
        return summary | counts | {"wrong_share": self.wrong / rays, "beyond_bound": self.beyond_bound}


@dataclass(frozen=True)
class Point:
    """Errors of all kernels at one x of a curve."""

    x: float
    rays: int
    errors: dict[str, Errors]

    def record(self) -> dict[str, object]:
        """The point for JSON."""
        kernels = {name: errors.record(self.rays) for name, errors in self.errors.items()}
        # The bound holds for float64; a float32 kernel on rounded input exceeds it by design.
        for name in KERNELS[1:]:
            del kernels[name]["beyond_bound"]
        return {"x": self.x, "rays": self.rays, **kernels}


def point(sweep: Sweep, x: float, rays: int, rng: Generator) -> Point:
    """Trace the rays of one x with every kernel and judge them exactly."""
    samples = sweep.samples(x, rays, rng)
    truth = [exact.closest_hits(s.vertices, s.faces, s.rays.origins, s.rays.directions) for s in samples]
    errors = {}
    for name in KERNELS:
        parts = [errors_of(answer(name, s), s, hits) for s, hits in zip(samples, truth, strict=True)]
        errors[name] = _joined(parts)
    return Point(x, sum(len(s.rays) for s in samples), errors)


def answer(kernel: str, sample: Sample) -> HitArrays:
    """Closest hits of one kernel."""
    rays = sample.rays
    if kernel == "ours":
        hits = Octree(sample.vertices, sample.faces).closest_hit(rays.origins, rays.directions)
        return HitArrays.told(hits.t, hits.face)
    embree = Embree(sample.vertices, sample.faces, robust=kernel == "embree_robust")
    t, face = embree.closest_hit(rays.origins, rays.directions)
    # In default mode an overflow can leave a face with a t that is not finite, which cannot be compared.
    face = np.where(np.isfinite(t), face, -1)
    return HitArrays(np.where(face >= 0, t, np.inf), face)


def errors_of(found: HitArrays, sample: Sample, truth: list[ExactHit | None]) -> Errors:
    """Compare hits with exact ones, ray by ray."""
    hit = np.array([h is not None for h in truth])
    both = np.flatnonzero(found.hit & hit)
    pairs = [(ray, float(found.t[ray]), h) for ray in both.tolist() if (h := truth[ray]) is not None]
    right = [found.face[ray] in h.faces_at_t for ray, _, h in pairs]
    errors = [way_from(t, h.t) for _, t, h in pairs]
    bounds = _bounds(sample, found.face[both], both)
    beyond = [ok and not error <= bound for ok, error, bound in zip(right, errors, bounds, strict=True)]
    ulps = [float(e / Fraction(float(np.spacing(float(h.t))))) for e, (_, _, h) in zip(errors, pairs, strict=True)]
    return Errors(
        missed=int((hit & ~found.hit).sum()),
        false_hits=int((~hit & found.hit).sum()),
        wrong_face=right.count(False),
        beyond_bound=beyond.count(True),
        relative=np.array([float(e / h.t) for e, (_, _, h) in zip(errors, pairs, strict=True)]),
        ulp=np.array(ulps),
    )


def judge(name: str, points: list[Point]) -> list[Gate]:
    """Gates on ours: hit, miss and face must be exact, and t within the bound that rounding derives for the ray."""
    rays = sum(p.rays for p in points)
    wrong = sum(p.errors["ours"].wrong for p in points)
    beyond = sum(p.errors["ours"].beyond_bound for p in points)
    subject = f"error against {name}, {rays:,} rays"
    aimed, derived = "no ray is aimed within rounding of an edge", "the bound follows from the kernel's arithmetic"
    return [
        Gate("stability", subject, "wrong hits", wrong, "at most", 0.0, aimed),
        Gate("stability", subject, "t beyond its bound", beyond, "at most", 0.0, derived),
    ]


def leak_row(level: int, count: int) -> dict[str, object]:
    """Leaks of ``count`` edge rays and ``count`` vertex rays from inside an icosphere, by kernel."""
    mesh = icosphere(level)
    rng = np.random.default_rng([SEED, level])
    counts = dict.fromkeys(KERNELS, 0)
    for kind in watertight.KINDS:
        rays = watertight.aimed(kind, mesh.vertices, mesh.faces, rng.uniform(-0.4, 0.4, (count, 3)), rng)
        counts["ours"] += watertight.leaks(Octree.from_mesh(mesh), rays)
        for mode in ("default", "robust"):
            embree = Embree(mesh.vertices, mesh.faces, robust=mode == "robust")
            counts[f"embree_{mode}"] += watertight.embree_leaks(embree, rays)
    return {"mesh": f"icosphere {level}", "faces": len(mesh.faces), "rays": 2 * count} | counts


def moved(offset: float, count: int, rng: Generator) -> list[Sample]:
    """A sphere and its rays moved by ``offset`` along each axis."""
    origins, targets = _around_sphere(count, rng)
    place = AWAY * offset
    return [Sample(_SPHERE.vertices + place, _SPHERE.faces, rays_towards(origins + place, targets + place))]


def scaled(scale: float, count: int, rng: Generator) -> list[Sample]:
    """A sphere and its rays, directions too, times ``scale``."""
    origins, targets = _around_sphere(count, rng)
    return [Sample(_SPHERE.vertices * scale, _SPHERE.faces, rays_towards(origins * scale, targets * scale))]


def grazing(angle: float, count: int, rng: Generator) -> list[Sample]:
    """Randomly rotated triangles, hit at ``angle`` radians from their planes."""
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.9, 0.0]])
    return _at_triangles(flat, count, rng, lambda n: np.full(n, angle))


def slivers(height: float, count: int, rng: Generator) -> list[Sample]:
    """Randomly rotated triangles of length 1 and ``height``, hit at 30 to 90 degrees."""
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, height, 0.0]])
    return _at_triangles(flat, count, rng, lambda n: rng.uniform(np.pi / 6, np.pi / 2, n))


def _powers(first: int, last: int, stride: int = 1) -> tuple[float, ...]:
    return tuple(float(f"1e{k}") for k in range(first, last + (1 if stride > 0 else -1), stride))


_SPHERE: Mesh = icosphere(3)

SWEEPS = (
    Sweep("offset", "offset of mesh and rays, in radii", _powers(0, 9), moved),
    Sweep("scale", "scale of mesh and rays", _powers(-18, 18, 2), scaled),
    Sweep("grazing angle", "angle between ray and plane, radians", _powers(-1, -7, -1), grazing),
    Sweep("sliver height", "height of a triangle of length 1", _powers(-1, -8, -1), slivers),
)


def _around_sphere(count: int, rng: Generator) -> tuple[Floats, Floats]:
    """Origins 3 radii away or inside, alternately, and targets within faces."""
    origins = rng.standard_normal((count, 3))
    origins *= np.where(np.arange(count) % 2, 3.0, 0.5)[:, None] / np.linalg.norm(origins, axis=1, keepdims=True)
    corners = _SPHERE.triangles[rng.integers(0, len(_SPHERE.faces), count)]
    return origins, _within(corners, rng)


def _at_triangles(flat: Floats, count: int, rng: Generator, angles: Callable[[int], Floats]) -> list[Sample]:
    """One triangle of z = 0 in several rotations, with rays from 2 away at inner points, ``angles(n)`` off it."""
    return list(_turned(flat, -(-count // _TURNS), rng, angles))


def _turned(flat: Floats, count: int, rng: Generator, angles: Callable[[int], Floats]) -> Iterator[Sample]:
    for _ in range(_TURNS):
        turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        vertices = flat @ turn
        targets = _within(np.broadcast_to(vertices, (count, 3, 3)), rng)
        around, above = rng.uniform(0.0, 2.0 * np.pi, count), angles(count)
        up = np.sin(above) * np.where(rng.random(count) < 0.5, 1.0, -1.0)
        back = np.stack([np.cos(above) * np.cos(around), np.cos(above) * np.sin(around), up], axis=1) @ turn
        yield Sample(vertices, np.array([[0, 1, 2]], np.int32), rays_towards(targets + 2.0 * back, targets))


def _within(corners: Floats, rng: Generator) -> Floats:
    """A point inside each triangle (n, 3, 3), at least 1 % of its height from its edges."""
    weights = 0.01 + 0.97 * rng.dirichlet((1.0, 1.0, 1.0), len(corners))
    return np.einsum("nk,nkj->nj", weights, corners)


def rays_towards(origins: Floats, targets: Floats) -> RayFamily:
    return RayFamily("stability", origins, targets - origins)


def _bounds(sample: Sample, faces: NDArray[np.int64], rows: NDArray[np.int64]) -> list[float]:
    """The float64 bound on t for the rays at ``rows`` and the faces of their hits."""
    if not len(rows):
        return []
    corners = sample.vertices[sample.faces[faces]]
    origins, directions = sample.rays.origins[rows], sample.rays.directions[rows]
    seen = zip(corners, origins, directions, strict=True)
    edges = np.array([[float(value) for value in exact.determinants(*one)[:3]] for one in seen])
    return t_bounds(corners, origins, directions, edges).tolist()


def _joined(parts: list[Errors]) -> Errors:
    return Errors(
        missed=sum(e.missed for e in parts),
        false_hits=sum(e.false_hits for e in parts),
        wrong_face=sum(e.wrong_face for e in parts),
        beyond_bound=sum(e.beyond_bound for e in parts),
        relative=np.concatenate([e.relative for e in parts]),
        ulp=np.concatenate([e.ulp for e in parts]),
    )
