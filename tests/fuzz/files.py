"""Mutated mesh and scene files: each is one clear error or a valid object that rays can be shot at.

Structure-aware: text is mutated by tokens and lines, binary bodies by numbers, everything by bytes. Input ``i`` of a
seed is the same on every machine with the same packages.
"""

import base64
import json
import re
import struct
import warnings
from collections.abc import Callable
from functools import partial
from io import BytesIO
from pathlib import Path
from random import Random

import numpy as np
import plyfile
import trimesh

from fuzz.values import SECONDS, Kind, time_limit
from renderer import BruteForce, Mesh, MeshError, Octree, Scene, SceneError, SceneWarning, load_mesh, load_scene
from renderer.mesh.mesh import RepairWarning
from renderer.mesh.ply import format_ply
from renderer.mesh.shapes import box, torus

RAYS = 16
# Meshes beyond this are checked but not traced, so that one floor of a million squares does not fill the run.
MOST_TRACED = 20_000

NUMBERS = [
    *(b"0", b"-0", b"1", b"-1", b"2", b"3", b"255", b"256", b"65535", b"2147483647", b"2147483648", b"-2147483648"),
    *(b"4294967295", b"9223372036854775808", b"99999999999999999999", b"1" + b"0" * 30, b"9" * 400, b"0x10", b"1_0"),
    *(b"nan", b"-nan", b"inf", b"-inf", b"1e38", b"1e39", b"-1e308", b"1e309", b"1e-45", b"1e-320", b"0.5", b"1e"),
    *(b".", b"", b"x", b"\xff", b"\0", b"true", b"[]", b"{}", b'""', b"1/1/1", b"1//1", b"/", b"#"),
    *(b"\\", b"list", b"end_header", b"[1, 2, 3]", b"-0.25", b"1e3"),
]  # fmt: skip
WORDS = [
    *(struct.pack("<f", x) for x in (np.nan, np.inf, -np.inf, 3e38, 1e-45, -0.0)),
    *(struct.pack("<d", x) for x in (np.nan, np.inf, 1e308, 5e-324)),
    *(struct.pack(f"{order}{code}", x) for order in "<>" for code, x in
      (("i", -1), ("i", 2**31 - 1), ("i", -(2**31)), ("I", 0), ("I", 7), ("H", 65535), ("H", 4), ("B", 0), ("B", 255))),
]  # fmt: skip

SCENE = """
ambient = 0.1
background = [0.5, 0.6, 0.8]
[render]
resolution = [8, 8]
samples = 4
max_depth = 3
min_weight = 0.01
[camera]
type = "perspective"
eye = [0, 1.5, 5]
target = [0, 0.5, 0]
up = [0, 1, 0]
fov = 40
[materials.glass]
type = "dielectric"
ior = 1.5
transmittance = [0.75, 0.95, 0.8]
[materials.silver]
type = "mirror"
reflectance = 0.9
[materials.red]
diffuse = [0.7, 0.1, 0.1]
specular = 0.5
shininess = 60
[[lights]]
type = "directional"
direction = [0.5, -1.3, -0.6]
irradiance = 0.6
[[lights]]
type = "point"
position = [-2.5, 3.5, 3]
intensity = 8.0
[[objects]]
mesh = "box.ply"
material = "glass"
normals = "smooth"
scale = [1, 2, 1]
rotate = [0, 30, 0]
translate = [0, 0.1, 0]
[floor]
min = [-4, -4]
max = [4, 4]
materials = ["red", "silver"]
squares = [4, 4]
"""


def _ply(text: bool, byte_order: str) -> bytes:
    """Triangles, a quadrilateral and a pentagon, colours and normals, written by plyfile."""
    shape = torus(around=5, across=3)
    vertex = np.zeros(
        len(shape.vertices),
        [(n, "f4") for n in ("x", "y", "z", "nx", "ny", "nz")] + [(n, "u1") for n in ("red", "green", "blue")],
    )
    for k, name in enumerate("xyz"):
        vertex[name], vertex["n" + name] = shape.vertices[:, k], shape.vertex_normals()[:, k]
    face = np.empty(len(shape.faces) + 2, [("vertex_indices", object)])
    for row, polygon in enumerate([*shape.faces.tolist(), [0, 1, 2, 3], [4, 5, 6, 7, 8]]):
        face["vertex_indices"][row] = np.array(polygon, np.int32)
    kinds = {"val_types": {"vertex_indices": "i4"}, "len_types": {"vertex_indices": "u1"}}
    elements = [plyfile.PlyElement.describe(vertex, "vertex"), plyfile.PlyElement.describe(face, "face", **kinds)]
    out = BytesIO()
    plyfile.PlyData(elements, text=text, byte_order=byte_order).write(out)
    return out.getvalue()


