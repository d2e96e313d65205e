"""A scene at one moment, as queries read it: instances in order, and the nodes over them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from renderer.distance.closest import Counted
from renderer.errors import expect, expect_known
from renderer.lazy import lazy
from renderer.mesh.mending import enclosed_share
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.queryable import Built
from renderer.rayscene.placing import box_all, corners_of_faces, locate
from renderer.rayscene.transforms import place_records
from renderer.system.threads import for_chunks
from renderer.trace.batch import NO_STARTS, RayBatch
from renderer.trace.instances import (
    FACING,
    FIRST_FACE,
    FLAGS,
    HALF,
    HIDDEN,
    INSTANCE_COUNT,
    INSTANCE_WORDS,
    INSTANCES,
    MATRIX,
    MESH_FACES,
    MIDDLE,
    MIRRORS,
    NUMBER_BITS,
    OBJECT,
    OBJECT_WORDS,
    SCENE_WORDS,
    TOP_NODES,
    VERTICES,
)
from renderer.trace.layout import (
    ANY_ORDER,
    BLOCK_FACES,
    BLOCK_WORDS,
    CHILDREN,
    LEAF_BITS,
    MASK_BITS,
    NODE_WORDS,
    ORDERS,
    TREE_WORDS,
    UNUSED,
    Tree,
    cache_aligned,
    root_box,
)
from renderer.tree.build import SPLITS, build_nodes, new_faces
from renderer.tree.hierarchy import Rule

# The faces of a scene are numbered by int32, and the largest number means none.
MOST_FACES = np.iinfo(np.int32).max - 1
# So many that a block of the last one, times BLOCK_WORDS, is an int64.
MOST_INSTANCES = (1 << 63 - NUMBER_BITS) // BLOCK_WORDS - 1
# The sides of faces that rays may hit, as ``trace.instances`` numbers them.
SIDES = ("both", "front", "back")
# A block and the place in it share a number with the instance.
_MOST_BLOCKS = (1 << NUMBER_BITS) // BLOCK_WORDS
# The share of its box that a mesh encloses for certain, whatever is rounded.
_ENCLOSED = 1e-6
# Faces that are looked for together: a tenth of a millisecond.
_CHUNK = 4096
_RULE = Rule(SPLITS["sah"], 1, 32)


def _new_id() -> str:
    return uuid4().hex


@dataclass(frozen=True, eq=False)
class Member:
    """A mesh of a scene with its tree, and the number of its instances; ``names`` are theirs, if any."""

    id: int
    name: str
    built: Built
    count: int
    names: tuple[str, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle without the addresses."""
        return Member, (self.id, self.name, self.built, self.count, self.names)

    @lazy
    def row(self) -> NDArray[np.int64]:
        """The object as kernels read it. It holds addresses, valid as long as this is kept."""
        mesh, tree = self.built
        row = np.zeros(OBJECT_WORDS, np.int64)
        row[:TREE_WORDS] = tree.descriptor
        row[VERTICES], row[MESH_FACES] = mesh.vertices.ctypes.data, mesh.faces.ctypes.data
        # Of the faces: a vertex that none of them has may be anywhere.
        lower, upper = root_box(tree.nodes) if len(mesh.faces) else (np.zeros(3), np.zeros(3))
        numbers = row.view(np.float64)
        numbers[MIDDLE : MIDDLE + 3] = lower / 2 + upper / 2
        # A rounding more, so that the box is around all corners.
        numbers[HALF : HALF + 3] = np.where(upper > lower, np.nextafter((upper - lower) / 2, np.inf), 0.0)
        return row

    @lazy
    def encloses(self) -> bool:
        """Whether the mesh is closed and, as its faces are turned, encloses more than nothing; so do copies then."""
        mesh = self.built.mesh
        return mesh.is_closed() and enclosed_share(mesh.bounds, mesh.triangles) > _ENCLOSED


