"""``python -m renderer.trimesh_ray``: a script that was not changed gives right answers, and is otherwise as before."""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer.trimesh_ray.__main__ import main
from renderer.trimesh_ray.trees import Traced

ROOT = Path(__file__).parents[2]
SCRIPT = Path(__file__).with_name("answers.py")
DROP_IN = ("-m", "renderer.trimesh_ray")


def ran(*command: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, *command], cwd=ROOT, capture_output=True, text=True, timeout=200)


@cache
def answers(*command: str) -> dict[str, Any]:
    done = ran(*command, str(SCRIPT), "a", "--b")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_script_runs_as_it_would_by_itself() -> None:
    for command in ((), DROP_IN):
        assert (answers(*command)["name"], answers(*command)["arguments"]) == ("__main__", ["a", "--b"])


def test_a_script_finds_its_modules_has_its_own_options_and_exits_as_by_itself(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    (tmp_path / "neighbour.py").write_text("word = 'beside the script'\n")
    lines = ("import json, neighbour, sys", "import trimesh.proximity as p", "words = [sys.argv[1:], neighbour.word]",
             "print(json.dumps([sys.path, words, p.closest_point.__module__]))", "sys.exit(3)")  # fmt: skip
    script.write_text("\n".join(lines))
    options = ["x", "--proximity", "--help", "-h"]
    plain, drop_in = (ran(*command, str(script), *options) for command in ((), DROP_IN))
    assert drop_in.stdout == plain.stdout and drop_in.returncode == plain.returncode == 3
    path, words, module = json.loads(plain.stdout)
    assert path[0] == str(tmp_path.resolve())
    assert words == [options, "beside the script"] and module == "trimesh.proximity"


def faults(found: dict[str, Any]) -> dict[str, bool]:
    """By the answer, whether it is wrong: the right ones are known without any computation."""
    # The ball's corners are on the axes; between them its faces are flat.
    near = np.array(found["near"]) / [-0.5e-9, 0.5e-9]
    return {
        "leaves": found["leaves"] != [False],
        "passes": found["passes"] != [2] * 121,
        "inside": any(found["inside"]),
        "near": bool(np.abs(near - 1).max() > 0.02),
    }


def test_answers_that_were_wrong_are_right() -> None:
    """After one line, or none. trimesh 5.2 with embreex has all four wrong."""
    assert any(faults(answers()).values())
    assert faults(answers(*DROP_IN)) == {"leaves": False, "passes": False, "inside": False, "near": True}
    assert faults(answers(*DROP_IN, "--proximity")) == dict.fromkeys(("leaves", "passes", "inside", "near"), False)


def test_one_added_line_does_the_same(tmp_path: Path) -> None:
    script = tmp_path / "answers.py"
    line = "import renderer.trimesh_ray; renderer.trimesh_ray.install(proximity=True)\n"
    script.write_text(SCRIPT.read_text(encoding="utf-8").replace("import trimesh\n", f"import trimesh\n{line}"))
    done = ran(str(script), "a", "--b")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == answers(*DROP_IN, "--proximity")


def test_a_script_that_fails_fails_as_by_itself(tmp_path: Path) -> None:
    script = tmp_path / "fails.py"
    script.write_text("raise KeyError('mine')\n")
    done = ran(*DROP_IN, str(script))
    assert done.returncode == 1 and "KeyError: 'mine'" in done.stderr


def test_no_script_is_said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for given, got in ([], "nothing"), (["nowhere.py"], "nowhere.py"):
        monkeypatch.setattr(sys, "argv", ["renderer.trimesh_ray", *given])
        with pytest.raises(SystemExit, match=rf"^usage: .*\n.* error: script: expected a file, got {got}$"):
            main()
    monkeypatch.setattr(sys, "argv", ["renderer.trimesh_ray", "--help"])
    main()
    assert "Run a script" in capsys.readouterr().out


def test_a_tree_keeps_the_faces_that_it_was_built_from() -> None:
    vertices = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (np.nan, 0.0, 0.0)])
    for count in (1, 2):
        faces = np.array([(0, 1, 2), (0, 1, 3)])[:count]
        traced = Traced(vertices, faces)
        faces[0] = (2, 1, 0)
        assert traced.faces[0].tolist() == [0, 1, 2]
