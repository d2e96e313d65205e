"""Every query of rays with every argument, alone and together with others, against slow twins in plain NumPy.

Rays without ``leaving`` have small multiples of 1/4 for numbers and powers of two for directions, so t is exact, ties
and ends of intervals are met, and bits are compared. Those that leave a face go in any direction.
"""

import inspect
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from array_forms import FORMS, forms, shaped, shapes_of
from hypothesis import given, settings
from hypothesis import strategies as st
from twins import CORNERS, FACES, MESH, NORMALS, Floats, Integers, dot, holding, meetings

from renderer import BruteForce, Mesh, Octree
from renderer.queryable import Queries

pytestmark = pytest.mark.judges(
    "BruteForce.all_hits", "BruteForce.any_hit", "BruteForce.closest_hit", "BruteForce.count_hits",
    "BruteForce.count_steps", "Octree.all_hits", "Octree.any_hit", "Octree.closest_hit", "Octree.count_hits",
    "Octree.count_steps",
)  # fmt: skip


TARGETS = {
    "octree": Octree.from_mesh(MESH, threads=1),
    "sah": Octree.from_mesh(MESH, split="sah", leaf_size=1, threads=3),
    "brute force": BruteForce.from_mesh(MESH, threads=2),
}
TETRAHEDRON = Mesh(np.eye(4, 3), [[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]])
# One, as many as go one by one, some packets, and with an odd one more.
COUNTS = st.sampled_from([1, 2, 7, 40, 300, 301])
SEEDS = st.integers(0, 2**20)
# A start is moved off its face by some roundings of 10, and a direction may be as flat as 1 in 100.
ROUNDED = 2.0**-38


@dataclass
class Rays:
    """n rays, the faces and sides that they leave, -1 and 0 for none, and the arguments that a query gets with them."""

    origins: Floats
    directions: Floats
    shape: tuple[int, ...]
    left: Integers
    sides: Integers
    options: dict[str, Any] = field(default_factory=dict)

    def hits(self, t_min: Floats | float = 0.0, t_max: Floats | float = np.inf) -> Floats:
        """t (n, F) of the hits within the interval, NaN for none: the twin of all queries."""
        t = meetings(CORNERS, self.origins, self.directions)
        on = np.flatnonzero(self.left >= 0)
        faces = self.left[on]
        t[on] = np.where(holding(CORNERS, self.origins[on]), np.nan, t[on])
        stopped = dot(NORMALS[faces], self.directions[on]) * self.sides[on] < 0.0
        t[on[stopped], faces[stopped]] = 0.0
        lower, upper = (np.broadcast_to(bound, self.shape).reshape(-1, 1) for bound in (t_min, t_max))
        return np.where((t >= lower) & (t <= upper), t, np.nan)


def places_on(faces: Integers, rng: np.random.Generator) -> Floats:
    """Places of faces that no other face holds: at multiples of 1/16 of their sides."""
    places, todo = np.empty((len(faces), 3)), np.arange(len(faces))
    while len(todo):
        weights = rng.multinomial(16, [1 / 3] * 3, len(todo)) / 16.0
        places[todo] = (weights[:, :, None] * CORNERS[faces[todo]]).sum(axis=1)
        todo = todo[holding(CORNERS, places[todo]).sum(axis=1) > 1]
    return places


@st.composite
def exact_rays(draw: Any) -> Rays:
    """Most towards a place of the mesh that they meet at t = 0, 1/4, 1 or 4."""
    rng, count = np.random.default_rng(draw(SEEDS)), draw(COUNTS)
    directions = rng.choice([-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0], (count, 3))
    directions[~directions.any(axis=1)] = [0.0, -0.5, 0.0]
    weights = rng.multinomial(4, [1 / 3] * 3, count) / 4.0
    targets = (CORNERS[rng.integers(0, FACES, count)] * weights[:, :, None]).sum(axis=1)
    alike = draw(st.sampled_from(["nothing", "origins", "directions"]))
    if alike == "directions":
        directions[:] = directions[0]
    origins = targets - directions * rng.choice([0.0, 0.25, 1.0, 4.0, -1.0], (count, 1))
    if alike == "origins":
        origins[:] = origins[0]
    none = np.full(count, -1)
    return Rays(origins, directions, draw(shapes_of(count)), none, 0 * none)


