"""The stability curves: the gates find a shift, a miss and a wrong face."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from cases import cases

from renderer.octree import Octree
from validation.hits.compare import HitArrays
from validation.stability import sweeps as stability
from validation.stability.cases.judgement import ulp_errors


def judged(sweep, x, monkeypatch, change):
    """The gates of one point when our answers are changed."""
    answered = stability.answer

    def changed(kernel, sample):
        found = answered(kernel, sample)
        return change(found) if kernel == "ours" else found

    monkeypatch.setattr(stability, "answer", changed)
    point = stability.point(sweep, x, 20, np.random.default_rng(3))
    wrong, beyond = stability.judge(sweep.name, [point])
    return wrong, beyond


SWEEPS = {sweep.name: sweep for sweep in stability.SWEEPS}


@cases("name", SWEEPS)
def test_a_shift_of_t_by_1e12th_fails(name, monkeypatch):
    x = SWEEPS[name].xs[0]
    wrong, beyond = judged(SWEEPS[name], x, monkeypatch, lambda f: HitArrays(f.t * (1 + 1e-12), f.face))
    assert wrong.passed and not beyond.passed


def test_a_missed_ray_fails(monkeypatch):
    def drop(found):
        first = np.arange(len(found.t)) == 0
        return HitArrays(np.where(first, np.inf, found.t), np.where(first, -1, found.face))

    wrong, beyond = judged(SWEEPS["scale"], 1.0, monkeypatch, drop)
    assert wrong.value == 1 and beyond.passed


def test_a_wrong_face_fails(monkeypatch):
    wrong, _ = judged(SWEEPS["scale"], 1.0, monkeypatch, lambda f: HitArrays(f.t, (f.face + 1) % 1280))
    assert wrong.value == 20


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of the last place of an infinity
@pytest.mark.parametrize("t", [np.inf, np.nan])
def test_hits_at_no_number_are_beyond_the_bound(t, monkeypatch):
    sound = Octree.closest_hit
    monkeypatch.setattr(Octree, "closest_hit", lambda *rays: replace(hits := sound(*rays), t=np.full_like(hits.t, t)))
    wrong, beyond = judged(SWEEPS["scale"], 1.0, monkeypatch, lambda found: found)
    assert wrong.passed and beyond.value == 20
    assert ulp_errors(np.array([t, 2.0]), [Fraction(2)] * 2).tolist() == [np.inf, 0.0]
