"""Error against run time: what the front and the slope are, and that each parameter has its own error."""

import dataclasses
import json
import math
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderer import Mesh, Octree, load_scene
from validation.benchmark.page import pareto
from validation.benchmark.parameters import hits as parameter_hits
from validation.benchmark.parameters import pictures as parameter_pictures
from validation.efficiency import hits as tradeoff_hits
from validation.error_curves import front, slope
from validation.hits.compare import HitArrays
from validation.hits.rays import random_rays
from validation.oracle import exact
from validation.scenes import SCENE_CASES
from validation.timing import median_seconds, timed

# Few values, so that equal costs and equal errors are common.
POINTS = st.lists(st.tuples(st.integers(0, 6).map(float), st.integers(0, 6).map(float)), max_size=20)


def dominates(a, b):
    return a[0] <= b[0] and a[1] <= b[1] and a != b


def test_a_front_holds_what_nothing_beats():
    assert front([]) == []
    assert front([(3.0, 1.0), (1.0, 5.0), (2.0, 5.0), (2.0, 2.0), (4.0, 1.0)]) == [1, 3, 0]


def test_equal_points_share_the_front():
    assert front([(1.0, 1.0), (2.0, 0.0), (1.0, 1.0)]) == [0, 2, 1]


def test_a_front_of_nan_is_refused():
    with pytest.raises(ValueError, match=r"got .*nan.* in row 1"):
        front([(1.0, 1.0), (2.0, math.nan)])


@given(POINTS)
def test_the_front_is_the_definition(points):
    expected = {i for i, p in enumerate(points) if not any(dominates(q, p) for q in points)}
    chosen = front(points)
    assert set(chosen) == expected and len(chosen) == len(expected)
    assert [points[i][0] for i in chosen] == sorted(points[i][0] for i in chosen)


@given(POINTS, st.randoms(use_true_random=False))
def test_the_front_does_not_depend_on_the_order(points, random):
    shuffled = random.sample(points, len(points))
    assert sorted(points[i] for i in front(points)) == sorted(shuffled[i] for i in front(shuffled))


@given(st.floats(-3, 3), st.floats(1e-3, 1e3))
def test_a_slope_is_the_exponent(power, factor):
    x = [0.5, 1.0, 4.0, 10.0]
    # A dozen roundings over a spread of ln 20 in x.
    assert slope(x, [factor * v**power for v in x]) == pytest.approx(power, abs=1e-12)


def test_a_slope_is_least_squares():
    # Residuals of 1, -2, 1 in the logarithm are orthogonal to a line.
    y = [math.exp(-0.5 * k + r) for k, r in zip((0, 1, 2), (1, -2, 1), strict=True)]
    assert slope([1.0, math.e, math.e**2], y) == pytest.approx(-0.5, abs=1e-12)


def test_a_slope_leaves_out_what_has_no_logarithm_and_needs_two():
    assert slope([0.0, 1.0, 2.0, 4.0], [9.0, 1.0, 2.0, 0.0]) == pytest.approx(1.0, abs=1e-12)
    assert slope([1.0, 2.0], [1.0, 0.0]) is None
    assert slope([2.0, 2.0], [1.0, 3.0]) is None


def test_the_median_leaves_out_the_first_round_and_all_take_turns():
    order = []

    def clock(name, seconds):
        return lambda: order.append(name) or seconds.pop(0)

    assert median_seconds({"a": clock("a", [99.0, 3.0, 1.0, 2.0]), "b": clock("b", [0.0, 5.0, 5.0, 7.0])}, 3) == {
        "a": 2.0,
        "b": 5.0,
    }
    assert order == ["a", "b"] * 4
    assert timed(sorted, [2, 1])() > 0.0


@pytest.fixture(scope="module")
def hits():
    return parameter_hits.run(parameter_hits.HitStudyEffort(level=2, rays=400, judged=200, runs=1), lambda _: None)


