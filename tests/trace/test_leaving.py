"""Rays that leave faces: they meet neither that face nor another in its plane, and start where they should."""

from fractions import Fraction

import numpy as np
import pytest
from cases import cases
from hypothesis import given
from hypothesis import strategies as st
from meshes import make_mesh, rays_at

from renderer import BruteForce, Octree
from renderer.mesh.shapes import box, grid, icosphere, torus
from renderer.results.hits import Hits, Passage
from renderer.trace import batch
from renderer.trace.intersect import CORNER
from renderer.trace.starts.record import EDGE, HEAD, ROW, SLACK

pytestmark = pytest.mark.judges("AllHits", "Hits", "Hits.through", "Octree.any_hit", "Octree.closest_hit")


SCALES = (1e-12, 1.0, 1e12)
OFFSETS = (0.0, 1e3, 1e8)


def on_faces(vertices, faces, seed, count=400):
    """Faces, points on them as anyone computes them, and directions to all sides."""
    rng = np.random.default_rng(seed)
    face = rng.integers(0, len(faces), count)
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    # At edges and corners too.
    u[rng.random(count) < 0.1], v[rng.random(count) < 0.1] = 0.0, 0.0
    p0, p1, p2 = vertices[faces[face]].transpose(1, 0, 2)
    points = (1 - u - v)[:, None] * p0 + u[:, None] * p1 + v[:, None] * p2
    return face, points, rng.normal(size=(count, 3)) * 10.0 ** rng.integers(-3, 4, (count, 1))


def crossing_soups(seed):
    """Three small meshes, moved onto each other so that edges of one pass through faces of another."""
    rng = np.random.default_rng(seed)
    vertices, faces = [], []
    for _ in range(3):
        points, corners = make_mesh(rng.choice(["lattice", "flat", "soup"]), int(rng.integers(1 << 20)), 30)
        faces.append(corners + sum(map(len, vertices)))
        vertices.append(points + rng.choice([rng.integers(-3, 4, 3), rng.normal(size=3)]))
    return np.concatenate(vertices), np.concatenate(faces)


# Before starts were tested beside the faces too, a third of these seeds differed.
@cases("seed", range(40))
def test_few_and_many_rays_and_no_tree_agree_where_edges_pass_a_start(seed):
    vertices, faces = crossing_soups(seed)
    octree, brute = Octree(vertices, faces), BruteForce(vertices, faces)
    origins, directions = rays_at(vertices, faces, seed)
    hit = octree.closest_hit(origins, directions).hit
    start = octree.closest_hit(origins[hit], directions[hit])
    towards = np.random.default_rng(seed).normal(size=start.points.shape)
    passage = start.through()
    many = octree.closest_hit(start.points, towards, leaving=passage)
    np.testing.assert_array_equal(many.t, brute.closest_hit(start.points, towards, leaving=passage).t)
    for k in range(0, len(towards), 8):
        some = Passage(*(values[k : k + 8] for values in passage))
        few = octree.closest_hit(start.points[k : k + 8], towards[k : k + 8], leaving=some)
        np.testing.assert_array_equal(many.t[k : k + 8], few.t)


@cases("kind", ["icosphere", "torus", "box", "soup", "sizes"])
@cases("scale", SCALES)
# In float32 nothing is left of a mesh 1e8 away.
@cases(("offset", "single"), [(o, s) for o in OFFSETS for s in (False, True) if not (s and o > 1e7)])
def test_no_ray_meets_the_face_that_it_leaves(kind, scale, offset, single):
    shapes = {"icosphere": lambda: icosphere(3), "torus": torus, "box": box}
    mesh = shapes[kind]() if kind in shapes else None
    vertices, faces = (mesh.vertices, mesh.faces) if mesh else make_mesh(kind, 3, 200)
    vertices = vertices * scale + offset * scale * np.array([1.0, -0.7, 0.3])
    if single:
        vertices = vertices.astype(np.float32).astype(np.float64)
    octree = Octree(vertices, faces)
    face, points, directions = on_faces(vertices, faces, 7)
    if single:
        points = points.astype(np.float32)
    hits = octree.closest_hit(points, directions, leaving=face)
    assert not (hits.face == face).any()
    np.testing.assert_array_equal(octree.any_hit(points, directions, leaving=face), hits.hit)
    # Without it many do: the test would see it.
    assert (octree.closest_hit(points, directions).face == face).any()
    brute = BruteForce(vertices, faces).closest_hit(points, directions, leaving=face)
    np.testing.assert_array_equal(brute.t, hits.t)
    np.testing.assert_array_equal(brute.face, hits.face)


