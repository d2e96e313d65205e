"""The public accelerators: ``Octree``, and ``BruteForce`` as its baseline with the same interface and triangle test."""

import os
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arguments.arrays import flag_argument
from renderer.arguments.counts import count_argument
from renderer.errors import MeshError, expect
from renderer.mesh.mesh import Mesh, Repairs
from renderer.queryable import Built, Queries
from renderer.system.threads import checked_threads
from renderer.trace.layout import BLOCK_FACES, CHILDREN, MAX_LEAF_BLOCKS, NODE_WORDS, Tree
from renderer.tree.build import SPLITS, build_blocks, build_tree
from renderer.tree.hierarchy import Rule
from renderer.tree.refit import refit_tree
from renderer.tree.store import Stored, load_octree, save_octree

MAX_LEAF_SIZE = BLOCK_FACES * MAX_LEAF_BLOCKS
MAX_DEPTH = 64
# Boxes are float32, and the products of two of their extents must neither overflow nor vanish. Meshes beyond these
# sizes are scaled by a power of two, which is exact.
_SMALLEST, _LARGEST = 2.0**-60, 2.0**60
# t comes from products of two sides of a face and the ray's distance from it. Where the distance is as small as a side,
# 2^-330 cubed is 2^-990: 2^32 above the least normal number, so that t and barycentrics keep their digits.
_LEAST_SIDE = 2.0**-330
# Vertices or faces checked together: so few that they stay in the cache.
_ROWS = 1 << 16


@dataclass(frozen=True)
class Stats:
    """Counts of a built tree. ``references`` counts the faces in all leaves; each face is in exactly one.

    ``cost`` is what the surface area heuristic expects of a line that crosses the mesh's bounds and is stopped by
    nothing: the number of nodes that it enters plus the number of blocks that it tests, each counted as its box's share
    of the root's area. It compares trees of one mesh, such as before and after a refit: the time per ray grows about as
    it does.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> stats = Octree.from_mesh(box()).stats
    >>> stats.faces, stats.references, stats.depth
    (12, 12, 1)
    """

    faces: int
    nodes: int
    leaves: int
    depth: int
    blocks: int
    references: int
    bytes: int
    cost: float

    @property
    def fill(self) -> float:
        """The share of the blocks' places that hold a face; 1 where there is no block.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree.from_mesh(box()).stats.fill
        0.6
        """
        return self.references / (self.blocks * BLOCK_FACES) if self.blocks else 1.0


class _Accelerator(Queries):
    """A built mesh, which can be refitted and counted."""

    def refit(self, vertices: ArrayLike) -> None:
        """Move the vertices and keep the faces: ``vertices`` is (V, 3), finite, V as built.

        Hits are from then on, bit for bit, those of a new build over the moved mesh. Only boxes and blocks are made
        anew, which takes a fraction of a build. Faces that share a leaf still do, so rays slow down when neighbours
        move apart, about as ``stats.cost`` grows: build anew where that is too much. Normals, colours and texture
        coordinates of ``mesh`` stay as they are.

        A query that runs meanwhile sees the mesh before or after, never a mixture; ``Hits`` keep the mesh that they
        hit. Raises ``MeshError``, and changes nothing, where ``vertices`` cannot replace those of the mesh.

        >>> from renderer import Octree
        >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> octree.refit([[0, 0, 1], [1, 0, 1], [0, 1, 1]])
        >>> octree.closest_hit([[0.25, 0.25, 2.0]], [[0, 0, -1]]).t
        array([1.])
        """
        mesh, tree = self._built
        moved = _moved(mesh, vertices)
        scaled, scale = _scaled(moved)
        refitted = refit_tree(tree, scaled, moved.faces, scale, self.threads)
        _check_sides(moved, scaled, refitted)
        self._built = Built(moved, refitted)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} over {len(self.mesh.faces):,} faces, depth {self.tree.depth}>"

    @property
    def stats(self) -> Stats:
        """Counts and bytes of the built arrays, those of the mesh left out.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> stats = Octree.from_mesh(box(), leaf_size=2).stats
        >>> stats.nodes, stats.leaves, stats.blocks
        (1, 6, 6)
        """
        mesh, tree = self._built
        children, used = _octants(tree)
        return Stats(
            faces=len(mesh.faces),
            nodes=len(children),
            leaves=int((used & (children < 0)).sum()),
            depth=tree.depth,
            blocks=len(tree.faces) // BLOCK_FACES,
            references=int((tree.faces >= 0).sum()),
            bytes=tree.nodes.nbytes + tree.blocks.nbytes + tree.faces.nbytes,
            cost=_cost(tree),
        )


