"""Leading dimensions of rays: kept, broadcast, and not copied where one vector serves all."""

from dataclasses import fields

import numpy as np
import pytest
from cases import cases

from renderer import BruteForce, Hits, Mesh, Octree
from renderer.mesh.shapes import box, icosphere
from renderer.trace.batch import check_rays

BALL = icosphere(2)
QUERIES = [Octree.from_mesh(BALL), BruteForce.from_mesh(BALL)]
RNG = np.random.default_rng(6)
ORIGINS, DIRECTIONS = 2 * RNG.normal(size=(24, 3)), RNG.normal(size=(24, 3))


# A box that stands twice at one place, the second time turned inside out.
TWICE = Mesh.concatenate([box(), Mesh(box().vertices, box().faces[:, ::-1])])


@cases("queries", [Octree.from_mesh(TWICE), BruteForce.from_mesh(TWICE)])
@cases("shape", [(4, 6), (1, 2, 12)])
def test_rays_of_any_dimensions_go_on_through_coinciding_faces(queries, shape):
    """Through two faces at each wall, and out."""
    directions = np.array([0.5, 0.25, 0.5]) - ORIGINS
    flat = queries.closest_hit(ORIGINS, directions)
    hits = queries.closest_hit(ORIGINS.reshape(*shape, 3), directions.reshape(*shape, 3))
    for _ in range(4):
        assert flat.hit.any()
        np.testing.assert_array_equal(hits.face.ravel(), flat.face)
        np.testing.assert_array_equal(hits.t.ravel(), flat.t)
        starts, there = np.nan_to_num(flat.points), np.nan_to_num(hits.points)
        flat = queries.closest_hit(starts, directions, leaving=flat.through())
        hits = queries.closest_hit(there, directions.reshape(*shape, 3), leaving=hits.through())
    assert not hits.hit.any() and not flat.hit.any()


@pytest.mark.judges("Hits.shaped")
def test_hits_of_other_dimensions_have_all_that_hits_have():
    """Each field, its own too, at coinciding faces: there a ray has come upon another face than it hit."""
    octree, down = Octree.from_mesh(TWICE), [0.0, 0.0, -1.0]
    first = octree.closest_hit([[0.5, 0.25, 3.0]] * 4, down)
    hits = octree.closest_hit(first.points, down, leaving=first.through(), t_error=True)
    for field in fields(Hits):
        value, moved = getattr(hits, field.name), getattr(hits.shaped((2, 2)), field.name)
        if field.name == "_mesh":
            assert moved is value
        else:
            np.testing.assert_array_equal(moved, value.reshape(2, 2), strict=True)
    assert (hits.through().pile != hits.face).all()


@pytest.mark.judges("Octree.any_hit", "Octree.closest_hit")
@pytest.mark.parametrize("queries", QUERIES, ids=["octree", "brute"])
def test_origins_and_directions_are_broadcast(queries):
    grid = queries.closest_hit(ORIGINS[:5, None], DIRECTIONS[None, :7])
    assert grid.t.shape == (5, 7)
    for i in range(5):
        # One origin for many directions, and one direction for many origins.
        np.testing.assert_array_equal(queries.closest_hit(ORIGINS[i], DIRECTIONS[:7]).t, grid.t[i])
    for k in range(7):
        np.testing.assert_array_equal(queries.closest_hit(ORIGINS[:5], DIRECTIONS[k]).t, grid.t[:, k])
        np.testing.assert_array_equal(queries.any_hit(ORIGINS[:5], DIRECTIONS[k]), grid.hit[:, k])
        np.testing.assert_array_equal(
            queries.count_hits(ORIGINS[:5], DIRECTIONS[k])[:, None] > 0, grid.hit[:, k : k + 1]
        )
    assert queries.closest_hit(np.empty((0, 4, 3)), DIRECTIONS[0]).t.shape == (0, 4)
    both = np.broadcast_to(ORIGINS[0], (40, 3)), np.broadcast_to(DIRECTIONS[0], (40, 3))
    np.testing.assert_array_equal(
        queries.closest_hit(*both).t, np.full(40, queries.closest_hit(ORIGINS[0], DIRECTIONS[0]).t)
    )


RAYS = {"origins": ORIGINS[:6].reshape(2, 3, 3), "directions": -ORIGINS[:3]}
# The same, one argument after the other with dimensions of its own.
BROADCAST = {
    "t_max of a row": {"t_max": [[0.9], [np.inf]]},
    "t_min of a column, t_max of more": {"t_min": [0.0, 0.25, 3.0], "t_max": np.linspace(0.2, 3.0, 8).reshape(4, 2, 1)},
    "one": {"t_min": [0.25], "t_max": [[[2.0]]]},
}


@pytest.mark.judges("Octree.closest_hit", "Octree.any_hit", "Octree.all_hits", "Octree.count_hits")
@cases("bounds", BROADCAST)
@cases("queries", QUERIES)
def test_bounds_are_broadcast_with_the_rays(queries, bounds):
    given = BROADCAST[bounds]
    shape = np.broadcast_shapes((2, 3), *(np.shape(bound) for bound in given.values()))
    whole = {name: np.broadcast_to(rays, (*shape, 3)).reshape(-1, 3).copy() for name, rays in RAYS.items()}
    whole |= {name: np.broadcast_to(bound, shape).reshape(-1).copy() for name, bound in given.items()}
    hits, flat = queries.closest_hit(**RAYS, **given), queries.closest_hit(**whole)
    assert hits.t.shape == shape and 0 < flat.hit.sum() < flat.hit.size
    for name in ("t", "face", "u", "v", "side"):
        np.testing.assert_array_equal(getattr(hits, name).reshape(-1), getattr(flat, name))
    np.testing.assert_array_equal(queries.any_hit(**RAYS, **given), hits.hit, strict=True)
    np.testing.assert_array_equal(queries.count_hits(**RAYS, **given).reshape(-1), queries.count_hits(**whole))
    np.testing.assert_array_equal(queries.all_hits(**RAYS, **given).t, queries.all_hits(**whole).t)


