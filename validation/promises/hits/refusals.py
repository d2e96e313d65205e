"""Rays, bounds and refits that are refused: by the argument's name and row, and nothing is changed."""

from itertools import product
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.shapes import icosphere
from renderer.octree import BruteForce, Octree
from validation.promises.refused import refused, refuses
from validation.promises.row import row

# Either side of where packets, small chunks and full chunks end.
_COUNT, _ROWS = 17000, (0, 1, 15, 16, 1023, 1024, 8191, 8192, 16999)
_FEW = 5
# Whole numbers of rays that distinguish bounds from rays of other dimensions.
_DIMENSIONS = (3, 4)
_BOUNDS = (np.nan, -1.0, -np.inf, -(2.0**-1074))
_WRONG: dict[str, tuple[Any, ...]] = {"origins": (np.nan, np.inf, -np.inf), "directions": (np.nan, np.inf, 0.0)}


def check_refusals(rng: Generator) -> list[dict[str, Any]]:
    """A ball: rays of which one is wrong, bounds that are none, and vertices that cannot be those of a mesh."""
    ball = icosphere(2)
    tracers = Octree.from_mesh(ball), BruteForce.from_mesh(ball)
    return [
        row("a ray out of range is refused, and the error names the argument and the row", "known answer",
            np.concatenate([_rays(tracer, rng) for tracer in tracers])),
        row("numbers that are not finite are refused wherever they are", "known answer",
            np.concatenate([_coordinates(tracer) for tracer in tracers])),
        row("bounds that are negative, NaN or of another shape than the rays are refused by name",
            "known answer", np.concatenate([_bounds(tracer) for tracer in tracers])),
        row("vertices that cannot replace those of the mesh are refused, and change nothing", "earlier answers",
            np.concatenate([_refits(tracer, rng) for tracer in tracers])),
    ]  # fmt: skip


def _rays(tracer: Octree | BruteForce, rng: Generator) -> NDArray[np.bool_]:
    """Rays that go all ways, and rays that go one way, as packets do; all of them, and a few."""
    kept = []
    for spread, count in ((1.0, _COUNT), (1e-3, _COUNT), (1.0, _FEW)):
        rays = {
            "origins": rng.uniform(-2.0, 2.0, (count, 3)),
            "directions": rng.normal(size=(count, 3)) * spread + [0.0, 0.0, 1.0],
        }
        for argument, wrong in _WRONG.items():
            for at in (*(r for r in _ROWS if r < count), count - 1):
                before = rays[argument][at].copy()
                rays[argument][at] = wrong[at % len(wrong)]
                for ask in (tracer.closest_hit, tracer.any_hit, tracer.count_hits, tracer.count_steps):
                    said = refused(ask, **rays) or ""
                    kept.append(said.startswith(f"{argument}: expected ") and said.endswith(f"in row {at}"))
                rays[argument][at] = before
    return np.array(kept)


def _coordinates(tracer: Octree | BruteForce) -> NDArray[np.bool_]:
    """One ray, a few and packets, of which one coordinate is wrong."""
    kept = []
    for count in (1, 9, 40):
        for at, axis in ((0, 0), (count // 2, 1), (count - 1, 2)):
            for argument, bad in product(("origins", "directions"), (np.nan, np.inf, -np.inf)):
                rays = {"origins": np.ones((count, 3)), "directions": np.ones((count, 3))}
                rays[argument][at, axis] = bad
                kept += [refuses(ask, **rays) for ask in (tracer.closest_hit, tracer.any_hit, tracer.count_hits)]
    return np.array(kept)


def _bounds(tracer: Octree | BruteForce) -> NDArray[np.bool_]:
    """One for all, one a ray, and arrays that have as many values as there are rays but are turned or flat."""
    h, w = _DIMENSIONS
    origins, directions = np.zeros((h, w, 3)), np.ones((h, w, 3))
    wrong: list[tuple[Any, str]] = [(value, "in row 0") for value in _BOUNDS]
    for at, value in enumerate(_BOUNDS):
        each = np.ones((h, w))
        each[at % h, at % w] = value
        wrong.append((each, f"in row {at % h * w + at % w}"))
    wrong += [(np.ones(shape), f"shape {shape}") for shape in ((w, h), (h * w,), (h, w, 1), (h + 1, w))]
    kept = []
    for bound, end in wrong:
        for name in ("t_min", "t_max"):
            for ask in (tracer.closest_hit, tracer.any_hit, tracer.all_hits, tracer.count_hits):
                said = refused(ask, origins, directions, **{name: bound}) or ""
                kept.append(said.startswith(f"{name}: expected ") and said.endswith(end))
    return np.array(kept)


def _refits(tracer: Octree | BruteForce, rng: Generator) -> NDArray[np.bool_]:
    sound = tracer.mesh.vertices
    lost, endless, tiny = sound * 1.5, sound * 1.5, sound * 1.5
    lost[7, 1], endless[0, 2] = np.nan, np.inf
    # A face whose sides vanish beside the largest coordinate.
    tiny[tracer.mesh.faces[3]] = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]) * 2.0**-400
    rays = rng.uniform(-2.0, 2.0, (200, 3)), rng.normal(size=(200, 3))
    before, kept = tracer.closest_hit(*rays), []
    for vertices in (lost, endless, tiny, sound[:-1] * 1.5, sound[:, :2] * 1.5, 1.5):
        kept.append(refuses(tracer.refit, vertices))
        after = tracer.closest_hit(*rays)
        same = [np.array_equal(getattr(after, name), getattr(before, name), equal_nan=True) for name in ("t", "face")]
        kept += [*same, np.array_equal(tracer.mesh.vertices, sound)]
    return np.array(kept)
