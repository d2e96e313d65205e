"""A car park: a terrain, 500 cars of three models and trees, in which a car with a lidar drives and others move.

    python scenes/make_car_park.py FOLDER

writes the point cloud of each frame, ``frame_000.ply`` and so on, coloured by object. ``docs/gallery/car_park.py``
draws it. Lengths are in metres, and z is up.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer import Mesh, PerspectiveCamera, RayScene
from renderer.mesh.heightfield import heightfield_mesh
from renderer.shapes import box
from renderer.studies import Scan, scan

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
_SEED = 11
# The ground's least corner, its size and its cells; a parked car's place; from one pair of rows to the next.
_CORNER, _SIZE, _CELL, _PLACE, _PAIR = (-100.0, -75.0), (200.0, 150.0), 0.5, (2.6, 5.2), 17.0
# Pairs of rows back to back; places in a row, and those of them that have a tree.
_PAIRS, _IN_ROW, _TREES = 5, 54, (10, 21, 32, 43)
# Trees around the park, and leaves of a crown.
_AROUND, _LEAVES = 160, 2500
# Cars of a model that drive; their metres a second, and those of the car with the scanner; its height above the ground.
_DRIVING, _SPEED, _OWN_SPEED, _MAST = 4, 6.0, 8.0, 1.85
# Seconds between frames.
TURN = 0.1
# The masks of all, and of the car with the scanner, which does not scan itself.
SEEN, OWN = 1, 2
# Where the sun is, and the colour of the sky.
_SUN, _SKY = np.array([0.5, -0.6, 0.65]), (0.75, 0.85, 0.95)
# What objects are, and their colours.
COLORS = {
    "ground": (0.45, 0.50, 0.56), "hatchback": (1.0, 0.62, 0.18), "saloon": (0.30, 0.68, 1.0), "van": (1.0, 0.36, 0.45),
    "glass": (0.80, 1.0, 0.95), "wheels": (0.22, 0.22, 0.25), "trunk": (0.66, 0.48, 0.32), "crown": (0.36, 0.80, 0.36),
}  # fmt: skip


class Model(NamedTuple):
    """A car's length, width and height, the lengths of bonnet and boot, and how far its screens lean."""

    size: tuple[float, float, float]
    bonnet: float
    boot: float
    front: float
    back: float


MODELS = {
    "hatchback": Model((4.0, 1.75, 1.48), 0.95, 0.12, 0.85, 0.45),
    "saloon": Model((4.7, 1.82, 1.42), 1.25, 0.75, 0.9, 0.75),
    "van": Model((5.1, 1.95, 2.05), 0.75, 0.05, 0.75, 0.1),
}


class Fleet(NamedTuple):
    """The cars of a model: the objects that they are made of, and for each car (k,) where it is, and its speed."""

    objects: list[int]
    x: Floats
    y: Floats
    heading: Floats
    speed: Floats

    def poses(self, rows: Integers, seconds: ArrayLike) -> Floats:
        """Where some of them are at a time. Those that leave the park on one side come in on the other."""
        ahead = self.speed[rows] * np.cos(self.heading[rows]) * seconds
        return poses((self.x[rows] + ahead + 70.0) % 140.0 - 70.0, self.y[rows], self.heading[rows])