@st.composite
def leaving_faces(draw: Any) -> Rays:
    """Rays that leave faces by their numbers, or one face; or some of them none."""
    rng, count = np.random.default_rng(draw(SEEDS)), draw(COUNTS)
    shape, one = draw(shapes_of(count)), draw(st.booleans())
    faces = np.full(count, rng.integers(FACES)) if one else rng.integers(0, FACES, count)
    origins = places_on(faces, rng)
    rays = Rays(origins, ways(rng, count), shape, faces, np.zeros(count, np.int64))
    if not one:
        rays.left = np.where(rng.random(count) < 0.2, -1, faces)
        rays.origins = np.where(rays.left[:, None] < 0, origins + NORMALS[faces] / 4.0, origins)
    rays.options["leaving"] = int(faces[0]) if one else FORMS[draw(forms)](shaped(shape, rays.left))
    if draw(st.booleans()):
        same = draw(st.booleans())
        rays.sides = np.full(count, rng.integers(-1, 2)) if same else rng.integers(-1, 2, count)
        rays.options["side"] = int(rays.sides[0]) if same else FORMS[draw(forms)](shaped(shape, rays.sides))
    return rays


@st.composite
def leaving_hits(draw: Any) -> Rays:
    """Rays that leave hits, or go on through them."""
    rng, count = np.random.default_rng(draw(SEEDS)), draw(COUNTS)
    shape, faces, sides = draw(shapes_of(count)), rng.integers(0, FACES, count), rng.choice([-1, 1], count)
    origins, apart = places_on(faces, rng), NORMALS[faces] * sides[:, None] / 8.0
    hits = TARGETS["octree"].closest_hit(shaped(shape, origins + apart), shaped(shape, -apart))
    np.testing.assert_array_equal(hits.face.ravel(), faces)
    through = draw(st.booleans())
    rays = Rays(origins, ways(rng, count), shape, faces, -sides if through else sides)
    rays.options["leaving"] = hits.through() if through else hits
    return rays


def ways(rng: np.random.Generator, count: int) -> Floats:
    """Directions of any kind that float32 holds."""
    return rng.normal(size=(count, 3)).astype(np.float32).astype(np.float64)


@st.composite
def bounds(draw: Any, shape: tuple[int, ...], ends: list[float]) -> Any:
    """One bound, or one for each ray."""
    if draw(st.booleans()):
        return draw(st.sampled_from(ends))
    return np.random.default_rng(draw(SEEDS)).choice(ends, shape)


OPTIONS: dict[str, Any] = {
    "t_min": lambda shape: bounds(shape, [0.0, 0.25, 0.5, 1.0, 4.0]),
    "t_max": lambda shape: bounds(shape, [0.0, 0.25, 1.0, 4.0, 9.0, np.inf]),
    "contacts": lambda shape: st.booleans(),
    "max_hits": lambda shape: st.sampled_from([None, 1, 2, np.int64(3), 100]),
    "t_error": lambda shape: st.booleans(),
}
STARTS = {"leaving", "side"}  # drawn with the rays


