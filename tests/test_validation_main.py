"""The command ``python -m validation``: exit codes, what it writes, and that the page says what the metrics say."""

import json
from pathlib import Path
from typing import Any

import pytest

from validation import __main__ as command
from validation import efficiency, hits, images
from validation.gates import Gate


def good(subject: str = "subject") -> Gate:
    return Gate("hits", subject, "errors", 0.0, "at most", 0.0, "a reason")


@pytest.fixture
def sections(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Sections that answer at once; a test may change their gates."""
    found: dict[str, Any] = {"hits": [good()], "images": [good()]}
    monkeypatch.setattr(hits, "run", lambda quick, step: ({"families": [], "leaks": []}, found["hits"]))
    monkeypatch.setattr(
        images, "run", lambda quick, folder, step: ({"size": 8, "scenes": []}, found["images"])
    )
    return found


def test_all_gates_hold(tmp_path: Path, sections: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["--only", "hits", "--output", str(tmp_path)]) == 0
    assert "all 1 gates hold" in capsys.readouterr().out
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert metrics["gates"][0]["passed"] is True
    assert "All 1 gates hold" in (tmp_path / "index.html").read_text()


def test_a_failing_gate_is_exit_code_1_and_named_everywhere(
    tmp_path: Path, sections: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    sections["hits"].append(Gate("hits", "torus", "leaks", 3.0, "at most", 0.0, "a closed mesh has no holes"))
    assert command.main(["--only", "hits", "--output", str(tmp_path)]) == 1
    assert "FAILED torus: leaks is 3" in capsys.readouterr().out
    page = (tmp_path / "index.html").read_text()
    assert "1 of 2 gates fail" in page
    assert "torus: leaks is 3, expected at most 0" in page


def test_no_gate_is_no_success(tmp_path: Path, sections: dict[str, Any]) -> None:
    sections["hits"].clear()
    assert command.main(["--only", "hits", "--output", str(tmp_path)]) == 1


def test_the_page_needs_nothing_from_outside(tmp_path: Path, sections: dict[str, Any]) -> None:
    command.main(["--only", "hits", "--output", str(tmp_path)])
    page = (tmp_path / "index.html").read_text()
    assert "src=\"http" not in page and "href=\"http" not in page and "<script src" not in page


def test_unknown_sections_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        command.main(["--only", "hits,magic"])
    assert stopped.value.code == 2
    assert "'magic'" in capsys.readouterr().err


def test_a_missing_reference_is_exit_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing(*_: Any) -> None:
        raise ModuleNotFoundError("No module named 'embreex'", name="embreex")

    monkeypatch.setattr(hits, "run", missing)
    assert command.main(["--only", "hits", "--output", str(tmp_path)]) == 2
    assert "embreex" in capsys.readouterr().err
    assert not (tmp_path / "index.html").exists()


def test_ctrl_c_writes_no_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(hits, "run", interrupted)
    assert command.main(["--only", "hits", "--output", str(tmp_path)]) == 130
    assert not (tmp_path / "metrics.json").exists()


def test_efficiency_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(efficiency, "RUNS", 1)
    monkeypatch.setattr(efficiency, "_ORIGIN_ROWS", (("brute", 8, 1), ("octree", 8, 1), ("octree", 16, 2)))
    # No gates: the exit code says that nothing was proven, the page still shows the times.
    assert command.main(["--quick", "--only", "efficiency", "--output", str(tmp_path)]) == 1
    page = (tmp_path / "index.html").read_text()
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert metrics["efficiency"]["hits"]["families"][0]["mrays"]["ours"] > 0
    assert "Brute force against octree" in page
