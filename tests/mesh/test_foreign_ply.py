"""PLY files as other programs may write them: every type, order and place of properties, against what was put in."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from ply_bytes import CODES, FORMATS, ply

from renderer.mesh.ply import parse_ply

INTEGERS = sorted(set(CODES) - {"float", "double", "float32", "float64"})
SIGNED = [name for name in INTEGERS if CODES[name].islower()]
UNSIGNED = [name for name in INTEGERS if CODES[name].isupper()]
FLOATS = sorted(set(CODES) - set(INTEGERS))
# The greatest whole number that each of them holds, as far as is needed here.
MOST = {"b": 127, "B": 255, "h": 2**15 - 1, "H": 2**16 - 1, "i": 2**31 - 1, "I": 2**32 - 1, "f": 2**24, "d": 2**24}


def most(type_: str) -> int:
    return MOST[CODES[type_]]


Column = tuple[str, Any]  # a property as the header has it, and its value in each row


@st.composite
def unread(draw: Any, rows: int, prefix: str) -> list[Column]:
    """Properties that no mesh has: numbers, and lists of several lengths."""
    columns: list[Column] = []
    for number in range(draw(st.integers(0, 2))):
        name, type_ = f"{prefix}{number}", draw(st.sampled_from(sorted(CODES)))
        if draw(st.booleans()):
            columns.append((f"{type_} {name}", [7] * rows))
        else:
            lengths = [draw(st.integers(0, 2))] * rows if draw(st.booleans()) else [k % 3 for k in range(rows)]
            columns.append((f"list {draw(st.sampled_from(INTEGERS))} {type_} {name}", [[3] * k for k in lengths]))
    return columns


@st.composite
def vertices(draw: Any) -> tuple[list[Column], dict[str, NDArray[np.float64]]]:
    """Columns along a curve without a straight piece, in the plane z = x, so that any polygon of them is convex."""
    types = [draw(st.sampled_from(sorted(CODES))) for _ in range(3)]
    count = min(300, int(most(types[1]) ** 0.5), most(types[0]), most(types[2]))
    k = np.arange(count)
    attributes = {"vertices": np.stack([k, k * k, k], axis=1).astype(np.float64)}
    columns: list[Column] = [
        (f"{t} {name}", v.tolist()) for t, name, v in zip(types, "xyz", (k, k * k, k), strict=True)
    ]
    if draw(st.booleans()):
        attributes["normals"] = np.stack([k % 4 / 4.0, k % 3 - 1.0, 0.5 + k % 2], axis=1)
        columns += [
            (f"{draw(st.sampled_from(FLOATS))} {n}", attributes["normals"][:, i].tolist())
            for i, n in enumerate(("nx", "ny", "nz"))
        ]
    if draw(st.booleans()):
        steps = (np.stack([k % 5, k % 3, k % 2], axis=1) * 51.0 % 256.0).astype(int)
        channels = []
        for i, name in enumerate(("red", "green", "blue")):
            type_ = draw(st.sampled_from([*UNSIGNED, *FLOATS]))
            full = 1 if type_ in FLOATS else most(type_)
            stored = steps[:, i] % 2 / 2.0 if type_ in FLOATS else steps[:, i] * (full // 255)
            channels.append(stored / full)
            columns.append((f"{type_} {name}", stored.tolist()))
        attributes["colors"] = np.stack(channels, axis=1)
    if draw(st.booleans()):
        names = draw(st.sampled_from([("s", "t"), ("u", "v"), ("texture_u", "texture_v")]))
        attributes["texcoords"] = np.stack([k / 8.0, 1.0 - k / 4.0], axis=1)
        columns += [
            (f"{draw(st.sampled_from(FLOATS))} {n}", attributes["texcoords"][:, i].tolist())
            for i, n in enumerate(names)
        ]
    return columns, attributes


@st.composite
def polygons(draw: Any, count: int, same: bool) -> list[Column]:
    """A list of corners: rising numbers of vertices, so the polygons are convex; of one length, or of several."""
    type_ = draw(st.sampled_from([*INTEGERS, "float", "double"]))
    rng = np.random.default_rng(draw(st.integers(0, 2**20)))
    last = min(count - 1, most(type_))
    lengths = np.full(5, 3 + draw(st.integers(0, 2))) if same else rng.integers(3, 7, 5)
    rows = [sorted(rng.choice(last + 1, n, replace=False).tolist()) for n in lengths]
    rows[-1][-1] = last
    name = draw(st.sampled_from(["vertex_indices", "vertex_index"]))
    return [(f"list {draw(st.sampled_from(INTEGERS))} {type_} {name}", rows)]


@st.composite
def strips(draw: Any, count: int) -> list[Column]:
    """Strips that begin anew after -1, also where a row begins or ends with it."""
    type_ = draw(st.sampled_from(SIGNED))
    rng, last = np.random.default_rng(draw(st.integers(0, 2**20))), min(count, most(type_) + 1)
    pieces = [rng.choice(last, n, replace=False).tolist() for n in rng.integers(3, 7, 4)]
    rows = [[*pieces[0], -1, *pieces[1]], [-1, *pieces[2]], [*pieces[3], -1]]
    return [(f"list {draw(st.sampled_from(INTEGERS))} {type_} vertex_indices", rows)]


def triangles_of(corners: list[Any], strip: bool) -> list[list[int]]:
    """The triangles of a row: a fan's, or those of its strips, every second one turned."""
    if not strip:
        return [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
    found, begin = [], 0
    for end in [i for i, corner in enumerate(corners) if corner == -1] + [len(corners)]:
        piece = corners[begin:end]
        found += [[piece[i + i % 2], piece[i + 1 - i % 2], piece[i + 2]] for i in range(len(piece) - 2)]
        begin = end + 1
    return found


def element(name: str, columns: list[Column]) -> tuple[str, list[str], list[list[Any]]]:
    return (
        name,
        [text for text, _ in columns],
        [list(row) for row in zip(*(values for _, values in columns), strict=True)],
    )


@given(st.data())
@settings(max_examples=100)
def test_a_mesh_is_what_was_put_into_the_file(data: st.DataObject) -> None:
    columns, attributes = data.draw(vertices())
    count = len(attributes["vertices"])
    elements = [("vertex", data.draw(st.permutations(columns + data.draw(unread(count, "a")))))]
    faces: list[tuple[str, list[Any]]] = []
    for name in data.draw(st.sampled_from([["face"], ["tristrips"], ["face", "tristrips"], ["tristrips", "face"]])):
        own = data.draw(strips(count) if name == "tristrips" else polygons(count, data.draw(st.booleans())))
        faces += [(name, row) for row in own[0][1]]
        elements.append((name, data.draw(st.permutations(own + data.draw(unread(len(own[0][1]), "b"))))))
    for name in data.draw(st.sets(st.sampled_from(["camera", "edge"]))):
        more = data.draw(unread(3, "c")) or [("int c", [1, 2, 3])]
        elements.insert(data.draw(st.integers(0, len(elements))), (name, more))
    content = ply(data.draw(st.sampled_from(FORMATS)), *(element(*each) for each in elements))
    mesh = parse_ply(content)
    expected = [t for name, row in faces for t in triangles_of(row, name == "tristrips")]
    np.testing.assert_array_equal(mesh.faces, expected)
    np.testing.assert_array_equal(mesh.vertices, attributes["vertices"])
    for name in ("normals", "colors", "texcoords"):
        found = getattr(mesh, name)
        assert (found is None) == (name not in attributes)
        if found is not None:
            np.testing.assert_array_equal(found, attributes[name].astype(found.dtype))