@given(st.integers(0, 2**20))
def test_soups_of_any_kind_keep_the_law(seed):
    kinds = ("soup", "soup_float32", "sizes", "scaled", "far_away")
    vertices, faces = make_mesh(kinds[seed % len(kinds)], seed, 12)
    octree = Octree(vertices, faces)
    face, points, directions = on_faces(vertices, faces, seed, 40)
    assert not (octree.closest_hit(points, directions, leaving=face).face == face).any()


def test_a_flat_wall_of_many_faces_is_left_whole():
    """At the edges of its triangles, too: to leave out the own face by its number would not be enough."""
    wall = grid(7, 5)
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    wall_in_space = wall.vertices @ turn.T + np.array([5.0, -3.0, 2.0])
    octree = Octree(wall_in_space, wall.faces)
    face, points, directions = on_faces(wall_in_space, wall.faces, 2, 4000)
    plain = octree.closest_hit(points, directions)
    assert (plain.hit & (plain.face != face)).any()
    # The vertices are rounded, so the wall is flat to rounding only: grazing rays may meet what stands out.
    normal = np.cross(*(wall_in_space[wall.faces[0]][1:] - wall_in_space[wall.faces[0]][0]))
    slope = np.abs(directions @ normal) / np.linalg.norm(directions, axis=1) / np.linalg.norm(normal)
    steep = slope > 1e-6
    assert steep.mean() > 0.99
    assert not octree.any_hit(points[steep], directions[steep], leaving=face[steep]).any()


def plane_distance(vertices, face, point):
    """Exact sign and square of the distance of a point from a face's plane, with the plane's squared normal."""
    p0, p1, p2, p = ([Fraction(float(x)) for x in vertex] for vertex in (*vertices[face], point))
    a, b = [y - x for x, y in zip(p0, p1, strict=True)], [y - x for x, y in zip(p0, p2, strict=True)]
    n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    return sum(k * (y - x) for k, x, y in zip(n, p0, p, strict=True)), sum(k * k for k in n)


def test_starts_are_beyond_the_plane_by_no_more_than_roundings_and_above_the_nearest_point_of_it():
    from renderer.trace.batch import Leaving, check_rays, offset_origins

    ball = icosphere(2)
    for offset in OFFSETS:
        vertices = ball.vertices + offset
        octree = Octree(vertices, ball.faces)
        face, points, directions = on_faces(vertices, ball.faces, 5, 300)
        # Some lie off the plane, on either side, by more than rounding.
        points[::3] += 1e-6 * ball.face_normals()[face[::3]] * np.random.default_rng(0).choice([-1, 1], (100, 1))
        no_side = Leaving(face, np.zeros(1, np.int64), np.empty((0, 3)))
        rays = offset_origins(check_rays(points, directions, 0.0, np.inf)[0], no_side, octree.mesh, 1.0, 1)
        normals = ball.face_normals()[face]
        slack = rays.starts[HEAD:].view(np.float64).reshape(-1, ROW)[:, SLACK]
        edge = slack == EDGE
        assert 0.1 < edge.mean() < (0.3 if offset == 0.0 else 1.0)
        for k in range(len(face)):
            if edge[k]:
                # Exact signs decide there, from the point itself.
                np.testing.assert_array_equal(rays.origins[k], points[k])
                continue
            if slack[k] == CORNER:
                assert (rays.origins[k] == vertices[ball.faces[face[k]]]).all(axis=1).any()
                continue
            side = 1 if directions[k] @ normals[k] >= 0 else -1
            before, square = plane_distance(vertices, ball.faces[face[k]], points[k])
            after, _ = plane_distance(vertices, ball.faces[face[k]], rays.origins[k])
            assert side * after > 0
            assert side * float(after) / float(square) ** 0.5 <= 2e-13 * (1.0 + offset)
            # From either side along the normal.
            moved = np.linalg.norm(rays.origins[k] - points[k])
            assert moved <= abs(float(before)) / float(square) ** 0.5 + 2e-13 * (1.0 + offset)


