"""Mesh files by convention: corners, indices and materials of OBJ, colours and strips of PLY, textures of glTF."""

import base64
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from validation.promises.row import row

_JUDGE = "known answer"
# Lines of few are read one by one, many at once.
_SIZES = (4, 800)
_PLY = {"uchar": 255.0, "ushort": 65535.0, "uint": 4294967295.0, "float": 1.0, "double": 1.0}
_VERTICES = "0 0 0\n1 0 0\n0 1 0\n"
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
# A triangle and an image of 1 x 1 (PPM).
_FLOATS = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], "<f4").tobytes()
_TEXTURED: dict[str, Any] = {
    "asset": {"version": "2.0"},
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": len(_FLOATS)}],
    "buffers": [{"byteLength": len(_FLOATS), "uri": "data:;base64," + base64.b64encode(_FLOATS).decode()}],
    "textures": [{"source": 0}],
    "images": [{"uri": "data:;base64," + base64.b64encode(b"P6 1 1 255 abc").decode()}],
}


def check_files(rng: Generator) -> list[dict[str, Any]]:
    """Files by hand, in a folder of their own."""
    with TemporaryDirectory(prefix="promises-") as name:
        folder = Path(name)
        return [
            row("an OBJ file's corners with other normals or coordinates are other vertices", _JUDGE, _split(folder)),
            row("an OBJ file's normals are kept where each corner of each face has one", _JUDGE, _normals(folder)),
            row("an OBJ file's corners without texture coordinates get (0, 0)", _JUDGE, _texcoords(folder)),
            row("every second triangle of a PLY strip is flipped, also after a restart", _JUDGE, _strips(folder)),
            row("an index below 0 in an OBJ file counts back from its face", "known answer", _back(folder, rng)),
            row("colours of a PLY file are shares of the largest of their type", "known answer", _shares(folder)),
            row("a face of an OBJ file has the material that was used last before it", _JUDGE, _materials(folder, rng)),
            row("transforms of a glTF file's texture coordinates hold where v points up", _JUDGE, _moved(folder, rng)),
        ]


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


def _back(folder: Path, rng: Generator) -> NDArray[np.bool_]:
    """Faces between the vertices, which name their corners from the beginning, or back from where the face stands."""
    path, kept = folder / "a.obj", []
    for count in _SIZES:
        for backwards in (0.0, 0.5, 1.0):
            places, lines, expected = rng.integers(-99, 100, (count, 3)), [], []
            for k, place in enumerate(places):
                lines.append("v {} {} {}".format(*place))
                if k >= 3 or k == count - 1:
                    corners = rng.permutation(k + 1)[:3]
                    back = rng.random(3) < backwards
                    lines.append("f {} {} {}".format(*np.where(back, corners - k - 1, corners + 1)))
                    expected.append(places[corners])
            path.write_text("\n".join(lines) + "\n", encoding="ascii")
            kept.append((load_mesh(path).triangles == np.array(expected)).all(axis=(1, 2)))
    return np.concatenate(kept)


def _shares(folder: Path) -> NDArray[np.bool_]:
    path, kept = folder / "a.ply", []
    for kind, largest in _PLY.items():
        values = np.array([[0.0, 1.0, 0.5], [1.0, 0.25, 0.0], [0.75, 0.0, 1.0]]) * largest
        colors = values if kind in ("float", "double") else np.floor(values)
        names = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
        rows = zip(_VERTICES.splitlines(), colors.tolist(), strict=True)
        spelled = "".join(f"{at} {' '.join(str(c if kind in ('float', 'double') else int(c)) for c in color)}\n"
                          for at, color in rows)  # fmt: skip
        path.write_text(
            f"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{names}"
            f"element face 1\nproperty list uchar int vertex_indices\nend_header\n{spelled}3 0 1 2\n", encoding="ascii",
        )  # fmt: skip
        found = load_mesh(path).colors
        assert found is not None
        kept.append((found[:, :3] == (colors / largest).astype(np.float32)).ravel())
    return np.concatenate(kept)


def _materials(folder: Path, rng: Generator) -> NDArray[np.bool_]:
    """Quadrangles and triangles between materials, whose red is their number; before the first there is none."""
    kept = []
    (folder / "a.mtl").write_text("".join(f"newmtl m{k}\nKd {k / 8} 0 0\n" for k in range(8)), encoding="ascii")
    for count in _SIZES:
        lines, expected, last = ["mtllib a.mtl"], [], -1
        for polygon in rng.permuted(["f 1 2 4 3", "f 1 2 3"] * count).tolist():
            if rng.random() < 0.3:
                last = int(rng.integers(8))
                lines.append(f"usemtl m{last}")
            lines.append(polygon)
            expected += [last] * (len(polygon.split()) - 3)
        (folder / "a.obj").write_text(_CORNERS + "\n".join(lines) + "\n", encoding="ascii")
        mesh = load_mesh(folder / "a.obj")
        reds = np.array([*(8 * material.base_color[0] for material in mesh.materials), -1.0])
        found = -np.ones(len(mesh.faces)) if mesh.face_materials is None else reds[mesh.face_materials]
        kept.append(found == np.array(expected))
    return np.concatenate(kept)


def _moved(folder: Path, rng: Generator) -> NDArray[np.bool_]:
    """Scaled, turned counter-clockwise to an eye that sees v point down, and offset: by complex numbers."""
    kept = []
    for _ in range(32):
        (x, y), (width, height), turn = rng.uniform(-2, 2, 2), rng.uniform(0.1, 3, 2), rng.uniform(-4, 4)
        moved = {"offset": [x, y], "scale": [width, height], "rotation": turn}
        use = {"index": 0, "extensions": {"KHR_texture_transform": moved}}
        path = folder / "a.gltf"
        path.write_text(json.dumps(_TEXTURED | {"materials": [{"normalTexture": use}]}), encoding="ascii")
        texture = load_mesh(path).materials[0].normal_texture
        assert texture is not None
        at = rng.uniform(-1, 1, 2)
        place = complex(at[0] * width, -at[1] * height) * np.exp(1j * turn) + complex(x, -y)
        found = np.array(texture.transform) @ [at[0], 1.0 - at[1], 1.0]
        kept.append(np.abs(found - [place.real, 1.0 + place.imag]) < 1e-12)
    return np.concatenate(kept)
