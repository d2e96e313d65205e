"""Adaptive patches: cut where radiosity changes, and only there."""

import enclosures
import numpy as np
import pytest
from cases import cases

from renderer import Mesh
from renderer.mesh.shapes import box, grid
from renderer.radiosity import adaptive, patches, radiosity
from renderer.studies.factors.surfaces import areas_of

pytestmark = pytest.mark.judges("radiosity.adaptive", "radiosity.Adapted")


def under_a_sky(share):
    """View factors of surfaces that see nothing but a share of the sky, by the centroids of faces."""

    def factors(mesh):
        sky = share(mesh.triangles.mean(axis=1))
        n = len(sky)
        return enclosures.factors(areas_of(mesh), np.zeros((n, n)), sky)

    return factors


def longest_at(found, near):
    corners = found.patches.mesh.triangles
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    return lengths[near(corners.mean(axis=1))]


def test_a_shadow_is_cut_and_what_is_even_is_not():
    shadow = under_a_sky(lambda at: np.where(at[:, 0] < 0.1, 0.2, 0.8))
    start = patches(grid(4, 4), 0.5)
    found = adaptive(start, 0.0, 0.5, sky=1.0, rounds=4, factors=shadow)
    at_edge = longest_at(found, lambda at: np.abs(at[:, 0] - 0.1) < 0.01)
    far = longest_at(found, lambda at: np.abs(at[:, 0] - 0.1) > 0.3)
    whole = np.sqrt(2.0) / 4
    assert at_edge.max() <= whole / 8 and np.isclose(far.max(), whole)
    np.testing.assert_allclose(found.radiosity.values[:, 0], 0.5 * shadow(found.patches.mesh).sky)
    # The cut stops where the length times the change is too small: 0.3 l <= contrast * mean * whole.
    coarse = adaptive(start, 0.0, 0.5, sky=1.0, rounds=20, contrast=0.5, factors=shadow)
    values, mesh = coarse.radiosity.values[:, 0], coarse.patches.mesh
    mean = np.average(values, weights=areas_of(mesh))
    assert longest_at(coarse, lambda at: np.abs(at[:, 0] - 0.1) < 0.02).max() * 0.3 / np.sqrt(2) <= 0.5 * mean * whole
    assert len(values) < 2000


def test_a_lamp_elsewhere_changes_no_cut():
    """Only reflected light is what changes are compared with."""
    slope = under_a_sky(lambda at: np.clip(at[:, 0] + 0.5, 0.0, 1.0))
    two = Mesh.concatenate(grid(2, 2), grid(1, 1).transformed([[1, 0, 0, 9], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]))
    dark, lit = (np.repeat([0.0, lamp], [8, 2]) for lamp in (0.0, 1e6))
    cuts = [
        adaptive(patches(two, 1.5), emission, 0.5, sky=1.0, factors=slope).patches.faces for emission in (dark, lit)
    ]
    assert len(cuts[0]) > 10
    np.testing.assert_array_equal(*cuts)


def test_a_slope_is_cut_as_far_as_its_contrast():
    slope = under_a_sky(lambda at: at[:, 0] + 0.5)
    counts = []
    for contrast in (1.0, 0.1, 0.02):
        found = adaptive(patches(grid(2, 2), 1.0), 0.0, 0.5, sky=1.0, rounds=10, contrast=contrast, factors=slope)
        counts.append(len(found.patches.faces))
    assert counts[0] == 8 < counts[1] < counts[2] < 10_000


def test_nothing_is_cut_for_creases_and_for_surfaces_that_differ():
    # Sides of a box see different skies; faces of a plane reflect differently, or emit.
    sides = under_a_sky(lambda at: np.where(np.abs(at[:, 0] - 0.5) > 0.4, 0.2, 0.7))
    assert len(adaptive(patches(box(), 9.0), 0.0, 0.5, sky=1.0, factors=sides).patches.faces) == 12
    even = under_a_sky(lambda at: np.full(len(at), 0.5))
    plane, rows = patches(grid(), 9.0), np.array([0.2, 0.8])
    assert len(adaptive(plane, 0.0, rows, sky=1.0, factors=even).patches.faces) == 2
    assert len(adaptive(plane, rows, 0.5, sky=1.0, factors=even).patches.faces) == 2


def test_no_round_only_solves():
    shadow = under_a_sky(lambda at: np.where(at[:, 0] < 0.1, 0.2, 0.8))
    start = patches(grid(4, 4), 0.2)
    found = adaptive(start, 0.25, 0.5, sky=1.0, rounds=0, factors=shadow)
    assert found.patches is start
    expected = radiosity(shadow(start.mesh), 0.25, 0.5, sky=1.0).values
    np.testing.assert_array_equal(found.radiosity.values, expected)


def test_rows_of_faces_become_those_of_patches():
    even = under_a_sky(lambda at: np.full(len(at), 0.5))
    found = adaptive(patches(box(), 0.6), np.arange(12.0), np.linspace(0, 0.5, 12), sky=2.0, factors=even)
    faces = found.patches.faces
    np.testing.assert_allclose(found.radiosity.values[:, 0], faces + np.linspace(0, 0.5, 12)[faces])


@cases(
    ("arguments", "message"),
    [
        ({"patches": box()}, "patches: expected Patches, got Mesh"),
        ({"emission": [1.0] * 96}, "emission: expected one number, shape (12,) or (12, 3), a row a surface"),
        ({"contrast": 0.0}, "contrast: expected a finite number > 0, got 0.0"),
        ({"rounds": -1}, "rounds: expected an integer >= 0, got -1"),
        ({"crease": -1}, "crease: expected an angle from 0 to 180 degrees, got -1"),
    ],
)
def test_bad_input_is_named(arguments, message):
    even = under_a_sky(lambda at: np.full(len(at), 0.5))
    given = {"patches": patches(box(), 0.5), "emission": 0.0, "reflectance": 0.5, "factors": even} | arguments
    with pytest.raises(ValueError) as caught:
        adaptive(**given)
    assert str(caught.value).startswith(message)