def test_minus_one_leaves_no_face_and_one_number_stands_for_all():
    octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    origins, directions = np.array([[0.2, 0.2, 0.0], [0.3, 0.3, 0.0]]), np.array([[0, 0, 1.0], [0, 0, -1.0]])
    assert octree.any_hit(origins, directions, leaving=-1).tolist() == [True, True]
    assert octree.any_hit(origins, directions, leaving=[0, -1]).tolist() == [False, True]
    assert octree.any_hit(origins, directions, leaving=0).tolist() == [False, False]
    assert not octree.any_hit(np.broadcast_to(origins[0], (20, 3)), np.tile(directions[0], (20, 1)), leaving=0).any()
    assert octree.any_hit(np.empty((0, 3)), np.empty((0, 3)), leaving=np.empty(0, int)).shape == (0,)


@cases(
    ("bad", "told"),
    [
        ([0.0, 1.0], r"an integer or integers of shape \(2,\), got float64 of shape \(2,\)"),
        ([0] * 3, r"a number or a shape that goes with that of the rays, \(2,\), got shape \(3,\)"),
        ([0, 1], r"faces from 0 to 0, or -1, got 1 in row 1"),
        (-2, r"faces from 0 to 0, or -1, got -2 in row 0"),
        (True, r"real numbers, got dtype bool"),
        ("x", r"real numbers, got dtype <U1"),
    ],
)
def test_faces_that_are_not_there_are_errors(bad, told):
    octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(ValueError, match=f"^leaving: expected {told}$"):
        octree.any_hit([[0, 0, 0], [1, 1, 1]], [[0, 0, 1], [0, 0, 1]], leaving=bad)


@pytest.mark.parametrize("origin", [[1e30, 0.0, 1e300], [np.inf, 0.0, 0.0], [0.0, np.nan, 0.0]])
def test_an_origin_out_of_bounds_is_told_as_it_was_given(origin):
    octree = Octree.from_mesh(icosphere(1))
    with pytest.raises(ValueError, match=r"origins: .*row 1") as told:
        octree.any_hit([[0.0, 0.0, 3.0], origin], [[0.0, 0.0, 1.0]] * 2, leaving=0)
    assert str(origin) in str(told.value)


@cases("exponent", [-1000, -830, -600, -512, 512, 700, 1000])
def test_meshes_of_extreme_size_are_left_too(exponent):
    """The cross product of the sides vanished, or was infinite: NaN for a start, or the face itself at t = 0."""
    rng = np.random.default_rng(1)
    corners = rng.normal(size=(3, 3)) * 2.0**exponent
    octree = Octree(corners, [[0, 1, 2]])
    starts = rng.dirichlet([1.0] * 3, 2000) @ corners
    assert not octree.any_hit(starts, rng.normal(size=(2000, 3)), leaving=0).any()


def test_a_direction_that_is_no_number_is_blamed_not_the_origin():
    octree = Octree.from_mesh(icosphere(1))
    with pytest.raises(ValueError, match=r"directions: .*nan.* in row 1"):
        octree.any_hit(np.zeros((2, 3)), [[0.0, 0.0, 1.0], [np.nan, 0.0, 1.0]], leaving=[0, 1])


@cases("accelerator", [Octree, BruteForce])
@cases("toward", [0, 1])
def test_a_ray_along_a_face_on_a_line_leaves_it(accelerator, toward):
    """Of a direction along the side no normal looked back, so the start was not moved."""
    corners = np.array(
        [
            [0.47691293898668974, 0.8120147782475116, 0.7482027731609157],
            [-1.2846917166076126, 2.302273590569028, 1.157085049802302],
            [-0.07884622248081871, 1.2821685016014936, 0.8771988396072095],
        ]
    )
    direction = np.array([0.7144270209313762, -0.6043814429772874, -0.1658241228444045]) * (1 - 2 * toward)
    queries = accelerator(corners, [[0, 1, 2]])
    assert not queries.any_hit(corners[2], [direction], leaving=0).any()
    # Other directions so near to the side that their roundings are all that points across it.
    near = direction * (1.0 + 2.0**-52 * np.random.default_rng(0).integers(-2, 3, (500, 3)))
    assert not queries.any_hit(corners[2], near, leaving=0).any()


