"""The memory of a system: what a process grows by, without the system's libraries."""

from pathlib import Path

import pytest
from contenders import system

from validation.benchmark.measures import memory, meshes
from validation.benchmark.peers.ours import OURS


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="needs Linux's /proc/self/clear_refs")
def test_memory_grows_with_the_mesh_and_not_with_the_library() -> None:
    mesh = meshes.displaced_spheres(200_000)
    row = memory.measure(mesh, [system(OURS), system("embree")], lambda _: None)
    assert row is not None and set(row["systems"]) == {OURS, "embree"}
    for found in row["systems"].values():
        # A face and its share of the tree take 30 to 300 bytes; a library would be tens of megabytes, 100 times that.
        assert 30 < found["rest"] / len(mesh.faces) < 300
        assert found["peak"] >= found["rest"]
    ours = row["systems"][OURS]
    # Each of the tree's three arrays may end in a huge page of 2 MB that it does not fill.
    assert ours["rest"] == pytest.approx(ours["own"], abs=3 * 2**21)
