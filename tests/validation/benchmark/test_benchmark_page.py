"""One small run from the command line: the record, its way through JSON, and the page drawn from it alone."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from renderer.mesh.load import save_ply
from renderer.mesh.mesh import Mesh
from validation import timing
from validation.benchmark import __main__ as command
from validation.benchmark.measures import (
    ablation,
    calls,
    drop_in,
    first_answers,
    frames,
    memory,
    meshes,
    processes,
    studies,
)
from validation.benchmark.page import heat, history, page, record
from validation.benchmark.parameters import study
from validation.benchmark.peers import systems
from validation.benchmark.peers.ours import OURS, OURS_ONE


def _frames(*_: Any) -> dict[str, Any]:
    names = (frames.OURS, frames.LISTS, frames.SCALAR)
    return {
        "scene": "checkered", "size": 256, "max_depth": 6, "faces": 9, "labels": {n: frames.LABELS[n] for n in names},
        "contenders": {n: {"seconds": [0.1], "median": 0.1} for n in names}, "ratios": {n: 1.0 for n in names[1:]},
        "rays": {frames.OURS: {"all": 12}, frames.LISTS: {"rays": 9, "shadow_rays": 3}},
        "pictures": {frames.LISTS: {"ssim": 0.9987654, "mean_error": 0.0, "pixel_share": 0.0}},
    }  # fmt: skip


def _processes(*_: Any) -> dict[str, Any]:
    names = (processes.WARM, processes.IMPORT)
    return {name: {"command": f"python {name}", "seconds": [0.25], "median": 0.25} for name in names}


def _first_answers(*_: Any) -> dict[str, Any]:
    row = {"unit": "CPU s", "values": [3.0, 4.0, 9.0], "median": 4.0}
    return {"level": "x86-64-v3", "rows": {"first_hit_cpu": row}}


def _ablation(*_: Any) -> dict[str, Any]:
    pair = {"without": 1, "with": 2}
    row = {"scene": "stairs", "feature": "refraction", "seconds": pair, "bytes": pair, "rays": pair, "difference": 0.0,
           "identical": True}  # fmt: skip
    return {"rows": [row], "passed": True, "runs": 1, "size": 8}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run on five tiny meshes and an open one by path; what takes long is replaced by records of the same form."""
    folder = tmp_path_factory.mktemp("benchmark")
    spheres = meshes.displaced_spheres(500)
    save_ply(Mesh(spheres.vertices, spheres.faces[1:]), folder / "own.ply")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(timing, "REST", 0.0)
        patch.setattr(meshes, "QUICK", (100, 400, 1_000))
        patch.setattr(meshes, "QUICK_FORMS", (("scan", 600), ("city", 300)))
        patch.setattr(calls, "_CALLS", 2)
        patch.setattr(command, "QUICK_RAYS", 300)
        patch.setattr(drop_in, "QUICK_RAYS", (1, 40))
        patch.setattr(studies, "QUICK_SIZE", 400)
        patch.setattr(frames, "measure", _frames)
        patch.setattr(processes, "measure", _processes)
        patch.setattr(first_answers, "measure", _first_answers)
        patch.setattr(ablation, "run", _ablation)
        patch.setattr(study, "run", lambda *_: None)
        row = {"systems": {OURS: {"rest": 100, "peak": 200, "own": 90}}}
        patch.setattr(memory, "measure", lambda mesh, *_: row | {"mesh": mesh.name, "faces": len(mesh.faces)})
        patch.setitem(systems._PEERS, "nobody", ("nobody", "pip install nobody"))
        arguments = ["--quick", "--mesh", str(folder / "own.ply"), "--output", str(folder)]
        assert command.main(arguments) == 0
    return folder


