"""The ablation: what it forces on, what it measures, and that it notices a picture that changed."""

import json
from typing import Any

import numpy as np
import pytest

from renderer import Image, Needs, Scene, needs_of, render
from validation.benchmark.measures import ablation


@pytest.fixture(scope="module")
def result() -> dict[str, Any]:
    return ablation.run(True, lambda _: None)


def test_no_picture_changes_and_the_result_is_plain(result: dict[str, Any]) -> None:
    assert result["passed"] and all(row["difference"] == 0.0 for row in result["rows"])
    assert json.loads(json.dumps(result)) == result


def test_every_feature_is_forced_on_somewhere_and_never_where_it_is_needed(result: dict[str, Any]) -> None:
    pairs = {(row["scene"], row["feature"]) for row in result["rows"]}
    assert len(pairs) == len(result["rows"])
    # All scenes' lights shine, so none is left out alone; they go with the shadows.
    forced = {feature for _, feature in pairs}
    assert forced == {"reflection", "refraction", "shadows", "specular", "smooth_normals", "float64_vertices", "octree"}
    for name, scene in ablation.scenes():
        missing = {feature for feature, value in vars(needs_of(scene)).items() if not value} - {"lights"}
        assert {feature for n, feature in pairs if n == name} == missing


def test_what_is_forced_costs_memory_or_rays(result: dict[str, Any]) -> None:
    rows = {(row["scene"], row["feature"]): row for row in result["rows"]}
    for (_, feature), row in rows.items():
        more = row["bytes"]["with"] - row["bytes"]["without"]
        assert more >= 0 and min(row["seconds"].values()) > 0
        assert more > 0 or feature in ("specular", "reflection"), (feature, row)
    dark = rows["ambient only", "shadows"]["rays"]
    assert dark["without"] == 64 * 64 < dark["with"]
    # Nothing but the vertices is twice as wide, of 46 faces in 13 blocks. Placed models have float64 anyway.
    row = rows["stairs", "float64_vertices"]["bytes"]
    assert row["with"] - row["without"] == 4 * 9 * 4 * 13


def test_a_changed_picture_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    name, scene = next((n, s) for n, s in ablation.scenes() if n == "a box")

    def wrong(scene: Scene, *, needs: Needs, **options: Any) -> Image:
        image = render(scene, **options)
        if needs.octree:
            image.radiance[0, 0, 0] += np.float32(0.25)
        return image

    monkeypatch.setattr(ablation, "render", wrong)
    monkeypatch.setattr(ablation, "scenes", lambda: iter([(name, scene)]))
    result = ablation.run(True, lambda _: None)
    assert not result["passed"]
    assert [row["difference"] for row in result["rows"] if not row["identical"]] == [0.25]
    assert [row["feature"] for row in result["rows"] if not row["identical"]] == ["octree"]