def test_float32_storage_errs_by_its_rounding_and_float64_by_none(hits):
    assert hits["mesh"]["float32"] is False
    for family in hits["storage"]:
        errors = {p["name"]: p["errors"] for p in family["points"]}
        assert all(e["both_hit"] > 130 for e in errors.values())
        # Rays are no closer than 0.1 to their origin in this mesh of radius 3.4: float64 keeps twelve digits, while
        # float32 vertices, wrong by up to 2^-24 of that radius, leave a median above 1e-9.
        assert errors["float64"]["max"] < 1e-12
        for rounded in ("float32", "embree_default", "embree_robust"):
            assert 1e-9 < errors[rounded]["p50"] < 1e-5
        assert not errors["float64"]["missed"] + errors["float64"]["false_hits"] + errors["float64"]["wrong_face"]


def test_float32_storage_takes_fewer_bytes_and_embree_does_not_tell(hits):
    sizes = {p["name"]: p["bytes"] for p in hits["storage"][0]["points"]}
    assert 0 < sizes["float32"] < sizes["float64"]
    assert sizes["embree_default"] is None and sizes["embree_robust"] is None


def test_the_fronts_of_storage_hold_the_most_exact(hits):
    for family in hits["storage"]:
        for names in family["fronts"].values():
            assert names[-1] == "float64"


def test_no_option_of_the_tree_changes_a_bit(hits):
    tree = hits["tree"]
    assert tree["differing_rays"] == 0
    assert {p["leaf_size"] for p in tree["points"]} >= set(parameter_hits.LEAF_SIZES)
    assert len({p["bytes"] for p in tree["points"]}) > len(parameter_hits.LEAF_SIZES)  # they are different trees


def test_a_tree_that_answers_otherwise_is_reported(monkeypatch):
    mesh = tradeoff_hits.turned_mesh(2)
    rays = random_rays(mesh.triangles, 300, np.random.default_rng(1))
    moved = Mesh(np.nextafter(mesh.vertices, np.inf), mesh.faces)
    built = parameter_hits._built
    monkeypatch.setattr(parameter_hits, "_built", lambda m, t: built(moved if t.leaf_size == 8 else m, t))
    record = parameter_hits.tree_parameters(mesh, (rays,), 1)
    differing = {p["name"]: p["differing_rays"] for p in record["points"]}
    assert record["differing_rays"] == sum(differing.values()) > 450
    assert {name for name, count in differing.items() if count} == {
        "midpoint, leaf 8, depth 32",
        "sah, leaf 8, depth 32",
    }


@pytest.mark.parametrize("field", ["t", "face", "u", "v"])
def test_one_changed_bit_of_any_field_is_counted(field):
    mesh = tradeoff_hits.turned_mesh(2)
    rays = random_rays(mesh.triangles, 50, np.random.default_rng(1))
    hits = Octree.from_mesh(mesh).closest_hit(rays.origins, rays.directions)
    changed = getattr(hits, field).copy()
    row = int(hits.hit.argmax())
    changed.view(np.int64)[row] ^= 1
    assert parameter_hits.differing_rays(hits, hits) == 0
    assert parameter_hits.differing_rays(hits, dataclasses.replace(hits, **{field: changed})) == 1


def test_errors_count_every_kind_of_wrong_answer():
    triangle, below = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, -1], [1, 0, -1], [0, 1, -1]]
    origins = np.array([[0.2, 0.2, 1.0]] * 4 + [[2.0, 2.0, 1.0]] * 2)
    directions = np.array([[0.0, 0.0, -1.0]] * 6)
    truth = exact.closest_hits(triangle + below, [[0, 1, 2], [3, 4, 5]], origins, directions)
    answer = HitArrays(np.array([1.0, 1.25, 2.0, np.inf, np.inf, 3.0]), np.array([0, 0, 1, -1, -1, 1], dtype=np.int64))
    found = tradeoff_hits.errors(answer, truth)
    assert (found["missed"], found["false_hits"], found["wrong_face"], found["both_hit"]) == (1, 1, 1, 3)
    assert found["p50"] == 0.25 and found["max"] == 1.0
    nothing = tradeoff_hits.errors(HitArrays(np.full(6, np.inf), np.full(6, -1)), truth)
    assert nothing["max"] is None and nothing["missed"] == 4


