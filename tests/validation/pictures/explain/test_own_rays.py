"""Our own rays are judged whatever the reference's are: where they start, what they hit, and where they go."""

from typing import Any

import numpy as np
from cases import cases

from renderer import Dielectric, PointLight
from validation.pictures.explain.exactly import misplaced
from validation.pictures.explain.optics import wrong_rays
from validation.references.ray_tree import Node, Shadow

LIGHT = PointLight(position=(0.0, 0.0, 5.0))


def hit(**child: Any) -> Node:
    """A ray straight down on face 3 at the origin, with a reflected ray and one to the light."""
    up, down, zero = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(3)
    node = Node("camera", 0, up, down, np.ones(3), face=3, t=1.0, point=zero, normal=up, shading=up)
    node.children["reflected"] = Node(
        "reflected", 1, child.get("origin", zero), up, np.full(3, 0.04), child.get("face", -1)
    )
    hidden = child.get("by", -1)
    node.shadows[0] = Shadow(zero, up, child.get("length", 5.0), np.ones(3), hidden >= 0, hidden)
    return node


def test_rays_that_leave_as_they_should_are_not_named() -> None:
    assert list(misplaced(hit(), [LIGHT])) == list(misplaced(hit(face=4, by=7), [LIGHT])) == []


@cases(
    ("fault", "said"),
    [
        ({"face": 3}, "reflected ray hits face 3, which it leaves"),
        ({"by": 3}, "shadow ray to light 0 is hidden by face 3, which it leaves"),
        ({"origin": np.array([0.0, 0.0, 1e-3])}, "reflected ray starts 0.001 from its surface"),
        ({"length": 4.0}, "shadow ray to light 0 does not end there"),
    ],
)
def test_others_are(fault: dict[str, Any], said: str) -> None:
    (found,) = misplaced(hit(**fault), [LIGHT])
    assert said in found


def test_shares_and_directions_are_those_of_glass() -> None:
    """4 % of the light is reflected where air meets an index of 1.5 head-on."""
    node = hit()
    node.indices = 1.0, 1.5
    node.children["refracted"] = Node("refracted", 1, np.zeros(3), np.array([0.0, 0.0, -1.0]), np.full(3, 0.96))
    assert list(wrong_rays(node, Dielectric(ior=1.5))) == []
    node.children["refracted"].direction = np.array([0.0, 1e-6, -1.0])
    assert ["refracted ray goes along" in text for text in wrong_rays(node, Dielectric(ior=1.5))] == [True]
    node.indices = 1.5, 1.33
    assert len(list(wrong_rays(node, Dielectric(ior=1.5)))) == 2
