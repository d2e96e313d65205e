"""Hit comparison: each fault put into our hits or the reference's must be found, and nothing else."""

import numpy as np
import pytest
import trimesh
from cases import cases

from validation.hits import rays
from validation.hits.compare import HitArrays, compare, exact_errors, judge
from validation.hits.errors import EXPONENTS, error_sizes, truth
from validation.hits.verdicts import (
    BOTH_RIGHT,
    BOTH_WRONG,
    NEAR_EDGE,
    OURS_RIGHT,
    SETTLED,
    THEIRS_RIGHT,
)
from validation.oracle import exact
from validation.oracle.rounding import FLOAT64_ROUNDOFF
from validation.references.embree import Embree

BALL = trimesh.creation.icosphere(2)
VERTICES = rays.float32_exact(BALL.vertices)
FACES = BALL.faces.astype(np.int64)
RAYS = rays.random_rays(VERTICES[FACES], 400, np.random.default_rng(11))
EXACT = exact.closest_hits(VERTICES, FACES, RAYS.origins, RAYS.directions)
THEIRS = HitArrays(*Embree(VERTICES, FACES).closest_hit(RAYS.origins, RAYS.directions))
OURS = HitArrays(
    np.array([np.inf if hit is None else float(hit.t) for hit in EXACT]),
    np.array([-1 if hit is None else hit.face for hit in EXACT]),
)
# A ray that meets its face steeply and far away, so that every shift below is a shift beyond all rounding.
NORMALS = BALL.face_normals[OURS.face]
STEEP = np.abs((NORMALS * RAYS.directions).sum(axis=1)) > 0.7 * np.linalg.norm(RAYS.directions, axis=1)
HIT = int(np.flatnonzero(OURS.hit & STEEP & (OURS.t > 0.1))[0])
MISS = int(np.flatnonzero(~OURS.hit)[0])


def changed(hits, row, t=None, face=None):
    new_t, new_face = hits.t.copy(), hits.face.copy()
    new_t[row] = hits.t[row] if t is None else t
    new_face[row] = hits.face[row] if face is None else face
    return HitArrays(new_t, new_face)


def judged(ours=OURS, theirs=THEIRS, batch=RAYS):
    return judge(compare(ours, theirs, VERTICES, FACES, batch), VERTICES, FACES)


def the_one(comparison, ray):
    found = [d for d in comparison.disagreements if d.ray == ray]
    assert len(found) == 1
    return found[0]


def test_right_hits_are_right():
    comparison = judged()
    assert comparison.ours_wrong == 0 and comparison.verdicts[NEAR_EDGE] == 0
    assert comparison.both_hit + comparison.both_miss + comparison.only_ours + comparison.only_theirs == len(RAYS)
    assert comparison.both_hit == 353 and comparison.both_miss == 47
    assert 1e-8 < comparison.t_error_p50 < 1e-7
    errors = exact_errors(OURS, EXACT, VERTICES, FACES, RAYS)
    assert errors.wrong == errors.near_edge == 0 and errors.disagreements == ()
    assert errors.hits == np.count_nonzero(OURS.hit)
    assert 0 < errors.ulp_max <= 0.5


@pytest.mark.parametrize("shift", [1e-6, -1e-6, 1e-3])
def test_our_shifted_t_is_found(shift):
    ours = changed(OURS, HIT, t=OURS.t[HIT] * (1 + shift))
    comparison = judged(ours)
    found = the_one(comparison, HIT)
    assert found.kind == "t" and found.verdict == THEIRS_RIGHT
    assert found.exact_t == OURS.t[HIT] and found.exact_faces == (OURS.face[HIT],)
    assert comparison.ours_wrong == 1
    errors = exact_errors(ours, EXACT, VERTICES, FACES, RAYS)
    assert errors.wrong == 1 and errors.disagreements[0].ray == HIT


def test_a_shift_below_float32_is_found_by_the_exact_sample():
    ours = changed(OURS, HIT, t=OURS.t[HIT] * (1 + 1e-9))
    assert not any(d.ray == HIT for d in judged(ours).disagreements)
    assert exact_errors(ours, EXACT, VERTICES, FACES, RAYS).wrong == 1


