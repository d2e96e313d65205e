"""The objects of a scene as a page is told of them: where they are, and which of them a click hits."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from viewer_client import SIZE, looking

from renderer.mesh.mesh import Mesh
from renderer.scene.scene import Instance
from renderer.viewer.parts import Part, part_of_face, parts_of
from renderer.viewer.payload import description
from renderer.viewer.pick import picked
from renderer.viewer.protocol import Pick
from renderer.viewer.shown import ShownScene, hiding, open_file


@pytest.fixture(scope="module")
def whole(scene: Path) -> ShownScene:
    return open_file(scene)


@cases("hidden", [[], ["objects.0"], ["objects.1"], ["objects.0", "floor"]])
def test_each_face_belongs_to_the_object_whose_corners_it_has(whole: ShownScene, hidden: list[str]) -> None:
    shown = hiding(whole, hidden)
    mesh, first = shown.prepared.mesh, 0
    for told in description(shown)["objects"]:
        faces = range(first, first + (told["faces"] if told["shown"] else 0))
        assert {part_of_face(shown, face).name for face in faces} <= {told["name"]}
        if faces:
            corners = mesh.vertices[mesh.faces[faces]].reshape(-1, 3)
            assert told["bounds"] == [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()]
        first = faces.stop
    assert first == len(mesh.faces)


@cases("hidden", [["x > 0"], ["objects.0", "x < 0"], ["floor", "z > 0.1", "y > 0.5"]])
def test_faces_that_a_section_leaves_belong_to_their_object(whole: ShownScene, hidden: list[str]) -> None:
    shown = hiding(whole, hidden)
    names = [part.name for part in parts_of(whole.scene) if part.name not in hidden]
    first = 0
    for name, instances in zip(names, (part.instances for part in parts_of(shown.scene)), strict=True):
        faces = range(first, first + sum(len(one.mesh.faces) for one in instances))
        assert {part_of_face(shown, face).name for face in faces} <= {name}
        first = faces.stop
    assert 0 < first == len(shown.prepared.mesh.faces)


def test_a_click_names_the_object_behind_one_that_is_hidden(whole: ShownScene) -> None:
    def hit(shown: ShownScene, x: int, y: int) -> dict[str, Any]:
        return picked(shown, Pick(type="pick", seq=1, x=x, y=y, **SIZE, **looking((0.5, 2.6, 5.5))))

    found = {(x, y): hit(whole, x, y)["object"] for x in range(0, SIZE["w"], 16) for y in range(0, SIZE["h"], 12)}
    assert {*found.values()} == {"objects.0", "objects.1", "floor", None}
    x, y = next(pixel for pixel, name in found.items() if name == "objects.0")
    behind = hit(hiding(whole, ["objects.0"]), x, y)
    assert behind["object"] == {"stone": "floor", "glass": "objects.1", None: None}[behind["material"]]


def test_an_object_without_faces_is_nowhere() -> None:
    none = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert Part("objects.0", (Instance(none, "red", False),)).bounds is None
