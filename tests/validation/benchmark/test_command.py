"""The command: a short run of all that is measured, one whose page is drawn again, and those that are refused."""

from pathlib import Path
from typing import Any

import pytest

from renderer.mesh.load import save_ply
from validation.benchmark import __main__ as command
from validation.benchmark.measures import (
    calls,
    drop_in,
    first_answers,
    forms,
    frames,
    memory,
    meshes,
    processes,
    scenes,
    studies,
    tree_options,
)
from validation.benchmark.page import figures, page, record
from validation.benchmark.peers import systems
from validation.benchmark.peers.ours import OURS

# What whole processes and Mitsuba's frames measure takes long: records of their form stand for it.
_FRAMES = {
    "scene": "checkered", "size": 8, "max_depth": 6, "faces": 9, "labels": {frames.OURS: "ours"},
    "contenders": {frames.OURS: {"seconds": [0.1], "median": 0.1}}, "ratios": {}, "rays": {frames.OURS: {"all": 12}},
    "pictures": {},
}  # fmt: skip
_PROCESSES = {name: {"command": name, "seconds": [0.25], "median": 0.25} for name in (processes.WARM, processes.IMPORT)}
_MEMORY = {"systems": {OURS: {"rest": 100, "peak": 200, "own": 90}}}


def test_a_short_run_measures_all_and_its_page_is_drawn_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_ply(forms.city(40), tmp_path / "own.ply")
    for module, name, value in (
        (systems, "_PEERS", {name: systems._PEERS[name] for name in ("embree",)} | {"nobody": ("no", "find")}),
        (meshes, "QUICK", (100, 400)), (meshes, "QUICK_FORMS", (("scan", 300),)), (calls, "_CALLS", 2),
        (command, "QUICK_RAYS", 300), (drop_in, "QUICK_RAYS", (1,)), (drop_in, "_LEAST", 1),
        (scenes, "QUICK_MANY", (100, 9)), (scenes, "QUICK_RAYS", 50), (scenes, "QUICK_FEW", 2),
        (studies, "QUICK_SIZE", 200), (tree_options, "QUICK_LEVEL", 1), (tree_options, "QUICK_RAYS", 50),
        (studies, "memory", lambda *_: 10), (frames, "measure", lambda *_: _FRAMES),
        (processes, "measure", lambda *_: _PROCESSES), (first_answers, "measure", lambda *_: None),
        (figures, "draw", lambda *_, title, **more: f"<svg>{title}</svg>"),
        (memory, "measure", lambda mesh, *_: _MEMORY | {"mesh": mesh.name, "faces": len(mesh.faces)}),
    ):  # fmt: skip
        monkeypatch.setattr(module, name, value)
    arguments = ["--quick", "--mesh", str(tmp_path / "own.ply"), "--output", str(tmp_path)]
    assert command.main(arguments) == 0
    found = record.read(tmp_path / "benchmark.json")
    assert set(found["kinds"].values()) == {"spheres", "scan", "file"} and found["missing"]["nobody"] == "find"
    assert all(row["agree"] for row in found["queries"]) and found["trees"]["differing_rays"] == 0
    # Nothing is inside of a city, which is open.
    asked = {row["query"] for row in found["queries"] if row["mesh"] == "own"}
    assert {"closest", "nearest"} <= asked and not asked & {"contains", "signed"} and found["open_edges"]["own"] > 0
    # A curve for each family and query, of builds, and of the tree by two families of rays.
    series = {(row["family"], row["query"]) for row in found["queries"] if row["mesh"] in found["series"]}
    drawn = (tmp_path / "benchmark.html").read_text(encoding="utf-8")
    assert drawn.count("<svg>") == len(series) + 1 + 2
    # The page alone is drawn from what is stored.
    monkeypatch.setattr(command, "measure", lambda *_: pytest.fail("measured"))
    monkeypatch.setattr(page, "html", lambda record: f"drawn from {record['date']}")
    assert command.main(["--page-only", "--output", str(tmp_path)]) == 0
    assert (tmp_path / "benchmark.html").read_text(encoding="utf-8") == f"drawn from {found['date']}"


def test_ctrl_c_stops_and_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "_measure_mesh", interrupted)
    assert command.main(["--quick", "--output", str(tmp_path)]) == 130
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("output", ["benchmark.json", "benchmark.html", None])
def test_what_cannot_be_read_or_written_is_told_before_anything_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], output: str | None
) -> None:
    monkeypatch.setattr(command, "measure", lambda *_: pytest.fail("measured"))
    if output is not None:
        (tmp_path / output).mkdir()
    assert command.main(["--mesh", "nowhere.ply", "--output", str(tmp_path)]) == 2
    assert (output or "--mesh: expected a file, got 'nowhere.ply'") in capsys.readouterr().err
