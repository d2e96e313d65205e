"""Error against run time of ours and the references: what is measured is what the names say, and is drawn from JSON."""

import dataclasses
import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from renderer import Mesh, load_scene
from renderer.picture.render import render
from validation.efficiency import hits as tradeoff_hits
from validation.efficiency import pictures as tradeoff_pictures
from validation.references.mitsuba.sampling import Film, can_judge
from validation.scenes import SCENES

HITS = tradeoff_hits.HitTimingEffort(level=3, rays=2000, judged=400, leaks=5000, runs=1, few=20)
PICTURES = tradeoff_pictures.PictureTimingEffort(size=32, theirs=(1, 16), truth=36, runs=1)


def stored(*found: Any) -> Any:
    """Records as JSON gives them back."""
    return json.loads(json.dumps(found, allow_nan=False))


def test_each_contender_errs_as_its_numbers_are_stored() -> None:
    costs: dict[str, float] = {}
    record, _ = stored(tradeoff_hits.run(HITS, costs), costs)
    points = {p["name"]: p for p in record["points"]}
    # Float64 rounds t by 2^-53 and enlarges it by 1 / cos; float32 rounds the vertices or t itself by 2^-24.
    assert points["ours"]["errors"]["max"] < 1e-13
    for name in ("ours_float32", "embree_default", "embree_robust", "igl", "mitsuba"):
        assert 1e-9 < points[name]["errors"]["p99"] < 1e-5
    assert points["ours"]["leaks"] == 0 == points["ours_float32"]["leaks"]
    assert points["embree_default"]["leaks"] > 800
    assert points["embree_default"]["leaks"] > points["embree_robust"]["leaks"]
    # Mitsuba asks Embree in robust mode, for the same float32 rays.
    assert points["mitsuba"]["errors"] == points["embree_robust"]["errors"]
    assert points["mitsuba"]["leaks"] == points["embree_robust"]["leaks"]
    assert points["trimesh"]["rays"] == 20 and "20 rays of each set" in points["trimesh"]["label"]


def test_a_mesh_with_a_hole_leaks(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = tradeoff_hits.turned_mesh(3)
    holed = Mesh(whole.vertices, whole.faces[::2], name="holed")
    monkeypatch.setattr(tradeoff_hits, "turned_mesh", lambda level: holed)
    effort = dataclasses.replace(HITS, rays=200, judged=10)
    points = tradeoff_hits.run(effort, {})["points"]
    # trimesh takes a hit 1e-8 beside a face, so at a rim it misses none.
    assert all(p["leaks"] > 0.1 * p["leak_rays"] for p in points if p["name"] != "trimesh")


def test_the_fronts_are_by_throughput() -> None:
    def point(name: str, mrays: float, p99: float | None, leaks: int, given: int = 10) -> dict[str, Any]:
        return {"name": name, "mrays": mrays, "errors": {"p99": p99}, "leaks": leaks, "leak_rays": given}

    points = [point("slow", 1.0, 1e-9, 0), point("fast", 9.0, 1e-3, 7), point("worse", 8.0, 1e-2, 8),
              point("blind", 20.0, None, 9), point("few", 30.0, 1e-12, 0, given=2)]  # fmt: skip
    assert tradeoff_hits.fronts(points) == {"p99": ["fast", "slow"], "leaks": ["blind", "fast", "slow"]}


@pytest.mark.parametrize("depth", [0, 1, 3])
def test_mitsubas_film_is_whitteds_picture_at_the_same_depth(depth: int) -> None:
    scene = load_scene(SCENES / "mirrors.toml")
    ours = render(scene, resolution=(24, 24), samples=1, max_depth=depth, min_weight=0.0, offset="mitsuba").radiance
    theirs = Film(scene, 24).render(1, max_depth=depth, sampler="centre")
    # Mitsuba's own film may see another face than our ray along an edge: of 576 pixels a few.
    assert (np.abs(ours - theirs).max(axis=2) > 1e-4).mean() < 0.01


@pytest.mark.parametrize(("name", "why"), [("glass", "ambient"), ("checkered", "neither"), ("stairs", "perspective")])
def test_a_film_refuses_what_it_cannot_judge(name: str, why: str) -> None:
    scene = load_scene(SCENES / f"{name}.toml")
    assert why in (can_judge(scene) or "")
    with pytest.raises(ValueError, match="expected diffuse surfaces and mirrors"):
        Film(scene, 8)


@pytest.mark.usefixtures("built_once")
def test_sampling_and_truncation_fall_and_arithmetic_is_small(monkeypatch: pytest.MonkeyPatch) -> None:
    for who in ("ours", "theirs"):  # the same picture is drawn once
        monkeypatch.setattr(tradeoff_pictures.Bench, who, cache(getattr(tradeoff_pictures.Bench, who)))
    costs: dict[str, float] = {}
    scene = load_scene(SCENES / "mirrors.toml")
    (record, split), _ = stored(tradeoff_pictures.run(scene, "mirrors", PICTURES, costs), costs)
    curves = {(c["who"], c["knob"]): c for c in record["curves"]}
    for who in ("ours", "Mitsuba"):
        errors = [p["rmse"] for p in curves[who, "samples"]["points"]]
        # Random samples give -1/2; 256 pixels scatter about it, and what does not converge has 0.
        assert curves[who, "samples"]["slope_value"]["rmse"] < -0.35 and errors[0] > 2 * errors[-1] > 0.0
        depths = [p["rmse"] for p in curves[who, "max_depth"]["points"]]
        assert depths[0] > 10 * depths[-2]
    weights = [p["rmse"] for p in curves["ours", "min_weight"]["points"]]
    assert weights == sorted(weights) and weights[-1] > 0.0
    parts = {p["name"]: p for p in split["parts"]}
    assert min(parts["sampling"]["rmse"], parts["truncation"]["rmse"]) > parts["arithmetic"]["rmse"] > 0.0
    # Radiance of about 1 in float32, after some hundred roundings of 6e-8.
    assert parts["arithmetic"]["rmse"] < 1e-5
    # A ratio of measured seconds: that there is one, not how large it is on a machine that may be busy.
    assert parts["sampling"]["halved"] > 0.0
