"""A report's folder: what others put there stays, and what cannot be a report's folder is refused before the run."""

from pathlib import Path

import pytest
from cases import cases

from validation import suite


def pictures(folder: Path, *names: str) -> Path:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(name)
    return folder


def files(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("through_link", [False, True])
def test_only_what_a_run_wrote_is_replaced(tmp_path: Path, through_link: bool) -> None:
    kept = tmp_path / "report" / "pictures"
    kept.parent.mkdir()
    if through_link:
        (tmp_path / "elsewhere").mkdir()
        kept.symlink_to(tmp_path / "elsewhere")
    pictures(kept, "mine.ply", "failed/mine.txt")
    suite._replace_pictures(pictures(tmp_path / "first", "a.png", "failed/b.png"), kept)
    assert files(kept) == [".written", "a.png", "failed/b.png", "failed/mine.txt", "mine.ply"]
    suite._replace_pictures(pictures(tmp_path / "second", "a.png", "c.png"), kept)
    assert files(kept) == [".written", "a.png", "c.png", "failed/mine.txt", "mine.ply"]
    assert kept.is_symlink() == through_link


def test_a_list_that_leads_elsewhere_removes_nothing(tmp_path: Path) -> None:
    outside = pictures(tmp_path, "outside.txt") / "outside.txt"
    kept = pictures(tmp_path / "pictures", "a.png")
    (kept / ".written").write_text(f"../outside.txt\n{outside}\na.png\n")
    suite._replace_pictures(pictures(tmp_path / "new", "b.png"), kept)
    assert outside.exists()
    assert files(kept) == [".written", "b.png"]


@cases("defects", [False, True])
@cases(
    ("there", "message"),
    [
        ("report/index.html", "expected a new folder or one with a report, got .* with another index.html"),
        ("report/pictures", "with a file called pictures"),
        ("report", "expected a folder, got the file"),
    ],
)
def test_other_folders_are_refused_before_anything_runs(
    tmp_path: Path, there: str, message: str, defects: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object) -> None:
        raise AssertionError("began")

    monkeypatch.setattr(suite, "steps", never)
    pictures(tmp_path, there)
    request = suite.Request("command", True, ("hits",), tmp_path / "report")
    with pytest.raises(ValueError, match=message):
        (suite.run_defects if defects else suite.run)(request)
    assert files(tmp_path) == [there]