@cases("queries", QUERIES)
def test_one_ray_and_many_bounds_are_many_rays(queries):
    hits = queries.closest_hit([0, 0, 3], [0, 0, -1], t_max=[1.0, 2.5, np.inf])
    assert hits.hit.tolist() == [False, True, True]
    assert queries.closest_hit([0, 0, 3], [0, 0, -1], t_max=np.empty(0)).t.shape == (0,)


@cases("queries", QUERIES)
def test_starts_are_broadcast_with_the_rays(queries):
    """Many directions from each of some hits, and from faces and sides by number."""
    hits = queries.closest_hit(ORIGINS[:5], -ORIGINS[:5])
    starts, repeated = hits.points[:, None], np.repeat(hits.points, 7, axis=0)
    ways = np.tile(DIRECTIONS[:7], (5, 1))
    face, side = np.repeat(hits.face, 7), np.repeat(hits.side, 7)
    flat = queries.closest_hit(repeated, ways, leaving=face, side=side)
    assert 0 < flat.hit.sum() < flat.hit.size
    by_face = queries.closest_hit(starts, DIRECTIONS[:7], leaving=hits.face[:, None], side=hits.side[:, None])
    np.testing.assert_array_equal(by_face.t, flat.t.reshape(5, 7))
    np.testing.assert_array_equal(
        queries.closest_hit(starts[0, 0], DIRECTIONS[:7], leaving=hits.face[:1]).t.shape, (7,)
    )
    for left in (lambda hits: hits, Hits.through):
        column = left(hits.shaped((5, 1)))
        expected = [
            queries.closest_hit(hits.points[k], way, leaving=left(queries.closest_hit(ORIGINS[k], -ORIGINS[k]))).t
            for k in range(5)
            for way in DIRECTIONS[:7]
        ]
        np.testing.assert_array_equal(
            queries.closest_hit(starts, DIRECTIONS[:7], leaving=column).t.reshape(-1), expected
        )


@pytest.mark.judges("Octree.closest_point", "Octree.signed_distance", "Octree.visible")
@cases("queries", QUERIES)
def test_distances_and_ends_are_broadcast_with_the_points(queries):
    limits = np.array([[0.25], [1.0], [np.inf]])
    near, distance = queries.closest_point(ORIGINS, limits), queries.signed_distance(ORIGINS, limits)
    for k, limit in enumerate(limits[:, 0]):
        np.testing.assert_array_equal(near.face[k], queries.closest_point(ORIGINS, limit).face, strict=True)
        np.testing.assert_array_equal(distance[k], queries.signed_distance(ORIGINS, limit), strict=True)
    assert queries.closest_point(ORIGINS[0], limits[:, 0]).found.shape == (3,)
    hits = queries.closest_hit(ORIGINS[:5], -ORIGINS[:5])
    seen = queries.visible(hits.points[:, None], ORIGINS[:7], leaving=hits.face[:, None])
    for k in range(5):
        alone = queries.visible(hits.points[k], ORIGINS[:7], leaving=int(hits.face[k]))
        np.testing.assert_array_equal(seen[k], alone, strict=True)
    faces = np.array([hits.face[0], -1])
    assert queries.visible(hits.points[0], ORIGINS[0], leaving=faces).shape == (2,)


def test_what_serves_all_is_not_copied():
    eye, one = np.array([0.0, 0.0, 3.0]), np.array([0.0, 0.0, -1.0])
    many = RNG.normal(size=(4, 6, 3))
    for origins, directions, place, shape in (
        (eye, many, 0, (4, 6)),
        (many, one, 1, (4, 6)),
        (np.broadcast_to(eye, (4, 6, 3)), many, 0, (4, 6)),
        (many, np.broadcast_to(one, (4, 6, 3)), 1, (4, 6)),
    ):
        rays, kept = check_rays(origins, directions, 0.0, np.inf)
        assert kept == shape and len(rays[place]) == 1 and rays.number == 24
        assert np.shares_memory(rays[1 - place], many)


class _OnlyDLPack:
    """An array of another library that knows the exchange of memory alone."""

    def __init__(self, array):
        self._array = array

    def __dlpack__(self, **options):
        return self._array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self._array.__dlpack_device__()


def test_arrays_of_others_are_taken_without_a_copy():
    rays, _ = check_rays(_OnlyDLPack(ORIGINS), _OnlyDLPack(DIRECTIONS), 0.0, np.inf)
    assert np.shares_memory(rays.origins, ORIGINS) and np.shares_memory(rays.directions, DIRECTIONS)
    hits = QUERIES[0].closest_hit(_OnlyDLPack(ORIGINS), _OnlyDLPack(DIRECTIONS))
    np.testing.assert_array_equal(hits.t, QUERIES[0].closest_hit(ORIGINS, DIRECTIONS).t)
    assert QUERIES[0].contains(_OnlyDLPack(ORIGINS)).tolist() == QUERIES[0].contains(ORIGINS).tolist()


class _Elsewhere:
    """A tensor on a graphics card, which says so when it is asked for its memory."""

    def __array__(self, *_, **__):
        raise TypeError("can't convert cuda:0 device type tensor to numpy")


def test_memory_out_of_reach_is_named():
    with pytest.raises(ValueError, match="origins: expected an array, got can't convert cuda:0"):
        QUERIES[0].closest_hit(_Elsewhere(), DIRECTIONS)
