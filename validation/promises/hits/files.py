"""What files keep: a stored tree's repairs and counts, what OBJ corners name, PLY strips; and each digit in blocks."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.meshes import loose
from validation.promises.row import row

_JUDGE = "meshes by hand"
# Triangles with more vertices than are looked at together.
_MANY = 30_000
_CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 1\nvn 0 1 0\n"
_STRIPS = """ply
format ascii 1.0
element vertex 10
property float x
property float y
property float z
element tristrips 1
property list int int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
1 1 0
0 2 0
5 0 0
6 0 0
5 1 0
6 1 0
5 2 0
"""


def check_files() -> list[dict[str, Any]]:
    """Each is written to a folder of its own and read again."""
    with TemporaryDirectory(prefix="promises-") as name:
        folder = Path(name)
        return [
            row("a loaded tree has the repairs and counts of the one that was saved", _JUDGE, _stored(folder)),
            row("an OBJ file's corners with other normals or coordinates are other vertices", _JUDGE, _split(folder)),
            row("an OBJ file's normals are kept where each corner of each face has one", _JUDGE, _normals(folder)),
            row("an OBJ file's corners without texture coordinates get (0, 0)", _JUDGE, _texcoords(folder)),
            row("every second triangle of a PLY strip is turned, after a restart too", _JUDGE, _strips(folder)),
            row("blocks are float32 only where that holds every vertex", _JUDGE, _digits()),
        ]


def _stored(folder: Path) -> NDArray[np.bool_]:
    """Of five faces, two of which a repair drops."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (np.nan, 0, 0)])
    octree = Octree(vertices, [[0, 1, 2], [0, 1, 4], [0, 1, 3], [4, 2, 3], [0, 2, 3]], repair=True)
    octree.save(folder / "a.octree")
    kept = []
    for one in (octree, Octree.load(folder / "a.octree")):
        repairs = one.repairs
        known = (
            repairs is not None and repairs.dropped_faces.tolist() == [1, 3] and repairs.bad_vertices.tolist() == [4]
        )
        kept += [known, one.stats.faces == 3, one.stats.references == 3]
    return np.array(kept)


def _split(folder: Path) -> NDArray[np.bool_]:
    """Two faces at an edge, whose corners there have the same normal or coordinates in both faces, or not."""
    kept, path = [], folder / "a.obj"
    for faces, count in (("1//1 2//1 3//1|2//1 4//1 3//1", 4), ("1//1 2//1 3//1|2//2 4//2 3//2", 6),
                         ("1//1 2//1 3//1|2//2 4//1 3//1", 5), ("1/1 2/1 3/1|2/2 4/2 3/1", 5)):  # fmt: skip
        lines = "".join(f"f {face}\n" for face in faces.split("|"))
        path.write_text(f"{_CORNERS}vt 0 0\nvt 1 1\n{lines}", encoding="ascii")
        mesh = load_mesh(path)
        kept += [len(mesh.vertices) == count, _is_of(mesh, faces)]
    return np.array(kept)


def _is_of(mesh: Mesh, faces: str) -> bool:
    """Whether each corner of each face has the normal or the coordinates that its file names."""
    given = [[int(one) for one in corner.split("/") if one] for face in faces.split("|") for corner in face.split()]
    if mesh.normals is not None:
        return bool((mesh.normals[mesh.faces.ravel()] == [[(0, 0, 1), (0, 1, 0)][n - 1] for _, n in given]).all())
    if mesh.texcoords is None:
        return False
    return bool((mesh.texcoords[mesh.faces.ravel()] == [[n - 1, n - 1] for _, n in given]).all())


def _normals(folder: Path) -> NDArray[np.bool_]:
    kept = []
    for faces, has in (("f 1//1 2//1 3//1\nf 2//1 4//1 3//1\n", True), ("f 1//1 2//1 3//1\nf 2 4 3\n", False),
                       ("f 1 2 3\nf 2//1 4//1 3//1\n", False), ("f 1 2 3\nf 2 4 3\n", False)):  # fmt: skip
        path = folder / "a.obj"
        path.write_text(_CORNERS + faces, encoding="ascii")
        found = load_mesh(path).normals
        kept.append((found == [0.0, 0.0, 1.0]).all() if has and found is not None else (found is None) != has)
    return np.array(kept)


def _texcoords(folder: Path) -> NDArray[np.bool_]:
    kept = []
    for faces, count in (("f 1/1 2/2 3/3\nf 2/2 4/1 3/3\n", 0), ("f 1/1 2/2 3/3\nf 2 4 3\n", 3), ("f 1 2 3\n", None)):
        path = folder / "a.obj"
        path.write_text(f"{_CORNERS}vt 0.5 0.25\nvt 0.75 0.5\nvt 1 1\n{faces}", encoding="ascii")
        mesh = load_mesh(path)
        given = None if mesh.texcoords is None else mesh.texcoords[mesh.faces].reshape(-1, 2)
        if given is None or count is None:
            kept.append(given is None and count is None)
        else:
            named = given[:3].tolist() == [[0.5, 0.25], [0.75, 0.5], [1.0, 1.0]]
            kept.append(named and (given == 0.0).all(axis=1).sum() == count)
    return np.array(kept)


def _strips(folder: Path) -> NDArray[np.bool_]:
    """Strips of three and of two triangles, which all look up, whichever is first."""
    kept = []
    for strips in ("0 1 2 3 4 -1 5 6 7 8 9", "0 1 2 3 -1 5 6 7 8 9", "-1 0 1 2 3 4 -1 -1 5 6 7 8"):
        path = folder / "a.ply"
        path.write_text(f"{_STRIPS}{len(strips.split())} {strips}\n", encoding="ascii")
        mesh = load_mesh(path)
        count = sum(max(0, len(one.split()) - 2) for one in strips.split("-1"))
        kept += [len(mesh.faces) == count, bool((mesh.face_normals() == [0.0, 0.0, 1.0]).all())]
    return np.array(kept)


def _digits() -> NDArray[np.bool_]:
    """A row of triangles of which a single vertex, each in turn, is not a float32 number; a ray meets it there."""
    x = np.arange(8.0)
    corners = np.stack(
        [np.stack([x, 0 * x, 0 * x], 1), np.stack([x + 0.5, 0 * x, 0 * x], 1), np.stack([x, 0 * x + 1, 0 * x], 1)], 1
    )
    vertices, kept = corners.reshape(-1, 3), []
    for k in range(len(vertices)):
        moved = vertices.copy()
        moved[k, 2] = 1.0 / 3.0
        octree = Octree.from_mesh(loose(moved))
        hits = octree.closest_hit(moved[k] + [0.0, 0.0, 2.0], [0.0, 0.0, -1.0])
        kept.append(hits.face == k // 3 and abs(hits.t - 2.0) <= 2.0**-51)
    return np.array([*kept, *_last_digit()])


def _last_digit() -> list[bool]:
    """The same of the last of very many triangles alone."""
    x = np.repeat(np.arange(_MANY, dtype=np.float64), 3)
    vertices = np.stack([x, np.tile([0.0, 1.0, 0.0], _MANY), np.tile([0.0, 0.0, 1.0], _MANY)], 1)
    vertices[-3:, 0] += 1.0 / 3.0
    octree = Octree.from_mesh(loose(vertices))
    hits = octree.closest_hit([_MANY + 1.0, 0.25, 0.25], [-1.0, 0.0, 0.0])
    return [bool(hits.t == _MANY + 1.0 - vertices[-1, 0]), bool(hits.face == _MANY - 1)]
