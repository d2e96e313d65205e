"""Meshes and trees keep their arrays: when a mesh is copied, pickled or written to, or a tree is stored."""

import copy
import pickle
import struct
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.promises.refused import refuses
from validation.promises.row import row

_JUDGE = "input arrays"
_ARRAYS = ("vertices", "faces", "normals", "colors", "texcoords")
# So large and small that the tree counts in units of its own.
_SIZES = (1.0, 2.0**200, 2.0**-200)
_COUNT = 40


def check_kept(rng: Generator) -> list[dict[str, Any]]:
    """Meshes with every array and with none but the needed."""
    copies, loaded, moved = [], [], []
    for more in (False, True):
        mesh = _mesh(rng, more)
        octree = Octree.from_mesh(mesh)
        copies += [_same(mesh, copy.copy(mesh)), _same(mesh, copy.deepcopy(mesh)), _same(mesh, _pickled(mesh))]
        loaded.append(_same(mesh, _stored(octree).mesh))
        octree.refit(mesh.vertices[::-1])
        moved += [_equal(mesh, octree.mesh, _ARRAYS[1:]), np.array_equal(octree.mesh.vertices, mesh.vertices[::-1])]
    return [
        row("a mesh that is copied or pickled keeps every array", _JUDGE, np.array(copies)),
        row("a loaded tree's mesh has all that the saved one had", _JUDGE, np.array(loaded)),
        row("a refit keeps normals, colours and texture coordinates", _JUDGE, np.array(moved)),
        row("a loaded tree gives the bits of the saved one, in any units", "saved tree", _asked(rng)),
        row("damage anywhere in a stored tree is detected", "flipped bits", _damaged(rng)),
        row("a loaded tree has the repairs and counts of the one that was saved", "known answer", _repaired()),
        row("a tree does not change with arrays that were made writable", "known answer", _writable()),
        row("files of other lengths, versions and orders of bytes are refused", "saved file", _other(rng)),
    ]


def _mesh(rng: Generator, more: bool) -> Mesh:
    points = rng.normal(size=(3 * _COUNT, 3))
    faces = np.arange(3 * _COUNT, dtype=np.int32).reshape(-1, 3)
    if not more:
        return Mesh(points, faces)
    colors, texcoords = rng.uniform(size=points.shape), rng.uniform(size=(len(points), 2))
    return Mesh(points, faces, rng.normal(size=points.shape), colors, texcoords, "all")


def _equal(one: Mesh, other: Mesh, names: tuple[str, ...]) -> bool:
    pairs = [(getattr(one, name), getattr(other, name)) for name in names]
    return all(b is None if a is None else b is not None and np.array_equal(a, b) for a, b in pairs)


def _same(one: Mesh, other: Mesh) -> bool:
    return _equal(one, other, _ARRAYS) and one.name == other.name


def _pickled(mesh: Mesh) -> Mesh:
    found: Mesh = pickle.loads(pickle.dumps(mesh))
    return found


def _stored(octree: Octree) -> Octree:
    """The octree as it is after it was saved and loaded."""
    with TemporaryDirectory(prefix="promises-") as folder:
        octree.save(Path(folder) / "a.octree")
        return Octree.load(Path(folder) / "a.octree")


def _repaired() -> NDArray[np.bool_]:
    """Of five faces, two of which a repair drops."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (np.nan, 0, 0)])
    octree = Octree(vertices, [[0, 1, 2], [0, 1, 4], [0, 1, 3], [4, 2, 3], [0, 2, 3]], repair=True)
    kept = []
    for one in (octree, _stored(octree)):
        repairs = one.repairs
        known = (
            repairs is not None and repairs.dropped_faces.tolist() == [1, 3] and repairs.bad_vertices.tolist() == [4]
        )
        kept += [known, one.stats.faces == 3, one.stats.references == 3]
    return np.array(kept)


def _writable() -> NDArray[np.bool_]:
    """Trees of meshes whose vertices, faces or both were made writable before the build, and are changed after it."""
    kept = []
    for tracer in (Octree, BruteForce):
        for names in (("vertices",), ("faces",), ("vertices", "faces")):
            mesh = Mesh([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (5.0, 5.0, 5.0)], [[0, 1, 2]])
            for name in names:
                getattr(mesh, name).flags.writeable = True
            built = tracer.from_mesh(mesh)
            if "vertices" in names:
                mesh.vertices[:3, 2] = 5.0
            if "faces" in names:
                mesh.faces[0, 2] = 3
            found = built.closest_hit([0.125, 0.25, 1.0], [0.0, 0.0, -1.0])
            kept += [found.points.tolist() == [0.125, 0.25, 0.0], found.normals.tolist() == [0.0, 0.0, 1.0]]
    return np.array(kept)


def _asked(rng: Generator) -> NDArray[np.bool_]:
    kept = []
    for size in _SIZES:
        mesh = _mesh(rng, False)
        octree = Octree(mesh.vertices * size, mesh.faces)
        pair = octree, _stored(octree)
        origins, directions = 3.0 * size * rng.normal(size=(60, 3)), rng.normal(size=(60, 3))
        directions -= origins / (3.0 * size)
        found = [one.closest_hit(origins, directions) for one in pair]
        near = [one.closest_point(origins) for one in pair]
        kept += [
            found[0].hit.any(),
            np.array_equal(found[0].t, found[1].t),
            np.array_equal(found[0].face, found[1].face),
            np.array_equal(near[0].distance, near[1].distance),
        ]
    return np.array(kept)


def _damaged(rng: Generator) -> NDArray[np.bool_]:
    kept = []
    with TemporaryDirectory(prefix="promises-") as folder:
        path = Path(folder) / "a.octree"
        Octree.from_mesh(_mesh(rng, True)).save(path)
        whole = path.read_bytes()
        for place in np.linspace(0, len(whole) - 1, 60).astype(int).tolist():
            path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
            kept.append(refuses(Octree.load, path))
    return np.array(kept)


def _other(rng: Generator) -> NDArray[np.bool_]:
    """Files of other lengths, versions and orders of bytes, whose checksums are right; mapped and read."""
    kept = []
    with TemporaryDirectory(prefix="promises-") as folder:
        path = Path(folder) / "a.octree"
        Octree.from_mesh(_mesh(rng, True)).save(path)
        whole = path.read_bytes()
        own = struct.unpack("<I", whole[12:16])[0]
        files = [(whole, False), (_with(whole, 1, own), False)]
        files += [(file, True) for file in (whole + b"\0", whole + bytes(64), whole + whole, whole[:-1], whole[:-64])]
        others = ((1, own - 1), (1, own + 1), (1, 1 << 31), (-1, own))
        files += [(_with(whole, order, version), True) for order, version in others]
        for file, bad in files:
            path.write_bytes(file)
            kept += [refuses(Octree.load, path, mmap=mapped) == bad for mapped in (False, True)]
    return np.array(kept)


def _with(whole: bytes, order: int, version: int) -> bytes:
    """A file of the given version, or with the bytes that tell the order turned, as ``tree/container.py`` has them."""
    told = whole[8:12][::order] + struct.pack("<I", version) + whole[16:20]
    text = whole[24 : 24 + struct.unpack("<I", whole[16:20])[0]]
    return whole[:8] + told + struct.pack("<I", zlib.crc32(whole[:8] + told + text)) + whole[24:]
