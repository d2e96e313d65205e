"""``--cluster`` by the command line: the same files, and one line for what is wrong."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from cases import cases

from renderer.cli.main import main
from renderer.mesh.load import save_ply
from validation.benchmark.measures.meshes import named

pytestmark = pytest.mark.judges("cluster.connected", "cluster.render_on", "octree-render render --cluster")


PICTURE = ["render", "scenes/glass.toml", "--resolution", "48x40", "--samples", "4"]


def test_a_picture_of_a_cluster_is_the_file_of_this_machine(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    here, there = tmp_path / "here" / "a.exr", tmp_path / "there" / "a.exr"
    for path in (here, there):
        path.parent.mkdir()
    asked = [*PICTURE, "--split", "sah", "--max-depth", "3", "--max-rays", "9"]
    assert main([*asked, "-o", str(here), "--quiet"]) == 0
    assert "pixels miss rays" in capsys.readouterr().err
    assert main([*asked, "-o", str(there), "--cluster", "--threads", "1"]) == 0
    told = capsys.readouterr()
    assert "pixels miss rays" in told.err and told.out.startswith("dashboard: http://127.0.0.1:")
    assert f"{there}: 48 x 40, " in told.out and told.out.rstrip().endswith("on the cluster")
    assert here.read_bytes() == there.read_bytes() and [p.name for p in there.parent.iterdir()] == ["a.exr"]


def test_a_study_of_a_cluster_has_the_bytes_of_this_machine_and_says_nothing_where_it_is_quiet(
    client: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of one of its own, and of one at an address."""
    save_ply(named("city_300"), tmp_path / "city.ply")
    study, files = ["study", "sky", str(tmp_path / "city.ply"), "--quiet", "-o"], []
    for where in ([], ["--cluster", "local", "--threads", "1"], ["--cluster", client.scheduler.address]):
        assert main([*study, str(tmp_path / "a.npy"), *where]) == 0
        files.append((tmp_path / "a.npy").read_bytes())
    assert files.count(files[0]) == 3 and capsys.readouterr() == ("", "")


@cases(
    "more, said",
    [
        (["--cluster", "tcp://127.0.0.1:9"], "127.0.0.1:9"),
        (["--cluster", "x://y"], "x"),
        (["--cluster", "tcp://127.0.0.1:9", "--threads", "2"], "--threads: expected none, as the cluster has its own"),
        (["--cluster", "--threads", "0"], "threads: expected an integer >= 1"),
        (["--cluster", "--min-weight", "2", "--threads", "1"], "min_weight: expected"),
    ],
)
def test_what_is_wrong_is_told_on_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], more: list[str], said: str
) -> None:
    monkeypatch.setattr(import_module("renderer.cluster.clients"), "SECONDS", 0.5)
    assert main([*PICTURE, "-o", str(tmp_path / "a.npy"), *more, "--quiet"]) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1 and not list(tmp_path.iterdir())


def test_without_a_cluster_no_dask_is_imported(tmp_path: Path) -> None:
    save_ply(named("city_300"), tmp_path / "city.ply")
    output = ["-o", str(tmp_path / "a.npy"), "--quiet"]
    commands = [[*PICTURE, *output], ["study", "sky", str(tmp_path / "city.ply"), *output]]
    program = (
        "import sys\nfrom renderer.cli.main import main\n"
        f"codes = [main(command) for command in {commands!r}]\n"
        "sys.exit(any(codes) or ('dask' in sys.modules or 'distributed' in sys.modules) * 9)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