def test_the_record_says_what_was_measured_and_with_what(folder: Path) -> None:
    found = record.read(folder / "benchmark.json")
    assert found["command"].startswith("python -m validation.benchmark --quick --mesh") and found["quick"]
    assert found["missing"]["nobody"] == "pip install nobody"
    assert found["environment"]["packages"]["numba"] and found["environment"]["threads"] >= 1
    assert len(found["series"]) == 3 and "own" not in found["series"]
    spheres = dict.fromkeys(found["series"], "spheres")
    assert found["kinds"] == spheres | {"scan_600": "scan", "city_300": "city", "own": "file"}
    asked = [(row["mesh"], row["query"]) for row in found["queries"]]
    # Six families of rays for two queries, one for two more; one of points for one query, two for two more. Other kinds
    # are asked by each family once, and by two of them twice.
    assert len(asked) == 4 * (6 * 2 + 2 + 1 + 2 * 2) - 3 + 2 * (6 + 2) and found["open_edges"] == {"own": 3}
    assert ("own", "nearest") in asked and not {("own", "contains"), ("own", "signed")} & set(asked)
    for row in found["queries"]:
        ours = row["contenders"][OURS]
        assert row["agree"] and len(ours["seconds"]) == 5 and min(ours["seconds"]) <= ours["median"]
        assert ours["ns"] == pytest.approx(1e3 / ours["mrays"])
        assert (row["hit_share"] == 0.0) == (row["family"] == "misses")
        brief = found["kinds"][row["mesh"]] in ("scan", "city")
        assert not brief or not {"trimesh", "mitsuba_scalar"} & set(row["contenders"])
    assert [row["rays"] for row in found["calls"]] == [1, 10, 100]
    assert len(found["limits"]["rows"]) == 6 * 6 and min(found["limits"]["rates"]["bandwidth"]) > 0
    for row in found["limits"]["rows"]:
        for counts in (row["ours"], row["embree"]):
            assert counts["triangles"] <= 4 * counts["blocks"]
            assert sum(counts["from"]) == pytest.approx(counts["lines"]) and counts["lines"] > 0
    # The mesh by path is none of the series, so no fit knows of it: a fit needs all three others.
    assert {f["contender"] for f in found["fits"]} >= {OURS, OURS_ONE, "embree", "trimesh", "mitsuba_scalar"}
    assert [row["mesh"].split(",")[0] for row in found["studies"]] == ["city", "terrain"]
    assert len(found["drop_in"]) == 5 * 2 and all(min(row["ratios"].values()) > 0 for row in found["drop_in"])
    for row in found["builds"]:
        assert {"ours_midpoint", "ours_sah", "embree"} <= set(row["contenders"])
        assert {"embree"} <= set(row["ratios_refit"]) and not [n for n in row["ratios_refit"] if n.startswith(OURS)]
        seconds = {name: c["seconds"] for name, c in row["contenders"].items()}
        for name, against in row["ratios_refit"].items():
            assert against == timing.ratio(seconds[name], seconds["ours_refit"])


