"""View factors in parts: the bits of one run at once, whatever is killed, spoilt or kept from before."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from furnished import room_objects, same_bits, write_room

from renderer import Mesh, Octree
from renderer.checkpoints import view_factors as runs
from renderer.checkpoints.folder import RunFolder
from renderer.checkpoints.view_factors import run_view_factors
from renderer.cli.main import main
from renderer.studies import view_factors
from renderer.studies.factors import known

pytest.importorskip("scipy")
pytestmark = pytest.mark.judges("octree-render study", "octree-render study kind")

FEW: dict[str, Any] = {"rtol": 0.5, "max_rays": 512}
# Rows and pairs of a part, so that the room below, of 24 faces, has five parts of rows, and some of pairs.
SMALL = {"RAYS": 0, "LEAST_ROWS": 5, "PAIRS": 50}


@pytest.fixture
def octree() -> Octree:
    return Octree.from_mesh(Mesh.concatenate([Mesh(*own) for own in room_objects().values()]))


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SMALL.items():
        monkeypatch.setattr(runs, name, value)


@pytest.fixture(params=[False, True], ids=["all pairs", "some pairs"])
def survey(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether rays say first which pairs are worth their time, as of many faces."""
    if request.param:
        monkeypatch.setattr(known, "_ALL", 10)
    return bool(request.param)


def names_in(folder: Path) -> set[str]:
    return {path.name.rpartition("-")[0] for path in folder.glob("*.part")}


@cases("threads", [1, 3])
def test_parts_have_the_bits_of_a_run_at_once(
    octree: Octree, tmp_path: Path, small: None, survey: bool, threads: int
) -> None:
    walls = np.repeat(np.arange(12), 2)
    shares = np.where(np.arange(24) % 5 == 0, 0.5, 0.0)
    for number, more in enumerate(({}, {"groups": walls, "sides": "both"}, {"sides": "both", "transmittance": shares})):
        folder = tmp_path / f"{number}"
        found = run_view_factors(octree, folder, threads=threads, **FEW, **more)
        assert same_bits(found, view_factors(octree, **FEW, **more))
        assert names_in(folder) >= {"rows", "survey"} if survey else names_in(folder) == {"rows", "pairs"}
    assert len(list((tmp_path / "0").glob("*.part"))) >= 8


def test_usual_parts_have_the_bits_of_a_run_at_once(octree: Octree, tmp_path: Path, survey: bool) -> None:
    assert same_bits(run_view_factors(octree, tmp_path / "parts", **FEW), view_factors(octree, **FEW))


def test_rows_of_a_part_are_so_many_that_threads_share_them() -> None:
    assert [runs.rows_of_part(rays) for rays in (256, 1 << 16, 1 << 24)] == [1 << 17, 1 << 9, 1 << 8]


def test_parts_that_are_kept_are_not_computed_again(
    octree: Octree, tmp_path: Path, small: None, survey: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, jobs = run_view_factors(octree, tmp_path / "parts", **FEW), []
    files = sorted((tmp_path / "parts").glob("*.part"))
    own = runs.compute_here

    def compute(tracing: Any, given: Any, update: Any) -> Any:
        return own(tracing, (jobs.append(job.part) or job for job in given), update)

    monkeypatch.setattr(runs, "compute_here", compute)
    assert same_bits(run_view_factors(octree, tmp_path / "parts", **FEW), before) and not jobs
    spoilt = files[0], files[-1]
    spoilt[0].write_bytes(spoilt[0].read_bytes()[:-1])
    spoilt[1].unlink()
    assert same_bits(run_view_factors(octree, tmp_path / "parts", **FEW), before) and len(jobs) == 2
    assert sorted((tmp_path / "parts").glob("*.part")) == files


OTHERS: dict[str, Callable[[Octree], tuple[Octree, dict[str, Any]]]] = {
    "groups": lambda octree: (octree, {"groups": np.repeat(np.arange(12), 2)}),
    "max rays": lambda octree: (octree, {"max_rays": 1024}),
    "mesh": lambda octree: (Octree(octree.mesh.vertices * 2.0, octree.mesh.faces), {}),
    "rtol": lambda octree: (octree, {"rtol": 0.25}),
    "sides": lambda octree: (octree, {"sides": "both"}),
    "sides, transmittance": lambda octree: (octree, {"transmittance": np.full(24, 0.5)}),
}


@cases("name", OTHERS)
def test_the_folder_of_another_run_is_refused(octree: Octree, tmp_path: Path, name: str) -> None:
    run_view_factors(octree, tmp_path / "parts", **FEW)
    other, given = OTHERS[name](octree)
    with pytest.raises(ValueError, match=f"whose {name} differ; remove the folder to begin anew"):
        run_view_factors(other, tmp_path / "parts", **(FEW | given))


def test_parts_of_another_size_are_refused(octree: Octree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_view_factors(octree, tmp_path / "parts", **FEW)
    monkeypatch.setattr(runs, "LEAST_ROWS", 7)
    with pytest.raises(ValueError, match="whose size differ"):
        run_view_factors(octree, tmp_path / "parts", **FEW)


def test_a_part_is_none_under_another_name(tmp_path: Path) -> None:
    files = RunFolder(tmp_path / "parts", {"kind": "any"})
    files.write("rows-00000000", b"whole")
    (tmp_path / "parts" / "rows-00000000.part").rename(tmp_path / "parts" / "pairs-00000000.part")
    assert files.read("rows-00000000") is None and files.read("pairs-00000000") is None
    with pytest.raises(OSError, match=r"rows-00000000\.part: expected a whole part of the run, got none"):
        files.whole("rows-00000000")


# The command with small parts. Once there are so many, it waits until it is killed.
PROGRAM = f"""
import sys, time
from renderer.checkpoints import folder, view_factors
vars(view_factors).update({SMALL})
own, most = folder.RunFolder.write, int(sys.argv[1])
def write(self, *part):
    own(self, *part)
    while len(list(self.folder.glob("*.part"))) >= most: time.sleep(0.1)
folder.RunFolder.write = write
from renderer.cli.main import main
sys.exit(main(sys.argv[2:]))
"""


def test_a_command_that_is_killed_goes_on_and_ends_with_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In its pairs, and in its rows."""
    result, undisturbed = tmp_path / "a.npz", tmp_path / "b.npz"
    words = ["study", "viewfactors", str(write_room(tmp_path)), "--quiet", "--rtol", "0.1", "--max-rays", "4096", "-o"]
    folder = tmp_path / "a.npz.parts"
    for most in (2, 8):
        child = subprocess.Popen([sys.executable, "-c", PROGRAM, str(most), *words, str(result)])
        while len(list(folder.glob("*.part"))) < most:
            assert child.poll() is None
            time.sleep(0.02)
        os.kill(child.pid, signal.SIGKILL)
        child.wait()
        assert not result.exists()
    assert names_in(folder) == {"pairs", "rows"}
    kept, written, own = {path.stem for path in folder.glob("*.part")}, list[str](), RunFolder.write
    (folder / "pairs-00000001.part").write_bytes(b"spoilt")
    with monkeypatch.context() as patch:
        for name, value in SMALL.items():
            patch.setattr(runs, name, value)
        patch.setattr(RunFolder, "write", lambda self, name, part: written.append(name) or own(self, name, part))
        assert main([*words, str(result)]) == 0 and not folder.exists()
    assert kept & set(written) == {"pairs-00000001"} and len(written) == len(set(written)) > 1
    assert main([*words, str(undisturbed)]) == 0
    assert result.read_bytes() == undisturbed.read_bytes()
