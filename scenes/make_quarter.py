"""A generated quarter of 5,000 buildings at UTM coordinates, and what its ground, facades and roofs see.

    python scenes/make_quarter.py FOLDER

writes ``quarter.ply`` (blocks of houses around courts, some of towers, some parks), ``suns.txt`` (the sun on 21
December, every ten minutes of solar time) and, by the commands that it prints, sky view factor and hours of sun of
every face: ``sky.npy`` and ``sun.npy``, pictures of the whole and of some streets. Facades are cut into panels of about
3 m, the ground into squares of 2 m. At the end it says the figures beside those that geometry gives.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer import Mesh
from renderer.cli.main import main as octree_render
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import lattice_faces

Floats = NDArray[np.float64]
# Near Munich in UTM zone 32N, metres, where float32 has steps of half a metre; and how streets lie to the north.
ORIGIN, _TURN = np.array([691_000.0, 5_335_000.0, 519.0]), np.radians(11.0)
_LATITUDE, _DECLINATION, _MINUTES = np.radians(48.14), np.radians(-23.44), 10
# Metres: a panel of a facade, a square of the ground, a storey, and the open ground around all.
_PANEL, _SQUARE, _STOREY, _AROUND = 3.0, 2.0, 3.2, 60.0
# Of streets, one in five an avenue; of blocks along a side and across; of houses along a street, and how deep they are.
_STREETS, _AVENUE, _BLOCKS, _LOTS, _DEPTH = (13.0, 19.0), 32.0, (55.0, 105.0), (11.0, 19.0), (11.0, 13.5)
# The share of blocks that are parks, and that are towers in a park; of houses with a pitched roof; its slope.
_PARKS, _TOWERS, _PITCHED, _SLOPE = 0.05, 0.06, 0.55, np.radians(35.0)
_HOUSES_A_BLOCK, _SEED = 19, 21
# Where streets are seen from, of the middle of the ground.
_EYE = np.array([-150.0, -210.0, 150.0])
GROUND, FACADE, FLAT, PITCHED = range(4)


class House(NamedTuple):
    """A house's corner, its sides along x and y, its height up to the eaves, and the axis of its ridge, -1 if flat."""

    corner: Floats
    size: Floats
    height: float
    ridge: int


class Piece(NamedTuple):
    """A rectangle or a triangle: its corner, two of its sides, how many cells each is cut into, and what it is of.

    Its front is where the sides turn to the left. A triangle's corners are the corner and the ends of both sides.
    """

    corner: Floats
    sides: Floats
    cells: tuple[int, int]
    kind: int
    triangle: bool = False


def quarter(buildings: int) -> tuple[Mesh, NDArray[np.int8]]:
    """The mesh of so many houses on level ground, and of each face whether it is of ground, a facade or a roof."""
    rng = np.random.default_rng(_SEED)
    made = [_on_squares(house) for house in _houses(rng, buildings)]
    upper = np.max([house.corner + house.size for house in made], axis=0) + _AROUND
    sides = np.diag(np.append(upper + _AROUND, 0.0))[:2]
    cells = (round(sides[0, 0] / _SQUARE), round(sides[1, 1] / _SQUARE))
    pieces = [Piece(np.array([-_AROUND, -_AROUND, 0.0]), sides, cells, GROUND)]
    pieces += [piece for house in made for piece in _pieces(house)]
    parts = [_cut(piece) for piece in pieces]
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    faces = np.concatenate([faces + np.int32(start) for (_, faces), start in zip(parts, starts, strict=False)])
    kinds = np.repeat(np.array([piece.kind for piece in pieces], np.int8), [len(faces) for _, faces in parts])
    turn = np.array([[np.cos(_TURN), np.sin(_TURN), 0.0], [-np.sin(_TURN), np.cos(_TURN), 0.0], [0.0, 0.0, 1.0]])
    return Mesh(np.concatenate([v for v, _ in parts]) @ turn + ORIGIN, faces, name="quarter"), kinds


def _houses(rng: np.random.Generator, buildings: int) -> Iterator[House]:
    """So many houses, block by block."""
    columns = max(1, round(np.sqrt(buildings / _HOUSES_A_BLOCK)))
    widths, made = rng.uniform(*_BLOCKS, columns), 0
    lefts = np.concatenate([[0.0], np.cumsum(widths + [_street(rng, k) for k in range(columns)])])
    y, row = 0.0, 0
    while made < buildings:
        depth = rng.uniform(*_BLOCKS)
        for x, width in zip(lefts, widths, strict=False):
            for house in _block(rng, np.array([x, y]), np.array([width, depth])):
                if made < buildings:
                    yield house
                made += 1
        y, row = y + depth + _street(rng, row), row + 1


