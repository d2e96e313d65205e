"""The public accelerators: ``Octree``, and ``BruteForce`` as its baseline with the same interface and triangle test."""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.errors import MeshError, expect
from renderer.mesh.mesh import Mesh, Repairs
from renderer.points.contains import contains
from renderer.process.parallel import checked_threads
from renderer.trace.all_hits import all_hits, count_hits
from renderer.trace.batch import RayBatch, check_rays, moved_off
from renderer.trace.hits import AllHits, Hits
from renderer.trace.layout import BLOCK_FACES, CHILDREN, MAX_LEAF_BLOCKS, NODE_WORDS, Tree
from renderer.trace.query import any_hits, closest_hits
from renderer.tree.build import SPLITS, build_blocks, build_tree
from renderer.tree.hierarchy import Rule
from renderer.tree.refit import refit_tree

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
        """The share of the blocks' places that hold a face; 1 where there is no block."""
        return self.references / (self.blocks * BLOCK_FACES) if self.blocks else 1.0


class _Accelerator:
    """Ray queries on one mesh; safe to call from many threads at once.

    ``mesh`` is the mesh that was built over, to which a hit's ``face`` refers. ``repairs`` says what ``repair=True``
    left out of the given arrays, and is None without it.
    """

    def __init__(self, mesh: Mesh, tree: Tree, threads: int | None) -> None:
        # One reference, so that a refit on another thread changes both at once.
        self._built = (mesh, tree)
        self.repairs: Repairs | None = None
        self.threads = checked_threads(threads)

    @property
    def mesh(self) -> Mesh:
        return self._built[0]

    @property
    def tree(self) -> Tree:
        """The arrays that rays are traced against."""
        return self._built[1]

    @tree.setter
    def tree(self, tree: Tree) -> None:
        self._built = (self.mesh, tree)

    def closest_hit(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: ArrayLike | None = None,
    ) -> Hits:
        """The nearest hit of each ray in the closed interval [t_min, t_max]; equal t: the lowest face.

        origins, directions  (n, 3), finite, or one (3,) for all of the other; directions are not zero, of any length
        t_min, t_max         >= 0, one number or (n,), in units of |direction|
        leaving              faces that the rays start on, one or (n,), -1 for none: each start is moved off its face by
                             more than rounding errors, to the side that the direction points to, so that the ray
                             meets neither that face nor another in its plane. No epsilon is needed

        No face is culled. A ray in a face's plane misses it, unless the rounding of its slopes lifts it out of the
        plane. The same bits for any number of threads. Raises ``ValueError`` naming argument and row.

        >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> hits = octree.closest_hit([[0.1, 0.2, 3.0], [2, 2, 2]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.t, hits.face
        (array([ 3., inf]), array([ 0, -1]))
        >>> octree.closest_hit(hits.points[:1], [[0, 0, -1]], leaving=hits.face[:1]).hit
        array([False])
        """
        mesh, tree = built = self._built
        rays = self._rays(built, origins, directions, t_min, t_max, leaving)
        return closest_hits(tree, rays, mesh, self.threads)

    def any_hit(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: ArrayLike | None = None,
    ) -> NDArray[np.bool_]:
        """Whether each ray hits anything in the closed interval [t_min, t_max], (n,) bool; arguments as above.

        >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> octree.any_hit([[0.1, 0.2, 3.0]], [[0, 0, -1]], t_max=[2.5])
        array([False])
        """
        built = self._built
        rays = self._rays(built, origins, directions, t_min, t_max, leaving)
        return any_hits(built[1], rays, self.threads)

    def all_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: ArrayLike | None = None,
        *,
        contacts: bool = True,
        max_hits: int | None = None,
    ) -> AllHits:
        """All hits of each ray in the closed interval [t_min, t_max], sorted by t, then face; arguments as above.

        contacts  True: the hits of a ray at one edge or corner of the surface, told apart by position, are one contact,
                  which is reported as the first of them. Thin walls and double faces stay two. False: each face that is
                  hit has its row
        max_hits  keep at most so many of each ray, the nearest

        The first row of a ray is its ``closest_hit``, bit for bit, and a ray has rows where ``any_hit`` is true. The
        tree is searched once, and no hit is told from another by its distance. Memory grows with what is found.

        >>> from renderer.mesh.shapes import box
        >>> octree = Octree.from_mesh(box())
        >>> hits = octree.all_hits([[0.5, 0.5, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        >>> hits.t, hits.offsets
        (array([2., 3.]), array([0, 2, 2]))
        >>> octree.all_hits([[0.5, 0.5, 3]], [[0, 0, -1]], contacts=False).t
        array([2., 2., 3., 3.])
        """
        mesh, tree = built = self._built
        rays = self._rays(built, origins, directions, t_min, t_max, leaving)
        return all_hits(tree, rays, mesh, contacts, max_hits, self.threads)

    def count_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        leaving: ArrayLike | None = None,
        *,
        contacts: bool = True,
    ) -> NDArray[np.int64]:
        """The number of rows that ``all_hits`` has for each ray, (n,) int64.

        >>> from renderer.mesh.shapes import box
        >>> Octree.from_mesh(box()).count_hits([[0.5, 0.5, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
        array([2, 0])
        """
        built = self._built
        rays = self._rays(built, origins, directions, t_min, t_max, leaving)
        return count_hits(built[1], rays, contacts, self.threads)

    def _rays(
        self,
        built: tuple[Mesh, Tree],
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike,
        t_max: ArrayLike,
        leaving: ArrayLike | None,
    ) -> RayBatch:
        """The arguments of a query, checked, and moved off the faces that the rays leave."""
        rays = check_rays(origins, directions, t_min, t_max)
        if leaving is None:
            return rays
        return moved_off(rays, leaving, built[0], built[1].scale, self.threads)

    def contains(
        self, points: ArrayLike, boundary: bool = True, rule: Literal["nonzero", "even-odd"] = "nonzero"
    ) -> NDArray[np.bool_]:
        """Whether each point lies inside the closed mesh, (...,) bool, exactly: no votes and no tolerance.

        points    (..., 3), finite
        boundary  the answer for points on the surface itself, which is told exactly too
        rule      "nonzero": inside where the surface winds around the point, so solids may overlap. "even-odd": inside
                  where a way out crosses the surface an odd number of times, however its faces are turned

        The mesh is closed where each edge is passed as often in one direction as in the other ("nonzero") or an even
        number of faces has it ("even-odd"), vertices told apart by position. The answer is that of real arithmetic for
        the float64 coordinates given, and the same bits for any number of threads. Raises ``ValueError`` for points
        that are not finite, with the row, and for a mesh that is not closed, with its open edges.

        Source: Shewchuk, Adaptive Precision Floating-Point Arithmetic, 1997, for the signs.

        >>> from renderer.mesh.shapes import box
        >>> octree = Octree.from_mesh(box())
        >>> octree.contains([[0.5, 0.5, 0.5], [1, 0.5, 0.5], [2, 0, 0]])
        array([ True,  True, False])
        >>> octree.contains([[0.5, 0.5, 0.5], [1, 0.5, 0.5], [2, 0, 0]], boundary=False)
        array([ True, False, False])
        """
        mesh, tree = self._built
        return contains(tree, mesh, points, boundary, rule, self.threads)

    def refit(self, vertices: ArrayLike) -> None:
        """Move the vertices and keep the faces: ``vertices`` is (V, 3), finite, V as built.

        Hits are from then on, bit for bit, those of a new build over the moved mesh. Only boxes and blocks are made
        anew, which takes a fraction of a build. Faces that share a leaf still do, so rays slow down when neighbours
        move apart, about as ``stats.cost`` grows: build anew where that is too much. Normals, colours and texture
        coordinates of ``mesh`` stay as they are.

        A query that runs meanwhile sees the mesh before or after, never a mixture; ``Hits`` keep the mesh that they
        hit. Raises ``MeshError``, and changes nothing, where ``vertices`` cannot replace those of the mesh.

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
        self._built = (moved, refitted)

    @property
    def stats(self) -> Stats:
        """Counts and bytes of the built arrays, those of the mesh left out."""
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

    split      "midpoint": octants about the middle of each box, and the surface area heuristic for the last few faces;
               "sah": that heuristic throughout, slower to build and a little faster to trace
    leaf_size  the most faces of a leaf, 1 to 32; one of more than four only where that is the cheaper
    max_depth  the deepest level that the split rule may cut, 1 to 64; below it faces are shared out evenly
    threads    for the build and queries; None takes all processors; results do not depend on it
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
        mesh = _checked_mesh(mesh)
        octree = cls.__new__(cls)
        octree._build(mesh, split, leaf_size, max_depth, threads)
        return octree

    def _build(self, mesh: Mesh, split: str, leaf_size: int, max_depth: int, threads: int | None) -> None:
        expect(isinstance(split, str) and split in SPLITS, "split", f"one of {sorted(SPLITS)}", repr(split))
        _expect_range("leaf_size", leaf_size, MAX_LEAF_SIZE)
        _expect_range("max_depth", max_depth, MAX_DEPTH)
        vertices, scale = _scaled(mesh)
        rule = Rule(SPLITS[split], int(leaf_size), int(max_depth))
        tree = build_tree(vertices, mesh.faces, rule, scale, checked_threads(threads))
        _check_sides(mesh, vertices, tree)
        super().__init__(mesh, tree, threads)


class BruteForce(_Accelerator):
    """Every ray against every face, through the octree's own triangle test: the octree's baseline.

    ``threads`` and ``repair`` as for ``Octree``.
    """

    def __init__(
        self, vertices: ArrayLike, faces: ArrayLike, *, threads: int | None = None, repair: bool = False
    ) -> None:
        mesh, repairs = _mesh(vertices, faces, repair)
        super().__init__(mesh, _all_blocks(mesh, checked_threads(threads)), threads)
        self.repairs = repairs

    @classmethod
    def from_mesh(cls, mesh: Mesh, *, threads: int | None = None) -> "BruteForce":
        """The same over a mesh that is already checked."""
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


def _expect_range(argument: str, value: object, largest: int) -> None:
    good = isinstance(value, int | np.integer) and not isinstance(value, bool) and 1 <= value <= largest
    expect(bool(good), argument, f"an integer from 1 to {largest}", repr(value))


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
