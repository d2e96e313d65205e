"""The public accelerators: ``Octree``, and ``BruteForce`` as its baseline with the same interface and triangle test."""

from __future__ import annotations  # so that help() shows ArrayLike by its name

import os
from dataclasses import dataclass, replace
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument
from renderer.arguments.counts import count_argument
from renderer.arguments.split import SPLIT, Split
from renderer.arguments.types import ArrayLike
from renderer.errors import MeshError, expect
from renderer.mesh.foreign import TriangleMesh, has_triangles
from renderer.mesh.mesh import Mesh, Repairs, foreign_arrays
from renderer.queryable import Built, Queries
from renderer.system.threads import checked_threads
from renderer.trace.layout import BLOCK_FACES, CHILDREN, MAX_LEAF_BLOCKS, NODE_WORDS, Tree, root_box
from renderer.tree.build import SPLITS, build_blocks, build_tree
from renderer.tree.hierarchy import Rule
from renderer.tree.refit import refit_tree
from renderer.tree.store import Stored, load_octree, save_octree

MAX_LEAF_SIZE = BLOCK_FACES * MAX_LEAF_BLOCKS
MAX_DEPTH = 64
# Boxes are float32, and the products of two of their extents must neither overflow nor vanish. Meshes beyond these
# sizes are scaled by a power of two, which is exact.
SMALLEST, LARGEST = 2.0**-60, 2.0**60
# t comes from products of two sides of a face and the ray's distance from it. Where the distance is as small as a side,
# 2^-330 cubed is 2^-990: 2^32 above the least normal number, so that t and barycentrics keep their digits.
_LEAST_SIDE = 2.0**-330
# Vertices or faces checked together: so few that they stay in the cache.
_ROWS = 1 << 16