class Park(NamedTuple):
    """The scene, what each of its objects is, and the cars, of which the first saloon has the scanner."""

    scene: RayScene
    kinds: list[str]
    fleets: dict[str, Fleet]

    def move(self, seconds: float) -> None:
        """Put the cars that drive where they are at a time."""
        for fleet in self.fleets.values():
            rows = np.flatnonzero(fleet.speed)
            for each in fleet.objects:
                self.scene.move(each, fleet.poses(rows, seconds), instances=rows)

    def scanner(self, moments: Floats) -> Floats:
        """The poses of the scanner, which is above its car."""
        places = self.fleets["saloon"].poses(np.zeros(len(moments), np.int64), moments)
        places[:, :, 3] += _MAST * places[:, :, 2]
        return places

    def scan(self, seconds: float, columns: int = 1024, rings: int = 64) -> Scan:
        """A turn of the scanner, which goes on between columns, and sees through windows."""
        scanner = self.scanner(seconds + TURN * np.arange(columns) / columns)
        glass = [number for number, kind in enumerate(self.kinds) if kind == "glass"]
        return scan(
            self.scene, np.repeat(scanner, rings, axis=0), directions(columns, rings), max_distance=120.0, returns=3,
            through=glass, mask=SEEN,
        )  # fmt: skip

    def drives(self, cloud: Scan) -> NDArray[np.bool_]:
        """Which points are of cars that drive."""
        found = np.zeros(len(cloud.points), np.bool_)
        for fleet in self.fleets.values():
            for each in fleet.objects:
                own = cloud.objects == each
                found[own] = fleet.speed[cloud.instances[own]] > 0.0
        return found

    def colors(self, objects: Integers) -> Floats:
        """The colour (n, 3) of each object."""
        return np.array([COLORS[kind] for kind in self.kinds])[objects]

    def picture(self, camera: PerspectiveCamera, width: int, height: int) -> Floats:
        """What a camera sees (height, width, 3), in the sun or in the shade, by four rays a pixel."""
        hits = self.scene.closest_hit(*camera.primary_rays((2 * width, 2 * height)))
        shaded = self.scene.any_hit(np.where(hits.hit[..., None], hits.points, 0.0), _SUN, leaving=hits)
        light = 0.35 + 0.65 * np.where(shaded, 0.0, np.abs(hits.normals @ _SUN))
        colors = np.where(hits.hit[..., None], self.colors(hits.object) * light[..., None], _SKY)
        return colors.reshape(height, 2, width, 2, 3).mean(axis=(1, 3)).clip(0.0, 1.0)


def drawn(points: Floats, colors: Floats, camera: PerspectiveCamera, width: int, height: int) -> Floats:
    """Points on black (height, width, 3), as a camera sees them: squares of two pixels, the nearest in front."""
    right, up, ahead = camera.frame()
    way = points - np.array(camera.eye)
    away = np.maximum(way @ ahead, 1.0)
    pixels = height / 2.0 / np.tan(np.radians(camera.fov / 2.0)) / away
    column, row = width / 2.0 + pixels * (way @ right), height / 2.0 - pixels * (way @ up)
    seen = (away > 1.0) & (column >= 0.0) & (column < width - 1.0) & (row >= 0.0) & (row < height - 1.0)
    order = np.flatnonzero(seen)[np.argsort(-away[seen])]
    picture = np.full((height, width, 3), 0.04)
    for down, along in np.ndindex(2, 2):
        picture[row[order].astype(int) + down, column[order].astype(int) + along] = colors[order]
    return picture


def directions(columns: int, rings: int) -> Floats:
    """The directions of a turn, column by column."""
    turn = np.linspace(np.pi, -np.pi, columns, endpoint=False)[:, None]
    rise = np.radians(np.linspace(-25.0, 5.0, rings))
    ways = [np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.broadcast_to(np.sin(rise), (columns, rings))]
    return np.stack(ways, axis=2).reshape(-1, 3)


def car_park() -> Park:
    """The park at the time 0."""
    rng, scene, kinds, fleets = np.random.default_rng(_SEED), RayScene(), list[str](), dict[str, Fleet]()

    def add(kind: str, mesh: Mesh, transforms: Floats | None = None, mask: ArrayLike = SEEN) -> int:
        kinds.append(kind)
        return scene.add(mesh, transforms, mask=mask, name=kind)

    east, north = (low + np.arange(0.0, size + _CELL, _CELL) for low, size in zip(_CORNER, _SIZE, strict=True))
    add("ground", heightfield_mesh(height(east, north[:, None]), _CELL, (*_CORNER, 0.0)))
    x, y, heading = places(rng)
    green = np.tile(np.isin(np.arange(_IN_ROW), _TREES), 2 * _PAIRS)
    for kind, stands in enumerate(np.array_split(woods(rng, x[green], y[green]), 3, axis=1)):
        for name, mesh in zip(("trunk", "crown"), tree(kind), strict=True):
            add(name, mesh, poses(*stands, upright=True))
    model = rng.choice(len(MODELS), len(x), p=(0.45, 0.35, 0.2))
    for number, name in enumerate(MODELS):
        own = ~green & (model == number)
        there = driving(number, x[own], y[own], heading[own])
        masks = np.where((np.arange(own.sum()) == 0) & (name == "saloon"), OWN, SEEN)
        made = zip((name, "glass", "wheels"), car(MODELS[name]), strict=True)
        fleets[name] = Fleet([add(kind, mesh, poses(*there[:3]), masks) for kind, mesh in made], *there)
    return Park(scene, kinds, fleets)


