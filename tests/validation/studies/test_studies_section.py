"""The section on studies: each kind of wrong answer turns a gate red."""

import numpy as np
import pytest
from cases import cases

from renderer import Octree
from renderer.studies.points import Chosen, Points
from validation.studies import bits, bodies, corners, forms, holds


@pytest.mark.parametrize("name", ["sky_view_factor", "ambient_occlusion", "openness"])
def test_a_share_that_is_off_breaks_its_bound(monkeypatch, name):
    own = getattr(forms, name)
    monkeypatch.setattr(forms, name, lambda *a, **k: np.minimum(own(*a, **k) + 0.02, 1.0))
    own_forms = [i for i, (form, _) in enumerate(forms.forms()) if form.study == name]
    assert max(forms.check_form(i, True)["share_of_bound"] for i in own_forms) > 1.0


def test_errors_that_do_not_fall_have_no_slope(monkeypatch):
    own = forms.sky_view_factor
    monkeypatch.setattr(forms, "sky_view_factor", lambda *a, **k: own(*a, **k) + 1e-3)
    assert all(row["slope"] > forms.SLOPE for row in forms.check_slope(True)["curves"])


@cases("name", ["town", "terrain", "balls", "loose triangles", "slivers"])
def test_a_wrong_bit_is_counted(monkeypatch, name):
    own = bits.occlusion

    def one_wrong(*told, **options):
        found = own(*told, **options)
        found[7, 0] ^= 0xFF
        return found

    assert bits.check_bits(name, 40, 64)["wrong"] == 0
    monkeypatch.setattr(bits, "occlusion", one_wrong)
    # Of the bits at the horizon's very edge either will do: none is among these.
    assert bits.check_bits(name, 40, 64)["wrong"] == 8


@cases("name", corners.MESHES)
def test_a_wrong_bit_at_a_vertex_is_counted(monkeypatch, name):
    own, index = corners.occlusion, list(corners.CHECKS).index((name, "vertices"))
    monkeypatch.setattr(corners, "_QUICK", 20)
    monkeypatch.setattr(corners, "_SAMPLE", 20)
    asked = []

    def one_wrong(octree, points, *told, **options):
        """The second call is that of lifted starts."""
        found = own(octree, points, *told, **options)
        asked.append(points)
        found[7, 0] ^= 0xFF * (len(asked) == 1)
        return found

    monkeypatch.setattr(corners, "occlusion", one_wrong)
    assert corners.check_corners(index, True)["wrong"] == 8


def test_a_face_that_turns_the_side_is_counted(monkeypatch):
    own = corners.sky_view_factor
    monkeypatch.setattr(corners, "_QUICK", 4)
    monkeypatch.setattr(
        corners, "sky_view_factor", lambda *a, leaving=None, **k: own(*a, **k) + (leaving is not None) * 2.0**-40
    )
    assert corners.check_corners(1, True)["unlike"] == 8


def test_the_law_at_a_corner_by_hand():
    """From a corner of a cube, out of which its normal points. A wall hides what goes there; along an edge the cube's
    next face is met.
    """
    mesh = bodies.Mesh.concatenate([bodies.box(), bodies.box((3.0, -9.0, -9.0), (4.0, 9.0, 9.0))])
    surface = corners.Surface(mesh.vertices, mesh.faces)
    start = corners.Start((corners.Fraction(1), corners.Fraction(1), corners.Fraction(1)))
    ways = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [-1.0, 2.0, -0.5], [-1.0, -1.0, -1.0]])
    hidden = corners.hidden_by_law(surface, [start] * 5, np.tile([1.0, 1.0, 1.0], (5, 1)), ways)
    assert hidden.tolist() == [True, True, False, False, True]


def test_exact_rays_skip_the_face_that_they_leave_and_nothing_else():
    mesh = bodies.touching()
    start = np.array([[0.5, 0.5, 2.0]])
    assert bits.hidden_exactly(mesh, start, np.array([[0.0, 0.0, 1.0]])).tolist() == [False]
    assert bits.hidden_exactly(mesh, start, np.array([[0.0, 0.0, -1.0]])).tolist() == [True]


def _below(own, octree, path):
    found = own(octree, path).points
    return found.normals, found.leaving


class BlindAtEdges(Octree):
    """What lies on an edge hides itself: nothing is seen from there."""

    def visible(self, points, targets):
        return super().visible(points, targets) & (self.closest_point(points).distance > 1e-12)


BROKEN = {
    "moved to UTM coordinates": (
        "sky_view_factor", lambda own: lambda o, p, *a, **k: own(o, p, *a, **k) + p[:, 0] * 1e-12),
    "threads, order and company": (
        "sky_view_factor", lambda own: lambda *a, **k: own(*a, **k) + 1e-9 * (k.get("threads") == 3)),
    "light through walls that touch": ("occlusion", lambda own: lambda *a, **k: own(*a, **k) & 0x7F),
    "shade among faces of a plane": ("ambient_occlusion", lambda own: lambda *a, **k: own(*a, **k) - 2.0**-53),
    "two sides of a thin plate": ("sky_view_factor", lambda own: lambda *a, **k: 1.0 - own(*a, **k)),
    "points inside bodies": ("openness", lambda own: lambda *a, **k: own(*a, **k) + 1.0 / 300),
    "hours of sun in a street": ("sun_hours", lambda own: lambda *a, **k: own(*a, **k) + 0.25),
    "weights and distances": ("occlusion", lambda own: lambda *a, distance=0, **k: own(*a, **k)),
    "light through screens": ("sun_hours", lambda own: lambda *a, transmittance, **k: own(*a, **k)),
    "faces that an eye sees": ("visible_faces", lambda own: lambda *a, **k: ~own(*a, **k)),
    "clouds and depths": ("depth_map", lambda own: lambda *a, **k: own(*a, **k) * (1 + 2.0**-50)),
    "clouds from a roof": ("scan", lambda own: lambda o, p, w: own(o, np.add(p, (0.0, 0.0, 1e-4)), w)),
    "places of a grid": (
        "of_file", lambda own: lambda o, path: Chosen(Points(own(o, path).points.points * 1.1, *_below(own, o, path)))),
    "edges from both sides": ("Octree", lambda own: lambda *a: BlindAtEdges(*a)),
}  # fmt: skip


@cases("name", BROKEN)
def test_what_does_not_hold_is_counted(monkeypatch, name):
    study, broken = BROKEN[name]
    assert BROKEN.keys() == holds.CHECKS.keys()
    monkeypatch.setattr(holds, "town", lambda *size: bodies.town(*size or (2, 6)))
    monkeypatch.setattr(holds, "terrain", lambda: bodies.terrain(6))
    monkeypatch.setattr(holds, study, broken(getattr(holds, study)))
    row = holds.check(name)
    assert 0 < row["wrong"] <= row["asked"]