def test_no_kernel_is_compiled_for_other_arrays(monkeypatch):
    """Directions had come as an array that cannot be written, for which Numba compiles the kernel again."""
    seen = []
    kernel = batch.offset_from_faces

    def noted(*arguments):
        _, _, origins, directions, leaving, starts, rows, *_ = arguments
        seen.append([array.flags.writeable for array in (origins, directions, *leaving, starts, rows)])
        return kernel(*arguments)

    monkeypatch.setattr(batch, "offset_from_faces", noted)
    octree, directions = Octree.from_mesh(icosphere(1)), np.eye(3)
    starts = octree.mesh.triangles[:3].mean(axis=1)
    for ways in (directions, directions[0], np.broadcast_to(directions[0], (3, 3))):
        octree.any_hit(starts, ways, leaving=[0, 1, 2])
    corner = octree.mesh.triangles[0, 0]
    octree.any_hit(np.broadcast_to(corner, (3, 3)), directions, leaving=0, side=1)
    hits = octree.closest_hit(3.0 * starts, -starts)
    for left in (hits, hits.through()):
        octree.any_hit(hits.points, -starts, leaving=left)
    assert len(seen) == 6 and all(all(row) for row in seen)


UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)


@cases("accelerator", [Octree, BruteForce])
@cases(
    ("side", "direction", "met"),
    [(1, UP, []), (1, DOWN, [0.0, 1.0]), (-1, DOWN, [1.0]), (-1, UP, [0.0]), (0, UP, []), (None, DOWN, [1.0])],
)
def test_a_ray_that_leads_through_the_surface_to_another_side_is_stopped_at_once(accelerator, side, direction, met):
    queries, point = accelerator.from_mesh(box()), [0.25, 0.5, 1.0]
    top = queries.closest_hit([0.25, 0.5, 3.0], DOWN).face
    every = queries.all_hits(point, direction, leaving=int(top), side=side)
    # Another face is as far as from where the start was moved to.
    np.testing.assert_allclose(every.t, met, rtol=1e-13, atol=0.0)
    hits = queries.closest_hit(point, direction, leaving=int(top), side=side)
    assert hits.t == (every.t[0] if met else np.inf)
    if met[:1] == [0.0]:
        assert hits.face == every.face[0] == top and hits.side == side


@cases("accelerator", [Octree, BruteForce])
def test_an_open_edge_stops_no_ray_and_sheets_in_one_plane_stop_it_at_the_lowest(accelerator):
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 2, 0], [-2, 2, 0], [0, -4, 0]]
    inside, edge, corner = [0.25, 0.25, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]
    sheet, pile = accelerator(corners, [[0, 1, 2]]), accelerator(corners, [[3, 4, 5], [0, 1, 2], [0, 2, 1]])
    for slope in ([0.0, 0.0], [0.1, 0.2]):
        down, up = [*slope, -1.0], [*slope, 1.0]
        assert sheet.any_hit([inside, edge, corner], down, leaving=0, side=1).tolist() == [True, False, False]
        assert not sheet.any_hit([inside, edge, corner], up, leaving=0, side=1).any()
        for face, above in ((0, 1), (1, 1), (2, -1)):
            stopped = pile.closest_hit(inside, down, leaving=face, side=above)
            assert (stopped.t, stopped.face) == (0.0, 0)
            assert not pile.any_hit(inside, up, leaving=face, side=above)
        # On the edge of a sheet the one below it still stops the ray.
        assert pile.closest_hit(edge, down, leaving=1, side=1).face == 0


@cases("accelerator", [Octree, BruteForce])
def test_where_a_wall_crosses_a_floor_it_stops_what_leads_through_it_alone(accelerator):
    """Beside the wall the ray is above the floor or below it; what leads through both stops at the lower face."""
    floor, wall = [[-4, -4, 0], [4, -4, 0], [0, 6, 0]], [[0, -4, -4], [0, 4, -4], [0, 0, 6]]
    queries = accelerator([*floor, *wall], [[0, 1, 2], [3, 4, 5]])
    stopped = queries.closest_hit([0, 0, 0], [[-0.3, 0.1, -1], [-0.3, 0.1, 1]], leaving=1, side=1)
    assert (stopped.t == 0).all() and sorted(stopped.face) == [0, 1]