class Octree(_Accelerator):
    """An octree over triangles with fitted boxes, eight octants tested at once and blocks of four triangles.

    split      "midpoint": octants about the middle of each box, not cut across axes less than half as long as the
               longest, and the surface area heuristic for the last few faces; "sah": that heuristic throughout, slower
               to build, with fewer steps for rays among flat walls
    leaf_size  the most faces of a leaf, 1 to 32; one of more than four only where that is the cheaper
    max_depth  the deepest level that the split rule may cut, 1 to 64; below it faces are shared out evenly
    threads    for the build and queries; None takes all processors; results do not depend on it
    repair     build without the faces that name a vertex that is not finite or an index out of range, which are errors
               otherwise. A hit's ``face`` is then one of ``octree.mesh``, the faces that were kept; ``octree.repairs``
               (None without this option) tells what was dropped, and ``repairs.kept_faces[hits.face[hits.hit]]``
               gives the rows of the given ``faces``

    >>> from renderer import Octree
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
        """Build over a mesh that is already checked; options as in the class.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import icosphere
        >>> octree = Octree.from_mesh(icosphere(3), split="sah", threads=1)
        >>> octree.closest_hit([[0, 0, 3]], [0, 0, -1]).t.round(2)
        array([2.])
        """
        mesh = _checked_mesh(mesh)
        octree = cls.__new__(cls)
        octree._build(mesh, split, leaf_size, max_depth, threads)
        return octree

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write mesh, tree and ``repairs`` to one file, whole or not at all, for ``load``.

        ``renderer/tree/store.py`` describes the file; no suffix is expected. A refit that runs meanwhile is in it or
        not. Raises ``OSError`` where it cannot be written, and ``ValueError`` for what is no path.

        >>> import tempfile
        >>> from renderer import Octree
        >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     octree.save(f"{folder}/triangle.octree")
        ...     again = Octree.load(f"{folder}/triangle.octree")
        >>> again.closest_hit([[0.25, 0.25, 2.0]], [[0, 0, -1]]).t
        array([2.])
        """
        mesh, tree = self._built
        save_octree(path, Stored(mesh, tree, self.repairs))

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, mmap: bool = False, threads: int | None = None) -> "Octree":
        """The octree that ``save`` wrote: the same bits from every query, in a fraction of the time of a build.

        mmap     False: read all, and check each array against its checksum. True: the arrays (V, 3), (F, 3) and the
                 tree's are views of a read-only map of the file: nothing is copied, processes that map one file share
                 its memory, and blocks of triangles, most of the file, are read when rays come to them. The checksums
                 of arrays are not checked then, and the file must not be written to as long as the octree is used, or
                 the process may crash; ``save`` over it is safe on POSIX, as it makes a new file
        threads  for queries, as in the class

        Either way the tree is checked so far that no content, damaged or forged, crashes a query; where no checksum
        tells, it may give wrong hits. The octree can be refitted, pickled and saved again. Raises ``ValueError`` that
        names the path: not there, not a file, no octree, of another version, truncated, damaged.

        >>> import tempfile
        >>> from renderer import Octree
        >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> with tempfile.NamedTemporaryFile() as file:
        ...     octree.save(file.name)
        ...     mapped = Octree.load(file.name, mmap=True, threads=1)
        >>> mapped.mesh.vertices.shape, mapped.mesh.faces.flags.writeable
        ((3, 3), False)
        """
        threads = checked_threads(threads)
        stored = load_octree(path, flag_argument("mmap", mmap))
        octree = cls.__new__(cls)
        _Accelerator.__init__(octree, stored.mesh, stored.tree, threads)
        # rule: repairs-of-file
        octree.repairs = stored.repairs
        return octree

    def _build(self, mesh: Mesh, split: str, leaf_size: int, max_depth: int, threads: int | None) -> None:
        expect(isinstance(split, str) and split in SPLITS, "split", f"one of {sorted(SPLITS)}", repr(split))
        leaf_size = count_argument("leaf_size", leaf_size, 1, MAX_LEAF_SIZE)
        max_depth = count_argument("max_depth", max_depth, 1, MAX_DEPTH)
        vertices, scale = _scaled(mesh)
        rule = Rule(SPLITS[split], leaf_size, max_depth)
        tree = build_tree(vertices, mesh.faces, rule, scale, checked_threads(threads))
        _check_sides(mesh, vertices, tree)
        super().__init__(mesh, tree, threads)