class Members:
    """The members of a scene in order, and what a tree over their instances needs of them.

    table  (m + 1, 2) int64, the first instance and the number of each, and the number of instances last
    sizes  (n,) int64, the number of faces of each instance
    """

    def __init__(self, members: Iterable[Member]) -> None:
        self.listed = list(members)
        counts = np.array([m.count for m in self.listed], np.int64)
        faces = np.array([len(m.built.mesh.faces) for m in self.listed], np.int64)
        self.faces, self.sizes = int((counts * faces).sum()), np.repeat(faces, counts)
        begins, ids = np.concatenate([[0], counts.cumsum()]), [m.id for m in self.listed]
        self.table = np.stack([begins, np.array([*ids, -1])], axis=1)
        self._begins = dict(zip(ids, begins.tolist(), strict=False))
        self.depth = max((m.built.tree.depth for m in self.listed), default=0)

    def __iter__(self) -> Iterator[Member]:
        return iter(self.listed)

    def rows(self, member: Member) -> slice:
        """The rows of a member's instances among all."""
        begin = self._begins[member.id]
        return slice(begin, begin + member.count)

    def number(self, instances: NDArray[np.float64]) -> None:
        """Write the number of the first face of each instance, and the address of its object."""
        words, first = instances.view(np.int64), 0
        for m in self:
            own = words[self.rows(m)]
            faces = len(m.built.mesh.faces)
            own[:, OBJECT] = m.row.ctypes.data
            own[:, FIRST_FACE] = first + faces * np.arange(m.count)
            first += faces * m.count


