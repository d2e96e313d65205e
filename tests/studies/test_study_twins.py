"""Every study of points with every argument, alone and together with others, against a slow twin in plain NumPy.

The mesh is turned against the axes, and points lie anywhere, on its faces or not: so no way meets an edge to rounding.
Many normals and directions have coordinates of 0, so some directions lie in a horizon.
"""

import inspect
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from array_forms import FORMS, shaped, shapes_of
from hypothesis import given, settings
from hypothesis import strategies as st
from twins import FACES, MESH, Floats, Integers, dot, meetings

from renderer import BruteForce, Mesh, Octree, studies
from renderer.studies import (
    Pattern,
    cosine_hemisphere,
    fibonacci_hemisphere,
    fibonacci_sphere,
    reinhart,
    share,
    tregenza,
)

TURN = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
TURNED = Mesh((MESH.vertices @ TURN).astype(np.float32), MESH.faces).transformed(
    np.diag([np.sign(np.linalg.det(TURN)), 1, 1, 1])
)
CORNERS, NORMALS = TURNED.triangles, TURNED.face_normals()
TARGETS = {
    "octree": Octree.from_mesh(TURNED, threads=1),
    "sah": Octree.from_mesh(TURNED, split="sah", leaf_size=1, threads=3),
    "brute force": BruteForce.from_mesh(TURNED, threads=2),
}
SEEDS = st.integers(0, 2**20)
# Fewer and more than go together with one beam, and more than a tile.
COUNTS = st.sampled_from([1, 2, 40, 300])
# Array kinds that hold any number of float64.
EXACT = st.sampled_from(sorted(set(FORMS) - {"small"}))
# Sums of some 600 numbers in another order.
ROUNDED = 600 * 2.0**-52


@dataclass
class Places:
    """Points (n, 3), the face that each lies on, -1 for none, and unit normals (n, 3), or none."""

    points: Floats
    faces: Integers
    normals: Floats | None = None

    def left(self, directions: Floats, asked: dict[str, Any]) -> Floats:
        """What is left of rays in directions (n, k, 3) behind all faces that they cross up to a distance."""
        shares, distance = asked.get("transmittance", np.zeros(FACES)), asked.get("max_distance", np.inf)
        places, ways = np.arange(len(self.points)).repeat(directions.shape[1]), directions.reshape(-1, 3)
        parts = [slice(begin, begin + 1000) for begin in range(0, len(ways), 1000)]
        t = np.concatenate([meetings(CORNERS, self.points[places[part]], ways[part]) for part in parts])
        face, normal = self.faces[places], self.all_normals()[places]
        t[face >= 0, face[face >= 0]] = np.nan
        met = (t >= 0.0) & (t * np.linalg.norm(ways, axis=1)[:, None] <= distance)
        kept = np.where(met, shares, 1.0).prod(axis=1)
        side = np.where(face >= 0, np.sign(dot(NORMALS[face], normal)), 0.0)
        kept = np.where(dot(ways, NORMALS[face]) * side < 0.0, kept * shares[face], kept)
        return np.where(normal.any(axis=1) & (dot(ways, normal) <= 0.0), 0.0, kept).reshape(directions.shape[:2])

    def all_normals(self) -> Floats:
        return np.zeros_like(self.points) if self.normals is None else self.normals


def alike(directions: Floats, places: Places) -> Floats:
    """The same directions (n, k, 3) for all points."""
    return np.broadcast_to(directions, (len(places.points), *directions.shape))


def frame(pole: Floats) -> Floats:
    """The axes (3, 3) of a hemisphere about a pole: the first across it and the coordinate that it has least of."""
    z = pole / np.linalg.norm(pole)
    x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def occlusion(places: Places, asked: dict[str, Any]) -> Any:
    ways = asked["directions"]
    left = places.left(alike(ways, places), asked)
    if asked.get("packed"):
        return np.packbits(left == 0.0, axis=-1)
    weights = np.ones(len(ways)) if asked.get("weights") is None else asked["weights"]
    return (1.0 - left) @ weights / weights.sum()


def axis_of(up: Any) -> Floats:
    """A direction, or that of an axis."""
    return np.eye(3)["xyz".index(up)] if isinstance(up, str) else np.array(up, np.float64)