def test_rays_go_on_from_hits_on_the_side_that_they_came_from_and_through_them_on_the_other():
    ball = icosphere(3)
    octree, rng = Octree.from_mesh(ball), np.random.default_rng(3)
    origins, targets = 3.0 * rng.normal(size=(500, 3)), 0.5 * rng.random((500, 3))
    origins[np.linalg.norm(origins, axis=1) < 1.5] = [3.0, 0.0, 0.0]
    directions = targets - origins
    hits, all_of_them = octree.closest_hit(origins, directions), octree.all_hits(origins, directions, contacts=False)
    assert hits.hit.all() and (all_of_them.counts == 2).all()
    # The direction leads through the face, but the ray is on this side of it.
    stopped = octree.closest_hit(hits.points, directions, leaving=hits)
    np.testing.assert_array_equal(stopped.t, 0.0)
    np.testing.assert_array_equal(stopped.face, hits.face)
    away = octree.closest_hit(hits.points, -directions, leaving=hits)
    assert not away.hit.any() and (away.through().pile == -1).all()
    assert not octree.any_hit(hits.points, -directions, leaving=hits).any()
    beyond = octree.closest_hit(hits.points, directions, leaving=hits.through())
    np.testing.assert_array_equal(beyond.face, all_of_them.face[1::2])
    np.testing.assert_array_equal(beyond.side, -1)
    np.testing.assert_allclose(beyond.t + hits.t, all_of_them.t[1::2], rtol=1e-12)
    np.testing.assert_array_equal(octree.closest_hit(hits.points, -directions, leaving=hits.through()).t, 0.0)
    assert not octree.any_hit(beyond.points, directions, leaving=beyond.through()).any()
    # Hits that know no side are places on faces alone.
    plain = Hits(hits.t, hits.face, hits.u, hits.v, ball)
    np.testing.assert_array_equal(octree.closest_hit(hits.points, directions, leaving=plain).face, beyond.face)
    assert plain.side is None and plain.through().side is None
    # A miss leaves none.
    missed = octree.closest_hit(origins, -directions)
    assert not missed.hit.any()
    np.testing.assert_array_equal(octree.closest_hit(origins, directions, leaving=missed).t, hits.t)


@cases("accelerator", [Octree, BruteForce])
@cases("scale", SCALES)
def test_at_corners_and_edges_of_a_box_its_faces_stop_what_leads_through_them_and_nothing_else(accelerator, scale):
    """The box is the octant of each corner, and a quarter of space at an edge."""
    solid = box()
    queries, rng = accelerator(solid.vertices * scale, solid.faces), np.random.default_rng(8)
    for along in range(3):  # the corners, and the middles of sides along y and z
        points = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
        if along:
            points[:, along] = 0.5
        for point in np.unique(points, axis=0):
            held = [number for number, corners in enumerate(solid.triangles) if _holds(corners, point)]
            directions = rng.normal(size=(60, 3))
            outer = np.where(point == 0.5, 0.0, 2.0 * point - 1.0)
            inward = (np.where(outer == 0.0, -1.0, directions * outer) < 0.0).all(axis=1)
            starts = np.tile(point * scale, (60, 1))
            for face in held:
                free = queries.closest_hit(starts, directions, leaving=face)
                assert (free.hit == inward).all() and (free.t[inward] > 0.0).all()
                outside = queries.closest_hit(starts, directions, leaving=face, side=1)
                assert (outside.t[inward] == 0.0).all() and not outside.hit[~inward].any()
                inside = queries.closest_hit(starts, directions, leaving=face, side=-1)
                assert (inside.t[~inward] == 0.0).all()
                np.testing.assert_array_equal(inside.t[inward], free.t[inward])
                assert np.isin(np.concatenate([outside.face[inward], inside.face[~inward]]), held).all()


def _holds(corners, point):
    """Whether a right-angled face of a box, parallel to an axis, holds a point."""
    p0, p1, p2 = corners
    n = np.cross(p1 - p0, p2 - p0)
    if (point - p0) @ n != 0.0:
        return False
    return all(np.cross(b - a, point - a) @ n >= 0.0 for a, b in ((p0, p1), (p1, p2), (p2, p0)))


