"""Rays within rounding of a face's plane, and thin faces: what is hit is there, and is found again from its own t."""

import numpy as np
import pytest
from cases import cases

from renderer import BruteForce, Octree
from renderer.studies import occlusion
from validation.oracle import exact
from validation.stability.cases.edge_on import judged, ray_at, thin_face


def only(vertices, origin, direction, **bounds):
    """The one row of hits of a ray at one face."""
    return Octree(np.array(vertices), [[0, 1, 2]]).closest_hit([origin], [direction], **bounds)


@pytest.mark.judges("Octree.closest_hit")
def test_a_ray_in_the_plane_of_a_face_does_not_hit_it_where_it_passes_beside():
    """t = 4.944 was reported, from a determinant that was rounding alone."""
    face = [
        [-1.336494105737508, -0.4547357126598065, -0.2046068815370394],
        [0.7583229005043416, 0.661534041141735, -1.073439823993968],
        [0.615449333954977, 0.3571394776551145, 1.469460588249371],
    ]
    origin = [-2.774958490771537, -1.0997765826218575, -0.9297520657779978]
    assert not only(face, origin, [0.38633234322957544, 0.14654329636785646, 0.48523761039149166]).hit[0]


def test_whether_a_ray_hits_a_thin_face_just_behind_it_depends_on_no_other_face():
    """It comes within rounding of the face, which counts, but only searches that another face made careful found it."""
    own = [["0x1.8p+1", "0x1p+0", "-0x1.8p+1"],
           ["-0x1.312c8f3895947p+10", "-0x1.316c8f3895947p+9", "-0x1.8p+1"],
           ["-0x1.312c8f39605a5p+10", "-0x1.316c8f339444dp+9", "-0x1.7fffff8ce8231p+1"]]  # fmt: skip
    far = ["0x1.306c8f3895947p+9", "0x1.31ec8f3895947p+9", "-0x1.ca62d6d4e05eap+10"]
    line = [["-0x1.8p+1", "0x0p+0", "0x1p+0"], far, far]
    origin = ["-0x1.5357b1c79031bp+9", "-0x1.53d7b1c3c2a8cp+8", "-0x1.7fffffda436fap+1"]
    vertices = np.array([[float.fromhex(x) for x in row] for row in own + line])
    ray = [[float.fromhex(x) for x in origin]], [[1.0, 1.0, -3.0]]
    for faces in ([[0, 1, 2]], [[0, 1, 2], [3, 4, 5]]):
        for mesh in (Octree(vertices, faces), BruteForce(vertices, faces)):
            assert mesh.any_hit(*ray)[0] and mesh.closest_hit(*ray).t[0] == 0.0 and mesh.count_hits(*ray)[0] == 1
            # So many points that their rays are traced together.
            assert (occlusion(mesh, ray[0] * 20, None, ray[1], packed=True) == 0x80).all()


def test_t_of_a_thin_face_met_at_a_small_angle_is_right():
    """t = 30.056 was reported."""
    face = [
        [14.975076627890312, 21.62747835008107, -31.365114582769575],
        [-30.863584497665137, 2.7376385975864586, -19.15339285140863],
        [-36.99726996672972, 0.20998516194670588, -17.51934191730366],
    ]
    origin, direction = [0.0, 0.0, 0.0], [-0.5917912811305898, 0.17423555711026686, -0.5828814312334653]
    true = exact.intersect(face, origin, direction)
    assert true is not None
    assert only(face, origin, direction).t[0] == pytest.approx(float(true), rel=1e-15)


def test_a_closed_mesh_whose_corners_lie_a_few_roundings_apart_does_not_leak():
    """The face [3, 2, 1] was thrown away: the ray meets it at t = 1, which was noise."""
    vertices = [
        [0.3333333333333348, -0.9999999999999984, -0.33333333333333337],
        [-0.9999999999999966, -0.9999999999999966, 1.0],
        [-0.9999999999999962, -0.9999999999999962, 1.0],
        [-0.9999999999999972, -0.9999999999999972, 1.0],
        [0.33333333333333337, 1.0, 0.33333333333333337],
        [-0.9999999999988045, 0.33333333333333326, -0.33333333333333326],
    ]
    faces = [[3, 5, 0], [0, 4, 2], [0, 2, 3], [3, 1, 5], [3, 2, 1], [4, 5, 2], [1, 2, 5], [5, 4, 0]]
    ray = [[-0.0625, 0.046875, 0.0625]], [[-0.9374999999999964, -1.0468749999999964, 0.9375]]
    for accelerator in (Octree(vertices, faces), BruteForce(vertices, faces)):
        assert accelerator.closest_hit(*ray).t[0] == pytest.approx(1.0, abs=1e-14)