class BruteForce(_Accelerator):
    """Every ray against every face, through the octree's own triangle test: the octree's baseline.

    ``threads`` and ``repair`` as for ``Octree``.

    >>> from renderer import BruteForce, Octree
    >>> from renderer.mesh.shapes import icosphere
    >>> mesh, rays = icosphere(3), ([[0.1, 0.2, 3], [2, 2, 2]], [0, 0, -1])
    >>> brute, octree = BruteForce(mesh.vertices, mesh.faces), Octree(mesh.vertices, mesh.faces)
    >>> bool((brute.closest_hit(*rays).t == octree.closest_hit(*rays).t).all())
    True
    """

    def __init__(
        self, vertices: ArrayLike, faces: ArrayLike, *, threads: int | None = None, repair: bool = False
    ) -> None:
        mesh, repairs = _mesh(vertices, faces, repair)
        super().__init__(mesh, _all_blocks(mesh, checked_threads(threads)), threads)
        self.repairs = repairs

    @classmethod
    def from_mesh(cls, mesh: Mesh, *, threads: int | None = None) -> "BruteForce":
        """The same over a mesh that is already checked.

        >>> from renderer import BruteForce
        >>> from renderer.mesh.shapes import box
        >>> BruteForce.from_mesh(box(), threads=1).any_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
        array([ True, False])
        """
        mesh = _checked_mesh(mesh)
        brute = cls.__new__(cls)
        _Accelerator.__init__(brute, mesh, _all_blocks(mesh, checked_threads(threads)), threads)
        return brute


def _mesh(vertices: ArrayLike, faces: ArrayLike, repair: bool) -> tuple[Mesh, Repairs | None]:
    expect(isinstance(repair, bool), "repair", "True or False", repr(repair))
    if repair:
        return Mesh.repaired(vertices, faces)
    return Mesh(vertices, faces), None


def _checked_mesh(mesh: Mesh) -> Mesh:
    """``mesh``, checked again if its arrays have been made writable since it was."""
    arrays = hasattr(mesh, "vertices") and hasattr(mesh, "faces")  # as a trimesh.Trimesh, or Open3D's mesh, has them
    hint = ", whose arrays Octree(mesh.vertices, mesh.faces) takes" if arrays else ""
    expect(isinstance(mesh, Mesh), "mesh", "a renderer.Mesh", f"{type(mesh).__module__}.{type(mesh).__name__}{hint}")
    return replace(mesh) if mesh.vertices.flags.writeable or mesh.faces.flags.writeable else mesh


def _all_blocks(mesh: Mesh, threads: int) -> Tree:
    vertices, scale = _scaled(mesh)
    tree = build_blocks(vertices, mesh.faces, scale, threads)
    _check_sides(mesh, vertices, tree)
    return tree


def _moved(mesh: Mesh, vertices: ArrayLike) -> Mesh:
    """The mesh with other positions of its vertices."""
    try:
        shape = np.shape(vertices)
    except ValueError:  # a ragged list, which Mesh rejects in more detail
        shape = mesh.vertices.shape
    if shape != mesh.vertices.shape:
        raise MeshError(f"vertices: expected shape {mesh.vertices.shape} as built, got {shape}")
    changed: Any = {"vertices": vertices}  # Mesh checks and converts
    return replace(mesh, **changed)


def _octants(tree: Tree) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """The children of all nodes, (n, 8), and which octants are not empty."""
    words = tree.nodes.reshape(-1, NODE_WORDS)
    return tree.links.reshape(-1, NODE_WORDS)[:, CHILDREN : CHILDREN + 8], words[:, :8] <= words[:, 8:16]


