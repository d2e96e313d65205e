"""View factors on a cluster have the bits of those on this machine, whatever workers die."""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from furnished import room_objects, same_bits, write_room
from watched import results_here

from renderer import Mesh, Octree, RayScene
from renderer.checkpoints import view_factors as runs
from renderer.checkpoints.folder import RunFolder
from renderer.cli.main import main
from renderer.cluster import connected, view_factors_on
from renderer.studies import ViewFactors, view_factors
from renderer.studies.factors import known

pytest.importorskip("scipy")
pytestmark = pytest.mark.judges("cluster.view_factors_on", "octree-render study --cluster")

FEW: dict[str, Any] = {"rtol": 0.5, "max_rays": 512}


@pytest.fixture
def octree() -> Octree:
    return Octree.from_mesh(Mesh.concatenate([Mesh(*own) for own in room_objects().values()]))


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of five rows and fifty pairs; the workers do not know."""
    for name, value in {"RAYS": 0, "LEAST_ROWS": 5, "PAIRS": 50}.items():
        monkeypatch.setattr(runs, name, value)


@cases("split", ["sah", "midpoint"])
def test_workers_find_the_bits_of_one_process(
    client: Any, octree: Octree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, split: Any
) -> None:
    """Of all pairs, and of those that rays choose."""
    shares = np.where(np.arange(24) % 5 == 0, 0.5, 0.0)
    for number, more in enumerate(({}, {"groups": np.repeat(np.arange(12), 2)}, {"transmittance": shares})):
        given = FEW | more | {"sides": "both"}
        assert same_bits(
            view_factors_on(client, octree, tmp_path / str(number), split=split, **given), view_factors(octree, **given)
        )
    monkeypatch.setattr(known, "_ALL", 10)
    found = view_factors_on(client, octree, str(tmp_path / "survey"), split=split, **FEW)
    assert same_bits(found, view_factors(octree, **FEW))
    assert {path.name.partition("-")[0] for path in (tmp_path / "survey").glob("*.part")} >= {"survey", "rows"}


def test_a_scene_goes_to_workers_as_its_merged_mesh(client: Any, octree: Octree, tmp_path: Path) -> None:
    scene = RayScene()
    scene.add(octree, [[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0.0, 5.0)])
    found = view_factors_on(client, scene, tmp_path / "parts", max_rays=256)
    assert same_bits(found, view_factors(Octree(scene.merged), max_rays=256))


def test_a_worker_that_dies_is_replaced(octree: Octree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """When the third part is there, so that what it was sent dies with it."""
    import multiprocessing

    own, killed = RunFolder.write, []

    def write(self: RunFolder, *part: Any) -> None:
        own(self, *part)
        if not killed and len(list(self.folder.glob("*.part"))) >= 3:
            killed.extend(multiprocessing.active_children())
            for worker in killed:
                worker.kill()

    monkeypatch.setattr(RunFolder, "write", write)
    with connected(workers=1) as client:
        found = view_factors_on(client, octree, tmp_path / "parts", **FEW)
    assert killed and same_bits(found, view_factors(octree, **FEW))


def test_a_run_goes_on_from_here_to_there_and_back(
    octree: Octree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Parts do not depend on where they are computed."""
    monkeypatch.setattr(import_module("renderer.cluster.view_factors"), "results", results_here)
    here = runs.run_view_factors(octree, tmp_path / "parts", **FEW)
    some = sorted((tmp_path / "parts").glob("*.part"))[::2]
    before = [path.read_bytes() for path in some]
    for path in some:
        path.unlink()
    assert same_bits(view_factors_on(None, octree, tmp_path / "parts", **FEW), here)
    assert [path.read_bytes() for path in some] == before


def test_the_command_writes_the_same_file(client: Any, tmp_path: Path) -> None:
    words = ["study", "viewfactors", str(write_room(tmp_path)), "--quiet", "--rtol", "0.5", "--max-rays", "512"]
    words += ["--groups", "objects", "--transmittance", "glass=0.5", "--sides", "both", "-o", str(tmp_path / "f.npz")]
    files = []
    for where in ([], ["--cluster", client.scheduler.address]):
        assert main([*words, *where]) == 0
        files.append((tmp_path / "f.npz").read_bytes())
    assert files[0] == files[1] and {path.name for path in tmp_path.iterdir()} == {"f.npz", "room.obj", "room.mtl"}
    assert ViewFactors.load(tmp_path / "f.npz").names is not None


@cases(
    "bad, said",
    [
        ({"client": None}, "client: expected a distributed.Client, got NoneType"),
        ({"octree": 1}, "octree: expected an Octree"),
        ({"split": "x"}, "split: expected one of"),
        ({"folder": 3}, "folder: expected a string"),
        ({"rtol": 0.0}, "rtol: expected a number above 0"),
    ],
)
def test_bad_arguments_are_named(client: Any, octree: Octree, tmp_path: Path, bad: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        view_factors_on(**({"client": client, "octree": octree, "folder": tmp_path / "parts"} | FEW | bad))
