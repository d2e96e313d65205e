"""The public accelerators: ``Octree``, and ``BruteForce`` as its baseline with the same interface and triangle test."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.build import SPLITS, Rule, build_blocks, build_tree
from renderer.errors import MeshError, expect
from renderer.layout import CHILDREN, LANES, MAX_LEAF_BLOCKS, NODE_WORDS
from renderer.mesh import Mesh, Repairs
from renderer.parallel import checked_threads
from renderer.query import Hits, Target, any_hits, check_rays, closest_hits

MAX_LEAF_SIZE = LANES * MAX_LEAF_BLOCKS
MAX_DEPTH = 64
# Boxes are float32, whose products of two extents must neither overflow nor vanish. Meshes beyond these sizes are
# scaled by a power of two, which is exact.
_SMALLEST, _LARGEST = 2.0**-60, 2.0**60


@dataclass(frozen=True)
class Stats:
    """What was built. ``references`` counts the faces in all leaves; each face is in exactly one."""

    faces: int
    nodes: int
    leaves: int
    depth: int
    blocks: int
    references: int
    bytes: int

    @property
    def fill(self) -> float:
        """Share of the blocks' places that hold a face; 1 for none at all."""
        return self.references / (self.blocks * LANES) if self.blocks else 1.0


class _Accelerator:
    """Ray queries on one mesh; safe to call from many threads at once.

    ``mesh`` is what was built, and what a hit's ``face`` refers to. ``repairs`` says what ``repair=True`` left out of
    the given arrays, and is None without it.
    """

    def __init__(self, mesh: Mesh, target: Target, threads: int | None) -> None:
        self.mesh = mesh
        self.repairs: Repairs | None = None
        self.target = target
        self.threads = checked_threads(threads)

    def closest_hit(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> Hits:
        """The nearest hit of each ray in the closed interval [t_min, t_max]; equal t: the lowest face.

        ``origins`` and ``directions`` are (n, 3), finite, directions non-zero and of any length; ``t_min`` and
        ``t_max`` are >= 0, one number or (n,), in units of |direction|. No face is culled. A ray in a face's plane
        misses it, unless the rounding of its slopes lifts it out of the plane. The same bits for any number of
        threads. Raises ``ValueError`` naming argument and row.
        """
        rays = check_rays(origins, directions, t_min, t_max, self.target.scale)
        return closest_hits(self.target, rays, self.mesh, self.threads)

    def any_hit(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> NDArray[np.bool_]:
        """Whether each ray hits anything in the closed interval [t_min, t_max], (n,) bool; arguments as above."""
        return any_hits(self.target, check_rays(origins, directions, t_min, t_max, self.target.scale), self.threads)

    @property
    def stats(self) -> Stats:
        """Counts and bytes of the built arrays, those of the mesh left out."""
        tree = self.target.tree
        children = tree.links.reshape(-1, NODE_WORDS)[:, CHILDREN:]
        return Stats(
            faces=len(self.mesh.faces),
            nodes=len(children),
            leaves=int((children < 0).sum()),
            depth=self.target.depth,
            blocks=len(tree.faces) // LANES,
            references=int((tree.faces >= 0).sum()),
            bytes=tree.nodes.nbytes + tree.blocks.nbytes + tree.faces.nbytes,
        )


class Octree(_Accelerator):
    """An octree over triangles with fitted boxes, eight octants tested at once and blocks of four triangles.

    split      "midpoint": octants at the middle of the faces' centres, small ones merged; "sah": binary splits by
               the surface area heuristic, slower to build and a little faster to trace
    leaf_size  the most faces of a leaf, 1 to 32
    max_depth  the deepest level that the split rule may cut, 1 to 64; below it faces are shared out evenly
    threads    for queries; None takes all processors
    repair     build without the faces that name a vertex that is not finite or an index out of range, which are errors
               otherwise. A hit's ``face`` is then one of ``octree.mesh``, the faces that were kept; ``octree.repairs``
               (None without this option) tells what was dropped, and ``repairs.kept_faces[hits.face[hits.hit]]``
               gives the rows of the given ``faces``

    >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> octree.closest_hit([[0.25, 0.25, 2.0]], [[0, 0, -1]]).t
    array([2.])
    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        split: Literal["midpoint", "sah"] = "midpoint",
        leaf_size: int = 4,
        max_depth: int = 32,
        threads: int | None = None,
        repair: bool = False,
    ) -> None:
        mesh, repairs = _mesh(vertices, faces, repair)
        self._build(mesh, split, leaf_size, max_depth, threads)
        self.repairs = repairs

    @classmethod
    def from_mesh(
        cls,
        mesh: Mesh,
        *,
        split: Literal["midpoint", "sah"] = "midpoint",
        leaf_size: int = 4,
        max_depth: int = 32,
        threads: int | None = None,
    ) -> "Octree":
        """Build over a mesh that is already checked; options as in the class."""
        _expect_mesh(mesh)
        octree = cls.__new__(cls)
        octree._build(mesh, split, leaf_size, max_depth, threads)
        return octree

    def _build(self, mesh: Mesh, split: str, leaf_size: int, max_depth: int, threads: int | None) -> None:
        expect(isinstance(split, str) and split in SPLITS, "split", f"one of {sorted(SPLITS)}", repr(split))
        _expect_range("leaf_size", leaf_size, MAX_LEAF_SIZE)
        _expect_range("max_depth", max_depth, MAX_DEPTH)
        vertices, scale = _scaled(mesh)
        tree, depth = build_tree(vertices, mesh.faces, Rule(SPLITS[split], int(leaf_size), int(max_depth)))
        super().__init__(mesh, Target(tree, depth, scale), threads)


class BruteForce(_Accelerator):
    """Every ray against every face, through the octree's own triangle test: its honest baseline.

    ``threads`` and ``repair`` as for ``Octree``.
    """

    def __init__(
        self, vertices: ArrayLike, faces: ArrayLike, *, threads: int | None = None, repair: bool = False
    ) -> None:
        mesh, repairs = _mesh(vertices, faces, repair)
        super().__init__(mesh, _all_blocks(mesh), threads)
        self.repairs = repairs

    @classmethod
    def from_mesh(cls, mesh: Mesh, *, threads: int | None = None) -> "BruteForce":
        """The same over a mesh that is already checked."""
        _expect_mesh(mesh)
        brute = cls.__new__(cls)
        _Accelerator.__init__(brute, mesh, _all_blocks(mesh), threads)
        return brute


def _mesh(vertices: ArrayLike, faces: ArrayLike, repair: bool) -> tuple[Mesh, Repairs | None]:
    expect(isinstance(repair, bool), "repair", "True or False", repr(repair))
    if repair:
        return Mesh.repaired(vertices, faces)
    return Mesh(vertices, faces), None  # type: ignore[arg-type]  # Mesh checks and converts


def _expect_mesh(mesh: object) -> None:
    expect(isinstance(mesh, Mesh), "mesh", "a Mesh", type(mesh).__name__)


def _expect_range(argument: str, value: object, largest: int) -> None:
    good = isinstance(value, int | np.integer) and not isinstance(value, bool) and 1 <= value <= largest
    expect(bool(good), argument, f"an integer from 1 to {largest}", repr(value))


def _all_blocks(mesh: Mesh) -> Target:
    vertices, scale = _scaled(mesh)
    return Target(build_blocks(vertices, mesh.faces), 0, scale)


def _scaled(mesh: Mesh) -> tuple[NDArray[np.float64], float]:
    """The vertices times a power of two that brings the largest coordinate near 1, and that power.

    It is 1 for all but extreme meshes. Raises ``MeshError`` where float64 cannot hold the scaled vertices exactly.
    """
    largest = float(np.abs(mesh.vertices[mesh.faces]).max(initial=0.0)) if _is_extreme(mesh) else 1.0
    if largest == 0.0 or _SMALLEST <= largest <= _LARGEST:
        return mesh.vertices, 1.0
    # Limited to what a float64 can be, for meshes of denormals.
    exponent = min(-int(np.frexp(largest)[1]), 1000)
    scaled = np.ldexp(mesh.vertices, exponent)
    exact = (np.ldexp(scaled, -exponent) == mesh.vertices).all(axis=1)
    if not exact.all():
        row = int((~exact).argmax())
        got = mesh.vertices[row].tolist()
        raise MeshError(f"vertices: expected coordinates within 2^900 of each other, got {got} in row {row}")
    return scaled, 2.0**exponent


def _is_extreme(mesh: Mesh) -> bool:
    """Whether any vertex, used or not, lies outside the comfortable sizes."""
    lower, upper = mesh.bounds
    largest = float(max(np.abs(lower).max(), np.abs(upper).max())) if len(mesh.vertices) else 1.0
    return not _SMALLEST <= largest <= _LARGEST