@dataclass(frozen=True)
class Stats:
    """Counts of a built tree.

    Attributes
    ----------
    faces, nodes, leaves : int
        Numbers of faces, inner nodes and leaves.
    depth : int
        The number of levels.
    blocks : int
        Blocks of four triangles.
    references : int
        Faces in all leaves; each face is in exactly one.
    bytes : int
        Memory of the tree, without the mesh.
    cost : float
        The nodes entered and blocks tested that the surface area heuristic expects of a line through the bounds. It
        compares trees of one mesh, as before and after a refit: the time per ray grows about as it does.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> stats = Octree(box()).stats
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
        """The share of the blocks' places that hold a face; 1 without blocks.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).stats.fill
        0.6
        """
        return self.references / (self.blocks * BLOCK_FACES) if self.blocks else 1.0


class _Accelerator(Queries):
    """A built mesh, which can be refitted and counted."""

    def refit(self, vertices: ArrayLike) -> None:
        """Move the vertices and keep the faces, in a fraction of the time of a build.

        Hits are then bit for bit those of a new build. Rays slow down where faces of one leaf move apart, about as
        ``stats.cost`` grows; build anew where that is too much. Normals, colours, texture coordinates and parts of
        ``mesh`` stay. A query that runs meanwhile sees the mesh before or after. ``Hits`` keep the mesh that they hit.

        Parameters
        ----------
        vertices : array_like, shape (V, 3)
            Finite, and as many as before.

        Raises
        ------
        MeshError
            For other arrays; nothing is changed then.

        Examples
        --------
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
        """Counts of the tree: faces, nodes, leaves, depth, blocks, bytes and cost.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> stats = Octree(box(), leaf_size=2).stats
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
    """An octree over a triangle mesh, for ray, inside and distance queries.

    ``Octree(mesh)`` takes a ``Mesh``, the path of a mesh file, or an object with ``vertices`` and ``faces``, such as a
    ``trimesh.Trimesh``. ``Octree(vertices, faces)`` takes arrays.

    Parameters
    ----------
    vertices : Mesh, str, path, trimesh.Trimesh, or array_like of shape (V, 3)
        The mesh, or its vertices if ``faces`` is given.
    faces : array_like of int, shape (F, 3), optional
        Vertex numbers, counter-clockwise seen from outside.
    split : {"midpoint", "sah"}, default "sah"
        Where boxes are cut: in the middle, or by the surface area heuristic. The second takes up to a fifth longer to
        build, and saves steps where rays run among flat walls.
    leaf_size : int, default 4
        The most faces of a leaf, 1 to 32. Leaves of more than four are made only where they cost less.
    max_depth : int, default 32
        The deepest level that ``split`` may cut, 1 to 64. Below it faces are shared out evenly.
    threads : int, optional
        Threads of the build and of queries; None for all processors. Results do not depend on it.
    repair : bool, default False
        Leave out faces that name a missing vertex or one that is not finite, which are errors otherwise. ``face`` of a
        hit then counts the faces of ``octree.mesh``, and ``octree.repairs`` says what was left out. For a file, a
        ``RepairWarning`` says it.

    Raises
    ------
    MeshError
        For a mesh that cannot be used. The message names the array or file and the fault.
    FileNotFoundError
        If there is no such file. The error is a ``MeshError`` too.

    Examples
    --------
    >>> from renderer import Octree
    >>> octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> octree.closest_hit([[0.25, 0.25, 2.0]], [[0, 0, -1]]).t
    array([2.])
    >>> Octree("scenes/models/torus_knot.ply")
    <Octree over 40,000 faces, depth 6>
    """

    @overload
    def __init__(
        self,
        vertices: Mesh | str | os.PathLike[str] | TriangleMesh,
        faces: None = None,
        *,
        split: Split = SPLIT,
        leaf_size: int = 4,
        max_depth: int = 32,
        threads: int | None = None,
        repair: bool = False,
    ) -> None: ...
    @overload
    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        split: Split = SPLIT,
        leaf_size: int = 4,
        max_depth: int = 32,
        threads: int | None = None,
        repair: bool = False,
    ) -> None: ...
    def __init__(
        self,
        vertices: Mesh | str | os.PathLike[str] | TriangleMesh | ArrayLike,
        faces: ArrayLike | None = None,
        *,
        split: Split = SPLIT,
        leaf_size: int = 4,
        max_depth: int = 32,
        threads: int | None = None,
        repair: bool = False,
    ) -> None:
        mesh, repairs = as_mesh(vertices, faces, repair)
        self._build(mesh, split, leaf_size, max_depth, threads)
        self.repairs = repairs

    @classmethod
    def from_mesh(
        cls,
        mesh: Mesh,
        *,
        split: Split = SPLIT,
        leaf_size: int = 4,
        max_depth: int = 32,
        threads: int | None = None,
    ) -> Octree:
        """Build over a ``Mesh``, as ``Octree(mesh)`` does.

        Parameters
        ----------
        mesh : Mesh
        split, leaf_size, max_depth, threads
            As for ``Octree``.

        Returns
        -------
        Octree

        Examples
        --------
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
        """Write mesh, tree and ``repairs`` to one file for ``Octree.load``.

        The file appears whole or not at all. It has no materials.

        Parameters
        ----------
        path : str or path
            Any file name.

        Raises
        ------
        OSError
            If the file cannot be written.
        ValueError
            For what is no path.

        Notes
        -----
        ``renderer/tree/store.py`` describes the file.

        Examples
        --------
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
    def load(cls, path: str | os.PathLike[str], *, mmap: bool = False, threads: int | None = None) -> Octree:
        """Return the octree that ``Octree.save`` wrote, in a fraction of the time of a build.

        It gives the same bits, and can be refitted, pickled and saved again.

        Parameters
        ----------
        path : str or path
        mmap : bool, default False
            Map the file instead of reading it: nothing is copied, processes share the memory, and blocks of triangles
            are read when rays come to them. Checksums of arrays are not checked. The file must not be written to while
            the octree is used; ``save`` over it is safe on POSIX, as it makes a new file.
        threads : int, optional
            Threads of queries; None for all processors.

        Returns
        -------
        Octree

        Raises
        ------
        FileNotFoundError
            If there is no such file. The error is a ``ValueError`` too.
        ValueError
            For a file that is no octree, of another version, truncated or damaged. The message names the path.

        Notes
        -----
        No content, damaged or forged, crashes a query. Where no checksum is checked, it may give wrong hits.

        Examples
        --------
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
    """Every ray against every face, by the octree's own triangle test: a baseline with the queries of ``Octree``.

    Parameters
    ----------
    vertices, faces, threads, repair
        As for ``Octree``.

    Examples
    --------
    >>> from renderer import BruteForce, Octree
    >>> from renderer.mesh.shapes import icosphere
    >>> mesh, rays = icosphere(3), ([[0.1, 0.2, 3], [2, 2, 2]], [0, 0, -1])
    >>> brute, octree = BruteForce(mesh), Octree(mesh)
    >>> bool((brute.closest_hit(*rays).t == octree.closest_hit(*rays).t).all())
    True
    """

    @overload
    def __init__(
        self,
        vertices: Mesh | str | os.PathLike[str] | TriangleMesh,
        faces: None = None,
        *,
        threads: int | None = None,
        repair: bool = False,
    ) -> None: ...
    @overload
    def __init__(
        self, vertices: ArrayLike, faces: ArrayLike, *, threads: int | None = None, repair: bool = False
    ) -> None: ...
    def __init__(
        self,
        vertices: Mesh | str | os.PathLike[str] | TriangleMesh | ArrayLike,
        faces: ArrayLike | None = None,
        *,
        threads: int | None = None,
        repair: bool = False,
    ) -> None:
        mesh, repairs = as_mesh(vertices, faces, repair)
        super().__init__(mesh, _all_blocks(mesh, checked_threads(threads)), threads)
        self.repairs = repairs

    @classmethod
    def from_mesh(cls, mesh: Mesh, *, threads: int | None = None) -> BruteForce:
        """Return the same over a ``Mesh``, as ``BruteForce(mesh)`` does.

        Parameters
        ----------
        mesh : Mesh
        threads : int, optional
            As for ``Octree``.

        Returns
        -------
        BruteForce

        Examples
        --------
        >>> from renderer import BruteForce
        >>> from renderer.mesh.shapes import box
        >>> BruteForce.from_mesh(box(), threads=1).any_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
        array([ True, False])
        """
        mesh = _checked_mesh(mesh)
        brute = cls.__new__(cls)
        _Accelerator.__init__(brute, mesh, _all_blocks(mesh, checked_threads(threads)), threads)
        return brute