def rows_of(t: Floats, contacts: bool = True, max_hits: int | None = None, **_: Any) -> list[Integers]:
    """The faces of each ray's rows, by t and then by number; of one edge or corner of a cube the first."""
    rows = []
    for ray in t:
        found = [(ray[face], face) for face in np.flatnonzero(~np.isnan(ray))]
        found.sort()
        first = {(t, face // 12 if contacts else face): face for t, face in reversed(found)}
        rows.append(np.array([face for t, face in found if face in first.values()][:max_hits], np.int64))
    return rows


def check_closest_hit(got: Any, rays: Rays, t: Floats, options: dict[str, Any]) -> None:
    first = [row[:1] for row in rows_of(t)]
    check_hits(got, rays, t, first, options, got.face.shape)
    np.testing.assert_array_equal(got.face.ravel(), [row[0] if len(row) else -1 for row in first])
    assert (got.side[got.face < 0] == 0).all()


def check_all_hits(got: Any, rays: Rays, t: Floats, options: dict[str, Any]) -> None:
    rows = rows_of(t, **options)
    np.testing.assert_array_equal(np.diff(got.offsets), [len(row) for row in rows])
    np.testing.assert_array_equal(got.face, np.concatenate(rows))
    check_hits(got, rays, t, rows, options, got.counts.shape)


def check_hits(got: Any, rays: Rays, t: Floats, rows: list[Integers], options: dict[str, Any], shape: Any) -> None:
    """t, side and the bound of t's error of hits, which are those in ``rows``."""
    assert shape == rays.shape
    ray, face, met = np.repeat(np.arange(len(rows)), [len(row) for row in rows]), np.concatenate(rows), got.face >= 0
    expected = t[ray, face]
    exact = "leaving" not in options
    np.testing.assert_allclose(got.t[met], expected, rtol=0.0 if exact else ROUNDED, atol=0.0 if exact else ROUNDED)
    from_side = -np.sign(dot(NORMALS[face], rays.directions[ray]))
    at_once = (expected == 0.0) & (rays.left[ray] == face)
    np.testing.assert_array_equal(got.side[met][~at_once], from_side[~at_once])
    assert (got.t_error is not None) == options.get("t_error", False)
    if got.t_error is not None:
        assert (np.abs(got.t[met] - expected) <= got.t_error[met] + (0.0 if exact else ROUNDED)).all()


def check_any_hit(got: Any, rays: Rays, t: Floats, options: dict[str, Any]) -> None:
    np.testing.assert_array_equal(got, shaped(rays.shape, ~np.isnan(t).all(axis=1)), strict=True)


def check_count_hits(got: Any, rays: Rays, t: Floats, options: dict[str, Any]) -> None:
    counts = np.array([len(row) for row in rows_of(t, **options)])
    np.testing.assert_array_equal(got, shaped(rays.shape, counts), strict=True)


CHECKS = {
    "closest_hit": check_closest_hit,
    "any_hit": check_any_hit,
    "all_hits": check_all_hits,
    "count_hits": check_count_hits,
}


@pytest.mark.parametrize("query", CHECKS)
@given(st.data())
@settings(max_examples=60)
def test_a_query_answers_as_its_slow_twin(query: str, data: st.DataObject) -> None:
    asked = inspect.signature(getattr(Queries, query)).parameters.keys() - {"self", "origins", "directions"}
    rays = data.draw(st.one_of(exact_rays(), leaving_faces(), leaving_hits()))
    chosen = data.draw(st.sets(st.sampled_from(sorted(asked - STARTS))))
    options = rays.options | {name: data.draw(OPTIONS[name](rays.shape)) for name in sorted(chosen)}
    t = rays.hits(**{name: options[name] for name in ("t_min", "t_max") if name in options})
    given = {n: FORMS[data.draw(forms)](v) if type(v) is np.ndarray else v for n, v in options.items()}
    o, d = (FORMS[data.draw(forms)](whole(shaped(rays.shape, v), data)) for v in (rays.origins, rays.directions))
    target = TARGETS[data.draw(st.sampled_from(sorted(TARGETS)))]
    CHECKS[query](getattr(target, query)(o, d, **given), rays, t, options)


def whole(vectors: Floats, data: st.DataObject) -> Floats:
    """The vectors, or one of them where all are alike; the other ones then say how many there are."""
    rows = vectors.reshape(-1, 3)
    return rows[0] if (rows == rows[0]).all() and len(rows) > 1 and data.draw(st.booleans()) else vectors


def test_every_query_of_rays_has_a_twin() -> None:
    queries = {name for name, thing in vars(Queries).items() if callable(thing) and not name.startswith("_")}
    assert {name for name in queries if "origins" in inspect.signature(getattr(Queries, name)).parameters} == {
        *CHECKS, "count_steps",
    }  # fmt: skip


@given(SEEDS, st.sets(st.sampled_from(["t_min", "t_max", "side"])), st.booleans())
@settings(max_examples=25)
def test_steps_of_a_single_block_are_counted_where_the_interval_meets_its_box(
    seed: int, chosen: set[str], leaves: bool
) -> None:
    """The root is entered by every ray. Four faces are one block, which is tested whole."""
    rng = np.random.default_rng(seed)
    faces, directions, spans = rng.integers(0, 4, 40), ways(rng, 40), np.sort(rng.uniform(0.0, 3.0, (2, 40)), axis=0)
    origins = TETRAHEDRON.triangles[faces].mean(axis=1) if leaves else rng.uniform(-2.0, 2.0, (40, 3))
    lower = spans[0] if "t_min" in chosen else np.zeros(40)
    upper = spans[1] if "t_max" in chosen else np.full(40, np.inf)
    options: dict[str, Any] = {"t_min": lower} if "t_min" in chosen else {}
    options |= {"t_max": upper} if "t_max" in chosen else {}
    options |= {"leaving": faces} if leaves else {}
    options |= {"side": rng.integers(-1, 2, 40)} if leaves and "side" in chosen else {}
    ends = (np.stack(TETRAHEDRON.bounds)[:, None] - origins) / directions
    enter, leave = np.maximum(ends.min(axis=0).max(axis=1), lower), np.minimum(ends.max(axis=0).min(axis=1), upper)
    steps = Octree.from_mesh(TETRAHEDRON).count_steps(origins, directions, **options)
    told = np.abs(enter - leave) > 1e-5  # boxes are float32, and grow by some of its roundings
    np.testing.assert_array_equal(steps.triangles[told], 4 * (enter < leave)[told])
    assert (steps.nodes == 1).all() and told.sum() > 20
    brute = BruteForce.from_mesh(TETRAHEDRON).count_steps(origins, directions, **options)
    assert (brute.nodes == 0).all() and (brute.triangles == 4).all()
