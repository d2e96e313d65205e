"""GLB files made by hand: every type of index, layout of vertices, kind of colour and transform of nodes."""

from typing import Any

import numpy as np
from glb_bytes import Glb
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.mesh.load import parse_mesh

Floats = NDArray[np.float64]
INDICES = {5121: "B", 5123: "H", 5125: "I"}  # component types, and struct's letters
# Component types of colours, struct's letters, and what stands for 1.
COLORS = {5121: ("B", 255), 5123: ("H", 65535), 5126: ("f", 1)}
HALF = 0.5**0.5


@st.composite
def primitives(draw: Any, glb: Glb, color: int | None, textured: bool, normals: bool) -> tuple[Any, Any]:
    """A primitive and its triangles' corners: (f, 3, 11) positions, normals, colours and texture coordinates."""
    rng, count = np.random.default_rng(draw(st.integers(0, 2**20))), draw(st.sampled_from([4, 5, 300]))
    rows = np.zeros((count, 11))
    rows[:, :3] = rng.integers(-99, 99, (count, 3)) / 4.0
    rows[:, 3:6] = np.eye(3)[rng.integers(0, 3, count)] * rng.choice([-1.0, 1.0], (count, 1))
    rows[:, 6:9] = rng.integers(0, 6, (count, 3)) * 0.2
    rows[:, 9:] = rng.integers(0, 8, (count, 2)) / 8.0
    gap = draw(st.sampled_from([0, 4, 12]))
    attributes = {"POSITION": glb.add(rows[:, :3].tolist(), "f", 5126, "VEC3", gap)}
    if normals:
        attributes["NORMAL"] = glb.add(rows[:, 3:6].tolist(), "f", 5126, "VEC3", gap)
    if color is not None:
        letter, full = COLORS[color]
        stored = rows[:, 6:9] * full if letter == "f" else np.rint(rows[:, 6:9] * full).astype(int)
        stored = np.concatenate([stored, np.full((count, 1), full)], axis=1)  # of four numbers, as of whole words
        attributes["COLOR_0"] = glb.add(stored.tolist(), letter, color, "VEC4", gap, normalized=letter != "f")
    if textured:
        attributes["TEXCOORD_0"] = glb.add(rows[:, 9:].tolist(), "f", 5126, "VEC2", gap)
        rows[:, 10] = 1.0 - rows[:, 10]  # from the lower left, where the file counts from the upper
    primitive: dict[str, Any] = {"attributes": attributes} | ({"material": 0} if textured else {})
    kind = draw(st.sampled_from([None, *(k for k in INDICES if count < 256 or k != 5121)]))
    strip = draw(st.booleans())
    order = np.arange(count - count % 3 if not strip else count)
    if kind is not None:
        order = rng.choice(count, draw(st.sampled_from([3, 6])), replace=count < 6)
        order[-1] = count - 1
        primitive["indices"] = glb.add(order.tolist(), INDICES[kind], kind, "SCALAR", 0)
    elif not strip and count % 3:
        order, strip = np.arange(count), True
    if strip:
        primitive["mode"] = 5
        faces = [[i + i % 2, i + 1 - i % 2, i + 2] for i in range(len(order) - 2)]
    else:
        faces = np.arange(len(order)).reshape(-1, 3).tolist()
    return primitive, rows[order[faces]]


@st.composite
def placements(draw: Any) -> tuple[dict[str, Any], Floats]:
    """How a node is placed, and the matrix of it: turned by quarters, so that numbers stay short."""
    quaternion = draw(st.sampled_from([(0, 0, 0, 1), (HALF, 0, 0, HALF), (0, -HALF, 0, HALF), (0.5, 0.5, 0.5, 0.5)]))
    scale = draw(st.sampled_from([(1, 1, 1), (2, 2, 2), (-1, 1, 1), (2, 0.5, -4)]))
    move = draw(st.sampled_from([(0, 0, 0), (3, -2, 0.5)]))
    x, y, z, w = quaternion
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn * scale, move
    if draw(st.booleans()):
        return {"matrix": matrix.T.ravel().tolist()}, matrix
    given = {"rotation": list(quaternion), "scale": list(scale), "translation": list(move)}
    kept = draw(st.booleans())  # what is 1 or 0 may be left out
    plain = {"rotation": [0, 0, 0, 1], "scale": [1, 1, 1], "translation": [0, 0, 0]}
    return {name: value for name, value in given.items() if kept or value != plain[name]}, matrix


def placed(corners: Floats, matrix: Floats) -> Floats:
    """Triangles' corners in the world; mirrored ones turned, so that outside stays outside."""
    moved = corners.copy()
    moved[..., :3] = corners[..., :3] @ matrix[:3, :3].T + matrix[:3, 3]
    normals = corners[..., 3:6] @ np.linalg.inv(matrix[:3, :3])
    moved[..., 3:6] = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    return moved[:, [0, 2, 1]] if np.linalg.det(matrix[:3, :3]) < 0.0 else moved


def canonical(corners: Floats) -> list[list[float]]:
    """Triangles in an order of their own, each from its least corner on."""
    rounded = corners.round(6) + 0.0
    rows = [min(np.roll(triangle, -k, axis=0).ravel().tolist() for k in range(3)) for triangle in rounded]
    return sorted(rows)


@given(st.data())
@settings(max_examples=60)
def test_a_mesh_is_what_was_put_into_the_file(data: st.DataObject) -> None:
    """Numbers are told within 1e-6, where colours of 8 bits and quarter turns are exact to more."""
    glb, expected, nodes, meshes = Glb(), [], [], []
    color = data.draw(st.sampled_from([None, *COLORS]))
    textured, normals = color is None and data.draw(st.booleans()), data.draw(st.booleans())
    world: list[Floats] = []
    for number in range(data.draw(st.integers(1, 4))):
        node, matrix = data.draw(placements())
        parent = data.draw(st.integers(-1, number - 1))
        if parent >= 0:
            nodes[parent].setdefault("children", []).append(number)
        world.append(world[parent] @ matrix if parent >= 0 else matrix)
        if number == 0 or data.draw(st.booleans()):
            node["mesh"] = len(meshes)
            made = [data.draw(primitives(glb, color, textured, normals)) for _ in range(data.draw(st.integers(1, 2)))]
            meshes.append({"primitives": [primitive for primitive, _ in made]})
            expected += [placed(corners, world[-1]) for _, corners in made]
        nodes.append(node)
    below = {child for node in nodes for child in node.get("children", [])}
    document = {"nodes": nodes, "meshes": meshes, "materials": [{}], "scene": 0}
    scene = {"nodes": [number for number in range(len(nodes)) if number not in below]}
    mesh = parse_mesh(glb.file(scenes=[scene], **document), ".glb")
    assert (mesh.normals is not None, mesh.colors is not None, mesh.texcoords is not None) == (
        normals, color is not None, textured,
    )  # fmt: skip
    parts = [mesh.vertices, mesh.normals, mesh.colors, mesh.texcoords]
    widths = (3, 3, 3, 2)
    columns = [np.zeros((len(mesh.vertices), w)) if p is None else p for p, w in zip(parts, widths, strict=True)]
    has = np.repeat([part is not None for part in parts], widths)
    found = np.concatenate(columns, axis=1)[mesh.faces]
    assert canonical(found) == canonical(np.concatenate(expected) * has)