def as_mesh(given: Any, faces: ArrayLike | None, repair: bool) -> tuple[Mesh, Repairs | None]:
    """The mesh that the first arguments of ``Octree`` stand for, and its repairs, None without ``repair``.

    Raises ``MeshError`` naming the argument.
    """
    expect(isinstance(repair, bool), "repair", "True or False", repr(repair))
    if isinstance(given, str | os.PathLike) and faces is None:
        # Imported here, because all readers of files come with it.
        from renderer.mesh.load import load_mesh

        return load_mesh(given, repair=repair), None
    if isinstance(given, Mesh) and faces is None:
        mesh = _checked_mesh(given)  # nothing in it needs repair
        return mesh, Mesh.repaired(mesh.vertices, mesh.faces)[1] if repair else None
    attributes: dict[str, Any] = {}
    if has_triangles(given):
        if faces is not None:
            raise MeshError(f"faces: expected none beside a mesh, got {type(faces).__name__}")
        given, faces, attributes = foreign_arrays(given)
    elif faces is None:
        _refuse(given)
    if repair:
        return Mesh.repaired(given, faces, **attributes)  # type: ignore[arg-type]
    return Mesh(given, faces, **attributes), None  # type: ignore[arg-type]


def _refuse(given: object) -> None:
    """Raise the error for one argument that is neither a mesh nor a path."""
    if isinstance(given, list | tuple) or hasattr(given, "__array__") or hasattr(given, "__dlpack__"):
        raise MeshError("faces: expected integers of shape (F, 3) beside vertices, got None")
    hint = "; scene.to_mesh() makes one of a scene" if hasattr(given, "to_mesh") else ""
    raise MeshError(
        "mesh: expected a Mesh, a path, an object with vertices and faces such as a trimesh.Trimesh, or vertices and "
        f"faces, got {type(given).__module__}.{type(given).__name__}{hint}"
    )


def _checked_mesh(mesh: Mesh) -> Mesh:
    """``mesh``, checked again if its arrays have been made writable since it was."""
    hint = "; Octree(mesh) takes it" if has_triangles(mesh) else ""
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
    lower, upper = root_box(tree.nodes)
    x, y, z = upper - lower
    whole = x * y + y * z + z * x
    shares = areas / whole if 0.0 < whole < np.inf else used.astype(np.float64)
    blocks = np.where(children < 0, (~children & (MAX_LEAF_BLOCKS - 1)) + 1, 1)
    return 1.0 + float((shares * blocks).sum())


def _scaled(mesh: Mesh) -> tuple[NDArray[np.float64], float]:
    """The vertices times a power of two that brings the largest coordinate near 1, and that power.

    It is 1 for all but extreme meshes. Raises ``MeshError`` where float64 cannot hold the scaled vertices exactly.
    """
    largest = float(np.abs(mesh.vertices[mesh.faces]).max(initial=0.0)) if _is_extreme(mesh) else 1.0
    if largest == 0.0 or SMALLEST <= largest <= LARGEST:
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
    """Whether the largest coordinate of any vertex, used or not, is not from SMALLEST to LARGEST."""
    # Not from mesh.bounds: the least of each column takes thirty times as long as the least of all.
    largest = float(max(mesh.vertices.max(), -mesh.vertices.min())) if len(mesh.vertices) else 1.0
    return not SMALLEST <= largest <= LARGEST
