"""Row 51 of the extreme cases: points within, on and an ulp beside closed meshes, judged by exact arithmetic."""

import numpy as np
from numpy.random import Generator

from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import box, icosphere
from validation.meshes import loose
from validation.oracle.inside import winding_number
from validation.oracle.vectors import rational
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import SEED, Floats

# Places and sizes of each mesh: offset and scale.
PLACES = ((0.0, 1.0), (1e6, 1.0), (0.0, 1e-6), (1e6, 1e6))


def closed_solids() -> dict[str, Mesh]:
    """Closed meshes: nested, hollow, overlapping and touching ones, triangle soup, and corners at small integers."""
    ball, small = icosphere(1), box((-1, -1, -1), (1, 1, 1))
    large, turned = box((-2, -2, -2), (2, 2, 2)), Mesh(small.vertices, small.faces[:, ::-1])
    return {
        "box": small,
        "ball": ball,
        "nested boxes": Mesh.concatenate([large, small]),
        "hollow box": Mesh.concatenate([large, turned]),
        "overlapping boxes": Mesh.concatenate([box((-2, -2, -2), (1, 1, 1)), box((-1, -1, -1), (2, 2, 2))]),
        "touching boxes": Mesh.concatenate([box((-2, -1, -1), (0, 1, 1)), box((0, -1, -1), (2, 1, 1))]),
        "soup": loose(ball.triangles),
        "integers": _integer_star(1),
        "more integers": _integer_star(2),
    }


def _integer_star(seed: int) -> Mesh:
    """A ball whose corners are moved to small integers: points meet its planes, edges and corners often."""
    ball, rng = icosphere(1), np.random.default_rng(seed)
    return Mesh(np.round(ball.vertices * rng.integers(2, 6, (len(ball.vertices), 1))), ball.faces)


def points_at(mesh: Mesh, rng: Generator, count: int) -> Floats:
    """Points anywhere, in planes of corners, on corners, edges and faces, ``count`` each, and one ulp beside those."""
    lower, upper = mesh.bounds
    anywhere = lower + (upper - lower) * (1.4 * rng.random((count, 3)) - 0.2)
    planes = np.where(rng.random((count, 3)) < 0.5, rng.choice(mesh.vertices.ravel(), (count, 3)), anywhere)
    corners = mesh.triangles[rng.integers(0, len(mesh.faces), count)]
    share = rng.choice([0.0, 0.25, 0.5, 1.0], (count, 1))
    edges = corners[:, 0] * share + corners[:, 1] * (1 - share)
    inner = corners[:, 0] * 0.5 + corners[:, 1] * 0.25 + corners[:, 2] * 0.25
    exact = np.concatenate([anywhere, planes, corners[:, 0], edges, inner])
    return np.concatenate([exact, np.nextafter(exact, rng.choice([-9e9, 9e9], exact.shape))])


def winding_numbers(mesh: Mesh, points: Floats) -> list[int | None]:
    """Winding numbers by exact arithmetic, None on the surface."""
    triangles = [rational(triangle.tolist()) for triangle in mesh.triangles]
    return [winding_number(point, triangles) for point in rational(points.tolist())]


def wrong_answers(mesh: Mesh, points: Floats) -> int:
    """The number of points at which some answer differs from exact arithmetic."""
    numbers = winding_numbers(mesh, points)
    on = np.array([number is None for number in numbers])
    around = np.array([bool(number) for number in numbers])
    odd = np.array([number is not None and number % 2 == 1 for number in numbers])
    wrong = np.zeros(len(points), np.bool_)
    for accelerator in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        wrong |= accelerator.contains(points) != (around | on)
        wrong |= accelerator.contains(points, boundary=False) != around
        wrong |= accelerator.contains(points, boundary=False, rule="even-odd") != odd
    return int(wrong.sum())


def _inside(quick: bool) -> Outcome:
    rng, wrong, asked = np.random.default_rng(SEED), 0, 0
    for solid in closed_solids().values():
        for offset, scale in PLACES:
            mesh = Mesh(solid.vertices * scale + offset * rng.random(3), solid.faces)
            points = points_at(mesh, rng, 4 if quick else 20)
            wrong, asked = wrong + wrong_answers(mesh, points), asked + len(points)
    return Outcome(f"{wrong} of {asked:,} points wrong", wrong == 0)


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        51, "points within, on and an ulp beside closed meshes: nested, hollow, overlapping, soup; far, tiny, huge",
        "inside, outside or on the surface as in real arithmetic, by both rules", ("exact",),
        "none: every sign is exact", _inside,
    ),
)  # fmt: skip
