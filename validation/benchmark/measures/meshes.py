"""The meshes of a run: a series of one shape and many sizes, those of other kinds, and files.

Only N differs within the series, so that costs can be compared against faces.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import lattice_faces
from validation.benchmark.measures.forms import FORMS, short
from validation.benchmark.peers.contender import Floats
from validation.hits.rays import float32_exact

QUICK = (1_000, 10_000, 100_000)
FULL = (*QUICK, 1_000_000, 5_000_000)
HUGE = (*FULL, 10_000_000)
# Other kinds: the two of a quick run are those that differ most from spheres, and small.
QUICK_FORMS = (("thin", 10_000), ("city", 10_000))
FULL_FORMS = tuple((form, faces) for form in FORMS for faces in (100_000, 1_000_000))
SERIES, FILE = "spheres", "file"
_SEED = 7


def displaced_spheres(faces: int) -> Mesh:
    """Eight spheres with seeded hills, at the corners of a cube and nearly touching: about ``faces`` faces, 96 n^2.

    Eight spheres, because a single sphere does not shadow itself: here a third of the shadow and bounce rays hit
    something. The hills are the same at every size. Vertices are exact in float32. The six n x n lattices of a sphere
    share no vertices along their borders, where rounding may separate them by an ulp.
    """
    n = max(1, round((faces / 96) ** 0.5))
    sphere = _cube_sphere(n)
    corners = 1.05 * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    points = [c + sphere * (1.0 + 0.035 * _hills(sphere + c))[:, None] for c in corners]
    side = lattice_faces(n + 1, n + 1)
    all_faces = np.concatenate([side + np.int32(i * (n + 1) ** 2) for i in range(6 * len(corners))])
    return Mesh(float32_exact(np.concatenate(points)), all_faces, name=f"{SERIES}_{short(faces)}")


def _cube_sphere(n: int) -> Floats:
    """Points of the unit sphere: (n + 1) x (n + 1) on each side of a cube, row by row, counter-clockwise outside."""
    # Equal angles rather than equal lengths: then cells at the cube's corners are nearly as large as in the middle.
    along = np.tan(np.linspace(-np.pi / 4, np.pi / 4, n + 1))
    x, y = (a.ravel() for a in np.meshgrid(along, along))
    z = np.ones_like(x)
    sides = [np.stack([np.roll((s * x, y, s * z), turn, axis=0) for turn in range(3)]) for s in (1.0, -1.0)]
    points: Floats = np.concatenate(sides).transpose(0, 2, 1).reshape(-1, 3)
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def _hills(points: Floats) -> Floats:
    rng = np.random.default_rng(_SEED)
    height = np.zeros(len(points))
    for _ in range(20):
        wave = rng.normal(size=3)
        wave *= rng.uniform(2.5, 18.0) / np.linalg.norm(wave)
        height += np.sin(points @ wave + rng.uniform(0.0, 2.0 * np.pi)) / (wave @ wave) ** 0.4
    return height


class Chosen(NamedTuple):
    """A mesh of a run and its kind: ``SERIES``, a name of ``FORMS``, or ``FILE``."""

    mesh: Mesh
    kind: str

    @property
    def brief(self) -> bool:
        """Whether only first hits are measured, without slow contenders, so that a run with all kinds ends."""
        return self.kind in FORMS


def chosen(quick: bool, huge: bool, paths: tuple[Path, ...]) -> Iterator[Chosen]:
    """The meshes of a run, one at a time."""
    for faces in QUICK if quick else HUGE if huge else FULL:
        yield Chosen(displaced_spheres(faces), SERIES)
    for form, faces in QUICK_FORMS if quick else FULL_FORMS:
        yield Chosen(FORMS[form](faces), form)
    for path in paths:
        yield Chosen(from_file(path), FILE)


def named(text: str) -> Mesh:
    """A mesh by its number of faces (of the series), by kind and faces as in ``terrain_100k``, or from a file."""
    found = re.fullmatch(rf"(?:({'|'.join((SERIES, *FORMS))})_)?(\d+)([km]?)", text)
    if found is None:
        return from_file(Path(text))
    faces = int(found[2]) * {"": 1, "k": 1_000, "m": 1_000_000}[found[3]]
    return FORMS.get(found[1], displaced_spheres)(faces)


def from_file(path: Path) -> Mesh:
    """A mesh file's, rounded to float32, in which the peers compute."""
    mesh = load_mesh(path)
    return Mesh(float32_exact(mesh.vertices), mesh.faces, name=path.stem)
