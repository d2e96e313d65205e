"""Shares of the sky with closed forms: the error of each against the number of directions, and how fast it falls."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.octree import Octree
from renderer.studies import ambient_occlusion, openness, sky_view_factor
from validation.studies.bodies import FAR, awning, shaft, street, walls

Floats = NDArray[np.float64]
# Points across a street's floor, and the number of streets.
_PLACES = 16
# Tregenza's and Reinhart's patches, and numbers of a lattice.
PATCHES = (145, 577)
COUNTS = (64, 256, 1024, 4096, 16384, 65536)
# Chance alone has -1/2. Of an even lattice only the points along a boundary are right or wrong by chance, sqrt(n) of n,
# which gives -3/4; boundaries that run along its spiral do worse.
SLOPE = -0.6


@dataclass(frozen=True)
class Form:
    """A study whose answers are known: ``found`` answers with so many directions what ``known`` holds."""

    study: str
    name: str
    source: str
    known: Floats
    found: Callable[[int], Floats]


def sky_bound(count: int) -> float:
    """The largest error of a share of the sky.

    Patches are sqrt(2 pi / count) wide, so boundaries of length 2 pi, the longest here, run through sqrt(2 pi count) of
    them, each wrong by half its weight at most: that is 1 / count, or by cosine 2 cos / count, whose mean along half a
    great circle is 4 / pi at most. As if all erred to one side.
    """
    return float(0.5 * np.sqrt(2.0 * np.pi / count) * 4.0 / np.pi)


def all_sides_bound(count: int) -> float:
    """The same for all directions, 4 pi over ``count`` patches, and one circle of at most 2 pi."""
    return float(0.5 * np.sqrt(4.0 * np.pi / count) * 2.0 * np.pi / (4.0 * np.pi))


def corner_bound(count: int) -> float:
    """And over the disc of cosines: parts are sqrt(pi / count) wide, boundaries at most 4 long, two diameters."""
    return float(2.0 / np.sqrt(np.pi * count))


def streets() -> list[Form]:
    """Floors of endless streets at places from wall to wall, by cosine and by solid angle."""
    width, depth = 2.0, 1.5
    place = width * (np.arange(_PLACES) + 0.5) / _PLACES
    points = np.stack([place - width / 2.0, np.linspace(0.1, 0.9, _PLACES), np.zeros(_PLACES)], axis=1)
    left, right = np.arctan(depth / place), np.arctan(depth / (width - place))
    # The floor is cut along the line from x = -1, y = -FAR to x = 1, y = FAR.
    asked = {"points": points, "leaving": np.where(points[:, 0] * FAR > points[:, 1] * width / 2.0, 0, 1)}
    return [
        _sky("floor of a street", "(cos a + cos b) / 2 of the walls' heights in angle (Oke 1987)", street(width, depth),
             (np.cos(left) + np.cos(right)) / 2.0, **asked),
        _sky("floor of a street, solid angle", "1 - (a + b) / pi: a wedge", street(width, depth),
             1.0 - (left + right) / np.pi, definition="geometric", **asked),
    ]  # fmt: skip


def _sky(name: str, source: str, mesh: Mesh, known: Any, **asked: Any) -> Form:
    octree = Octree.from_mesh(mesh)
    return Form(
        "sky_view_factor",
        name,
        source,
        np.atleast_1d(known),
        lambda count: sky_view_factor(octree, patches=count, **asked),
    )


@functools.cache
def forms() -> list[tuple[Form, Callable[[int], float]]]:
    """All of them, each with its bound."""
    disc = Octree.from_mesh(shaft(1.0, 1.5))
    wall, corner = Octree.from_mesh(walls("xz")), Octree.from_mesh(walls("xyz"))
    ball, away = Octree.from_mesh(icosphere(5)), 1.5
    tilts = np.radians([0.0, 30.0, 60.0, 90.0, 120.0, 180.0])
    normals = np.stack([np.sin(tilts) * 0.6, np.sin(tilts) * 0.8, np.cos(tilts)], axis=1)
    below, cloth = walls("z"), awning(2.0, 1.5)
    shade = {"transmittance": np.full(len(cloth.faces), 0.25)}
    skies = [
        *streets(),
        Form("sky_view_factor", "bottom of a round shaft", "form factor of a disc, r^2 / (r^2 + h^2)",
             np.array([1.0 / (1.0 + 2.25)]), lambda n: sky_view_factor(disc, [[0.0, 0.0, 0.0]], patches=n)),
        Form("sky_view_factor", "bottom of a round shaft, solid angle", "1 - h / sqrt(r^2 + h^2)",
             np.array([1.0 - 1.5 / np.sqrt(3.25)]),
             lambda n: sky_view_factor(disc, [[0.0, 0.0, 0.0]], patches=n, definition="geometric")),
        _sky("under a round awning, a quarter of the light through it", "1 - 3/4 r^2 / (r^2 + h^2)", cloth,
             1.0 - 0.75 * 4.0 / 6.25, points=[[0.0, 0.0, 0.0]], **shade),
        _sky("under a round awning, solid angle", "1 - 3/4 (1 - h / sqrt(r^2 + h^2))", cloth,
             1.0 - 0.75 * (1.0 - 1.5 / 2.5), points=[[0.0, 0.0, 0.0]], definition="geometric", **shade),
        Form("sky_view_factor", "beside an endless wall", "1/2", np.array([0.5]),
             lambda n: sky_view_factor(wall, [[0.01, 0.0, 0.0]], leaving=[1], patches=n)),
        _sky("tilted planes in the open", "(1 + cos b) / 2", below, (1.0 + np.cos(tilts)) / 2.0,
             points=np.tile([0.0, 0.0, 9.0], (6, 1)), normals=normals),
    ]  # fmt: skip
    corners = [
        Form("ambient_occlusion", "ambient light in the corner of a box", "1/4", np.array([0.25]),
             lambda n: ambient_occlusion(corner, [[1e-3, 1e-3, 0.0]], [0, 0, 1], samples=n, leaving=2)),
        Form("ambient_occlusion", "ambient light beside a wall", "1/2", np.array([0.5]),
             lambda n: ambient_occlusion(wall, [[1e-3, 1e-3, 0.0]], [0, 0, 1], samples=n, leaving=1)),
    ]  # fmt: skip
    # The ball of triangles is a little smaller than the sphere: by 4e-4 of its radius, which hides as much less.
    around = Form("openness", "openness beside a ball", "(1 + cos asin(r / d)) / 2 +- 4e-4",
                  np.array([(1.0 + np.sqrt(1.0 - away**-2)) / 2.0]),
                  lambda n: openness(ball, [[0.0, 0.0, away]], samples=n))  # fmt: skip
    return [
        *((form, sky_bound) for form in skies), *((form, corner_bound) for form in corners),
        (around, lambda n: all_sides_bound(n) + 4e-4),
    ]  # fmt: skip


def check_form(index: int, quick: bool) -> dict[str, Any]:
    """A row: the largest error over its places for each number of directions, and the worst share of the bound."""
    form, bound = forms()[index]
    lattice = COUNTS[:-1] if quick else COUNTS
    counts = sorted({*lattice, *(PATCHES if form.study == "sky_view_factor" else ())})
    errors = [float(np.abs(form.found(count) - form.known).max()) for count in counts]
    worst = max(error / bound(count) for error, count in zip(errors, counts, strict=True))
    return {"subject": form.name, "study": form.study, "source": form.source, "counts": counts, "errors": errors,
            "share_of_bound": worst}  # fmt: skip


def check_slope(quick: bool) -> dict[str, Any]:
    """Errors over a street's floor, as a mean square, against the number of a lattice's directions; and their slope."""
    counts = COUNTS[:-1] if quick else COUNTS
    rows = []
    for form in streets():
        rms = [float(np.sqrt(np.mean((form.found(count) - form.known) ** 2))) for count in counts]
        slope = float(np.polyfit(np.log(counts), np.log(rms), 1)[0])
        patches = [float(np.sqrt(np.mean((form.found(count) - form.known) ** 2))) for count in PATCHES]
        rows.append({"subject": form.name, "counts": list(counts), "rms": rms, "slope": slope, "patches": patches})
    return {"curves": rows}