@pytest.fixture(scope="module")
def pictures():
    glass = tuple(case for case in SCENE_CASES if case.name == "glass")
    return parameter_pictures.run(
        parameter_pictures.PictureStudyEffort(glass, size=16, samples=256, runs=1), lambda _: None
    )


def rows(pictures, parameter):
    return pictures["scenes"][0]["knobs"][parameter]["points"]


def test_each_parameter_at_its_converged_end_errs_by_little_and_at_the_other_by_much(pictures):
    samples, depths, weights = (rows(pictures, k) for k in ("samples", "max_depth", "min_weight"))
    assert samples[0]["rmse"] > 2 * samples[-1]["rmse"] > 0.0
    assert depths[0]["rmse"] > 10 * depths[-1]["rmse"]
    assert weights[0]["rmse"] == weights[0]["max_error"] == 0.0 < weights[-1]["rmse"]


def test_rays_rise_with_samples_and_depth_and_fall_with_the_least_weight(pictures):
    for parameter, sign in (("samples", 1), ("max_depth", 1), ("min_weight", -1)):
        rays = [sign * p["rays"] for p in rows(pictures, parameter)]
        assert rays == sorted(rays) and rays[0] < rays[-1]


def test_the_error_to_all_converged_contains_that_of_one_sample(pictures):
    deepest, one_sample = rows(pictures, "min_weight")[0], rows(pictures, "samples")[0]
    assert deepest["rmse_all"] == one_sample["rmse_all"] == one_sample["rmse"] > 0.0


def test_sampling_a_regular_grid_converges_at_least_like_monte_carlo(pictures):
    # Random samples would give -1/2. A few pixels scatter about their law: 0.1 leaves room for that, and a sampler
    # that does not converge at all has 0.
    assert pictures["scenes"][0]["knobs"]["samples"]["slope_value"] < -0.4


def test_a_difference_is_rms_and_largest_over_all_channels():
    scene = load_scene(next(case.path for case in SCENE_CASES if case.name == "stairs"))
    image = parameter_pictures.render(scene, resolution=(2, 1))
    other = dataclasses.replace(image, radiance=image.radiance + np.float32([[[0, 3, 0], [0, 0, -4]]]))
    # Adding to float32 radiances below 1 rounds to within 2^-22.
    assert parameter_pictures.difference(other, image) == pytest.approx((math.sqrt(25 / 6), 4.0), abs=1e-6)
    assert parameter_pictures.difference(image, image) == (0.0, 0.0)


def test_the_record_survives_json_and_is_drawn_from_it(hits, pictures):
    record = json.loads(json.dumps({"hits": hits, "pictures": pictures}, allow_nan=False))
    figures = pareto.figures(record)
    assert len(figures) == 2 * len(hits["storage"]) + len(pictures["scenes"])
    shown = [{text for e in ElementTree.fromstring(f["svg"]).iter() for text in e.itertext()} for f in figures]
    assert {"ours, float64", "ours, float32", "Embree default", "Embree robust"} <= shown[0]
    assert {"leaf_size, midpoint", "leaf_size, sah", "max_depth", "bytes"} <= shown[2]
    assert {"samples", "max_depth", "min_weight", "front"} <= shown[-1]
    assert "no ray's answer differs in a bit" in figures[2]["title"]
    assert "not correctness" in figures[-1]["title"]
    record["hits"]["tree"]["differing_rays"] = 7
    assert "7 answers differ" in pareto.figures(record)[2]["title"]
