"""``RayScene``: many meshes, each placed many times, with the queries of ``Octree``."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument, plain_argument, real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import MeshError, expect
from renderer.mesh.foreign import TriangleMesh
from renderer.mesh.load import FilePaths
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree, as_mesh
from renderer.queryable import Built, Queries
from renderer.rayscene.built import (
    BuiltScene,
    Member,
    Members,
    SceneTree,
    check_mesh,
    check_sizes,
    matrices_of,
    new_records,
)
from renderer.rayscene.files import scene_of_files
from renderer.rayscene.locking import new_lock
from renderer.rayscene.queries import SceneQueries
from renderer.rayscene.records import Records
from renderer.rayscene.store import StoredScene, load_scene, save_scene
from renderer.rayscene.transforms import as_transforms, place_records
from renderer.system.threads import checked_threads
from renderer.trace.instances import FLAGS, HIDDEN
from renderer.trace.layout import MASK_BITS

# What a copy of a scene has of its own.
_OWN = ("_lock", "_members", "_records", "_faces", "_next", "_snapshot", "_listed")


class RayScene(SceneQueries):
    """Many meshes, each placed many times, with the queries of ``Octree``.

    A scene answers bit for bit like the one mesh that its placed meshes make together, in the order of objects,
    instances and faces: corners as ``Mesh.transformed`` places them, and equal t by that order. Its memory grows by
    the meshes, and some 290 bytes for each instance.

    Parameters
    ----------
    threads : int, optional
        Threads of queries; None for all processors. Results do not depend on it.

    Examples
    --------
    >>> from renderer import RayScene
    >>> from renderer.mesh.shapes import box, icosphere
    >>> scene = RayScene()
    >>> ground = scene.add(box((-9, -9, -1), (9, 9, 0)))
    >>> balls = scene.add(icosphere(4), transforms=[[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 1]] for x in (-2, 2)])
    >>> hits = scene.closest_hit([[2.1, 0.1, 9], [0, 0, 9]], [0, 0, -1])
    >>> hits.object, hits.instance, hits.t.round(1)
    (array([1, 0]), array([1, 0]), array([7., 9.]))
    """

    def __init__(self, *, threads: int | None = None) -> None:
        self.threads = checked_threads(threads)
        self._lock = new_lock()
        self._members: dict[int, Member] = {}
        self._records = Records(Members([]), new_records(0))
        self._faces, self._next = 0, 0
        # None where the scene, or which members it has, changed since.
        self._snapshot: BuiltScene | None = None
        self._listed: Members | None = None
        self._owner = uuid4().hex

    def __repr__(self) -> str:
        built = self._built
        instances = sum(m.count for m in built.members)
        return f"<RayScene of {len(built.members.listed):,} objects, {instances:,} instances, {built.count:,} faces>"

    def add(
        self,
        mesh: Octree | Mesh | str | os.PathLike[str] | TriangleMesh,
        transforms: ArrayLike | None = None,
        *,
        mask: ArrayLike = MASK_BITS,
        name: str | None = None,
    ) -> int:
        """Add an object: a mesh, placed once or many times. Nothing of it is copied.

        Parameters
        ----------
        mesh : Octree, Mesh, str, path or trimesh.Trimesh
            An octree is shared as it is now; of anything else one is built.
        transforms : array_like, shape (3, 4), (4, 4), (k, 3, 4) or (k, 4, 4), optional
            Where it stands, applied to column vectors: one instance, or k. None leaves it where it is.
        mask : array_like of int, shape () or (k,), default all bits
            32 bits: a ray meets an instance if its own mask has one of them too.
        name : str, optional
            The name of the object; None for that of the mesh.

        Returns
        -------
        int
            The object's number, by which hits and the other methods name it.

        Raises
        ------
        MeshError
            For a mesh that cannot be used.
        ValueError
            For a matrix that is singular or nearly so, which is named by its row, and for any other argument.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> scene.add(box()), scene.add(box(), transforms=[[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0]])
        (0, 1)
        """
        expect(isinstance(name, str | None), "name", "a string or None", repr(name))
        octree = mesh if isinstance(mesh, Octree) else Octree(as_mesh(mesh, None, False)[0], threads=self.threads)
        matrices = as_transforms(transforms)
        name = octree.mesh.name if name is None else name
        return self._add(octree._built, name, matrices, _masks(mask, len(matrices)))

    def add_scene(self, scene: RayScene, transforms: ArrayLike | None = None) -> dict[int, int]:
        """Add all objects of another scene, as it is now, once or many times; meshes are shared.

        An instance of an object stands at the product of both matrices, and is placed once by it. The instances of the
        first copy come first, in their order, then those of the next.

        Parameters
        ----------
        scene : RayScene
        transforms : array_like, shape (3, 4), (4, 4), (k, 3, 4) or (k, 4, 4), optional
            Where the scene stands: once, or k times. None leaves it where it is.

        Returns
        -------
        dict of int to int
            The number here of each object there.

        Raises
        ------
        ValueError
            As for ``add``; then nothing is added.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> tower, town = RayScene(), RayScene()
        >>> floors = tower.add(box(), [[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, z]] for z in range(3)])
        >>> town.add_scene(tower, [[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0, 5)])
        {0: 0}
        >>> town.closest_hit([5.5, 0.25, 9], [0, 0, -1]).instance
        array(5)
        """
        expect(isinstance(scene, RayScene), "scene", "a RayScene", type(scene).__name__)
        outer, there = as_transforms(transforms), scene._built
        with self._lock:
            copies = len(outer)
            check_sizes(self._records.count + copies * len(there.top.instances), self._faces + copies * there.count)
            made = {m.id: _composed(outer, there.matrices(m)) for m in there.members}
            for m in there.members:
                place_records(m.row, new_records(len(made[m.id])), made[m.id])  # refused before any is added
            return {
                m.id: self._add(m.built, m.name, made[m.id], np.tile(there.flags(m), len(outer)), m.names * len(outer))
                for m in there.members
            }

    def _add(
        self,
        built: Built,
        name: str,
        matrices: NDArray[np.float64],
        flags: NDArray[np.int64],
        names: tuple[str, ...] = (),
    ) -> int:
        check_mesh(built.tree)
        with self._lock:
            faces = self._faces + len(matrices) * len(built.mesh.faces)
            check_sizes(self._records.count + len(matrices), faces)
            member = Member(self._next, name, built, len(matrices), names)
            self._records.add(member.id, _placed(member, matrices, flags))
            self._members[member.id] = member
            self._faces, self._next = faces, self._next + 1
            self._snapshot = self._listed = None
            return member.id

    def add_instances(self, object: int, transforms: ArrayLike, *, mask: ArrayLike = MASK_BITS) -> NDArray[np.int64]:
        """Place an object some more times. Its instances keep their numbers.

        Parameters
        ----------
        object : int
        transforms : array_like, shape (3, 4), (4, 4), (k, 3, 4) or (k, 4, 4)
        mask : array_like of int, shape () or (k,), default all bits
            As for ``add``.

        Returns
        -------
        ndarray of int64, shape (k,)
            The numbers of the new instances, which follow those that the object has.

        Raises
        ------
        ValueError
            As for ``add``; then nothing is added.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.add_instances(cube, [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0]])
        array([1])
        >>> scene.closest_hit([5.5, 0.25, 9], [0, 0, -1]).instance
        array(1)
        """
        expect(transforms is not None, "transforms", "matrices", "None")
        matrices = as_transforms(transforms)
        masks, count = _masks(mask, len(matrices)), len(matrices)
        with self._lock:
            member = self._member(object)
            faces = self._faces + count * len(member.built.mesh.faces)
            check_sizes(self._records.count + count, faces)
            names = member.names + ("",) * count if member.names else ()
            self._records.extend(member.id, _placed(member, matrices, masks))
            self._members[member.id] = replace(member, count=member.count + count, names=names)
            self._faces, self._snapshot, self._listed = faces, None, None
            return np.arange(member.count, member.count + count)

    def move(
        self,
        object: int | Mapping[int, ArrayLike],
        transforms: ArrayLike | None = None,
        *,
        instances: ArrayLike | None = None,
    ) -> None:
        """Place the instances of an object, or of several, anew.

        A query that runs meanwhile sees the scene before or after.

        Parameters
        ----------
        object : int, or dict of int to array_like
            The object; or several, with the transforms of each, that move at once.
        transforms : array_like, shape (3, 4), (4, 4), (k, 3, 4) or (k, 4, 4)
            As for ``add``, one for each instance that is moved. None beside a dict.
        instances : array_like of int or bool, optional
            Which k instances: their numbers, or a bool for each of the object; None for all.

        Raises
        ------
        ValueError
            For a bad argument; nothing is changed then.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube, roof = scene.add(box()), scene.add(box((0, 0, 1), (1, 1, 2)))
        >>> lifted = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5]]
        >>> scene.move(roof, lifted)
        >>> scene.move({cube: lifted, roof: lifted})
        >>> scene.closest_hit([0.5, 0.25, 9], [0, 0, -1]).t
        array(2.)
        """
        several = isinstance(object, Mapping)
        alone = transforms is None and instances is None
        expect(alone or not several, "transforms", "None beside a dict, as instances", "matrices or instances")
        with self._lock:
            moves = object.items() if isinstance(object, Mapping) else [(object, transforms)]
            moved = [self._moved(each, given, instances) for each, given in moves]  # refused before any is moved
            records = self._writable()
            for rows, own in moved:
                records[rows] = own

    def _moved(
        self, object: int, transforms: ArrayLike | None, instances: ArrayLike | None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Instances of an object, and their records where they are moved to."""
        expect(transforms is not None, "transforms", "matrices", "None")
        matrices, rows = as_transforms(transforms), self._rows_of(object, instances)
        expect(len(matrices) == len(rows), "transforms", f"{len(rows)} matrices", f"{len(matrices)}")
        own = self._records.array[rows]
        place_records(self._member(object).row, own, matrices)
        return rows, own

    def refit(self, object: int, vertices: ArrayLike) -> None:
        """Move the vertices of an object's mesh, as ``Octree.refit`` does; an octree that was added stays as it was.

        Parameters
        ----------
        object : int
        vertices : array_like, shape (V, 3)

        Raises
        ------
        MeshError
            For other arrays, or vertices that the instances place too far away; nothing is changed then.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.refit(cube, box().vertices * 2)
        >>> scene.closest_hit([0.5, 0.25, 9], [0, 0, -1]).t
        array(7.)
        """
        with self._lock:
            member = self._member(object)
            octree = Octree.__new__(Octree)
            Queries.__init__(octree, *member.built, self.threads)
            octree.refit(vertices)
            refitted = replace(member, built=octree._built)
            rows = self._rows_of(object, None)
            own = self._records.array[rows]
            try:
                place_records(refitted.row, own, matrices_of(member, own))
            except ValueError as error:
                raise MeshError(f"vertices: expected positions that every instance can place; {error}") from None
            self._writable()[rows] = own
            self._members[object], self._listed = refitted, None

    def show(self, object: int, shown: ArrayLike = True, *, instances: ArrayLike | None = None) -> None:
        """Show instances of an object or hide them: hidden ones are hit by no ray. Numbers stay as they are.

        Parameters
        ----------
        object : int
        shown : array_like of bool, shape () or (k,), default True
        instances : array_like of int or bool, optional
            Which k instances: their numbers, or a bool for each of the object; None for all.

        Raises
        ------
        ValueError
            For a bad argument.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.show(cube, False)
        >>> scene.any_hit([[0.5, 0.25, 9]], [0, 0, -1]), scene.shown(cube)
        (array([False]), array([False]))
        """
        with self._lock:
            rows = self._rows_of(object, instances)
            given = plain_argument("shown", shown)
            fits = given.dtype == np.bool_ and given.shape in ((), (len(rows),))
            expect(fits, "shown", f"a bool or {len(rows)} bools", f"{given.dtype} of shape {given.shape}")
            flags = self._writable().view(np.int64)[:, FLAGS]
            flags[rows] = np.where(given, flags[rows] & ~HIDDEN, flags[rows] | HIDDEN)

    def shown(self, object: int) -> NDArray[np.bool_]:
        """Return whether each instance of an object is shown, (k,).

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box(), mask=6)
        >>> scene.shown(cube)
        array([ True])
        """
        with self._lock:
            return self._records.array.view(np.int64)[self._rows_of(object, None), FLAGS] & HIDDEN == 0

    def mask(self, object: int, mask: ArrayLike, *, instances: ArrayLike | None = None) -> None:
        """Change the masks of instances of an object.

        Parameters
        ----------
        object : int
        mask : array_like of int, shape () or (k,)
            32 bits, as for ``add``.
        instances : array_like of int or bool, optional
            Which k instances: their numbers, or a bool for each of the object; None for all.

        Raises
        ------
        ValueError
            For a bad argument.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.mask(cube, 0b10)
        >>> scene.any_hit([[0.5, 0.25, 9]], [0, 0, -1], mask=0b01), scene.masks(cube)
        (array([False]), array([2]))
        """
        with self._lock:
            rows = self._rows_of(object, instances)
            masks = _masks(mask, len(rows))
            flags = self._writable().view(np.int64)[:, FLAGS]
            flags[rows] = (flags[rows] & ~MASK_BITS) | masks

    def masks(self, object: int) -> NDArray[np.int64]:
        """Return the mask of each instance of an object, (k,).

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box(), mask=6)
        >>> scene.masks(cube)
        array([6])
        """
        with self._lock:
            return self._records.array.view(np.int64)[self._rows_of(object, None), FLAGS] & MASK_BITS

    def remove(self, object: int) -> None:
        """Take an object out of the scene. The numbers of others stay.

        Parameters
        ----------
        object : int

        Raises
        ------
        ValueError
            If the scene has no such object.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box())
        >>> scene.remove(cube)
        >>> scene
        <RayScene of 0 objects, 0 instances, 0 faces>
        """
        with self._lock:
            gone = self._members.pop(self._member(object).id)
            self._records.remove(gone.id)
            self._faces -= gone.count * len(gone.built.mesh.faces)
            self._snapshot = self._listed = None

    @property
    def objects(self) -> list[int]:
        """The numbers of the objects, in order.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box(), name="cube")
        >>> scene.objects, scene.name(cube), len(scene.mesh(cube).faces), scene.transforms(cube).shape
        ([0], 'cube', 12, (1, 3, 4))
        """
        return list(self._members)

    def name(self, object: int) -> str:
        """Return the name of an object.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box(), name="cube")
        >>> scene.name(cube)
        'cube'
        """
        return self._member(object).name

    def instance_names(self, object: int) -> tuple[str, ...]:
        """Return the names of an object's instances: those of the nodes of a glTF file, or none.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> scene.instance_names(scene.add(box()))
        ()
        """
        return self._member(object).names

    def mesh(self, object: int) -> Mesh:
        """Return the mesh of an object, to which ``face`` of a hit refers.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box(), name="cube")
        >>> scene.mesh(cube).extent.tolist()
        [1.0, 1.0, 1.0]
        """
        return self._member(object).built.mesh

    def transforms(self, object: int) -> NDArray[np.float64]:
        """Return where the instances of an object stand, (k, 3, 4).

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box(), name="cube")
        >>> scene.transforms(cube).shape
        (1, 3, 4)
        """
        built = self._built
        return next(built.matrices(m) for m in built.members if m.id == self._member(object).id)

    @property
    def merged(self) -> Mesh:
        """The one mesh that the placed meshes make together, with a part for each instance.

        Examples
        --------
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cubes = scene.add(box(), transforms=[[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0, 3)])
        >>> len(scene.merged.faces), scene.merged.bounds[1].tolist()
        (24, [4.0, 1.0, 1.0])
        """
        return self._built.merged.mesh

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the scene to one file for ``RayScene.load``, with the mesh and tree of each octree once.

        The file appears whole or not at all.

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
        ``renderer/rayscene/store.py`` describes the file.

        Examples
        --------
        >>> import tempfile
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box(), transforms=[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5]])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     scene.save(f"{folder}/cube.scene")
        ...     again = RayScene.load(f"{folder}/cube.scene")
        >>> again.closest_hit([0.5, 0.25, 9], [0, 0, -1]).t
        array(3.)
        """
        with self._lock:
            stored = StoredScene(self._built, self._next)
        save_scene(path, stored)

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, mmap: bool = False, threads: int | None = None) -> RayScene:
        """Return the scene that ``RayScene.save`` wrote.

        It gives the same bits, and can be changed, pickled and saved again.

        Parameters
        ----------
        path : str or path
        mmap : bool, default False
            Map the meshes and trees instead of reading them, as ``Octree.load`` does.
        threads : int, optional
            Threads of queries; None for all processors.

        Returns
        -------
        RayScene

        Raises
        ------
        FileNotFoundError
            If there is no such file. The error is a ``ValueError`` too.
        ValueError
            For a file that is no scene, of another version, truncated or damaged. The message names the path.

        Notes
        -----
        No content, damaged or forged, crashes a query. Where no checksum is checked, it may give wrong hits.

        Examples
        --------
        >>> import tempfile
        >>> from renderer import RayScene
        >>> from renderer.mesh.shapes import box
        >>> scene = RayScene()
        >>> cube = scene.add(box(), name="cube")
        >>> with tempfile.NamedTemporaryFile() as file:
        ...     scene.save(file.name)
        ...     mapped = RayScene.load(file.name, mmap=True, threads=1)
        >>> mapped.name(cube), mapped.closest_hit([0.5, 0.25, 9], [0, 0, -1]).t
        ('cube', array(8.))
        """
        threads = checked_threads(threads)
        return cls._of(load_scene(path, flag_argument("mmap", mmap), threads))

    @classmethod
    def from_files(
        cls,
        paths: FilePaths,
        *,
        threads: int | None = None,
    ) -> RayScene:
        """Return the scene in a file, or that of several mesh files.

        Each mesh of a .glb or .gltf file becomes an object, and the nodes and ``EXT_mesh_gpu_instancing`` that show it
        its instances. A mesh that joints pull, or a matrix flattens, stands as an object of its own.
        Any other file is an object of the file's name. In a folder or list of files, the names of several meshes of one
        file begin with that of the file.

        Parameters
        ----------
        paths : str, path, or iterable of these
            A mesh file; a folder, whose mesh files are taken in the order of their names; or several of these.
        threads : int, optional
            Threads of the builds and of queries; None for all processors.

        Returns
        -------
        RayScene
            ``merged`` has the triangles of ``load_mesh``.

        Raises
        ------
        FileNotFoundError
            If there is no such file. The error is a ``MeshError`` too.
        MeshError
            For a file that cannot be read, as by ``load_mesh``; the message names it. Also for a folder without mesh
            files.

        Notes
        -----
        Coordinates stay as they are in the files: in glTF y points up. What is left out is named by a
        ``RepairWarning``.

        Examples
        --------
        >>> from renderer import RayScene
        >>> scene = RayScene.from_files(["scenes/models/torus_knot.ply", "scenes/models/stairs.ply"])
        >>> [scene.name(object) for object in scene.objects]
        ['torus_knot', 'stairs']
        """
        return cls._of(scene_of_files(paths, checked_threads(threads)))

    @classmethod
    def _of(cls, stored: StoredScene) -> RayScene:
        """A scene that is ready for queries."""
        scene = cls.__new__(cls)
        RayScene.__init__(scene, threads=stored.built.threads)
        scene._keep(stored)
        return scene

    def __getstate__(self) -> dict[str, Any]:
        """Copies and pickles have locks and addresses of their own."""
        with self._lock:
            stored = StoredScene(self._built, self._next)
        kept = {name: value for name, value in vars(self).items() if name not in _OWN}
        return {**kept, "stored": stored}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._lock = new_lock()
        self._keep(state.pop("stored"))
        vars(self).update(state)

    def _keep(self, stored: StoredScene) -> None:
        built = self._snapshot = stored.built
        self._owner, self._next, self._listed = built.owner, stored.next, built.members
        self._members, self._faces = {m.id: m for m in built.members}, built.count
        self._records = Records(built.members, built.top.instances)

    @property
    def _built(self) -> BuiltScene:
        """The scene as it is now, ready for queries."""
        built = self._snapshot
        if built is None:
            with self._lock:
                built = self._snapshot
                if built is None:
                    self._records.compact()
                    records = self._records.array
                    if self._listed is None:
                        self._listed = Members(self._members.values())
                        self._listed.number(records)
                    built = BuiltScene(SceneTree(self._listed, records, self.threads), self.threads, self._owner)
                    self._snapshot = built
        return built

    def _member(self, object: int) -> Member:
        if not (isinstance(object, int | np.integer) and object in self._members):
            expect(False, "object", f"one of {str(list(self._members))[:200]}", repr(object))
        return self._members[int(object)]

    def _rows_of(self, object: int, instances: ArrayLike | None) -> NDArray[np.int64]:
        """The records of instances of an object."""
        member = self._member(object)
        return self._records.rows(member.id).start + _rows(instances, member.count)

    def _writable(self) -> NDArray[np.float64]:
        """The records of all instances, to be changed: not those that a snapshot has."""
        if self._snapshot is not None and self._records.array is self._snapshot.top.instances:
            self._records.array = self._records.array.copy()
        self._snapshot = None
        return self._records.array


def _placed(member: Member, matrices: NDArray[np.float64], flags: NDArray[np.int64]) -> NDArray[np.float64]:
    """The records of new instances."""
    own = new_records(len(matrices))
    own.view(np.int64)[:, FLAGS] = flags
    place_records(member.row, own, matrices)
    return own


def _composed(outer: NDArray[np.float64], inner: NDArray[np.float64]) -> NDArray[np.float64]:
    """The products (k * n, 3, 4) of k maps and n maps, which are applied first."""
    a, b = outer[:, None], inner[None]
    # Term by term, as in ``Mesh.transformed``.
    product = (a[..., :, 0:1] * b[..., 0:1, :] + a[..., :, 1:2] * b[..., 1:2, :]) + a[..., :, 2:3] * b[..., 2:3, :]
    product[..., 3] += a[..., 3]
    return product.reshape(-1, 3, 4)


def _masks(mask: ArrayLike, count: int) -> NDArray[np.int64]:
    masks = real_argument("mask", mask)
    fits = masks.dtype.kind in "iu" and masks.shape in ((), (count,))
    expect(fits, "mask", f"an integer or {count} integers", f"{masks.dtype} of shape {masks.shape}")
    expect(bool(((masks >= 0) & (masks <= MASK_BITS)).all()), "mask", "32 bits", masks.tolist())
    return np.broadcast_to(masks, (count,)).astype(np.int64)


def _rows(instances: ArrayLike | None, count: int) -> NDArray[np.int64]:
    if instances is None:
        return np.arange(count)
    rows = plain_argument("instances", instances)
    if rows.dtype == np.bool_:
        expect(rows.shape == (count,), "instances", f"{count} bools, or integers", f"bools of shape {rows.shape}")
        return np.flatnonzero(rows)
    rows = real_argument("instances", rows).reshape(-1)
    rows = rows if len(rows) else rows.astype(np.int64)
    fits = rows.dtype.kind in "iu" and ((rows >= 0) & (rows < count)).all() and len(np.unique(rows)) == len(rows)
    expect(bool(fits), "instances", f"different integers from 0 to {count - 1}", rows.tolist()[:10])
    return rows.astype(np.int64)
