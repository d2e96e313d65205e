"""Points in many directions beside a peer: the peer's rays are those of ours, and so are its bits."""

import numpy as np
import pytest

from renderer import Octree
from validation.benchmark.measures.studies import ask_peer, views


@pytest.mark.parametrize("form", ["city", "terrain"])
@pytest.mark.parametrize("batch", [7, 1000])
@pytest.mark.parametrize("by_direction", [True, False])
def test_a_peers_bits_are_ours_where_its_rays_are(form, batch, by_direction):
    of, asked = views(form, 2_000, 150), []
    octree = Octree.from_mesh(of.mesh)

    def test(rays):
        asked.append(len(rays))
        return octree.any_hit(rays[:, :3], rays[:, 3:])

    answer = ask_peer(test, of, 1e-5, batch, by_direction)
    ours = of.hidden(octree, threads=1)
    differing = np.unpackbits(answer.bits ^ ours, axis=1, count=145)
    # Its rays are float32 and start an epsilon off the surface.
    assert differing.mean() < 0.01 and 0.3 < np.unpackbits(ours, axis=1, count=145).mean() < 0.9
    assert sum(asked) == (of.normals @ of.directions.T > 0.0).sum() and len(asked) == -(-150 // batch)
    assert 0.0 < answer.bare <= answer.whole
