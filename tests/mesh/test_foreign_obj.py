"""OBJ files as other programs may write them: every form of corners and lines, against what was put in."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer.mesh.obj import parse_obj

FORMS = ["{0}", "{0}/{1}", "{0}//{2}", "{0}/{1}/{2}", "{0}/{1}/"]
HAS_TEXCOORD, HAS_NORMAL = {"{0}/{1}", "{0}/{1}/{2}", "{0}/{1}/"}, {"{0}//{2}", "{0}/{1}/{2}"}


@dataclass
class File:
    """Lines of a file, all alike or not, and what they hold."""

    alike: bool
    lines: list[str] = field(default_factory=list)
    positions: list[Any] = field(default_factory=list)
    texcoords: list[Any] = field(default_factory=list)
    normals: list[Any] = field(default_factory=list)
    # Of each triangle's three corners: rows of positions, texture coordinates and normals, None for none.
    corners: list[list[Any]] = field(default_factory=list)


def add_values(file: File, draw: Any, colors: bool) -> None:
    """Some rows of each kind: positions along a curve, so that any polygon of them is convex."""
    for _ in range(draw(st.integers(3, 5))):
        k = len(file.positions)
        file.positions.append([k / 2, k * k / 4, -k / 2])
        more = (
            f" {k % 5 / 4} {k % 3 / 2} {k % 2}"
            if colors
            else draw(st.sampled_from([""] if file.alike else ["", " 1.0"]))
        )
        file.lines.append(f"v {k / 2} {k * k / 4} {-k / 2}{more}")
    for _ in range(draw(st.integers(1, 3))):
        k = len(file.texcoords)
        one = not file.alike and draw(st.booleans())
        file.texcoords.append([k / 8, 0.0 if one else 1 - k / 8])
        file.lines.append(
            f"vt {k / 8}" if one else f"vt {k / 8} {1 - k / 8}{draw(st.sampled_from(['', ' 0.5'])) * (not file.alike)}"
        )
        file.normals.append([0.0, k - 1.0, 2.0])
        file.lines.append(f"vn 0 {k - 1.0} 2")


def add_face(file: File, draw: Any, form: str | None, negative: bool | None) -> None:
    """A convex polygon, whose numbers count from the first row on or back from the last one so far."""
    count = draw(st.integers(3, min(6, len(file.positions))))
    chosen = sorted(draw(st.permutations(range(len(file.positions))))[:count])
    words, corners = [], []
    for position in chosen:
        one = draw(st.sampled_from(FORMS)) if form is None else form
        rows = [position, draw(st.integers(0, len(file.texcoords) - 1)), draw(st.integers(0, len(file.normals) - 1))]
        kinds = (file.positions, file.texcoords, file.normals)
        back = [draw(st.booleans()) if negative is None else negative for _ in rows]
        words.append(
            one.format(*(k - len(rows_) if b else k + 1 for k, rows_, b in zip(rows, kinds, back, strict=True)))
        )
        corners.append([position, rows[1] if one in HAS_TEXCOORD else None, rows[2] if one in HAS_NORMAL else None])
    gap = " " if file.alike else draw(st.sampled_from([" ", "  ", "\t", " \\\n "]))
    end = "" if file.alike else draw(st.sampled_from(["", " ", " # a face"]))
    file.lines.append("f" + gap + gap.join(words) + end)
    file.corners += [[corners[0], corners[i], corners[i + 1]] for i in range(1, count - 1)]


OTHER = ["# v 1 2 3", "", "g part one", "o thing", "usemtl red", "mtllib a.mtl", "s off", "l 1 2", "p 1"]


@st.composite
def files(draw: Any) -> tuple[File, bool]:
    """A file, and whether its vertices have colours."""
    file, colors = File(draw(st.booleans())), draw(st.booleans())
    form = draw(st.sampled_from(FORMS)) if file.alike else draw(st.one_of(st.none(), st.sampled_from(FORMS)))
    negative = draw(st.sampled_from([False, True] if file.alike else [None, False, True]))
    for _ in range(draw(st.integers(1, 3))):
        add_values(file, draw, colors)
        for _ in range(draw(st.integers(1, 3))):
            add_face(file, draw, form, negative)
            file.lines += draw(st.lists(st.sampled_from(OTHER), max_size=1))
    indent = draw(st.sampled_from(["", "  "] if not file.alike else [""]))
    file.lines = [indent + line for line in file.lines]
    return file, colors


@given(files(), st.sampled_from(["\n", "\r\n"]), st.booleans())
@settings(max_examples=100)
def test_a_mesh_is_what_was_put_into_the_file(drawn: tuple[File, bool], newline: str, ends: bool) -> None:
    """Corner by corner: without a texture coordinate (0, 0), and no normals where one corner lacks its own."""
    (file, colors), content = drawn, newline.join(drawn[0].lines) + newline * ends
    mesh = parse_obj(content.replace("\\\n", "\\" + newline).encode())
    np.testing.assert_array_equal(mesh.triangles, [[file.positions[c[0]] for c in t] for t in file.corners])
    every = [corner for triangle in file.corners for corner in triangle]
    assert (mesh.texcoords is None) == all(corner[1] is None for corner in every)
    if mesh.texcoords is not None:
        expected = [[0.0, 0.0] if corner[1] is None else file.texcoords[corner[1]] for corner in every]
        np.testing.assert_array_equal(mesh.texcoords[mesh.faces].reshape(-1, 2), expected)
    assert (mesh.normals is None) == any(corner[2] is None for corner in every)
    if mesh.normals is not None:
        expected = [file.normals[corner[2]] for corner in every]
        np.testing.assert_array_equal(mesh.normals[mesh.faces].reshape(-1, 3), expected)
    assert (mesh.colors is None) == (not colors)
    if mesh.colors is not None:
        own = [[c[0] % 5 / 4, c[0] % 3 / 2, c[0] % 2] for c in every]
        np.testing.assert_array_equal(mesh.colors[mesh.faces].reshape(-1, 3), own)