def _on_squares(house: House) -> House:
    """The house with its walls between squares of the ground, none of which is half indoors then."""
    near, far = (_SQUARE * np.round(place / _SQUARE) for place in (house.corner, house.corner + house.size))
    return house._replace(corner=near, size=far - near)


def _street(rng: np.random.Generator, number: int) -> float:
    return _AVENUE if number % 5 == 2 else float(rng.uniform(*_STREETS))


def _block(rng: np.random.Generator, corner: Floats, size: Floats) -> Iterator[House]:
    """The houses of a block: none in a park, some towers, or rows along the four streets around a court."""
    kind, storeys = rng.random(), int(rng.integers(3, 7))
    if kind < _PARKS:
        return
    if kind < _PARKS + _TOWERS:
        for x, y in ((0.2, 0.25), (0.6, 0.55)):
            yield House(corner + size * (x, y), np.array([18.0, 18.0]), _STOREY * int(rng.integers(12, 21)), -1)
        return
    deep = float(rng.uniform(*_DEPTH))
    for axis in (0, 1):
        # Rows along x take the corners.
        begin, end = (0.0, size[0]) if axis == 0 else (deep, size[1] - deep)
        for far in (0.0, size[1 - axis] - deep):
            ends = _lots(rng, begin, end)
            for a, b in pairwise(ends):
                place = (a, far) if axis == 0 else (far, a)
                sides = (b - a, deep) if axis == 0 else (deep, b - a)
                height = _STOREY * (storeys + int(rng.integers(-1, 2)))
                ridge = axis if rng.random() < _PITCHED else -1
                # A gap now and then, through which a court is seen.
                if rng.random() > 0.06:
                    yield House(corner + place, np.array(sides), height, ridge)


def _lots(rng: np.random.Generator, begin: float, end: float) -> list[float]:
    """Where houses of a row meet."""
    count = max(1, round((end - begin) / float(rng.uniform(*_LOTS))))
    return np.linspace(begin, end, count + 1).tolist()


def _pieces(house: House) -> Iterator[Piece]:
    """Four facades, and a roof, flat or of two slopes with a gable at each end."""
    (x, y), (w, d), h = house.corner, house.size, house.height
    up = (0.0, 0.0, h)
    yield _rectangle((x, y, 0.0), (w, 0.0, 0.0), up, FACADE)
    yield _rectangle((x + w, y, 0.0), (0.0, d, 0.0), up, FACADE)
    yield _rectangle((x + w, y + d, 0.0), (-w, 0.0, 0.0), up, FACADE)
    yield _rectangle((x, y + d, 0.0), (0.0, -d, 0.0), up, FACADE)
    if house.ridge < 0:
        yield _rectangle((x, y, h), (w, 0.0, 0.0), (0.0, d, 0.0), FLAT)
        return
    # Along the ridge, and across it up to the ridge; from each side's right end to its left one.
    along, across = ((w, 0.0), (0.0, d / 2)) if house.ridge == 0 else ((0.0, d), (-w / 2, 0.0))
    near = (x, y) if house.ridge == 0 else (x + w, y)
    rise = float(np.tan(_SLOPE) * np.hypot(*across))
    for corner, turn in ((np.array(near), 1.0), (np.array(near) + along + 2.0 * np.array(across), -1.0)):
        side, half = turn * np.array([*along, 0.0]), turn * np.array([*across, 0.0])
        start, slope = np.array([*corner, h]), np.array([*half[:2], rise])
        yield _rectangle(start, side, slope, PITCHED)
        yield Piece(start, np.array([slope, 2.0 * half]), (1, 1), FACADE, triangle=True)


def _rectangle(corner: Sequence[float] | Floats, along: Sequence[float] | Floats,
               up: Sequence[float] | Floats, kind: int) -> Piece:  # fmt: skip
    """A rectangle of panels."""
    sides = np.array([along, up], np.float64)
    m, n = (max(1, round(float(np.linalg.norm(side)) / _PANEL)) for side in sides)
    return Piece(np.array(corner, np.float64), sides, (m, n), kind)


def _cut(piece: Piece) -> tuple[Floats, NDArray[np.int32]]:
    """The vertices and faces of a piece."""
    if piece.triangle:
        return piece.corner + np.array([np.zeros(3), *piece.sides]), np.array([[0, 1, 2]], np.int32)
    m, n = piece.cells
    j, i = (grid.ravel()[:, None] for grid in np.meshgrid(np.arange(n + 1) / n, np.arange(m + 1) / m, indexing="ij"))
    return piece.corner + i * piece.sides[0] + j * piece.sides[1], lattice_faces(n + 1, m + 1)