def test_our_lost_hit_is_found():
    ours = changed(OURS, HIT, t=np.inf, face=-1)
    comparison = judged(ours)
    found = the_one(comparison, HIT)
    assert (found.kind, found.verdict, found.ours_t) == ("hit or miss", THEIRS_RIGHT, None)
    assert comparison.ours_wrong == 1 and comparison.only_theirs >= 1
    assert exact_errors(ours, EXACT, VERTICES, FACES, RAYS).wrong == 1


def test_our_phantom_hit_is_found():
    ours = changed(OURS, MISS, t=1.0, face=0)
    assert the_one(judged(ours), MISS).verdict == THEIRS_RIGHT
    assert exact_errors(ours, EXACT, VERTICES, FACES, RAYS).wrong == 1


def test_our_wrong_face_is_found_by_the_exact_sample_only():
    ours = changed(OURS, HIT, face=(OURS.face[HIT] + 1) % len(FACES))
    assert not any(d.ray == HIT and d.kind == "hit or miss" for d in judged(ours).disagreements)
    assert exact_errors(ours, EXACT, VERTICES, FACES, RAYS).wrong == 1


def test_a_farther_hit_is_found():
    """The face and its t are true, but another is nearer: a traversal that stops too early or skips a node."""
    for ray in np.flatnonzero(OURS.hit):
        others = np.delete(np.arange(len(FACES)), EXACT[ray].face).tolist()
        second = exact.closest_hit(VERTICES, FACES, RAYS.origins[ray], RAYS.directions[ray], candidates=others)
        if second is not None and second.t > EXACT[ray].t * 2:
            break
    ours = changed(OURS, ray, t=float(second.t), face=second.face)
    assert the_one(judged(ours), ray).verdict == THEIRS_RIGHT
    assert exact_errors(ours, EXACT, VERTICES, FACES, RAYS).wrong == 1
    theirs = changed(THEIRS, ray, t=float(second.t), face=second.face)
    assert the_one(judged(theirs=theirs), ray).verdict == OURS_RIGHT


def test_a_hit_behind_the_origin_is_not_right():
    """At its t the face is exactly hit, and nothing nearer is; but hits begin at t = 0."""
    square = np.array([[-1.0, -1, 0], [3, -1, 0], [-1, 3, 0], [-1, -1, 2], [3, -1, 2], [-1, 3, 2]])
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    batch = one_ray([0, 0, 1], [0, 0, -1])
    comparison = judge(compare(answer(1.0, 0), answer(-1.0, 1), square, faces, batch), square, faces)
    assert comparison.verdicts[OURS_RIGHT] == 1


@cases("side", [1, -1])
@cases("place", [(0, 0), (1, 0), (0, 1), (-1, 0), (-1, -1)])
def test_their_hit_at_an_edge_or_corner_is_right_from_either_side(place, side):
    triangle = np.array([[-1.0, -1, 0], [1, -1, 0], [-1, 1, 0]])
    batch, faces = one_ray([*place, side], [0, 0, -side]), np.array([[0, 1, 2]])
    comparison = judge(compare(answer(np.inf, -1), answer(1.0, 0), triangle, faces, batch), triangle, faces)
    (found,) = comparison.disagreements
    assert found.theirs_right == (max(place) <= 0)


def grazing():
    """Grazing rays, what exact arithmetic answers with t rounded to float64, and Embree's answers."""
    batch = rays.grazing_rays(VERTICES[FACES], 2000, np.random.default_rng(2))
    hits = exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)
    exactly = HitArrays(
        np.array([np.inf if hit is None else float(hit.t) for hit in hits]),
        np.array([-1 if hit is None else hit.face for hit in hits]),
    )
    return batch, exactly, HitArrays(*Embree(VERTICES, FACES).closest_hit(batch.origins, batch.directions))


def test_what_float32_cannot_tell_is_right_on_both_sides():
    batch, ours, theirs = grazing()
    comparison = judged(ours, theirs, batch)
    assert comparison.verdicts[BOTH_RIGHT] > 0 and comparison.ours_wrong == 0


