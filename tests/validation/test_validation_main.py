"""The command ``python -m validation``: exit codes, what it writes and leaves alone, and what it prints."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from cases import cases

from validation import __main__ as command
from validation import suite
from validation.defects import run as defects
from validation.defects.answers import Answer
from validation.defects.list import DEFECTS
from validation.defects.record import gates, record
from validation.gates import Gate
from validation.job import Job
from validation.report import chapters, schema
from validation.report import page as report
from validation.sections import NAMES, SECTIONS

pytestmark = pytest.mark.judges(
    "octree-validate --defects",
    "octree-validate --gate",
    "octree-validate --mesh",
    "octree-validate --only",
    "octree-validate --output",
    "octree-validate --quick",
    "octree-validate --random",
    "octree-validate --scene",
    "octree-validate --write-baseline",
    "octree-validate meshes",
)


SCENE = Path(__file__).parents[2] / "scenes" / "stairs.toml"
MESH = SCENE.parent / "models" / "stairs.ply"


class Fake:
    """A section that answers at once with gates of zero errors; a test may change everything."""

    def __init__(self, name: str) -> None:
        self.gates = [Gate(name, "subject", "errors", 0.0, "at most", 0.0, "a reason")]
        self.record: dict[str, Any] = {"costs": {"a reference": 1.5}, "ours_sha256": "ab"}
        self.jobs: list[Job] = []
        self.before: Callable[[Job], None] = lambda job: None

    def steps(self, job: Job) -> int:
        return 2

    def run(self, job: Job) -> tuple[dict[str, Any], list[Gate]]:
        self.jobs.append(job)
        self.before(job)
        job.step("one")
        job.step("two")
        return dict(self.record), self.gates


@pytest.fixture
def sections(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Fake]:
    """Sections that answer at once; on the page each is one line."""
    templates = tmp_path_factory.mktemp("templates")
    (templates / "plain.html").write_text("<p>a section</p>")
    monkeypatch.setattr(report, "_TEMPLATES", [report._TEMPLATES, templates])
    plain = {name: partial._replace(template="plain.html") for name, partial in chapters.PARTIALS.items()}
    monkeypatch.setattr(chapters, "PARTIALS", plain)
    fakes = {name: Fake(name) for name in plain}
    modules = {section.module: section.name for section in SECTIONS}
    monkeypatch.setattr(suite, "import_module", lambda name: fakes[modules[name]])
    monkeypatch.setattr(suite.judges, "check_names", lambda gates, left_out: ({"left_out": "no section is real"}, []))
    return fakes


def metrics(folder: Path) -> dict[str, Any]:
    return schema.read(folder / "metrics.json")


def test_all_gates_hold(tmp_path: Path, sections: dict[str, Fake], capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--output", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    # Two steps and one gate a section.
    count = len(NAMES)
    assert [line[:7] for line in lines[:-1]] == [f"[{k:2}/{2 * count}]" for k in range(1, 2 * count + 1)]
    assert lines[-1].startswith(f"validation: PASS, {count} of {count} gates in ")
    assert metrics(tmp_path)["verdict"] == {"passed": True, "gates": count, "failed": 0}
    assert ET.parse(tmp_path / "junit.xml").getroot().get("failures") == "0"
    assert f"{count} of {count} gates hold" in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_a_failing_gate_is_exit_code_1_and_named_everywhere(
    tmp_path: Path, sections: dict[str, Fake], capsys: pytest.CaptureFixture[str]
) -> None:
    sections["hits"].gates.append(Gate("hits", "torus", "leaks", 3.0, "at most", 0.0, "a closed mesh has no holes"))
    assert command.main(["--only", "hits", "--output", str(tmp_path)]) == 1
    out = capsys.readouterr().out
    assert "FAILED hits: torus: leaks is 3, expected at most 0" in out
    assert "validation: FAIL, 1 of 2 gates" in out
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "FAIL" in page and page.index("torus: leaks") < page.index('id="hits"')
    assert "a closed mesh has no holes" in (tmp_path / "junit.xml").read_text(encoding="utf-8")


def test_a_section_that_takes_a_step_too_many_is_named(tmp_path: Path, sections: dict[str, Fake]) -> None:
    sections["images"].before = lambda job: job.step("a third")
    with pytest.raises(RuntimeError, match="images: expected 2 steps, got 3"):
        command.main(["--output", str(tmp_path)])
    # A user's report does not end for its bar.
    assert command.main(["--scene", str(SCENE), "--output", str(tmp_path)]) == 0


def test_no_gate_is_no_success(tmp_path: Path, sections: dict[str, Fake], capsys: pytest.CaptureFixture[str]) -> None:
    sections["hits"].gates.clear()
    assert command.main(["--only", "hits", "--output", str(tmp_path)]) == 1
    assert "FAIL, nothing judged" in capsys.readouterr().out


class TestUserFiles:
    def test_only_the_sections_that_judge_them_run(self, tmp_path: Path, sections: dict[str, Fake]) -> None:
        assert command.main(["--scene", str(SCENE), "--output", str(tmp_path)]) == 0
        assert sections["images"].jobs[0].scenes == (SCENE,) and not sections["images"].jobs[0].own
        assert [name for name, fake in sections.items() if fake.jobs] == ["images"]
        left_out = metrics(tmp_path)["left_out"]
        assert left_out["hits"] == "no file was given by --mesh"
        assert left_out.keys() == set(NAMES) - {"images"}
        page = (tmp_path / "index.html").read_text(encoding="utf-8")
        assert all(reason in page for reason in left_out.values())

    def test_scene_and_mesh(self, tmp_path: Path, sections: dict[str, Fake]) -> None:
        assert command.main(["--scene", str(SCENE), "--mesh", str(MESH), str(MESH), "--output", str(tmp_path)]) == 0
        assert sections["hits"].jobs[0].meshes == (MESH, MESH)
        assert metrics(tmp_path)["left_out"].keys() == set(NAMES) - {"images", "hits"}

    def test_the_seed_of_random_scenes_is_theirs_alone(
        self, tmp_path: Path, sections: dict[str, Fake], capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert command.main(["--only", "random", "--random", "7", "--output", str(tmp_path)]) == 0
        assert sections["random"].jobs[0].seed == 7
        with pytest.raises(SystemExit):
            command.main(["--scene", str(SCENE), "--random", "7", "--output", str(tmp_path)])
        assert "--random: the section random does not run" in capsys.readouterr().err

    @pytest.mark.parametrize(
        ("option", "text"), [("--scene", "camera = 3"), ("--mesh", "ply?"), ("--gate", "[hits]\nmagic = 1")]
    )
    def test_a_bad_file_is_one_line_and_exit_code_2_before_anything_runs(
        self, option: str, text: str, tmp_path: Path, sections: dict[str, Fake], capsys: pytest.CaptureFixture[str]
    ) -> None:
        bad = tmp_path / ("bad.ply" if option == "--mesh" else "bad.toml")
        bad.write_text(text)
        assert command.main([option, str(bad), "--output", str(tmp_path / "out")]) == 2
        error = capsys.readouterr().err
        assert error.startswith("validation: ") and str(bad) in error and error.count("\n") == 1
        assert not any(fake.jobs for fake in sections.values())
        assert not (tmp_path / "out").exists()

    def test_moved_thresholds_reach_the_sections_and_the_page(self, tmp_path: Path, sections: dict[str, Fake]) -> None:
        gate = tmp_path / "gate.toml"
        gate.write_text("[pictures.own]\nssim = 0.5\n")
        assert command.main(["--only", "hits", "--gate", str(gate), "--output", str(tmp_path)]) == 0
        assert sections["hits"].jobs[0].thresholds.pictures.own.ssim == 0.5
        assert "pictures.own.ssim" in (tmp_path / "index.html").read_text(encoding="utf-8")


@cases(
    ("arguments", "words"),
    [
        (["--only", "hits,magic"], "'magic'"),
        (["--only", "hits", "--scene", "a.toml"], "no section is left to run"),
        (["--defects", "--only", "hits"], "got --only too"),
        (["--defects", "--mesh", "a.ply"], "got --mesh too"),
        (["--defects", "--write-baseline"], "--defects goes with --output and --quick alone, got --write-baseline too"),
        (["--write-baseline", "--gate", "a.toml"], "got --gate too"),
        (["--record", "a.json"], "--record: expected one mesh after the file, got 0"),
        (["--compare", "a.json", "a.ply", "b.ply"], "--compare: expected at most one mesh after the file, got 2"),
        (["--compare", "a.json", "--quick"], "got --quick too"),
        (["--record", "a.json", "--compare", "a.json", "a.ply"], "got --compare too"),
        (["--tolerance", "0"], "--tolerance goes with --compare, got none"),
        (["--compare", "a.json", "--tolerance", "-1"], "expected a number from 0, got '-1'"),
    ],
)
def test_arguments_at_odds_are_refused(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        command.main(arguments)
    assert stopped.value.code == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("raised", "code"),
    [(ModuleNotFoundError("No module named 'embreex'"), 2), (ValueError("mesh: no"), 2), (KeyboardInterrupt(), 130)],
)
def test_a_run_that_ends_early_leaves_the_old_report_untouched(
    raised: BaseException, code: int, tmp_path: Path, sections: dict[str, Fake]
) -> None:
    def break_off(job: Job) -> None:
        (job.folder / "picture.png").write_bytes(b"new")
        if code != 0:
            raise raised

    sections["hits"].before = lambda job: (job.folder / "picture.png").write_bytes(b"old") and None
    assert command.main(["--only", "hits", "--output", str(tmp_path)]) == 0
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert tmp_path / "pictures" / "picture.png" in before
    sections["hits"].before = break_off
    assert command.main(["--only", "hits", "--output", str(tmp_path)]) == code
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_the_baseline_is_written_read_and_named_in_the_summary(
    tmp_path: Path, sections: dict[str, Fake], capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--output", str(tmp_path)]
    assert command.main([*arguments, "--quick"]) == 0
    assert command.main([*arguments, "--write-baseline"]) == 2
    assert "got a quick run" in capsys.readouterr().err
    assert command.main(arguments) == 0
    assert command.main([*arguments, "--write-baseline"]) == 0
    sections["hits"].gates = [Gate("hits", "subject", "errors", 2.0, "at most", 0.0, "a reason")]
    assert command.main(arguments) == 1
    assert "better 0, worse 1 than baseline" in capsys.readouterr().out
    assert "2 (fails) now" in (tmp_path / "index.html").read_text(encoding="utf-8")


class TestDefects:
    @pytest.fixture
    def answers(self, monkeypatch: pytest.MonkeyPatch) -> list[Answer]:
        """What each process would have said; the first is the control."""
        answers: list[Answer] = []

        def run(*_: object, known: object) -> tuple[dict[str, Any], list[Gate]]:
            return record(DEFECTS[:1], answers[0], answers[1:]), gates(DEFECTS[:1], answers[0], answers[1:])

        monkeypatch.setattr(defects, "run", run)
        return answers

    def test_the_record_is_stored_and_every_report_shows_it(
        self, tmp_path: Path, sections: dict[str, Fake], answers: list[Answer], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        output = ["--output", str(tmp_path)]
        assert command.main(["--only", "hits", *output]) == 0
        assert "no run is stored" in (tmp_path / "index.html").read_text(encoding="utf-8")
        names = ("hits: a: b",)
        answers += [Answer(names, red, None, 1.0) for red in ((), names)]
        assert command.main(["--defects", *output]) == 0
        assert "The sources are the same now" in (tmp_path / "index.html").read_text(encoding="utf-8")
        assert metrics(tmp_path)["facts"][0]["value"] == 1
        monkeypatch.setattr(suite.environment, "sources_sha256", lambda: "others")
        assert command.main(["--only", "hits", *output]) == 0
        assert "The sources have changed since" in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_reports_need_neither_the_extra_dev_nor_the_viewer() -> None:
    """Reading a record had imported coverage and pytest, at the end of every run."""
    program = """
import sys

class Without:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"pytest", "_pytest", "hypothesis", "uvicorn", "starlette"}:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Without())
from pathlib import Path
from validation import suite
from validation.promises import judges
assert suite._outcome({}, [], Path("nowhere"))["gates"] == [] and judges.check_names([], ())[0]["unknown"] == []
"""
    subprocess.run([sys.executable, "-c", program], cwd=SCENE.parents[1], check=True)


def test_a_folder_that_cannot_be_made_and_a_run_that_is_missing_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    for more in (["--only", "hits"], ["--defects"]):
        assert command.main([*more, "--output", str(tmp_path / "file" / "below")]) == 2
        assert "--output: expected a folder that can be made, got " in capsys.readouterr().err
    assert command.main(["--write-baseline", "--output", str(tmp_path)]) == 2
    assert "--write-baseline: expected " in capsys.readouterr().err
