"""Values of vertices and faces at hits."""

from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import icosphere

pytestmark = pytest.mark.judges(
    "AllHits.colors", "AllHits.interpolate", "AllHits.take", "AllHits.texcoords", "ClosestPoints.colors",
    "ClosestPoints.interpolate", "ClosestPoints.take", "ClosestPoints.texcoords", "Hits.colors", "Hits.interpolate",
    "Hits.take", "Hits.texcoords",
)  # fmt: skip

BALL = icosphere(2)
RNG = np.random.default_rng(9)
ORIGINS, DIRECTIONS = 3 * RNG.normal(size=(60, 3)), RNG.normal(size=(60, 3))


@cases("accelerator", [Octree, BruteForce])
def test_positions_as_values_are_the_points(accelerator: Any) -> None:
    """A linear function of the place is the same by its values at the vertices."""
    queries = accelerator(BALL)
    ways = 2.0 * DIRECTIONS - ORIGINS
    hits, everything = queries.closest_hit(ORIGINS, ways), queries.all_hits(ORIGINS, ways)
    near = queries.closest_point(ORIGINS, max_distance=2.0)
    for found, there in ((hits, hits.hit), (everything, slice(None)), (near, near.found)):
        np.testing.assert_allclose(found.interpolate(BALL.vertices), found.points, atol=1e-15)
        heights = found.interpolate(BALL.vertices[:, 2].tolist())
        assert heights.dtype == np.float64 and heights.shape == found.face.shape
        np.testing.assert_allclose(heights, found.points[:, 2], atol=1e-15)
        labels = RNG.integers(0, 9, (len(BALL.faces), 2))
        np.testing.assert_array_equal(found.interpolate(labels)[there], labels[found.face[there]])
    assert np.isnan(hits.interpolate(BALL.vertices)[~hits.hit]).all() and (~hits.hit).any()
    assert np.isnan(near.interpolate(range(len(BALL.faces)))[~near.found]).all() and (~near.found).any()


def test_values_keep_the_shape_of_the_rays() -> None:
    hits = Octree(BALL).closest_hit(ORIGINS.reshape(3, 20, 3), -ORIGINS.reshape(3, 20, 3))
    assert hits.interpolate(np.zeros((len(BALL.vertices), 4, 2))).shape == (3, 20, 4, 2)
    assert Octree(BALL).closest_hit([0, 0, 3], [0, 0, -1]).interpolate(BALL.vertices[:, 2]).shape == ()


def test_what_values_belong_to_is_told_where_numbers_do_not_tell() -> None:
    tetrahedron = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    hits = Octree(tetrahedron).closest_hit([0.25, 0.25, -1], [0, 0, 1])
    values = [1.0, 2.0, 4.0, 8.0]
    assert hits.interpolate(values, on="faces") == 1.0 and hits.interpolate(values, on="vertices") == 2.0
    with pytest.raises(ValueError, match=r"^values: expected on='vertices' or on='faces', as the mesh has 4 of both"):
        hits.interpolate(values)


@cases(
    ("given", "says"),
    [
        ({"values": [1.0, 2.0]}, r"^values: expected 162 rows, one a vertex, or 320, one a face, got shape \(2,\)$"),
        ({"values": 1.0}, r"^values: expected 162 rows, .* got shape \(\)$"),
        ({"values": np.zeros(162), "on": "faces"}, r"^values: expected 320 rows for on='faces', got shape \(162,\)$"),
        ({"values": np.zeros(162), "on": "edges"}, "^on: expected 'vertices', 'faces' or None, got 'edges'$"),
        ({"values": ["a"] * 162}, "^values: expected real numbers"),
    ],
)
def test_other_values_are_errors(given: Any, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        Octree(BALL).closest_hit(ORIGINS, DIRECTIONS).interpolate(**given)


def test_colours_and_texture_coordinates_are_those_at_the_points_and_faces_have_values_of_their_own():
    """A linear map of the vertices is, interpolated, that map of the points."""
    mesh = Mesh(BALL.vertices, BALL.faces, colors=(BALL.vertices + 1) / 2, texcoords=BALL.vertices[:, :2])
    octree, bare = Octree(mesh), Octree(BALL)
    rays = ORIGINS, DIRECTIONS
    for places in (octree.closest_hit(*rays), octree.all_hits(*rays), octree.closest_point(ORIGINS, 2.5)):
        assert (places.face >= 0).sum() > 0
        np.testing.assert_allclose(places.colors, (places.points + 1) / 2, atol=1e-6)  # colours are float32
        np.testing.assert_allclose(places.texcoords, places.points[:, :2], atol=1e-12)
        numbers = np.where(places.face >= 0, places.face, np.nan)
        np.testing.assert_array_equal(places.take(range(len(BALL.faces))), numbers)
    hits = bare.closest_hit(ORIGINS, DIRECTIONS)
    assert np.isnan(hits.colors).all() and np.isnan(hits.texcoords).all() and hits.texcoords.shape == (60, 2)


def test_some_hits_are_those_of_their_rays():
    octree = Octree(BALL)
    hits = octree.closest_hit(ORIGINS, DIRECTIONS, t_error=True)
    some = hits[hits.hit]
    again = octree.closest_hit(ORIGINS[hits.hit], DIRECTIONS[hits.hit], t_error=True)
    for name in ("t", "face", "u", "v", "side", "t_error", "points"):
        np.testing.assert_array_equal(getattr(some, name), getattr(again, name))
    np.testing.assert_array_equal(octree.any_hit(some.points, [0, 0, 1], leaving=some),
                                  octree.any_hit(again.points, [0, 0, 1], leaving=again))  # fmt: skip


@pytest.mark.parametrize("level", [2, 7])
def test_places_of_many_hits_have_the_bits_of_those_of_some(level: int) -> None:
    """Fewer faces than hits and more; all rays hit, and some."""
    octree, rng = Octree(icosphere(level)), np.random.default_rng(1)
    for reach in (0.5, 2.0):
        hits = octree.closest_hit(rng.uniform(-reach, reach, (40_000, 3)), rng.normal(size=(40_000, 3)))
        some = [hits[first : first + 999] for first in range(0, 40_000, 999)]
        assert hits.points.tobytes() == b"".join(part.points.tobytes() for part in some)
        assert hits.normals.tobytes() == b"".join(part.normals.tobytes() for part in some)