def test_two_wrong_answers():
    ours = changed(OURS, HIT, t=OURS.t[HIT] * 1.1)
    comparison = judged(ours, changed(THEIRS, HIT, t=np.inf, face=-1))
    assert the_one(comparison, HIT).verdict == BOTH_WRONG
    assert comparison.ours_wrong == 1


def one_ray(origin, direction):
    return rays.RayFamily("one", np.array([origin], dtype=float), np.array([direction], dtype=float))


def answer(t, face):
    return HitArrays(np.array([t], dtype=float), np.array([face]))


def test_a_tie_may_name_any_face():
    target = VERTICES[3]
    batch = one_ray([0, 0, 0], target)
    hits = exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)
    assert len(hits[0].faces_at_t) == 5
    for face in hits[0].faces_at_t:
        assert exact_errors(answer(1.0, face), hits, VERTICES, FACES, batch).wrong == 0
        assert judged(answer(1.0, face), answer(np.inf, -1), batch).verdicts[OURS_RIGHT] == 1
    leak = exact_errors(answer(np.inf, -1), hits, VERTICES, FACES, batch)
    assert leak.wrong == 1 and leak.near_edge == 0


def test_a_silhouette_is_counted_apart_and_listed():
    top = VERTICES[VERTICES[:, 2].argmax()]
    batch = one_ray(top - [2, 0, 0], [2, 0, 0])
    hits = exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)
    assert hits[0].t == 1
    missed = answer(np.inf, -1)
    comparison = judged(missed, answer(1.0, hits[0].face), batch)
    assert comparison.verdicts[NEAR_EDGE] == 1 and comparison.ours_wrong == 0
    errors = exact_errors(missed, hits, VERTICES, FACES, batch)
    assert (errors.wrong, errors.near_edge, errors.near_edge_flipped, len(errors.disagreements)) == (0, 1, 1, 1)


def test_the_neighbour_at_an_edge_is_counted_apart_but_is_no_flip():
    """Aim a hair beside an edge: the neighbour is missed by less than float64 resolves, at the same t."""
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    batch = one_ray([np.nextafter(0.7, 1), 0.7, 1], [0, 0, -1])
    hits = exact.closest_hits(square, faces, batch.origins, batch.directions)
    assert hits[0].faces_at_t == (0,)
    errors = exact_errors(answer(1.0, 1), hits, square, faces, batch)
    assert (errors.wrong, errors.near_edge, errors.near_edge_flipped) == (0, 1, 0)


def test_what_is_not_judged_counts_as_wrong():
    missed = HitArrays(np.full(len(RAYS), np.inf), np.full(len(RAYS), -1))
    comparison = judge(compare(missed, THEIRS, VERTICES, FACES, RAYS), VERTICES, FACES, most=5)
    assert comparison.unjudged == len(comparison.disagreements) - 5
    assert comparison.ours_wrong == np.count_nonzero(THEIRS.hit)
    errors = exact_errors(missed, EXACT, VERTICES, FACES, RAYS)
    assert errors.wrong == np.count_nonzero(OURS.hit)
    assert sum(d.verdict is None for d in errors.disagreements) == errors.wrong - SETTLED > 0


def test_answers_that_are_plainly_ours_are_all_judged():
    """However many disagree: only rays on which ours is in doubt need the slow judgement that is bounded."""
    nothing = HitArrays(np.full(len(RAYS), np.inf), np.full(len(RAYS), -1))
    comparison = judge(compare(OURS, nothing, VERTICES, FACES, RAYS), VERTICES, FACES, most=0)
    assert comparison.unjudged == 0 and comparison.verdicts[OURS_RIGHT] == np.count_nonzero(OURS.hit)


def test_equal_rays_with_other_answers_are_judged_apart():
    """0 and -0 in a direction are equal; a kernel that trips over one of them must not be hidden by the other."""
    batch = RAYS.select([HIT, HIT])
    ours, theirs = OURS.select(np.array([HIT, HIT])), HitArrays(np.full(2, np.inf), np.full(2, -1))
    wrong = changed(ours, 1, t=ours.t[1] * 2)
    assert judge(compare(wrong, theirs, VERTICES, FACES, batch), VERTICES, FACES).wrong_rays == {1}


