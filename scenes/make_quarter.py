"""A generated quarter of 5,000 buildings at UTM coordinates, and what its ground, walls and roofs see.

    python scenes/make_quarter.py FOLDER

writes ``quarter.ply``, ``suns.txt`` (the sun on 21 December at 48 degrees north, every ten minutes of solar time), and,
by the commands that it prints, ``sky.png``, ``sky.npy``, ``sun.png`` and ``sun.npy``: sky view factor and hours of sun
of every face, seen from the south-west. Walls are cut into panels of about 3 m, the ground into squares of 2 m.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer import Mesh
from renderer.cli import main as octree_render
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import lattice_faces

Floats = NDArray[np.float64]
# Near Munich in UTM zone 32N, metres; float32 has steps of half a metre there.
ORIGIN = np.array([691_000.0, 5_335_000.0, 519.0])
# Blocks of houses around streets: their pitch, the width of the street in it, and the ground around all.
_PITCH, _STREET, _AROUND = 18.0, 9.0, 40.0
_PANEL, _SQUARE = 3.0, 2.0
_LATITUDE, _DECLINATION, _MINUTES = 48.14, -23.44, 10
_SEED = 21


def quarter(buildings: int) -> Mesh:
    """So many houses of 4 to 8 storeys, a few of up to 20, on level ground."""
    rng = np.random.default_rng(_SEED)
    columns = int(np.ceil(np.sqrt(buildings)))
    pieces: list[tuple[Floats, NDArray[np.int32]]] = []
    for k in range(buildings):
        corner = _PITCH * np.array([k % columns, k // columns]) + rng.uniform(0.0, 2.0, 2)
        size = _PITCH - _STREET + rng.uniform(-1.5, 1.5, 2)
        storeys = rng.integers(8, 21) if rng.random() < 0.03 else rng.integers(4, 9)
        pieces += _house(corner, size, 3.0 * float(storeys))
    rows = -(-buildings // columns)
    extent = _PITCH * np.array([columns, rows]) + 2.0 * _AROUND
    pieces.append(_rectangle((-_AROUND, -_AROUND, 0.0), (extent[0], 0.0, 0.0), (0.0, extent[1], 0.0), _SQUARE))
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in pieces])
    vertices = np.concatenate([vertices for vertices, _ in pieces]) + ORIGIN
    faces = np.concatenate([faces + np.int32(start) for (_, faces), start in zip(pieces, starts, strict=False)])
    return Mesh(vertices, faces, name="quarter")


def _house(corner: Floats, size: Floats, height: float) -> Iterator[tuple[Floats, NDArray[np.int32]]]:
    """Four walls and a flat roof, their outer sides to the front."""
    (x, y), (w, d) = corner, size
    yield _rectangle((x, y, 0.0), (w, 0.0, 0.0), (0.0, 0.0, height), _PANEL)
    yield _rectangle((x + w, y, 0.0), (0.0, d, 0.0), (0.0, 0.0, height), _PANEL)
    yield _rectangle((x + w, y + d, 0.0), (-w, 0.0, 0.0), (0.0, 0.0, height), _PANEL)
    yield _rectangle((x, y + d, 0.0), (0.0, -d, 0.0), (0.0, 0.0, height), _PANEL)
    yield _rectangle((x, y, height), (w, 0.0, 0.0), (0.0, d, 0.0), _PANEL)


def _rectangle(
    corner: Sequence[float], along: Sequence[float], up: Sequence[float], cell: float
) -> tuple[Floats, NDArray[np.int32]]:
    """A rectangle cut into cells of about the given size; its front is where ``along`` and ``up`` turn to the left."""
    m, n = (max(1, round(float(np.linalg.norm(side)) / cell)) for side in (along, up))
    j, i = (grid.ravel()[:, None] for grid in np.meshgrid(np.arange(n + 1) / n, np.arange(m + 1) / m, indexing="ij"))
    return np.asarray(corner) + i * np.asarray(along) + j * np.asarray(up), lattice_faces(n + 1, m + 1)


def suns() -> Floats:
    """Rows x (east), y (north), z and hours of the sun above the horizon, by its declination and hour angle.

    Source: any almanac: the spherical triangle of pole, zenith and sun.
    """
    turn = np.radians(15.0 * (np.arange(_MINUTES / 120.0, 24.0, _MINUTES / 60.0) - 12.0))
    latitude, declination = np.radians([_LATITUDE, _DECLINATION])
    up = np.sin(latitude) * np.sin(declination) + np.cos(latitude) * np.cos(declination) * np.cos(turn)
    north = np.cos(latitude) * np.sin(declination) - np.sin(latitude) * np.cos(declination) * np.cos(turn)
    east = -np.cos(declination) * np.sin(turn)
    rows: Floats = np.stack([east, north, up, np.full(len(turn), _MINUTES / 60.0)], axis=1)
    return rows[up > 0.0]


def main(arguments: Sequence[str] | None = None) -> int:
    """Write all; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--buildings", type=int, default=5_000, metavar="N")
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    mesh, sun = (str(options.folder / name) for name in ("quarter.ply", "suns.txt"))
    save_ply(quarter(options.buildings), mesh)
    np.savetxt(sun, suns(), fmt="%.17g", header="x (east), y (north), z (up), hours: 21 December")
    for kind, more in (("sky", ()), ("sun", ("--suns", sun))):
        for suffix in ("npy", "png"):
            command = ["study", kind, mesh, *more, "-o", str(options.folder / f"{kind}.{suffix}")]
            print("octree-render", *command, flush=True)
            code = octree_render(command)
            if code:
                return code
    return 0


if __name__ == "__main__":
    sys.exit(main())
