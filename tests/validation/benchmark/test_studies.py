"""Points in many directions beside a peer: the peer's rays, its bits, and what the row says."""

import numpy as np
import pytest

from renderer import Octree
from renderer.studies import occlusion
from validation.benchmark.measures.studies import ask_peer, measure, scene, text


@pytest.mark.parametrize("form", ["city", "terrain"])
@pytest.mark.parametrize("batch", [7, 1000])
@pytest.mark.parametrize("by_direction", [True, False])
def test_a_peers_bits_are_ours_where_its_rays_are(form, batch, by_direction):
    mesh, points, normals, on, ways = scene(form, 2_000, 150)
    octree, asked = Octree.from_mesh(mesh), []

    def test(rays):
        asked.append(len(rays))
        return octree.any_hit(rays[:, :3], rays[:, 3:])

    bare, whole, bits = ask_peer(test, (points, normals, ways), 1e-5, batch, by_direction)
    ours = occlusion(octree, points, normals, ways, leaving=on, packed=True)
    differing = np.unpackbits(bits ^ ours, axis=1, count=145)
    # Its rays are float32 and start an epsilon off the surface.
    assert differing.mean() < 0.01 and 0.3 < np.unpackbits(ours, axis=1, count=145).mean() < 0.9
    assert sum(asked) == (normals @ ways.T > 0.0).sum() and len(asked) == -(-150 // batch)
    assert 0.0 < bare <= whole


def test_a_row_and_its_lines():
    steps = []
    row = measure("city", 2_000, 300, 2, steps.append)
    assert row["points"] == 300 and row["directions"] == 145 and 0 < row["rays"] < 300 * 145
    assert (
        row["seconds"] > 0.0
        and row["written"] > 0.0
        and row["shadow"] > 0.0
        and row["array"] == 24 * 300 * 145
        and row["memory"] >= 0
    )
    assert steps[0] == "city: octree" and steps[-1] == "city: memory"
    for peer in row["peers"].values():
        assert peer["bare"] > 0.0 and peer["differing"] < 0.01 * row["rays"]
    lines = text(row).splitlines()
    assert lines[0].startswith("city, ") and len(lines) == 2 + len(row["peers"])