def test_the_page_is_drawn_from_the_stored_record_alone(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stored = json.loads((folder / "benchmark.json").read_text(encoding="utf-8"))
    stored["queries"][0]["ratios"]["embree"] = 12.34
    stored["queries"][0]["ratios_one_thread"]["embree"] = 0.9876
    stored["environment"]["processor"] = "A <made-up> processor"
    stored["studies"][0] |= {"seconds": 2.0, "peers": {"embree": {"whole": 15.5, "bare": 9.0, "differing": 7}}}
    stored["studies"][1] |= {"peers": {"embree": {"whole": 1.0, "bare": 0.5, "differing": 0}}}
    record.write(stored, folder / "benchmark.json")
    assert command.main(["--page-only", "--output", str(folder)]) == 0
    text = (folder / "benchmark.html").read_text(encoding="utf-8")
    assert (
        "7.75" in text
        and "4.50" in text
        and "12.34" in text
        and ">0.98<" in text
        and "A &lt;made-up&gt; processor" in text
        and "pip install nobody" in text
    )
    # Memory is not drawn for meshes as small as these.
    assert text.count("<svg") == 12 + 7 + 1
    assert "own has 3 open edges" in text and "2<sup>−20</sup>" in text
    first, second = text.split("<h2>All hits and points</h2>")
    assert "libigl<br>" in second and "libigl<br>" not in first
    for said in ("all hits", "number of hits", "inside", "closest point", "signed distance"):
        assert f'<td class="name">{said}</td>' in second and f'<td class="name">{said}</td>' not in first
    assert "0.9987654" in text and "First answers" in text and "--level x86-64-v3" in text
    assert "12.34" in capsys.readouterr().out
    for outside in ("http://", "https://", "<script", "<link"):
        assert outside not in text.replace("http://www.w3.org", "")


def test_the_limits_say_which_bound_holds_for_each_mesh_and_family(folder: Path) -> None:
    stored = record.read(folder / "benchmark.json")
    rates = stored["limits"]["rates"]
    shown = page.html(stored).split("<h2>Limits</h2>")[1].split("<h2>The drop-in")[0]
    assert shown.count('<td class="name">compute</td>') == len(stored["limits"]["rows"])
    rates["overlapped"] = [1e6] * len(rates["overlapped"])
    shown = page.html(stored).split("<h2>Limits</h2>")[1].split("<h2>The drop-in")[0]
    assert shown.count('<td class="name">latency</td>') == sum(
        any(r["ours"]["waits"][1:]) for r in stored["limits"]["rows"]
    )


def test_the_heat_map_is_right_after_the_targets_with_a_cell_for_each_ratio(folder: Path) -> None:
    stored = record.read(folder / "benchmark.json")
    stored["queries"][1]["agree"] = False
    text = page.html(stored)
    titles = re.findall(r"<h2>(.*?)</h2>", text)
    assert titles[:3] == ["Targets", "Heat map", "Rays"] and titles[-1] == "What was tried and kept"
    shown = text.split("<h2>Heat map</h2>")[1].split("<h2>Rays</h2>")[0]
    rows = [r for r in stored["queries"] if r["query"] in ("closest", "any")]
    for peer in heat.peers(stored):
        of = [r for r in rows if heat.first_ratio(r, peer) is not None]
        assert len(re.findall(f'title="[^"]* rays, (?:closest|any) hit, against {peer}: ', shown)) == len(of) > 0
    disagreeing = re.findall(r'<td class="[a-z]+\d odd[^>]*>[\d.]+≠</td>', shown)
    assert len(disagreeing) == len(heat.peers(stored))
    assert all(name in shown for name, _ in heat.legend()) and "prefers-color-scheme: dark" in text
    for what in ("Build, refit and memory", "build", "refit", "memory at rest", "Calls of few rays", "below 1"):
        assert what in shown
    assert "efficiency of 2 threads" in text.split("<h2>Rays</h2>")[1]


def test_the_page_has_the_history_of_ideas_and_a_faulty_one_stops_the_run(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = [line[2:] for line in history.FILE.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
    form = [line for line in shown if "=" in line or "[[" in line]
    own = tmp_path / "history.toml"
    own.write_text("\n".join(form).replace("One sentence", "EXAMPLE sentence"), encoding="utf-8")
    monkeypatch.setattr(history, "FILE", own)
    assert command.main(["--page-only", "--output", str(folder)]) == 0
    assert "EXAMPLE sentence" in (folder / "benchmark.html").read_text(encoding="utf-8")
    own.write_text("surprise = 1\n", encoding="utf-8")
    monkeypatch.setattr(command, "measure", lambda *_: pytest.fail("measured"))
    assert command.main(["--quick", "--output", str(tmp_path)]) == 2
    assert "history.toml: surprise: Extra inputs" in capsys.readouterr().err


def test_the_terminal_shows_ratios_and_what_is_missing(folder: Path) -> None:
    lines = page.ratios(record.read(folder / "benchmark.json")).splitlines()
    assert any(line.startswith("spheres_") and "bounce" in line for line in lines)
    assert any("target import renderer: 0.25 s (below 0.5) met" in line for line in lines)
    assert any("target first hit: 4.00 CPU s (below 8) met" in line for line in lines)
    assert any("target first picture: - not measured" in line for line in lines)
    assert any("target a call of 10 rays, against embree: " in line for line in lines)
    assert [line for line in lines if line.startswith("heat map, embree, one thread each: geometric mean ")]
    assert any(line.startswith("calls of 1, peer's time over ours: embree ") for line in lines)
    assert "own: 3 open edges, so nothing is inside: not asked for contains and signed" in lines
    heads = [line.split() for line in lines if line.startswith("mesh ")]
    assert heads[0][-2:] == ["embree", "1:1"] and "1:1" not in heads[1]
    assert "mitsuba_scalar" in heads[0] and "libigl" not in heads[0]
    assert "mitsuba_scalar" not in heads[1] and "libigl" in heads[1]
    assert any(line.split()[1:3] == ["near", "signed"] for line in lines)
    assert "not measured: nobody; pip install nobody" in lines


def test_a_disagreement_is_shown(folder: Path) -> None:
    stored = record.read(folder / "benchmark.json")
    assert "contenders disagree" not in page.ratios(stored)
    for row in (3, next(i for i, r in enumerate(stored["queries"]) if r["query"] == "contains")):
        stored["queries"][row]["agree"] = False
        assert "contenders disagree" in page.ratios(stored)
        stored["queries"][row]["agree"] = True


def test_a_record_goes_through_json_unchanged(folder: Path, tmp_path: Path) -> None:
    stored = record.read(folder / "benchmark.json")
    record.write(stored, tmp_path / "again.json")
    assert record.read(tmp_path / "again.json") == stored


def test_other_records_are_refused(folder: Path, tmp_path: Path) -> None:
    stored = record.read(folder / "benchmark.json")
    path = tmp_path / "benchmark.json"
    path.write_text(json.dumps(stored | {"schema": 99}))
    with pytest.raises(ValueError, match="schema 7, got 99"):
        record.read(path)
    path.write_text(json.dumps({k: v for k, v in stored.items() if k != "fits"}))
    with pytest.raises(ValueError, match="expected the keys"):
        record.read(path)
    with pytest.raises(ValueError, match="JSON compliant"):
        record.write(stored | {"seconds": float("nan")}, path)


def test_a_wrong_path_is_one_line_and_nothing_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--mesh", "nowhere.ply", "--output", str(tmp_path)]) == 2
    assert "--mesh: expected a file, got 'nowhere.ply'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    assert command.main(["--page-only", "--output", str(tmp_path)]) == 2


def test_ctrl_c_stops_and_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "_measure_mesh", interrupted)
    assert command.main(["--quick", "--output", str(tmp_path)]) == 130
    assert list(tmp_path.iterdir()) == []


def test_memory_grows_with_the_mesh_and_not_with_the_library() -> None:
    if not Path("/proc/self/clear_refs").exists():
        pytest.skip("needs Linux's /proc/self/clear_refs")
    mesh = meshes.displaced_spheres(400_000)
    chosen = [system for system in systems.available()[0] if system.name in (OURS, "embree")]
    row = memory.measure(mesh, chosen, lambda _: None)
    assert row is not None and set(row["systems"]) == {OURS, "embree"}
    for found in row["systems"].values():
        # A face and its share of the tree take 30 to 300 bytes; a library would be tens of megabytes, 100 times that.
        assert 30 < found["rest"] / len(mesh.faces) < 300
        assert found["peak"] >= found["rest"]
    ours = row["systems"][OURS]
    # Each of the tree's three arrays may end in a huge page of 2 MB that it does not fill.
    assert ours["rest"] == pytest.approx(ours["own"], abs=3 * 2**21)


def commit_told_in(repository: Path, copy: Path, edit: bool = False) -> tuple[str, str]:
    """What a copy of the project in ``repository`` tells as its commit, and the commit of the repository."""
    code = copy / "validation" / "benchmark" / "page" / "record.py"
    code.parent.mkdir(parents=True)
    shutil.copy(record.__file__, code)
    for words in (["init", "-q"], ["add", "."], ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "x"]):
        subprocess.run(["git", *words], cwd=repository, check=True)
    if edit:
        (copy / "new").touch()
    told = "import runpy, sys; print(runpy.run_path(sys.argv[1])['commit']())"
    words, root = [sys.executable, "-B", "-c", told, str(code)], Path(__file__).parents[3]
    said = subprocess.run(words, cwd=root, capture_output=True, text=True, check=True).stdout.strip()
    head = ["git", "rev-parse", "HEAD"]
    return said, subprocess.run(head, cwd=repository, capture_output=True, text=True, check=True).stdout.strip()


def test_a_copy_in_the_repository_of_something_else_has_no_commit(tmp_path: Path) -> None:
    assert commit_told_in(tmp_path, tmp_path / "else" / "copy")[0] == "None"


def test_a_checkout_tells_its_commit(tmp_path: Path) -> None:
    told, head = commit_told_in(tmp_path, tmp_path)
    assert told == head


def test_a_checkout_whose_files_differ_tells_it(tmp_path: Path) -> None:
    told, head = commit_told_in(tmp_path, tmp_path, edit=True)
    assert told == f"{head}+"


def test_a_damaged_record_is_named(tmp_path: Path) -> None:
    (tmp_path / "benchmark.json").write_text("{")
    with pytest.raises(ValueError, match=r"benchmark\.json: expected JSON"):
        record.read(tmp_path / "benchmark.json")


@pytest.mark.parametrize("output", ["benchmark.json", "benchmark.html"])
def test_a_folder_that_takes_no_file_is_told_before_anything_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], output: str
) -> None:
    (tmp_path / output).mkdir()
    monkeypatch.setattr("validation.benchmark.__main__.measure", lambda *_: pytest.fail("measured"))
    assert command.main(["--quick", "--output", str(tmp_path)]) == 2
    assert output in capsys.readouterr().err


def test_a_fault_in_the_history_is_told_before_anything_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def read() -> None:
        raise ValueError("history.toml: a fault")

    monkeypatch.setattr("validation.benchmark.page.history.read", read)
    monkeypatch.setattr("validation.benchmark.__main__.measure", lambda *_: pytest.fail("measured"))
    assert command.main(["--quick", "--output", str(tmp_path)]) == 2
    assert "history.toml: a fault" in capsys.readouterr().err