_IMAGE = b"P6 2 1 255 abcdef"
# Beside the file of materials that is mutated.
_OF_MTL = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n"
_MTL = """newmtl a
Kd 0.5 0 1
Ks 1
Ns 20
Tr 0.25
map_Kd -s 2 2 1 -clamp on a.ppm
newmtl b
illum 7
Ni 1.5
Tf 1 0.5 0
map_bump -bm 0.5 a.ppm
"""


def _gltf() -> bytes:
    """A triangle of normalized bytes, twice by instances, and one that a joint would pull, in a document of text."""
    data = struct.pack("<9b3x4B4f6f16f", *(0, 0, 0, 127, 0, 0, 0, 127, 0), 0, 0, 0, 0, 1, 0, 0, 0, *(0, 0, 0, 2, 0, 0),
                       *np.eye(4).ravel().tolist())  # fmt: skip
    shapes = [(5120, "VEC3", 3, 0, 9), (5121, "VEC4", 1, 12, 4), (5126, "VEC4", 1, 16, 16), (5126, "VEC3", 2, 32, 24),
              (5126, "MAT4", 1, 56, 64)]  # fmt: skip
    views = [{"buffer": 0, "byteOffset": at, "byteLength": size} for *_, at, size in shapes]
    accessors = [{"bufferView": k, "componentType": kind, "count": count, "type": of, "normalized": kind == 5120}
                 for k, (kind, of, count, *_) in enumerate(shapes)]  # fmt: skip
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 3}}}},
                  {"mesh": 1, "skin": 0, "children": [2], "scale": [1, 2, 1]}, {"translation": [0, 0, 1]}],
        "skins": [{"joints": [2], "inverseBindMatrices": 4}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]},
                   {"primitives": [{"attributes": {"POSITION": 0}, "material": 1}]}],
        "materials": [
            {"name": "a", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0, 1], "baseColorTexture": {"index": 0}},
             "normalTexture": {"index": 0, "scale": 0.5, "texCoord": 0, "extensions": {
                 "KHR_texture_transform": {"offset": [0, 1], "rotation": 0.5, "scale": [2, 1]}}}},
            {"alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [0, 1, 0], "doubleSided": True,
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_unlit": {}}},
        ],
        "textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 33071, "magFilter": 9728}],
        "images": [{"uri": "data:;base64," + base64.b64encode(_IMAGE).decode()}],
        "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
    }  # fmt: skip
    return json.dumps(document, indent=1).encode()


def _seeds() -> dict[str, bytes]:
    cube = box()
    foreign = trimesh.Trimesh(cube.vertices, cube.faces, process=False)
    obj = "".join(f"v {x} {y} {z}\n" for x, y, z in cube.vertices.tolist()) + "vt 0 0\nvt 1 0.5\nvn 0 0 1\n"
    obj += "g side\nusemtl red\nf 1/1/1 2/2/1 3/1/1 4/2/1\nf -1//1 -2//1 -3//1\n# a comment\n"
    obj += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in cube.faces.tolist())
    return {
        "ascii.ply": _ply(True, "="),
        "little.ply": _ply(False, "<"),
        "big.ply": _ply(False, ">"),
        "saved.ply": format_ply(cube),
        "plain.obj": obj.encode(),
        "binary.stl": foreign.export(file_type="stl"),
        "text.stl": foreign.export(file_type="stl_ascii").encode(),
        "a.glb": trimesh.Scene(foreign).export(file_type="glb"),
        "a.gltf": _gltf(),
        "a.mtl": _MTL.encode(),
        "scene.toml": SCENE.encode(),
    }


SEEDS = _seeds()


# --- mutations ------------------------------------------------------------------------------------------------


def _mutate_list(rng: Random, parts: list[bytes], replacements: list[bytes]) -> None:
    """Replace, delete, duplicate, swap or insert one of ``parts``, in place."""
    if not parts:
        return
    at, other = rng.randrange(len(parts)), rng.randrange(len(parts))
    match rng.randrange(10):
        case 0 | 1 | 2 | 3 | 4:
            parts[at] = rng.choice(replacements)
        case 5:
            del parts[at]
        case 6:
            parts.insert(other, parts[at])
        case 7 | 8:
            parts[at], parts[other] = parts[other], parts[at]
        case _:
            parts.insert(at, rng.choice(replacements))