def suns() -> Floats:
    """Rows x (east), y (north), z and hours of the sun above the horizon, by its declination and hour angle.

    Source: any almanac: the spherical triangle of pole, zenith and sun.
    """
    turn = np.radians(15.0 * (np.arange(_MINUTES / 120.0, 24.0, _MINUTES / 60.0) - 12.0))
    high, low = np.sin(_LATITUDE) * np.sin(_DECLINATION), np.cos(_LATITUDE) * np.cos(_DECLINATION)
    up = high + low * np.cos(turn)
    north = np.cos(_LATITUDE) * np.sin(_DECLINATION) - np.sin(_LATITUDE) * np.cos(_DECLINATION) * np.cos(turn)
    east = -np.cos(_DECLINATION) * np.sin(turn)
    rows: Floats = np.stack([east, north, up, np.full(len(turn), _MINUTES / 60.0)], axis=1)
    return rows[up > 0.0]


def day_length() -> float:
    """Hours from sunrise to sunset over level ground, whose cosine of hour angle is -tan(latitude) tan(declination)."""
    return float(2.0 * np.degrees(np.arccos(-np.tan(_LATITUDE) * np.tan(_DECLINATION))) / 15.0)


def figures(kinds: NDArray[np.int8], sky: Floats, sun: Floats) -> list[tuple[str, float, float]]:
    """What is known without a ray: its name, the figure of the study, and that of geometry."""
    return [
        ("sky view factor of a flat roof above all others", float(np.nanmax(sky[kinds == FLAT])), 1.0),
        ("of a roof of 35 degrees that nothing hides", float(np.nanmax(sky[kinds == PITCHED])),
         float(1.0 + np.cos(_SLOPE)) / 2.0),
        ("of a facade that nothing hides", float(np.nanmax(sky[kinds == FACADE])), 0.5),
        ("hours of sun of a flat roof above all others", float(np.nanmax(sun[kinds == FLAT])), day_length()),
    ]  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Write all; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--buildings", type=int, default=5_000, metavar="N")
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    made, kinds = quarter(options.buildings)
    mesh, sun, street = (str(options.folder / name) for name in ("quarter.ply", "suns.txt", "street.toml"))
    save_ply(made, mesh)
    np.savetxt(sun, suns(), fmt="%.17g", header="x (east), y (north), z (up), hours: 21 December")
    Path(street).write_text(_view(made), encoding="utf-8")
    for kind, more in (("sky", []), ("sun", ["--suns", sun])):
        whole, near = ([str(options.folder / f"{kind}{name}.{suffix}") for name, suffix in names]
                       for names in ((("", "npy"), ("", "png")), (("-streets", "png"),)))  # fmt: skip
        for command in ([*more, "-o", whole[0], "-o", whole[1]], [*more, "--camera", street, "-o", near[0]]):
            command = ["study", kind, mesh, *command]
            print("octree-render", *command, flush=True)
            code = octree_render(command)
            if code:
                return code
    _say(kinds, *(np.load(options.folder / f"{kind}.npy") for kind in ("sky", "sun")))
    return 0


def _view(mesh: Mesh) -> str:
    """A scene file of the mesh, seen from over the roofs near its middle."""
    middle = (mesh.bounds[0] + mesh.bounds[1]) / 2.0
    middle[2] = mesh.bounds[0][2]
    return (
        f"[camera]\neye = {(middle + _EYE).tolist()}\ntarget = {middle.tolist()}\n"
        "up = [0.0, 0.0, 1.0]\nfov = 40.0\n\n[materials.grey]\ndiffuse = 0.5\n\n"
        '[[objects]]\nmesh = "quarter.ply"\nmaterial = "grey"\n'
    )


def _say(kinds: NDArray[np.int8], sky: Floats, sun: Floats) -> None:
    """Means of what lies outdoors, and figures beside those of geometry."""
    for name, kind in (("ground", GROUND), ("facades", FACADE), ("flat roofs", FLAT), ("pitched roofs", PITCHED)):
        # Ground inside a house, and a wall behind its neighbour's, sees nothing of the sky.
        seen = (kinds == kind) & (sky > 0.0)
        print(f"{name:14} {seen.sum():9,} faces outdoors: sky view factor {sky[seen].mean():.3f}, "
              f"hours of sun {sun[seen].mean():.2f}")  # fmt: skip
    for name, found, known in figures(kinds, sky, sun):
        print(f"{name}: {found:.4f}; by geometry {known:.4f}")


if __name__ == "__main__":
    sys.exit(main())