def places(rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """The middles of all places for cars, row by row, and the headings of cars there: some are backed in."""
    along = _PLACE[0] * (np.arange(_IN_ROW) - (_IN_ROW - 1) / 2.0)
    rows = _PAIR * (np.arange(_PAIRS) - (_PAIRS - 1) / 2.0)[:, None] + np.array([-0.5, 0.5]) * _PLACE[1]
    x, y = (part.ravel() for part in np.broadcast_arrays(along, rows.reshape(-1, 1)))
    side = np.repeat(np.tile([1.0, -1.0], _PAIRS), _IN_ROW) * rng.choice([1.0, -1.0], len(x), p=(0.7, 0.3))
    jitter = rng.normal(size=(3, len(x))) * [[0.1], [0.15], [0.02]]
    return x + jitter[0], y + jitter[1], side * np.pi / 2.0 + jitter[2]


def driving(number: int, x: Floats, y: Floats, heading: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """The places, headings and speeds of a model's cars, of which the first few drive in the lanes."""
    car, speed = _DRIVING * number + np.arange(_DRIVING), np.zeros(len(x))
    lane, west = car % (_PAIRS - 1), (car // (_PAIRS - 1) % 2 == 0) | (car % (_PAIRS - 1) == 1)
    x[:_DRIVING], heading[:_DRIVING], speed[:_DRIVING] = 11.0 * car - 62.0, np.where(west, np.pi, 0.0), _SPEED
    y[:_DRIVING] = _PAIR * (lane - _PAIRS / 2.0 + 1.0) + np.where(west, 1.6, -1.6)
    if number == 1:  # the scanner's, towards those that come in its lane
        x[0], y[0], heading[0], speed[0] = -40.0, -_PAIR / 2.0 - 1.6, 0.0, _OWN_SPEED
    return x, y, heading, speed


def woods(rng: np.random.Generator, x: Floats, y: Floats) -> Floats:
    """Where trees stand: at the given places and around the park; rows x, y, heading and size."""
    around = rng.uniform(-1.0, 1.0, (2, 40 * _AROUND)) * [[97.0], [72.0]]
    around = around[:, (np.abs(around[0]) > 76.0) | (np.abs(around[1]) > 46.0)][:, :_AROUND]
    x, y = np.append(x, around[0]), np.append(y, around[1])
    stands = np.stack([x, y, rng.uniform(0.0, 7.0, len(x)), rng.uniform(0.7, 1.3, len(x))])
    return rng.permutation(stands, axis=1)


def height(x: ArrayLike, y: ArrayLike) -> Floats:
    """The height of the ground: nearly level under the cars, and hills around."""
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    outside = np.clip(np.maximum(np.abs(x) / 76.0, np.abs(y) / 48.0) - 1.0, 0.0, 1.0)
    hills = 40.0 * outside**1.5 * (1.0 + 0.4 * np.sin(x / 9.0) * np.cos(y / 7.0))
    return 0.01 * x + 0.5 * np.sin(x / 31.0) * np.cos(y / 23.0) + hills


def poses(x: Floats, y: Floats, heading: Floats, size: ArrayLike = 1.0, upright: bool = False) -> Floats:
    """Matrices (k, 3, 4) that stand things on the ground: their x ahead, their y to the left."""
    step = 0.0 if upright else 1.0
    slopes = [height(x + dx, y + dy) - height(x - dx, y - dy) for dx, dy in ((step, 0.0), (0.0, step))]
    up = _unit(np.stack([-slopes[0], -slopes[1], np.full(x.shape, 2.0)], axis=1))
    left = _unit(np.cross(up, np.stack([np.cos(heading), np.sin(heading), np.zeros(x.shape)], axis=1)))
    turn = np.stack([np.cross(left, up), left, up], axis=2) * np.reshape(size, (-1, 1, 1))
    return np.concatenate([turn, np.stack([x, y, height(x, y)], axis=1)[:, :, None]], axis=2)


def _unit(vectors: Floats) -> Floats:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def car(model: Model) -> tuple[Mesh, Mesh, Mesh]:
    """A car: its body, its windows, and its wheels with the seats."""
    length, width, top = model.size
    half, wide, narrow, belt = length / 2.0, width / 2.0, width / 2.0 - 0.2, 0.62 * top if top < 1.8 else 0.52 * top
    ahead, behind = half - model.bonnet, model.boot - half
    outline = [
        (-half, 0.45), (0.12 - half, 0.22), (half - 0.15, 0.22), (half, 0.45), (half - 0.08, 0.72 * belt),
        (ahead, belt), (behind, belt), (0.05 - half, 0.92 * belt),
    ]  # fmt: skip
    sides = [(behind, -1.0), (ahead, -1.0), (ahead, 1.0), (behind, 1.0)]
    lean = {behind: model.back, ahead: -model.front}
    window = [(x, wide * y, belt) for x, y in sides] + [(x + lean[x], narrow * y, top) for x, y in sides]
    panes = [[k, (k + 1) % 4, 4 + (k + 1) % 4] for k in range(4)] + [[k, 4 + (k + 1) % 4, 4 + k] for k in range(4)]
    roof = Mesh(window[4:], [[0, 1, 2], [0, 2, 3]])
    seats = [box((x, y, belt - 0.5), (x + 0.2, y + 0.5, belt + 0.25)) for x in (-0.9, 0.0) for y in (-0.6, 0.1)]
    wheels = [wheel(x, y) for x in (0.82 - half, half - 0.85) for y in (0.1 - wide, wide - 0.1)]
    return Mesh.concatenate(prism(outline, wide), roof), Mesh(window, panes), Mesh.concatenate(*seats, *wheels)


def wheel(x: float, y: float) -> Mesh:
    """A wheel that stands at a place."""
    turn = np.linspace(0.0, 2.0 * np.pi, 20, endpoint=False)
    tyre = prism([(x + 0.33 * np.cos(a), 0.33 + 0.33 * np.sin(a)) for a in turn], 0.11)
    return Mesh(tyre.vertices + np.array([0.0, y, 0.0]), tyre.faces)


def prism(outline: Sequence[tuple[float, float]], half: float) -> Mesh:
    """A body between -half and half along y, with an outline (x, z) that is seen whole from its middle."""
    k, (x, z) = len(outline), np.mean(outline, axis=0)
    corners = [(a, y, b) for y in (-half, half) for a, b in outline] + [(x, -half, z), (x, half, z)]
    a, b = np.arange(k), (np.arange(k) + 1) % k
    ends = [(a, b, np.full(k, 2 * k)), (k + b, k + a, np.full(k, 2 * k + 1))]
    return Mesh(corners, np.concatenate([np.stack(rows, 1) for rows in (*ends, (b, a, k + a), (b, k + a, k + b))]))


def tree(kind: int) -> tuple[Mesh, Mesh]:
    """A trunk, and a crown of single leaves in tufts, some 6 m high."""
    rng, a, turn = np.random.default_rng(kind), np.arange(8), np.arange(8) / 4.0 * np.pi
    rings = [np.stack([r * np.cos(turn), r * np.sin(turn), np.full(8, z)], 1) for r, z in ((0.2, -1.0), (0.08, 4.0))]
    b = (a + 1) % 8
    trunk = Mesh(np.concatenate(rings), np.concatenate([np.stack([a, b, 8 + b], 1), np.stack([a, 8 + b, 8 + a], 1)]))
    tufts = _unit(rng.normal(size=(30, 3))) * [1.3, 1.3, 1.5 + 0.4 * kind]
    leaves = tufts[rng.integers(0, 30, _LEAVES)] + rng.normal(size=(_LEAVES, 3)) * 0.4 + [0.0, 0.0, 4.2]
    corners = leaves[:, None] + rng.normal(size=(_LEAVES, 3, 3)) * 0.11
    return trunk, Mesh(corners.reshape(-1, 3), np.arange(3 * _LEAVES).reshape(-1, 3))


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the clouds; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--frames", type=int, default=100, metavar="N")
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    park, points = car_park(), 0
    for frame in range(options.frames):
        park.move(TURN * frame)
        cloud = park.scan(TURN * frame)
        colors, none = park.colors(cloud.objects), np.empty((0, 3), np.int32)
        Mesh(cloud.points, none, colors=colors).save(options.folder / f"frame_{frame:03}.ply")
        points += len(cloud.points)
    print(f"{park.scene}; frames: {options.frames}; points: {points:,}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