def mutate_text(rng: Random, content: bytes) -> bytes:
    """One token or one line, with extreme numbers among the replacements."""
    if rng.random() < 0.3:
        lines = content.split(b"\n")
        _mutate_list(rng, lines, [rng.choice(lines), rng.choice(NUMBERS)])
        return b"\n".join(lines)
    pieces = re.split(rb"([\s,=\[\]]+)", content)
    tokens = pieces[::2]
    # A deleted token leaves its separator behind, which text formats skip.
    _mutate_list(rng, tokens, [rng.choice(tokens), rng.choice(NUMBERS), rng.choice(NUMBERS)])
    gaps = [*pieces[1::2], *[b" "] * 2]
    return b"".join(piece for pair in zip(tokens, gaps, strict=False) for piece in pair)


def mutate_bytes(rng: Random, content: bytes) -> bytes:
    """Flip, overwrite, delete, duplicate, insert, swap or cut off."""
    at = rng.randrange(len(content) + 1)
    size = rng.choice([1, 1, 2, 4, 8, 12, 13, 50, 100])
    before, span, after = content[:at], content[at : at + size], content[at + size :]
    match rng.randrange(7):
        case 0:
            return before + bytes(b ^ (1 << rng.randrange(8)) for b in span[:1]) + span[1:] + after
        case 1:
            word = rng.choice(WORDS)
            return before + word + content[at + len(word) :]
        case 2:
            return before + after
        case 3:
            return before + span + span + after
        case 4:
            return before + rng.randbytes(size) + span + after
        case 5:
            other = rng.randrange(len(content) + 1)
            moved = content[other : other + size]
            return before + moved + content[at + len(moved) :]
        case _:
            return before if rng.random() < 0.3 else before + rng.randbytes(len(span)) + after


def mutated(name: str, seed: int, index: int) -> bytes:
    """Input ``index`` of ``seed``: the seed file ``name`` with one to four mutations."""
    rng = Random(f"{name} {seed} {index}")
    content = SEEDS[name]
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        head, mark, body = content.partition(b"end_header\n")
        if name in ("ascii.ply", "plain.obj", "text.stl", "a.gltf", "a.mtl", "scene.toml"):
            content = (mutate_text if rng.random() < 0.8 else mutate_bytes)(rng, content)
        elif mark and rng.random() < 0.3:
            content = mutate_text(rng, head) + mark + body
        elif name == "binary.stl" and rng.random() < 0.5 and len(content) > 84:
            at = rng.randrange(84, len(content))
            word = rng.choice(WORDS)
            content = (content[:at] + word + content[at + len(word) :])[: len(content)]
        elif name == "a.glb" and rng.random() < 0.5:
            content = _mutate_glb_text(rng, content)
        else:
            content = mutate_bytes(rng, content)
    return content


def _mutate_glb_text(rng: Random, content: bytes) -> bytes:
    """Mutate the JSON chunk and mend the lengths, so that the reader comes as far as what the JSON says."""
    length = int.from_bytes(content[12:16], "little")
    text, rest = content[20 : 20 + length], content[20 + length :]
    pieces = re.split(rb"([,:\[\]{}]+)", text)
    _mutate_list(rng, pieces, [rng.choice(NUMBERS), rng.choice(pieces)])
    text = b"".join(pieces)
    text += b" " * (-len(text) % 4)
    return content[:8] + struct.pack("<II", 20 + len(text) + len(rest), len(text)) + content[16:20] + text + rest


# --- checks ---------------------------------------------------------------------------------------------------


def check_materials(mesh: Mesh) -> None:
    """Each face has one or none, and each image its pixels or one clear error."""
    for material in mesh.materials:
        for texture in material.textures.values():
            try:
                assert texture.image.pixels.shape[:2] == texture.image.size[::-1]
            except MeshError as error:
                assert "\n" not in str(error)
    rows = [-1] if mesh.face_materials is None else mesh.face_materials
    assert min(rows) >= -1 and max(rows) < len(mesh.materials)


def check_mesh(mesh: Mesh, rng: np.random.Generator) -> bool:
    """Valid arrays, and the octree's hits are brute force's, each finite or a miss. False: no octree may be built."""
    assert len(mesh.faces) > 0 and mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices)
    assert np.isfinite(mesh.vertices).all()
    check_materials(mesh)
    if len(mesh.faces) > MOST_TRACED:
        return True
    try:
        octree = Octree.from_mesh(mesh, threads=1)
    except MeshError:
        return False
    # Half at vertices and half at middles of faces, from anywhere within the mesh's largest coordinate.
    corners = mesh.triangles[rng.integers(0, len(mesh.faces), RAYS)]
    size = max(float(np.abs(corners).max()), 1e-300)
    weights = np.where(np.arange(RAYS)[:, None] % 2, [1 / 3, 1 / 3, 1 / 3], [1.0, 0.0, 0.0])
    # A rounding may carry size times a number near 1 past the largest float64.
    origins = rng.uniform(-0.99, 0.99, (RAYS, 3)) * size
    directions = np.einsum("nk,nkj->nj", weights, corners / size) - origins / size
    directions[~directions.any(axis=1)] = [0.0, 0.0, 1.0]
    hits = octree.closest_hit(origins, directions)
    assert (np.isfinite(hits.t) == hits.hit).all() and (hits.t >= 0).all() and (hits.face < len(mesh.faces)).all()
    brute = BruteForce.from_mesh(mesh, threads=1).closest_hit(origins, directions)
    assert np.array_equal(hits.face, brute.face) and np.array_equal(hits.t, brute.t)
    assert np.array_equal(octree.any_hit(origins, directions), hits.hit)
    return True


