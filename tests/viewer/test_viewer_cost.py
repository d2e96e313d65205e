"""What a ray costs: heat maps of nodes and triangles, and the whole tree of rays of a clicked pixel."""

from pathlib import Path

import numpy as np
import pytest
from viewer_client import Client, Got, looking

from renderer.diagnostics.false_color import shades_of
from renderer.diagnostics.ray_cost import camera_steps
from renderer.picture.prepare import PreparedScene
from renderer.scene.camera import primary_rays
from renderer.viewer.shown import open_file
from renderer.viewer.viewpoint import camera_of

EYE = (0.5, 2.6, 5.5)


@pytest.fixture(scope="module")
def prepared(scene: Path) -> PreparedScene:
    return open_file(scene).prepared


@pytest.mark.parametrize("aov", ["nodes", "triangles"])
def test_the_heat_map_is_that_of_the_counted_steps(client: Client, prepared: PreparedScene, aov: str) -> None:
    client.view(w=100, h=75, settings={"aov": aov})
    view = looking(EYE)
    origins, directions = primary_rays(camera_of(view["m"], view["fovy"]), 100, 75)
    counts = getattr(prepared.octree.count_steps(origins, directions), aov).reshape(75, 100)
    told, got = client.next(), client.next()
    assert isinstance(told, dict) and isinstance(got, Got)
    assert (told["type"], told["aov"], told["low"], told["high"]) == ("legend", aov, counts.min(), counts.max())
    assert told["colors"][0] == [68, 1, 84] and told["colors"][-1] == [253, 231, 37]  # viridis
    # Rays through rounded directions may enter another box at its very edge.
    assert (got.rgb == shades_of(counts, counts.min(), counts.max())).all(axis=2).mean() > 0.999
    assert len(np.unique(counts)) > 3


def test_brute_force_tests_all_triangles_and_no_node(client: Client, prepared: PreparedScene) -> None:
    for aov, number in (("nodes", 0), ("triangles", len(prepared.mesh.faces))):
        client.view(mode="brute", w=40, h=30, settings={"aov": aov})
        while (told := client.next())["type"] == "progress":  # type: ignore[index]
            pass
        assert isinstance(told, dict) and told["low"] == told["high"] == number
        got = client.next()
        assert isinstance(got, Got)
        client.acknowledge(got)


def test_steps_are_counted_in_parts_that_are_the_whole(
    prepared: PreparedScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    from renderer.diagnostics import ray_cost

    camera, shares = prepared.scene.camera, list[float]()
    whole = camera_steps(prepared, camera, (64, 48))
    monkeypatch.setattr(ray_cost, "_RAYS", 300)
    parts = camera_steps(prepared, camera, (64, 48), shares.append)
    assert whole.nodes.shape == (48, 64) and len(shares) == 12 and sum(shares) == pytest.approx(1.0, abs=1e-12)
    assert np.array_equal(parts.nodes, whole.nodes) and np.array_equal(parts.triangles, whole.triangles)