def test_theirs_is_judged_by_its_own_rounding():
    """The same t, float32's rounding off: right for a float32 reference and wrong for a float64 one."""
    batch, ours, theirs = grazing()
    single = judge(compare(ours, theirs, VERTICES, FACES, batch), VERTICES, FACES)
    double = judge(compare(ours, theirs, VERTICES, FACES, batch, FLOAT64_ROUNDOFF), VERTICES, FACES)
    assert single.verdicts[BOTH_RIGHT] > 0 and double.verdicts[BOTH_RIGHT] == 0
    assert single.verdicts[OURS_RIGHT] < double.verdicts[OURS_RIGHT]


def test_parts_keep_the_numbers_of_their_rays():
    rows = np.arange(HIT, len(RAYS))
    ours = changed(OURS, HIT, t=np.inf, face=-1).select(rows)
    comparison = compare(ours, THEIRS.select(rows), VERTICES, FACES, RAYS.select(rows), numbers=rows)
    assert judge(comparison, VERTICES, FACES).wrong_rays == {HIT}
    errors = exact_errors(ours, EXACT[HIT:], VERTICES, FACES, RAYS.select(rows), numbers=rows)
    assert [d.ray for d in errors.disagreements] == [HIT]


def test_errors_have_their_sizes():
    face, t = OURS.face[[HIT] * 4], OURS.t[[HIT] * 4] * np.array([1, 1 + 1.5e-9, 1 + 1.5e-3, 2.5])
    sizes = error_sizes(t, face, truth([EXACT[HIT]] * 4))
    assert (sizes.rays, sizes.right_face, sizes.missed, sizes.false_hits, sizes.other_face) == (4, 4, 0, 0, 0)
    assert sizes.relative_max == pytest.approx(1.5) and sizes.ulp_max == pytest.approx(1.5 * t[0] / np.spacing(t[0]))
    assert [sizes.histogram[1 + EXPONENTS.index(e)] for e in (-9, -3)] == [1, 1] and sizes.histogram[-1] == 1
    assert sum(sizes.histogram) == 4 and len(sizes.histogram) == len(EXPONENTS) + 1


def test_errors_without_a_size_are_counted():
    """A miss, a hit of nothing, another face, and a face at the ray's origin, where no error is relative."""
    square = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    origins = np.array([[0.5, 0.5, 1.0], [9, 9, 1], [0.5, 0.5, 1], [0.5, 0.5, 0]])
    hits = exact.closest_hits(square, [[0, 1, 2]], origins, np.tile([0.0, 0.0, -1.0], (4, 1)))
    sizes = error_sizes(np.array([np.inf, 1.0, 1.0, 1e-9]), np.array([-1, 0, 7, 0]), truth(hits))
    assert (sizes.missed, sizes.false_hits, sizes.other_face, sizes.right_face) == (1, 1, 1, 1)
    assert sizes.relative_max == sizes.ulp_max == sum(sizes.histogram) == 0


def test_a_flat_hit_is_not_excused_by_its_tolerance():
    """At a cosine of 1e-9 the relative tolerance would exceed 1 and accept any t."""
    square = np.array([[0.0, -1.0, 0.0], [2.0, -1.0, 0.0], [1.0, 1.0, 0.0]])
    batch = one_ray([0, 0, 1e-9], [1, 0, -1e-9])
    comparison = compare(answer(1.0, 0), answer(1.01, 0), square, [[0, 1, 2]], batch)
    assert len(comparison.disagreements) == 1


@cases(("ray", "t", "face"), [(HIT, np.inf, 0), (HIT, np.nan, 0), (HIT, 1.0, -1), (MISS, 1.0, -1)])
def test_what_contradicts_itself_is_judged_wrong(ray, t, face):
    """It was refused before it was judged, and a judge that raises finds nothing."""
    told, named = OURS.t.copy(), OURS.face.copy()
    told[ray], named[ray] = t, face if face < 0 else OURS.face[ray]
    lost = HitArrays.told(told, named)
    assert exact_errors(lost, EXACT, VERTICES, FACES, RAYS).wrong == judged(lost).ours_wrong == 1
