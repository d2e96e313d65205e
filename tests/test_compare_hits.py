"""Hit comparison: each fault put into our hits or the reference's must be found, and nothing else."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from validation import compare_hits, exact, rays
from validation.compare_hits import (
    BOTH_RIGHT,
    BOTH_WRONG,
    NEAR_EDGE,
    OURS_RIGHT,
    THEIRS_RIGHT,
    HitArrays,
    compare,
    exact_errors,
    judge,
)
from validation.embree import Embree

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
    assert comparison.both_hit > 200 and comparison.both_miss > 10
    assert 1e-8 < comparison.t_error_p50 < 1e-7
    errors = exact_errors(OURS, EXACT, VERTICES, FACES, RAYS)
    assert errors.wrong == errors.near_edge == 0 and errors.listed == ()
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
    assert errors.wrong == 1 and errors.listed[0].ray == HIT


def test_a_shift_below_float32_is_found_by_the_exact_sample():
    ours = changed(OURS, HIT, t=OURS.t[HIT] * (1 + 1e-9))
    assert not any(d.ray == HIT for d in judged(ours).disagreements)
    assert exact_errors(ours, EXACT, VERTICES, FACES, RAYS).wrong == 1


def test_ulps_are_counted():
    ours = changed(OURS, HIT, t=OURS.t[HIT] + 3 * np.spacing(OURS.t[HIT]))
    errors = exact_errors(ours, EXACT, VERTICES, FACES, RAYS)
    assert errors.wrong == 0 and 2.5 <= errors.ulp_max <= 3.5


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


def test_their_faults_are_theirs():
    for t, face in ((OURS.t[HIT] * 1.01, None), (np.inf, -1)):
        comparison = judged(theirs=changed(THEIRS, HIT, t=t, face=face))
        assert the_one(comparison, HIT).verdict == OURS_RIGHT
        assert comparison.ours_wrong == 0


def test_what_float32_cannot_tell_is_right_on_both_sides():
    batch = rays.grazing_rays(VERTICES[FACES], 2000, np.random.default_rng(2))
    hits = exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)
    ours = HitArrays(
        np.array([np.inf if hit is None else float(hit.t) for hit in hits]),
        np.array([-1 if hit is None else hit.face for hit in hits]),
    )
    theirs = HitArrays(*Embree(VERTICES, FACES).closest_hit(batch.origins, batch.directions))
    comparison = judged(ours, theirs, batch)
    assert comparison.verdicts[BOTH_RIGHT] > 0 and comparison.ours_wrong == 0


def test_two_wrong_answers():
    ours = changed(OURS, HIT, t=OURS.t[HIT] * 1.1)
    comparison = judged(ours, changed(THEIRS, HIT, t=np.inf, face=-1))
    assert the_one(comparison, HIT).verdict == BOTH_WRONG
    assert comparison.ours_wrong == 1


def one_ray(origin, direction):
    return rays.RayBatch("one", np.array([origin], dtype=float), np.array([direction], dtype=float))


def answer(t, face):
    return HitArrays(np.array([t], dtype=float), np.array([face]))


def test_a_tie_may_name_any_face():
    target = VERTICES[3]
    batch = one_ray([0, 0, 0], target)
    hits = exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)
    assert len(hits[0].faces_at_t) >= 5
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
    assert (errors.wrong, errors.near_edge, errors.near_edge_flipped, len(errors.listed)) == (0, 1, 1, 1)


def test_the_neighbour_at_an_edge_is_counted_apart_but_is_no_flip():
    """Aim a hair beside an edge: the neighbour is missed by less than float64 resolves, at the same t."""
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    batch = one_ray([np.nextafter(0.7, 1), 0.7, 1], [0, 0, -1])
    hits = exact.closest_hits(square, faces, batch.origins, batch.directions)
    assert hits[0].faces_at_t == (0,)
    errors = exact_errors(answer(1.0, 1), hits, square, faces, batch)
    assert (errors.wrong, errors.near_edge, errors.near_edge_flipped) == (0, 1, 0)


def test_faces_are_not_compared_where_t_agrees():
    theirs = replace(THEIRS, face=np.where(THEIRS.hit, (THEIRS.face + 1) % len(FACES), -1))
    assert np.count_nonzero(theirs.face != THEIRS.face) > 200
    first, second = compare(OURS, THEIRS, VERTICES, FACES, RAYS), compare(OURS, theirs, VERTICES, FACES, RAYS)
    assert [d.ray for d in first.disagreements] == [d.ray for d in second.disagreements]


def test_what_is_not_judged_counts_as_wrong():
    missed = HitArrays(np.full(len(RAYS), np.inf), np.full(len(RAYS), -1))
    comparison = judge(compare(missed, THEIRS, VERTICES, FACES, RAYS), VERTICES, FACES, most=5)
    assert comparison.unjudged == len(comparison.disagreements) - 5
    assert comparison.ours_wrong == np.count_nonzero(THEIRS.hit)


def test_a_flat_hit_is_not_excused_by_its_tolerance():
    """At a cosine of 1e-9 the relative tolerance would exceed 1 and accept any t."""
    square = np.array([[0.0, -1.0, 0.0], [2.0, -1.0, 0.0], [1.0, 1.0, 0.0]])
    batch = one_ray([0, 0, 1e-9], [1, 0, -1e-9])
    comparison = compare(answer(1.0, 0), answer(1.01, 0), square, [[0, 1, 2]], batch)
    assert len(comparison.disagreements) == 1


def test_records_are_json():
    comparison = judged(changed(OURS, HIT, t=np.inf, face=-1))
    record = json.loads(json.dumps(comparison.record(), allow_nan=False))
    assert record["ours_wrong"] == 1 and record["disagreements"][0]["ray"] == HIT
    assert set(record["verdicts"]) == set(compare_hits.VERDICTS)
    errors = exact_errors(OURS, EXACT, VERTICES, FACES, RAYS)
    assert json.loads(json.dumps(errors.record(), allow_nan=False))["wrong"] == 0


def test_malformed_hits_are_refused():
    with pytest.raises(ValueError, match="finite t exactly where face >= 0, got t = nan, face = 0 in row 0"):
        answer(np.nan, 0)
    with pytest.raises(ValueError, match="finite t exactly where face >= 0"):
        answer(1.0, -1)
    with pytest.raises(ValueError, match="equal numbers of rays, got 1, 400 and 400"):
        compare(answer(1.0, 0), THEIRS, VERTICES, FACES, RAYS)
    with pytest.raises(ValueError, match="equal numbers of rays"):
        exact_errors(OURS, EXACT[:-1], VERTICES, FACES, RAYS)