@pytest.mark.parametrize("accelerator", [Octree, BruteForce])
def test_an_origin_exactly_on_faces_hits_the_lowest_of_those_that_its_direction_crosses_at_once(accelerator):
    """Nothing is named: then t is 0, and not a rounding beside it, in all directions that are not in their planes."""
    ball = icosphere(2)
    queries, rng = accelerator.from_mesh(ball), np.random.default_rng(2)
    for corner in rng.integers(0, len(ball.vertices), 12):
        directions = rng.normal(size=(50, 3)) * 10.0 ** rng.integers(-9, 9, (50, 1))
        hits = queries.closest_hit(np.tile(ball.vertices[corner], (50, 1)), directions)
        np.testing.assert_array_equal(hits.t, 0.0)
        np.testing.assert_array_equal(hits.face, np.flatnonzero((ball.faces == corner).any(axis=1)).min())
    flat = accelerator([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0, 1, 2]])
    for exponent in (0, -20, -52, -300):
        slopes = [[1.0, 1.0, 2.0**exponent], [1.0, 1.0, -(2.0**exponent)]]
        assert flat.closest_hit([[0.25, 0.25, 0.0]] * 2, slopes).t.tolist() == [0.0, 0.0]
    assert not flat.any_hit([0.25, 0.25, 0.0], [1.0, 1.0, 0.0])


@cases(
    ("given", "told"),
    [
        ({"side": 1}, "side: expected None without leaving, got 1"),
        ({"leaving": 0, "side": 2}, "side: expected 1, -1 or 0, got 2 in row 0"),
        ({"leaving": [0, 1], "side": [1, -3]}, "side: expected 1, -1 or 0, got -3 in row 1"),
        (
            {"leaving": 0, "side": 0.5},
            r"side: expected an integer or integers of shape \(2,\), got float64 of shape \(\)",
        ),
        (
            {"leaving": 0, "side": [1] * 3},
            r"side: expected a number or a shape that goes with that of the rays, \(2,\), got shape \(3,\)",
        ),
        ({"leaving": 0, "side": "x"}, "side: expected real numbers, got dtype <U1"),
    ],
)
def test_sides_that_are_not_there_are_errors(given, told):
    octree = Octree.from_mesh(box())
    with pytest.raises(ValueError, match=f"^{told}$"):
        octree.any_hit([[0.5, 0.25, 0.0]] * 2, [[0.0, 0.0, 1.0]] * 2, **given)


def test_hits_of_other_rays_and_sides_beside_hits_are_errors():
    octree = Octree.from_mesh(box())
    rays = [[0.5, 0.25, 3.0]] * 2, [[0.0, 0.0, -1.0]] * 2
    hits = octree.closest_hit(*rays)
    with pytest.raises(ValueError, match=r"^leaving: expected a number or a shape that goes with that of the rays"):
        octree.any_hit([hits.points[0]] * 3, [[0.0, 0.0, 1.0]] * 3, leaving=hits)
    with pytest.raises(ValueError, match=r"^side: expected None, as the hits say it, got 1$"):
        octree.any_hit(hits.points, rays[1], leaving=hits, side=1)
    off = hits.points + np.array([[0.0, 0.0, 0.0], [1e-4, 0.0, 0.0]])
    for left in (hits, hits.through()):
        with pytest.raises(ValueError, match=r"^origins: expected a point of face .* in row 1$"):
            octree.any_hit(off, rays[1], leaving=left)


@cases("largest", [1.0, 1e-9, 1e6])
@cases("direction", [0, 1])
def test_a_point_that_is_far_from_the_face_that_it_names_is_an_error(largest, direction):
    """Farther than 2^-18 of the largest coordinate, off the plane or beside the face; nearer ones are rounded."""
    octree = Octree(np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]]) * largest, [[0, 1, 2]])
    off = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])[direction] * largest
    foot = np.array([[-0.5, -0.5, 0.0], [-1.0, 0.0, 0.0]])[direction] * largest
    ways = [[0.3, 0.2, 1.0]] * 2
    assert not octree.any_hit([foot, foot + 0.9 * 2.0**-18 * off], ways, leaving=0).any()
    with pytest.raises(
        ValueError, match=r"^origins: expected a point of face 0 that it leaves, within 4e-06 of .* in row 1$"
    ):
        octree.any_hit([foot, foot + 1.1 * 2.0**-18 * off], ways, leaving=0)