def sun_hours(places: Places, asked: dict[str, Any]) -> Any:
    suns = asked["sun_directions"]
    hours = np.ones(len(suns)) if asked.get("weights") is None else asked["weights"]
    if asked.get("up") is not None:
        hours = np.where(suns @ axis_of(asked["up"]) > 0.0, hours, 0.0)
    return places.left(alike(suns, places), asked) @ hours


def sky_view_factor(places: Places, asked: dict[str, Any]) -> Any:
    up = axis_of(asked.get("up", "z"))
    given = asked.get("patches", 145)
    patches = given if isinstance(given, Pattern) else {145: tregenza(), 577: reinhart(2)}.get(given)
    ways, weights = patches or fibonacci_hemisphere(given)
    ways = ways if up[0] == up[1] == 0.0 < up[2] else ways @ frame(up)
    if places.normals is None:
        places = Places(places.points, places.faces, alike(up / np.linalg.norm(up), places))
    seen = places.left(alike(ways, places), asked)
    if asked.get("definition", "cosine") == "cosine":
        weights = weights * np.abs(places.normals @ (ways / np.linalg.norm(ways, axis=1)[:, None]).T)
    whole = np.broadcast_to(weights, seen.shape).sum(axis=1)
    return (seen * weights).sum(axis=1) / np.where(whole > 0.0, whole, 1.0)


def ambient_occlusion(places: Places, asked: dict[str, Any]) -> Any:
    ways = cosine_hemisphere(asked.get("samples", 256)).directions
    turned = np.stack([ways @ frame(normal) for normal in places.all_normals()])
    return places.left(turned, asked).mean(axis=1)


def openness(places: Places, asked: dict[str, Any]) -> Any:
    ways = fibonacci_sphere(asked.get("samples", 1024)).directions
    return places.left(alike(ways, places), asked).mean(axis=1)


TWINS = {f.__name__: f for f in (occlusion, sun_hours, sky_view_factor, ambient_occlusion, openness)}


@st.composite
def places_of(draw: Any, normals: bool) -> Places:
    """Points around the mesh and on its faces."""
    rng, count = np.random.default_rng(draw(SEEDS)), draw(COUNTS)
    faces, is_on = rng.integers(0, FACES, count), rng.random(count) < 0.5
    on = (CORNERS[faces] * rng.dirichlet(np.ones(3), count)[:, :, None]).sum(axis=1)
    around = CORNERS.mean(axis=(0, 1)) + rng.uniform(-9.0, 9.0, (count, 3))
    places = Places(np.where(is_on[:, None], on, around), np.where(is_on, faces, -1))
    if normals:
        axes = np.eye(3)[rng.integers(0, 3, count)]
        drawn = np.where(rng.random((count, 1)) < 0.5, rng.normal(size=(count, 3)), axes)
        places.normals = drawn / np.linalg.norm(drawn, axis=1)[:, None]
        if draw(st.booleans()):
            places.normals = alike(places.normals[0], places)
    return places


def ways_of(seed: int, count: int) -> Floats:
    """Directions to all sides, of any length; some across an axis."""
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-2.0, 2.0, (count, 1))
    ways[np.arange(count), rng.integers(0, 3, count)] *= rng.random(count) < 0.6
    return ways


def weights_of(seed: int, count: int) -> Floats:
    """Some are 0, not all."""
    return np.append(np.random.default_rng(seed).choice([0.0, 0.5, 1.0, 3.0], count - 1), 2.0)


def pattern_of(seed: int, count: int) -> Pattern:
    """Patches above the horizon."""
    ways = ways_of(seed, count)
    ways[:, 2] = np.abs(ways[:, 2]) + 0.01
    return Pattern(ways, weights_of(seed, count))


def shares_of(seed: int, kinds: list[float]) -> Floats:
    """What each face lets through."""
    return np.random.default_rng(seed).choice(kinds, FACES)


