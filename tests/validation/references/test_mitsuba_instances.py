"""Embree's instances through Mitsuba, and Mitsuba's attributes, where geometry gives the answer."""

import numpy as np

from renderer.mesh.shapes import box
from validation.oracle.placing import Body
from validation.oracle.rounding import FLOAT32_ROUNDOFF
from validation.references.mitsuba.attributes import attributes
from validation.references.mitsuba.instances import MitsubaInstances

CUBE = box()
# Embree divides by a reciprocal that AMD's processors approximate otherwise than Intel's: two roundings of float32.
ROUNDED = 2 * FLOAT32_ROUNDOFF


def test_instances_are_hit_where_they_stand_and_faces_are_numbered_on() -> None:
    far, mirrored = np.eye(4)[:3], np.diag([-1.0, 1.0, 1.0, 1.0])[:3]
    far[:, 3] = 4.0, 0.0, 2.0
    bodies = [
        Body(CUBE.vertices, CUBE.faces, np.stack([np.eye(4)[:3], far])),
        Body(CUBE.vertices, CUBE.faces, mirrored[None]),
    ]
    rays = np.array([[0.5, 0.25, 9], [4.5, 0.25, 9], [-0.5, 0.25, 9], [9, 9, 9]]), np.array([[0.0, 0, -2]] * 4)
    t, face = MitsubaInstances(bodies).closest_hit(*rays)
    np.testing.assert_allclose(t, [4.0, 3.0, 4.0, np.inf], rtol=ROUNDED)
    assert face[:2].tolist() == [10, 22] and face[2] in (34, 35) and face[3] == -1


def test_attributes_are_those_between_the_vertices() -> None:
    rays = np.array([[0.5, 0.25, 9], [9, 9, 9]]), np.array([[0.0, 0, -1]] * 2)
    found = attributes(CUBE.vertices, CUBE.faces.astype(np.int64), CUBE.vertices, CUBE.vertices[:, 1:], *rays)
    np.testing.assert_allclose(found.t, [8.0, np.inf], rtol=ROUNDED)
    np.testing.assert_allclose(found.colors[0], [0.5, 0.25, 1.0], atol=1e-6)
    np.testing.assert_allclose(found.texcoords[0], [0.25, 1.0], atol=1e-6)