class SceneTree:
    """The nodes over the instances of a scene. It has what queries read of ``layout.Tree``."""

    has_nodes, scale = True, 1.0

    def __init__(self, members: Members, instances: NDArray[np.float64], threads: int) -> None:
        words = instances.view(np.int64)
        shown = np.flatnonzero((words[:, FLAGS] & HIDDEN == 0) & (members.sizes > 0))
        self.members, self.instances, self.faces_shown = members, instances, int(members.sizes[shown].sum())
        self.nodes, levels = _top(instances, words, shown, threads)
        self.depth = levels + members.depth + 1

    def facing(self, faces: str) -> SceneTree:
        """The same for rays that hit the sides ``faces`` only."""
        expect_known("faces", faces, SIDES)
        if faces == SIDES[0]:
            return self
        tree = SceneTree.__new__(SceneTree)
        vars(tree).update(vars(self), descriptor=self.descriptor.copy())
        tree.descriptor[FACING] = SIDES.index(faces)
        return tree

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle without the addresses: instances are placed anew."""
        return tree_over, (self.members.listed, *placement(self.members, self.instances), 1)

    @lazy
    def descriptor(self) -> NDArray[np.uint64]:
        """The scene as kernels read it, see ``trace.instances``."""
        words = np.zeros(SCENE_WORDS, np.uint64)
        words[TOP_NODES], words[INSTANCES] = self.nodes.ctypes.data, self.instances.ctypes.data
        words[INSTANCE_COUNT] = len(self.instances)
        return words


def _top(
    instances: NDArray[np.float64], words: NDArray[np.int64], shown: NDArray[np.int64], threads: int
) -> tuple[NDArray[np.float32], int]:
    """The nodes over the instances ``shown``, whose links are those, and their levels."""
    if not len(shown):
        nodes = cache_aligned(NODE_WORDS, np.float32)
        nodes[:] = 0.0
        rows = nodes[:CHILDREN].reshape(3, 2, 8)
        rows[:, 0], rows[:, 1] = np.inf, -np.inf
        links = nodes.view(np.int32)
        links[CHILDREN : CHILDREN + 8], links[ORDERS : ORDERS + 8] = UNUSED, ANY_ORDER
        return nodes, 1
    order = new_faces(len(shown))
    box_all(instances, words, shown, order.boxes, order.numbers)
    nodes, block_faces, depth = build_nodes(order, _RULE, threads)
    links = nodes.view(np.int32).reshape(-1, NODE_WORDS)[:, CHILDREN : CHILDREN + 8]
    # Those of empty octants too, as a ray enters one where boxes are NaN: they become the first of all.
    leaves = links < 0
    links[leaves] = ~shown[block_faces[BLOCK_FACES * (~links[leaves] >> LEAF_BITS)]].astype(np.int32)
    return nodes, depth


class Located(NamedTuple):
    """Places on faces of a scene: objects, their instances, the faces of their meshes, and barycentrics on these."""

    object: NDArray[np.int64]
    instance: NDArray[np.int64]
    face: NDArray[np.int64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BuiltScene:
    """A scene at one moment: the tree over the instances of its members.

    To queries it is its own mesh. What they need of a mesh beside its tree is here; only what no tree knows is computed
    from the merged mesh.
    """

    top: SceneTree
    threads: int
    # The scene of which it is a moment, and the moment; copies of both are the same.
    owner: str = field(default_factory=_new_id)
    moment: str = field(default_factory=_new_id)

    @property
    def members(self) -> Members:
        """The objects."""
        return self.top.members

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle without what is computed anew."""
        return BuiltScene, (self.top, self.threads, self.owner, self.moment)

    @property
    def tree(self) -> Any:
        """The tree, as queries take it."""
        return self.top

    def tree_for(self, rays: RayBatch, faces: str) -> Any:
        """The tree to trace rays against: that of a mesh that stands alone, where it is, as far as that is enough."""
        top = self.top.facing(faces)
        return self._alone if top is self.top and rays.starts is NO_STARTS and self._alone is not None else top

    @lazy
    def _alone(self) -> Tree | None:
        if len(self.top.instances) != 1 or not self.top.faces_shown:
            return None
        plain = self.top.instances.view(np.int64)[0, FLAGS] == MASK_BITS
        only = next(m for m in self.members if m.count)
        (matrix,) = self.matrices(only)
        return only.built.tree if plain and (matrix == np.eye(3, 4)).all() else None

    @property
    def count(self) -> int:
        """The number of faces of all instances."""
        return self.members.faces

    def flags(self, member: Member) -> NDArray[np.int64]:
        """The masks of a member's instances, with HIDDEN of those that are not shown."""
        return self.top.instances.view(np.int64)[self.members.rows(member), FLAGS] & (MASK_BITS | HIDDEN)

    @property
    def mesh(self) -> Any:
        """The mesh, as queries take it."""
        return self

    @property
    def faces(self) -> range:
        """As many as faces are shown; ``count`` numbers them all."""
        return range(self.top.faces_shown)

    @lazy
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """A box around all that is shown."""
        return root_box(self.top.nodes)

    @property
    def vertices(self) -> NDArray[np.float64]:
        """The vertices of the merged mesh."""
        return self.merged.mesh.vertices

    @property
    def triangles(self) -> NDArray[np.float64]:
        """The triangles of the merged mesh."""
        return self.merged.mesh.triangles

    @lazy
    def open_edges(self) -> NDArray[Any]:
        """``Mesh.open_edges`` of the merged mesh, which has none if no placed mesh has one."""
        return self._edges("open_edges")

    @lazy
    def odd_edges(self) -> NDArray[Any]:
        """``Mesh.odd_edges`` of the merged mesh, which has none if no placed mesh has one."""
        return self._edges("odd_edges")

    def _edges(self, of: str) -> NDArray[Any]:
        own = [getattr(m.built.mesh, of) for m in self.members]
        edges: NDArray[Any] = getattr(self.merged.mesh, of) if any(map(len, own)) else np.empty((0, 2), np.int64)
        return edges

    def is_closed(self) -> bool:
        """``Mesh.is_closed`` of the merged mesh: closed meshes are closed together, unless they cancel."""
        return all(m.encloses for m in self.members) or self.merged.mesh.is_closed()

    @lazy
    def merged(self) -> Octree:
        """The one mesh that the placed meshes make together."""
        return Octree.from_mesh(Mesh.concatenate(list(self._placed())), threads=self.threads)

    def _placed(self) -> Iterator[Mesh]:
        """The mesh of each instance that is shown."""
        for m in self.members:
            for matrix, flag in zip(self.matrices(m), self.flags(m), strict=True):
                if flag & HIDDEN == 0:
                    yield m.built.mesh.transformed(np.concatenate([matrix, [[0.0, 0.0, 0.0, 1.0]]]))

    def matrices(self, member: Member) -> NDArray[np.float64]:
        """The transforms of a member's instances, (k, 3, 4)."""
        return matrices_of(member, self.top.instances[self.members.rows(member)])

    def located(self, faces: NDArray[np.int64], u: NDArray[np.float64], v: NDArray[np.float64]) -> Located:
        """The ``Located`` faces of the scene (...) with places on them; -1 for -1."""
        flat, weights = np.ascontiguousarray(faces).reshape(-1), np.stack([u.reshape(-1), v.reshape(-1)])
        located, swapped = np.empty((3, len(flat)), np.int64), np.empty((2, len(flat)))
        words = self.top.instances.view(np.int64)
        members = self.members.table

        def find(begin: int, end: int) -> None:
            locate(words, members, flat, weights, located, swapped, begin, end)

        for_chunks(find, len(flat), _CHUNK, self.threads)
        return Located(*(row.reshape(faces.shape) for row in (*located, *swapped)))

    def instances_of(self, faces: NDArray[np.int64]) -> NDArray[np.int64]:
        """The instances among all, from 0, of faces of the scene (k,); some one for -1."""
        first = self.top.instances.view(np.int64)[:, FIRST_FACE]
        return np.maximum(np.searchsorted(first, faces, side="right") - 1, 0)

    def corners(self, faces: NDArray[np.int64]) -> NDArray[np.float64]:
        """The placed corners of faces of the scene, (k, 3, 3)."""
        corners = np.empty((len(faces), 3, 3))
        corners_of_faces(self.top.descriptor, np.ascontiguousarray(faces), corners)
        return corners

    def counted(self, mask: int | None) -> Counted:
        """The instances that are shown and, with a mask, have a bit of it, as ``closest_point`` takes them."""

        def faces() -> tuple[NDArray[np.int64], NDArray[np.float64]]:
            flags = self.top.instances.view(np.int64)[:, FLAGS]
            chosen = (flags & HIDDEN == 0) & (mask is None or flags & mask != 0)
            numbers = np.flatnonzero(np.repeat(chosen, self.members.sizes))
            return numbers, self.corners(numbers)

        return Counted(-1 if mask is None else mask, faces)

    def mesh_of(self, faces: NDArray[np.int64]) -> tuple[Mesh, NDArray[np.int64]]:
        """Faces of the scene (k,), placed, as a mesh of their own, and their numbers there; -1 for -1."""
        known, numbers = faces >= 0, np.full(len(faces), -1)
        corners = self.corners(faces[known])
        numbers[known] = np.arange(len(corners))
        return Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)), numbers