FEW = st.sampled_from([1, 7, 8, 9, 40])
DISTANCES = st.sampled_from([0.0, 0.7, 4.0, np.inf])
OPTIONS: dict[str, st.SearchStrategy[Any]] = {
    "directions": st.builds(ways_of, SEEDS, FEW),
    "sun_directions": st.builds(ways_of, SEEDS, FEW),
    "packed": st.booleans(),
    "max_distance": DISTANCES,
    "definition": st.sampled_from(["cosine", "geometric"]),
    "up": st.sampled_from(
        ["x", "y", "z", (0, 0, 1), (0, 0, 2.5), (0, 0, -1), (0, 3, 0), (0.3, -0.2, 0.9), (-1.0, 0.5, 0.25)]
    ),
    "patches": st.one_of(st.sampled_from([1, 50, 145, 577]), st.builds(pattern_of, SEEDS, FEW)),
    "samples": st.sampled_from([1, 2, 100]),
    "threads": st.sampled_from([None, 1, 3]),
    "transmittance": st.builds(
        shares_of, SEEDS, st.sampled_from([[0.0], [1.0], [0.7], [0.0, 1.0], [0.0, 0.3, 1.0], [0.25, 0.8]])
    ),
}
# Drawn with the places and directions; what is shown while it runs is no matter of answers; a former name is tested in
# test_hidden.py.
ELSEWHERE = {"distance", "octree", "points", "normals", "leaving", "weights", "progress"}


def drawn(data: st.DataObject, study: str, places: Places) -> dict[str, Any]:
    """Some of the study's arguments, and all those that it needs."""
    known = inspect.signature(getattr(studies, study)).parameters
    needed = {name for name, p in known.items() if p.default is p.empty} - ELSEWHERE
    # The twin takes its time where many points look in as many directions as they do by default.
    needed |= {"samples"} & known.keys() if len(places.points) > 2 else set()
    chosen = needed | data.draw(st.sets(st.sampled_from(sorted(known.keys() - ELSEWHERE))))
    asked = {name: data.draw(OPTIONS[name]) for name in sorted(chosen)}
    if asked.get("packed"):
        asked.pop("transmittance", None)
    if "weights" in known and not asked.get("packed") and data.draw(st.booleans()):
        ways = asked.get("directions", asked.get("sun_directions"))
        asked["weights"] = weights_of(data.draw(SEEDS), len(ways))
    return asked


@pytest.mark.parametrize("study", TWINS)
@given(st.data())
@settings(max_examples=25)
def test_a_study_answers_as_its_slow_twin(study: str, data: st.DataObject) -> None:
    known = inspect.signature(getattr(studies, study)).parameters
    has_normals = study == "ambient_occlusion" or ("normals" in known and data.draw(st.booleans()))
    places = data.draw(places_of(has_normals))
    asked = drawn(data, study, places)
    shape = data.draw(shapes_of(len(places.points)))
    given = {n: FORMS[data.draw(EXACT)](v) if type(v) is np.ndarray else v for n, v in asked.items()}
    if places.normals is not None:
        same = (places.normals == places.normals[0]).all()
        # Of any length, and one where it is the same for all.
        given["normals"] = 3.0 * (places.normals[0] if same else shaped(shape, places.normals))
    elif "normals" in known:
        given["normals"] = None
    points = places.points
    if data.draw(st.booleans()):
        given["leaving"] = shaped(shape, places.faces)
        # So far off that nothing but the face's number tells that they are on it.
        beside = np.random.default_rng(data.draw(SEEDS)).choice([-(2.0**-24), 2.0**-24], (len(points), 1))
        points = np.where(places.faces[:, None] < 0, points, points + NORMALS[places.faces] * beside)
    target = TARGETS[data.draw(st.sampled_from(sorted(TARGETS)))]
    # Points that are put in order together: all, or some.
    with patch.object(share, "_BLOCK", data.draw(st.sampled_from([share._BLOCK, 37]))):
        got = getattr(studies, study)(target, FORMS[data.draw(EXACT)](shaped(shape, points)), **given)
    expected = TWINS[study](places, asked)
    assert got.shape == (*shape, *expected.shape[1:]) and got.dtype == expected.dtype
    np.testing.assert_allclose(got, expected.reshape(got.shape), rtol=ROUNDED, atol=ROUNDED)


def test_every_study_of_points_has_a_twin() -> None:
    functions = {name for name in studies.__all__ if inspect.isfunction(getattr(studies, name))}
    of_points = {n for n in functions if "points" in inspect.signature(getattr(studies, n)).parameters}
    # View factors have closed forms in the place of a twin.
    assert of_points - {"view_factors_from"} == TWINS.keys()