def _cost(tree: Tree) -> float:
    """``Stats.cost``; every box counts whole where the root's has no area, and every block where there is no node."""
    if not len(tree.nodes):
        return float(len(tree.faces) // BLOCK_FACES)
    rows = tree.nodes.reshape(-1, NODE_WORDS)[:, :CHILDREN].reshape(-1, 3, 2, 8)
    children, used = _octants(tree)
    extents = np.where(used[:, None], np.float64(rows[:, :, 1]) - rows[:, :, 0], 0.0)
    areas = (extents * np.roll(extents, 1, axis=1)).sum(axis=1)
    lower, upper = rows[0, :, 0].min(axis=1), rows[0, :, 1].max(axis=1)
    x, y, z = np.float64(upper) - lower
    whole = x * y + y * z + z * x
    shares = areas / whole if 0.0 < whole < np.inf else used.astype(np.float64)
    blocks = np.where(children < 0, (~children & (MAX_LEAF_BLOCKS - 1)) + 1, 1)
    return 1.0 + float((shares * blocks).sum())


def _scaled(mesh: Mesh) -> tuple[NDArray[np.float64], float]:
    """The vertices times a power of two that brings the largest coordinate near 1, and that power.

    It is 1 for all but extreme meshes. Raises ``MeshError`` where float64 cannot hold the scaled vertices exactly.
    """
    largest = float(np.abs(mesh.vertices[mesh.faces]).max(initial=0.0)) if _is_extreme(mesh) else 1.0
    if largest == 0.0 or _SMALLEST <= largest <= _LARGEST:
        return mesh.vertices, 1.0
    # Limited so that 2^exponent is a float64, for meshes of denormals.
    exponent = min(-int(np.frexp(largest)[1]), 1000)
    with np.errstate(over="ignore"):  # of a vertex that no face names; it comes back as inf
        scaled = np.ldexp(mesh.vertices, exponent)
        exact = (np.ldexp(scaled, -exponent) == mesh.vertices).all(axis=1)
    if not exact.all():
        row = int((~exact).argmax())
        got = mesh.vertices[row].tolist()
        raise MeshError(f"vertices: expected coordinates within 2^900 of each other, got {got} in row {row}")
    # Read-only as the mesh's own, or kernels would be compiled again for writable arrays.
    scaled.setflags(write=False)
    return scaled, 2.0**exponent


def _check_sides(mesh: Mesh, vertices: NDArray[np.float64], tree: Tree) -> None:
    """Raise ``MeshError`` for a face so small, beside the largest coordinate, that its products vanish."""
    # Differences of float32 numbers are 0 or at least 2^-149; those of float64 numbers at least 2^-53 of the smaller.
    if tree.blocks.dtype == np.float32 or _least_of(vertices) >= 2.0**53 * _LEAST_SIDE:
        return
    for begin in range(0, len(mesh.faces), _ROWS):
        corners = vertices[mesh.faces[begin : begin + _ROWS]]
        sides = np.sort(corners.max(axis=1) - corners.min(axis=1), axis=1)[:, 1]
        bad = (sides > 0.0) & (sides < _LEAST_SIDE)
        if bad.any():
            row, least = int(bad.argmax()), _LEAST_SIDE / tree.scale
            got = f"{sides[row] / tree.scale:.3g} in row {begin + row}"
            raise MeshError(
                f"faces: expected a second longest side of their bounds of 0 or, beside coordinates that large, at "
                f"least {least:.3g}, got {got}"
            )


def _least_of(vertices: NDArray[np.float64]) -> float:
    """The least size of a coordinate that is not 0."""
    least = np.inf
    for begin in range(0, len(vertices), _ROWS):
        sizes = np.abs(vertices[begin : begin + _ROWS])
        sizes[sizes == 0.0] = np.inf
        least = min(least, float(sizes.min()))
    return least


def _is_extreme(mesh: Mesh) -> bool:
    """Whether the largest coordinate of any vertex, used or not, is not from _SMALLEST to _LARGEST."""
    # Not from mesh.bounds: the least of each column takes thirty times as long as the least of all.
    largest = float(max(mesh.vertices.max(), -mesh.vertices.min())) if len(mesh.vertices) else 1.0
    return not _SMALLEST <= largest <= _LARGEST