def tree_over(
    members: list[Member], transforms: NDArray[np.float64], flags: NDArray[np.int64], threads: int
) -> SceneTree:
    """The tree over the instances of ``members`` that stand at ``transforms``, (n, 3, 4), with ``FLAGS``, (n,).

    Raises ``ValueError`` for what cannot be placed.
    """
    listed = Members(members)
    check_sizes(len(transforms), listed.faces)
    instances = new_records(len(transforms))
    instances.view(np.int64)[:, FLAGS] = flags
    for m in members:
        own = listed.rows(m)
        place_records(m.row, instances[own], transforms[own])
    listed.number(instances)
    return SceneTree(listed, instances, threads)


def placement(members: Members, instances: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The transforms and flags from which ``tree_over`` makes the same records."""
    transforms = [np.empty((0, 3, 4)), *(matrices_of(m, instances[members.rows(m)]) for m in members)]
    return np.concatenate(transforms), instances.view(np.int64)[:, FLAGS] & ~MIRRORS


def matrices_of(member: Member, records: NDArray[np.float64]) -> NDArray[np.float64]:
    """The transforms in the records of a member's instances, (k, 3, 4)."""
    own = records[:, MATRIX : MATRIX + 12].reshape(-1, 3, 4).copy()
    own[:, :, :3] *= member.built.tree.scale
    return own


def check_sizes(instances: int, faces: int) -> None:
    """Raise ``ValueError`` for more instances or faces than a scene can number."""
    expect(instances <= MOST_INSTANCES, "scene", f"at most {MOST_INSTANCES:,} instances", f"{instances:,}")
    expect(faces <= MOST_FACES, "scene", f"at most {MOST_FACES:,} faces, copies counted", f"{faces:,}")


def check_mesh(tree: Tree) -> None:
    """Raise ``ValueError`` for a mesh with more blocks than a scene can number."""
    blocks = len(tree.faces) // BLOCK_FACES
    expect(blocks <= _MOST_BLOCKS, "mesh", f"at most {BLOCK_FACES * _MOST_BLOCKS:,} faces", f"{BLOCK_FACES * blocks:,}")


def new_records(count: int) -> NDArray[np.float64]:
    """Memory for the records of instances."""
    return np.zeros((count, INSTANCE_WORDS))
