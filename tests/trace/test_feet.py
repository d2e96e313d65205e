"""Starts where faces stand on others: the feet of walls, roofs at facades, seams with more corners, fins and piles."""

from fractions import Fraction

import numpy as np
import pytest
from cases import cases

from renderer import BruteForce, Octree
from renderer.mesh.shapes import box
from renderer.studies import fibonacci_sphere, occlusion, scan, sky_view_factor, sun_hours
from validation.oracle.vectors import cross, difference, dot

BOTH = pytest.mark.parametrize("accelerator", [Octree, BruteForce])
GROUND = np.array([[-10, -10, 0], [30, -10, 0], [-10, 30, 0]], float), np.array([[0, 1, 2]])
WALL = np.array([[0, -2, 0], [0, 2, 0], [0, 2, 4], [0, -2, 4]], float), np.array([[0, 1, 2], [0, 2, 3]])


def solid(lower, upper):
    mesh = box(lower, upper)
    return np.asarray(mesh.vertices, float), mesh.faces


def together(*parts):
    """Vertices and faces of some meshes as one."""
    firsts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return np.concatenate([v for v, _ in parts]), np.concatenate(
        [f + k for (_, f), k in zip(parts, firsts, strict=False)]
    )


@cases("order", [1, -1])
@cases("place", [0.0, 0.1, 500000.5])
def test_at_the_feet_and_corners_of_a_house_the_sky_is_what_it_is_a_little_beside(order, place):
    """A half at a wall, and 3/4 of the directions at a corner, less what is below the point's own horizon."""
    floor = np.array([[0, 0, 0], [8, 0, 0], [8, 8, 0], [0, 8, 0]], float), np.array([[0, 1, 2], [0, 2, 3]])
    vertices, faces = together(*[floor, solid((2, 2, 0), (6, 6, 8))][::order])
    octree, around = Octree(vertices + place, faces), fibonacci_sphere(500).directions
    points = np.array([[2, 3, 0], [6, 3, 0], [3, 2, 0], [3, 6, 0], [2, 2, 0], [6, 2, 0], [6, 6, 0], [2, 6, 0]], float)
    normals = np.array([[-1, 0, 1], [1, 0, 1], [0, -1, 1], [0, 1, 1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
    beside = occlusion(octree, points + 1e-6 * normals + place, normals, around, packed=True)
    for kw in ({}, {"leaving": octree.closest_point(points + place).face}):
        hidden = occlusion(octree, points + place, normals, around, packed=True, **kw)
        np.testing.assert_array_equal(hidden, beside)
    up = sky_view_factor(octree, points + place, definition="geometric", patches=1000)
    np.testing.assert_allclose(up, [0.5] * 4 + [0.75] * 4, atol=0.01)


@pytest.mark.parametrize("order", [1, -1])
def test_where_a_roof_meets_a_facade_the_sky_is_open_on_its_side(order):
    octree = Octree(*together(*[solid((0, 0, 0), (8, 8, 4)), solid((8, 0, 0), (16, 8, 12))][::order]))
    points = [[8, 0, 4], [8, 8, 4], [8, 4, 4], [8, 3, 4]]
    sky = sky_view_factor(octree, points, definition="geometric", patches=1000)
    np.testing.assert_allclose(sky, [0.75, 0.75, 0.5, 0.5], atol=0.01)


@BOTH
def test_the_foot_of_a_wall_sees_what_is_before_it_and_not_through_it(accelerator):
    queries, rng = accelerator(*together(GROUND, WALL)), np.random.default_rng(1)
    feet = np.stack([np.zeros(500), rng.uniform(-2, 2, 500), np.zeros(500)], axis=1)
    for way in ([5.0, 0.0, 5.0], [-5.0, 0.0, 5.0]):
        assert queries.visible(feet, feet + way).all() and queries.visible(feet + way, feet).all()
    if accelerator is Octree:
        assert sun_hours(queries, feet, [1, 0, 0.1], [[-0.05, 0, 1]]).tolist() == [0.0] * 500
        assert sun_hours(queries, feet, [0.3, 0, 1], [[-0.1, 0, 1], [1, 0, 1]]).tolist() == [1.0] * 500
        for normal, rays in (([1, 0, 1], [1]), ([-1, 0, 1], [0])):
            seen = scan(queries, feet[0], [[1, 0, 1], [-1, 0, 1]], normal=normal)
            assert seen.rays.tolist() == rays and seen.distances.tolist() == [0.0]
    # Both sides of the wall, above the ground; out of the one is into the other, through the wall.
    for side, x in ((1, 1.0), (-1, -1.0)):
        toward = queries.closest_hit(feet, [-x, 0.0, 1.0], leaving=1, side=side)
        assert (toward.t == 0.0).all() and np.isin(toward.face, [1, 2]).all()
        assert not queries.any_hit(feet, [x, 0.0, 1.0], leaving=1, side=side).any()


@BOTH
def test_a_partition_keeps_the_rays_of_a_room_in_it(accelerator):
    wall = np.array([[2, 0, 0], [2, 4, 0], [2, 4, 3], [2, 0, 3]], float), np.array([[0, 1, 2], [0, 2, 3]])
    queries = accelerator(*together(wall, solid((0, 0, 0), (4, 4, 3))))
    targets = np.stack([np.full(63, 2.0), np.arange(1, 64) / 16.0, np.zeros(63)], axis=1)
    ways = targets - [1.0, 2.0, 1.5]
    hits = queries.closest_hit(np.broadcast_to([1.0, 2.0, 1.5], ways.shape), ways)
    assert hits.hit.all() and (hits.face == 0).any()
    stopped = queries.closest_hit(hits.points, ways, leaving=hits)
    assert (stopped.t == 0.0).all()
    # The way back is free, whichever of wall and floor was hit; u and v may put a start on the floor beyond the wall.
    back = queries.closest_hit(hits.points, -ways, leaving=hits).t
    assert (back != 0.0).all() and np.mean(back > 0.1) > 0.9


@BOTH
def test_a_ray_goes_through_a_foot_and_on(accelerator):
    """Wall and ground, and a fin that touches a fan in a corner: each face once, then nothing."""
    wall = np.array([[0, -2, 0], [0, 2, 0], [0, 0, 4]], float), np.array([[0, 1, 2]])
    fin = np.array([[0, 0, 0], [0, 1, 1], [0, 1, 2], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)
    fan = [[0, 1, 2], [0, 3, 4], [0, 4, 5], [0, 5, 6], [0, 6, 3]]
    for mesh, origin, way, most in (
        (together(wall, GROUND), [-1, 0.25, 2], [1, 0.25, -2.0], [0, 1]),
        ((fin, fan), [-1, 0, 1], [1, 0, -1.0], [0, 1]),
    ):
        queries, faces = accelerator(*mesh), []
        hits = queries.closest_hit(origin, way)
        while hits.hit and len(faces) < 9:
            faces.append(int(hits.face))
            hits = queries.closest_hit(hits.points, way, leaving=hits.through())
        assert faces == most
    assert queries.closest_hit([0, 0, 0], [1, 0, -1], leaving=0, side=1).face == 1  # it is past the fin


@BOTH
def test_a_seam_with_more_corners_on_one_side_is_closed(accelerator):
    """The side of a box's top that the wall below divides into four."""
    corners = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    points = np.array([*corners, [0.25, 0, 1], [0.5, 0, 1], [0.75, 0, 1]], float)
    top, bottom = [[0, 1, 2], [0, 2, 3]], [[4, 6, 5], [4, 7, 6]]
    front = [[4, 5, 1], [4, 1, 10], [4, 10, 9], [4, 9, 8], [4, 8, 0]]
    rest = [[5, 6, 2], [5, 2, 1], [6, 7, 3], [6, 3, 2], [7, 4, 0], [7, 0, 3]]
    queries = accelerator(points, [*top, *bottom, *front, *rest])
    for x in (0.25, 0.5, 0.75, 0.3):
        assert queries.closest_hit([x, 0, 1], [0.1, 0.3, -1], leaving=0, side=1).t == 0.0
        assert not queries.any_hit([x, 0, 1], [0.1, -0.3, -1], leaving=0, side=1)


@BOTH
def test_bodies_in_one_place_do_not_stop_rays_along_their_faces(accelerator):
    vertices, faces = together(solid((0, 0, 0), (1, 1, 1)), solid((0, 0, 0), (1, 1, 1)))
    queries = accelerator(vertices, faces)
    for face in range(24):
        a, b, c = vertices[faces[face]]
        for one, other, third in ((a, b, c), (b, c, a), (c, a, b)):
            if np.count_nonzero(other - one) == 1:  # an edge of the box
                inward = third - one
                inward = inward - (other - one) * (inward @ (other - one))
                hits = queries.closest_hit((one + other) / 2.0, inward, leaving=face, side=1)
                assert hits.t != 0.0


def test_two_fans_at_one_corner_are_crossed_one_by_one():
    rim = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], float)
    points = np.concatenate([[[0, 0, 0]], *(np.column_stack([size * rim, np.full(4, -1.0)]) for size in (1.0, 0.4))])
    outer = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    octree = Octree(points, np.concatenate([outer, np.where(outer > 0, outer + 4, 0)]))
    ways = [[0.1, 0.05, -1], [0.6, 0.05, -1], [0.1, 0.2, 1], [3, 0.1, -1]]
    bits = occlusion(octree, [[0, 0, 0]], [[0.3, 0.05, 0.01]], ways, packed=True)
    assert np.unpackbits(bits, count=4).tolist() == [1, 1, 0, 0]


@BOTH
def test_the_first_of_all_hits_is_the_closest_hit(accelerator):
    """At an edge of three walls, in a pile that is entered in its midst, and close above the start."""
    fan = np.array([[0, 0, -1], [0, 0, 1], [-1, 1, 0], [0, 1, 0], [1, 0, 0]], float)
    queries = accelerator(fan, [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    options = {"leaving": 2, "side": 1}
    first = queries.closest_hit([0, 0, 0], [-2, 1, 0], **options)
    assert first.face == 1
    assert queries.all_hits([0, 0, 0], [-2, 1, 0], contacts=False, **options).face.tolist() == [1, 0]
    assert queries.all_hits([0, 0, 0], [-2, 1, 0], contacts=False, max_hits=1, **options).face.tolist() == [1]

    low = np.array([[0, 0, 1], [8, 0, 1.3], [0, 8, 1.7]])
    sheets = together(*[(low + np.array([0, 0, h]), np.array([[0, 1, 2]])) for h in (0.0, 2.0**-34, 2.0**-28)])
    queries = accelerator(*sheets)
    start = np.array([0.4, 0.25, 0.35]) @ low
    for size in (0.3, 1.0, 3.0):
        nearest = queries.closest_hit(start, [0, 0, size], leaving=0)
        found = queries.all_hits(start, [0, 0, size], leaving=0, contacts=False)
        np.testing.assert_allclose(nearest.t * size, 2.0**-34, rtol=1e-5)
        assert found.t[0] == nearest.t
        np.testing.assert_allclose(found.t * size, [2.0**-34, 2.0**-28], rtol=1e-5)


@BOTH
def test_beside_a_free_end_nothing_is_left_out_at_the_end_on_the_surface(accelerator):
    sheets = together(*[(GROUND[0] + np.array([0, 0, h]), GROUND[1]) for h in (0.0, 2.0**-37)])
    assert not accelerator(*sheets).visible([0.25, 0.5, 32], [0.25, 0.5, 0], reaching=0)


def test_bounds_of_t_hold_for_rays_that_leave():
    octree, rng = Octree(*solid((0, 0, 0), (1000, 1000, 1))), np.random.default_rng(2)
    points = np.column_stack([rng.uniform(0, 1000, (500, 2)), np.full(500, 3.0)])
    hits = octree.closest_hit(points, [0, 0, -1.0])
    for options in ({"leaving": hits.through()}, {"leaving": hits.face, "side": -1}, {"leaving": hits.face}):
        for query in (octree.closest_hit, octree.all_hits):
            found = query(hits.points, [0, 0, -1.0], t_error=True, **options)
            assert (np.abs(found.t - 1.0) <= found.t_error).all()
            assert found.t_error.max() < 1e-8


def test_ends_that_are_not_on_the_faces_they_name_are_errors():
    octree = Octree.from_mesh(box())
    for name, place in (("leaving", 0), ("reaching", 1)):
        ends = [[0.5, 0.25, 0.5]] * 2
        ends[place] = [0.5, 0.25, 3.0]
        argument = ("points", "targets")[place]
        with pytest.raises(ValueError, match=rf"^{argument}: expected points on the faces that they name.* in row 0$"):
            octree.visible(*ends, **{name: 10})


def test_how_far_off_a_point_may_be_follows_the_largest_coordinate_of_the_mesh():
    octree = Octree([[-1000, -1000, 0], [1000, -1000, 0], [0, 1000, 0]], [[0, 1, 2]])
    assert occlusion(octree, [0, 0, 1e-3], [0, 0, 1], [[0.1, 0.2, 1.0]], leaving=0) == 0.0
    with pytest.raises(ValueError, match=r"^points: .* in row 0$"):
        occlusion(octree, [[0, 0, 1e-2]], [0, 0, 1], [[0.1, 0.2, 1.0]], leaving=0)


@BOTH
def test_origins_a_rounding_beside_a_slanted_face_are_on_the_side_that_is_exact(accelerator):
    """Nothing is named: a ray hits where its exact t is 0 or more."""
    corners, rng = np.array([[0.1, 0.2, 0.35], [1.3, 0.15, 0.9], [0.25, 1.2, -0.4]]), np.random.default_rng(4)
    origins, ways = rng.dirichlet(np.full(3, 5.0), 2000) @ corners, rng.normal(size=(2000, 3))
    exact = [[Fraction(x) for x in corner] for corner in corners.tolist()]
    normal = cross(difference(exact[1], exact[0]), difference(exact[2], exact[0]))
    slopes = np.array([float(dot(normal, [Fraction(x) for x in way])) for way in ways.tolist()])
    heights = [dot(normal, difference(exact[0], [Fraction(x) for x in origin])) for origin in origins.tolist()]
    ahead = np.array(
        [height == 0 or (height > 0) == (slope > 0) for height, slope in zip(heights, slopes, strict=True)]
    )
    steep = np.abs(slopes) > 0.01 * np.linalg.norm(ways, axis=1) * np.linalg.norm([float(x) for x in normal])
    hit = accelerator(corners, [[0, 1, 2]]).closest_hit(origins, ways).hit
    np.testing.assert_array_equal(hit[steep], ahead[steep])
    assert 0.3 < hit.mean() < 0.7
