"""Laws of radiative heat between the surfaces of rooms: by a closed form, and by its sum."""

import warnings

import numpy as np

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.octree import Octree
from renderer.radiosity import net_heat
from renderer.studies import view_factors
from validation.oracle.view_factors.enclosures import heat_of_two
from validation.studies.checks import Asked, counted
from validation.studies.factors.round import ball

# Of the largest heat: the tolerance of the solution, and the sums of view factors.
_RELATIVE = 1e-8
_RTOL = 0.01


def two_surfaces() -> Asked:
    """The heat between a ball and the shell around it is that of the closed form, for any emissivities."""
    (inner, _), (outer, _) = ball(0.5, (0.0, 0.0, 0.0), 2), ball(1.0, (0.0, 0.0, 0.0), 2, outward=False)
    groups = np.repeat([0, 1], [len(inner.faces), len(outer.faces)])
    factors = view_factors(Octree.from_mesh(Mesh.concatenate(inner, outer)), groups, rtol=_RTOL)
    right = []
    for shares, kelvin in (((1.0, 1.0), (400.0, 300.0)), ((0.8, 0.1), (300.0, 500.0)), ((0.05, 0.6), (77.0, 293.0))):
        found = net_heat(factors, shares, kelvin).net
        known = heat_of_two(tuple(factors.areas), shares, kelvin)
        right += [abs(found[0] - known) <= _RELATIVE * abs(known), abs(found[1] + known) <= _RELATIVE * abs(known)]
    return counted(right)


def heat_adds_up() -> Asked:
    """The heat of a closed room has the sum 0, also if a thing stands on its floor, with its bottom or without."""
    right = []
    for share, least in ((1.0, -0.5), (0.7, -2.0), (0.2, -0.5), (0.4, -2.0)):
        room, thing = box((0, 0, 0), (4, 3, 2)), box((1, 1, 0), (2, 2, 1))
        sides = thing.faces[thing.face_normals()[:, 2] > least]
        parts = Mesh(room.vertices, room.faces[:, ::-1]), Mesh(thing.vertices, sides)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "octree: .* see backs of faces", UserWarning)
            groups = np.repeat(np.arange(7), [2] * 6 + [len(sides)])
            factors = view_factors(Octree.from_mesh(Mesh.concatenate(*parts)), groups, rtol=_RTOL)
        net = net_heat(factors, share, [293.0, 293.0, 293.0, 293.0, 303.0, 291.0, 300.0]).net
        right.append(abs(net.sum()) <= _RELATIVE * np.abs(net).max())
    return counted(right)
