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


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_picture_of_a_cluster_is_the_file_of_this_machine(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    here, there = tmp_path / "here" / name, tmp_path / "there" / name
    for path in (here, there):
        path.parent.mkdir()
    asked = [*PICTURE, "--split", "sah", "--max-depth", "3", "--max-rays", "9"]
    assert main([*asked, "-o", str(here), "--quiet"]) == 0
    assert "pixels miss rays" in capsys.readouterr().err
    assert main([*asked, "-o", str(there), "--cluster", "--threads", "1"]) == 0
    told = capsys.readouterr()
    assert "pixels miss rays" in told.err and told.out.startswith("dashboard: http://127.0.0.1:")
    assert f"{there}: 48 x 40, " in told.out and told.out.rstrip().endswith("on the cluster")
    assert here.read_bytes() == there.read_bytes() and [p.name for p in there.parent.iterdir()] == [name]


def test_a_quiet_command_says_nothing_of_its_cluster(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_ply(named("city_300"), tmp_path / "city.ply")
    study = ["study", "sky", str(tmp_path / "city.ply"), "-o", str(tmp_path / "a.npy")]
    assert main([*study, "--cluster", "local", "--threads", "1", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_study_at_an_address_has_the_bytes_of_this_machine(client: Any, tmp_path: Path) -> None:
    save_ply(named("city_300"), tmp_path / "city.ply")
    study = ["study", "sky", str(tmp_path / "city.ply"), "--quiet", "-o"]
    assert main([*study, str(tmp_path / "here.npy")]) == 0
    assert main([*study, str(tmp_path / "there.npy"), "--cluster", client.scheduler.address]) == 0
    assert (tmp_path / "here.npy").read_bytes() == (tmp_path / "there.npy").read_bytes()


@cases(
    "more, said",
    [
        (["--cluster", "tcp://127.0.0.1:9"], "127.0.0.1:9"),
        (["--cluster", "x://y"], "x"),
        (["--cluster", "tcp://127.0.0.1:9", "--threads", "2"], "--threads: expected none, as the cluster has its own"),
        (["--cluster", "--threads", "0"], "threads: expected an integer >= 1"),
        (["--cluster", "--samples", "3", "--threads", "1"], "samples: expected a square number"),
    ],
)
def test_what_is_wrong_is_told_on_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], more: list[str], said: str
) -> None:
    monkeypatch.setattr(import_module("renderer.cluster.clients"), "SECONDS", 0.5)
    assert main([*PICTURE, "-o", str(tmp_path / "a.npy"), *more, "--quiet"]) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1 and not list(tmp_path.iterdir())


def test_parts_of_another_picture_are_refused_and_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "a.npy.parts"
    folder.mkdir()
    (folder / "manifest.json").write_text('{"rows": 40, "made_of": {"kind": "picture", "scene": "0"}}')
    assert main([*PICTURE, "-o", str(tmp_path / "a.npy"), "--cluster", "--threads", "1", "--quiet"]) == 2
    told = capsys.readouterr().err
    assert "a.npy.parts: expected the parts of this run, got those of another" in told and told.count("\n") == 1
    assert [path.name for path in folder.iterdir()] == ["manifest.json"]


def test_a_picture_without_a_cluster_imports_no_dask(tmp_path: Path) -> None:
    program = (
        "import sys\nfrom renderer.cli.main import main\n"
        f"code = main({[*PICTURE, '-o', str(tmp_path / 'a.npy'), '--quiet']!r})\n"
        "sys.exit(code or ('dask' in sys.modules or 'distributed' in sys.modules) * 9)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