@cases("component", [5e-324, -5e-324, 1e-300, 1e-212])
def test_a_direction_that_hardly_leaves_an_axis_lies_along_it(component):
    """Whether the face in the ray's plane was hit depended on the other face, and on the tree."""
    vertices = np.array([[0, 1, 0], [1, 0, 0], [2, 1, 0], [8, 1, 0], [9, 0, 0], [10, 1, 0]]) / 4
    origin, directions = [0.07145, 0.22215, 0.0], [[-1.0, 0.0, component]] * 17
    for faces in ([[0, 1, 2]], [[0, 1, 2], [3, 4, 5]]):
        for accelerator in (Octree(vertices, faces, leaf_size=1), BruteForce(vertices, faces)):
            assert not accelerator.closest_hit(origin, directions).hit.any()
            assert not accelerator.any_hit(origin, directions[:1]).any()


@cases("width", [0.0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6, 1e-3])
def test_a_ray_that_leaves_a_thin_face_starts_there(width):
    """The start had moved by 264 u over the face's relative width, without end. Now it moves by 2^-31 at most."""
    vertices = [[1, -1, -1], [-0.5, 0.5 + width, -1], [-1, 1, -1], [-9, -9, 1], [9, -9, 1], [0, 20, 1]]
    octree = Octree(np.array(vertices, float), [[0, 1, 2], [3, 4, 5]])
    origin, direction = [0.9331372763513686, -0.9331372763513686, -1.0], [-0.8842857581, 0.9200292, 0.9529599011]
    hits = octree.closest_hit(origin, direction, leaving=0)
    assert hits.face == 1
    assert float(hits.t) == pytest.approx(2.0 / direction[2], rel=2.0**-29)


@cases("turn", range(3))
@cases("axes", [(0, 1), (1, 0)])
def test_a_ray_beside_an_edge_by_less_than_its_products_hold_is_on_one_side_of_it(turn, axes):
    """The products of 1e-200 vanish, so the edge function is 0 as rounded; the ray passes it by 1e-400."""
    for far, hit in ((-1.0, True), (1.0, False)):
        corners = np.roll([(1e-200, -1.0), (0.0, 1e-200), (far, 0.5)], turn, axis=0)[:, axes]
        for mirror in (1.0, -1.0):
            for order in ([0, 1, 2], [2, 1, 0]):
                octree = Octree(np.column_stack([corners * [1.0, mirror], np.zeros(3)]), [order])
                for count in (1, 40):
                    rays = [[0.0, 0.0, 1.0]] * count, [[0.0, 0.0, -1.0]] * count
                    assert (octree.closest_hit(*rays).hit == hit).all()


def rays_at_thin_faces(seed, count):
    """``count`` faces far apart, so that each ray meets its own alone; their corners, origins and directions."""
    rng = np.random.default_rng(seed)
    faces = [thin_face(rng) for _ in range(count)]
    rays = [ray_at(rng, corners) for corners in faces]
    return np.array(faces), np.array([o for o, _ in rays]), np.array([d for _, d in rays])


@pytest.mark.parametrize("seed", range(3))
def test_hits_are_met_again_from_their_own_t_by_packets_streams_and_few(seed):
    """t_min was compared with the t before it was settled, so that asking again missed."""
    corners, origins, directions = rays_at_thin_faces(seed, 60)
    octree = Octree(corners.reshape(-1, 3), np.arange(180).reshape(-1, 3))
    brute = BruteForce(corners.reshape(-1, 3), np.arange(180).reshape(-1, 3))
    # Each ray many times in a row is a packet, in turn a stream, and a few are taken singly.
    for order in (np.repeat(np.arange(60), 32), np.tile(np.arange(60), 32), np.arange(5)):
        rays = origins[order], directions[order]
        hits = octree.closest_hit(*rays)
        assert hits.hit.any()
        found = np.flatnonzero(hits.hit)
        ask = origins[order][found], directions[order][found], hits.t[found], hits.t[found]
        for accelerator in (octree, brute):
            again = accelerator.closest_hit(*ask)
            np.testing.assert_array_equal(again.t, hits.t[found])
            np.testing.assert_array_equal(again.face, hits.face[found])


def test_barycentrics_of_thin_faces_name_the_point_that_t_names():
    rng, seen = np.random.default_rng(5), 0
    for _ in range(2000):
        corners = thin_face(rng)
        origin, direction = ray_at(rng, corners)
        hits = only(corners, origin, direction)
        if not hits.hit[0]:
            continue
        u, v = hits.u[0], hits.v[0]
        assert u >= 0.0 and v >= 0.0 and u + v <= 1.0 + 2.0**-52
        point = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0])
        # 10 roundings of 2^-53, which a determinant in no doubt may blow up 2^16 times and more where corners are far.
        reach = np.abs(corners - origin).max()
        assert np.abs(point - (origin + hits.t[0] * direction)).max() <= 2.0**-30 * reach
        seen += 1
    assert seen > 500


def test_the_judge_sees_hits_beside_and_hits_lost():
    face = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    origin, direction = np.array([0.25, 0.25, 1.0]), np.array([0.0, 0.0, -1.0])
    assert judged(face, origin, direction, 1.0) == (False, False)
    assert judged(face, origin, direction, 1.0 + 2.0**-36) == (True, False)
    assert judged(face, origin, direction, np.inf) == (False, True)
    assert judged(face, origin - [1.0, 0.0, 0.0], direction, np.inf) == (False, False)
    assert judged(face, origin, -direction, np.inf) == (False, False)
