"""Two commits beside each other: each answers with its own code, and answers of other bits are told."""

import subprocess
from pathlib import Path

import pytest

from validation.benchmark.measures import versions

# A renderer whose hits are all at one distance.
STUB = """
import numpy as np
class Hits:
    def __init__(self, n): self.t = self.u = self.v = np.full(n, {t}); self.face = np.zeros(n, np.int64)
class Octree:
    def __init__(self, vertices, faces): pass
    def closest_hit(self, origins, directions, low, high): return Hits(len(origins))
    def any_hit(self, origins, directions, low, high): return np.ones(len(origins), bool)
"""


@pytest.fixture
def commits(tmp_path: Path) -> list[str]:
    def git(*arguments: str) -> str:
        own = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
        return subprocess.run([*own, *arguments], check=True, capture_output=True, text=True).stdout.strip()

    git("init", "-q")
    found = []
    for t in (1.0, 2.0):
        (tmp_path / "renderer").mkdir(exist_ok=True)
        (tmp_path / "renderer" / "__init__.py").write_text(STUB.format(t=t))
        git("add", "renderer")
        git("commit", "-q", "-m", "a version")
        found.append(git("rev-parse", "HEAD"))
    return found


def test_each_commit_answers_with_its_own_code(commits: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(versions, "_RUNS", 1)
    before, after = commits
    for pair, same in (((before, after), False), ((after, after), True)):
        rows = list(versions.compare(pair, "1000", 64, 1, tmp_path))
        assert {"camera", "shadow", "random", "bounce"} <= {row["family"] for row in rows}
        for row in rows:
            assert row["same_bits"] == (same or row["query"] == "any") and row["ratio"] > 0.0
            assert row["query"] == ("any" if row["family"] == "shadow" else "closest")


def test_a_commit_that_is_not_there_is_named(tmp_path: Path, commits: list[str]):
    with pytest.raises(ValueError, match="commit: expected one with the package renderer, got 'f00': "):
        list(versions.compare((commits[0], "f00"), "1000", 8, 1, tmp_path))