def triangles_of(lengths: list[int]) -> range:
    """How many triangles faces of so many corners make: larger ones fewer where they touch themselves."""
    return range(sum(n == 3 for n in lengths), sum(max(n - 2, 0) for n in lengths) + 1)


def triangles_by_plyfile(content: bytes) -> range | None:
    """How many triangles plyfile counts; None where it cannot read the file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            read = plyfile.PlyData.read(BytesIO(content))
            if any(element.name == "tristrips" for element in read.elements):
                return None
            return triangles_of([
                len(polygon)
                for element in read.elements
                if element.name == "face"
                for name in [next(p.name for p in element.properties if p.name in ("vertex_indices", "vertex_index"))]
                for polygon in element[name]
            ])  # fmt: skip
    except Exception:  # a foreign reader on malformed input raises anything
        return None


def triangles_by_lines(content: bytes) -> range | None:
    """How many triangles the f lines of an OBJ file make; None where lines are joined."""
    if b"\\" in content:
        return None
    lines = map(str.split, re.split(r"[\r\n]", content.decode("utf-8", "replace")))
    return triangles_of([len(words) - 1 for words in lines if words[:1] == ["f"]])


def check_repair(path: Path, rng: np.random.Generator) -> str:
    """A refused mesh file with ``repair``: refused again, or a valid mesh and one warning."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            mesh = load_mesh(path, repair=True)
        except MeshError:
            return "refused"
    assert [w.category for w in caught] == [RepairWarning], "a repair without its warning, or another warning"
    check_mesh(mesh, rng)
    return "repaired"


COUNTERS: dict[str, Callable[[bytes], range | None]] = {".ply": triangles_by_plyfile, ".obj": triangles_by_lines}


def check(path: Path, content: bytes, index: int) -> str:
    """Load ``content`` from ``path`` and check what comes.

    'refused', 'repaired' (refused without ``repair``), 'loaded', or 'counted' (loaded, and by another reader too).

    Anything wrong is an exception: AssertionError, TimeoutError, or whatever the reader let through.
    """
    path.write_bytes(content)
    path = path.with_name("of_mtl.obj") if path.suffix == ".mtl" else path
    rng = np.random.default_rng(index)
    with warnings.catch_warnings(), time_limit(SECONDS):
        warnings.simplefilter("error")
        for category in (SceneWarning, RepairWarning):  # what is left out is named, and the rest is right
            warnings.simplefilter("ignore", category)
        try:
            loaded: Mesh | Scene = load_scene(path) if path.suffix == ".toml" else load_mesh(path)
        except (MeshError, SceneError) as error:
            assert str(error).startswith(f"{path}: ") and "\n" not in str(error) and len(str(error)) < 5000
            return "refused" if path.suffix == ".toml" else check_repair(path, rng)
        if isinstance(loaded, Scene):
            for instance in loaded.instances[:4]:
                check_mesh(instance.mesh, rng)
            return "loaded"
        check_mesh(loaded, rng)
    count = COUNTERS.get(path.suffix, lambda _: None)(path.read_bytes())
    assert count is None or len(loaded.faces) in count, f"a silent drop: {len(loaded.faces)} triangles of {count}"
    return "loaded" if count is None else "counted"


def prepare(folder: Path) -> None:
    """Put beside the inputs what they refer to, and compile the kernels before a clock starts."""
    check_mesh(box(), np.random.default_rng(0))
    (folder / "box.ply").write_bytes(format_ply(box()))
    (folder / "of_mtl.obj").write_text(_OF_MTL)
    (folder / "a.ppm").write_bytes(_IMAGE)


def _kind(name: str) -> Kind:
    return Kind(
        partial(mutated, name),
        lambda folder, content, index: check(folder / name, content, index),
        share=4,
    )


KINDS = {name: _kind(name) for name in SEEDS}
