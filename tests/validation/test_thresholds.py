"""Thresholds of a user's file: what moves, what is refused, and that the refusal says where."""

import re
from pathlib import Path

import pytest
from cases import cases

from validation.thresholds import Thresholds, _flat, load_thresholds


def write(folder: Path, text: str) -> Path:
    path = folder / "gate.toml"
    path.write_text(text)
    return path


def test_a_file_moves_what_it_names_and_nothing_else(tmp_path: Path) -> None:
    loaded = load_thresholds(write(tmp_path, "[pictures.own]\nssim = 0.9\nmax_error = 1\n[hits]\nwrong = 2\n"))
    own = Thresholds()
    assert (loaded.pictures.own.ssim, loaded.pictures.own.max_error, loaded.hits.wrong) == (0.9, 1.0, 2)
    assert loaded.moved() == {
        "pictures.own.ssim": (own.pictures.own.ssim, 0.9),
        "pictures.own.max_error": (own.pictures.own.max_error, 1.0),
        "hits.wrong": (0, 2),
    }


def test_the_values_are_those_that_the_readme_of_reports_gives() -> None:
    """Nobody moves a threshold without saying so there."""
    said: dict[str, float | None] = {}
    text = (Path(__file__).parents[2] / "reports" / "README.md").read_text(encoding="utf-8")
    columns = re.findall(r"`(\w+)`", next(line for line in text.splitlines() if line.startswith("| key | `ssim`")))
    for line in text.splitlines():
        if row := re.match(r"\| `(pictures\.\w+)`[^|]*\|(.*)\|$", line):
            cells = [cell.strip() for cell in row[2].split("|")]
            said |= {f"{row[1]}.{key}": float(cell) if cell else None for key, cell in zip(columns, cells, strict=True)}
    said |= {key: float(value) for key, value in re.findall(r"`((?:pictures|aovs|hits)\.\w+)` ([\d.e-]*\d)", text)}
    assert said == _flat(Thresholds().model_dump())


def test_an_empty_file_moves_nothing(tmp_path: Path) -> None:
    assert load_thresholds(write(tmp_path, "")) == Thresholds()
    assert load_thresholds(write(tmp_path, "")).moved() == {}


@cases(
    ("text", "where", "why"),
    [
        ("magic = 1", "magic", "unknown key"),
        ("[magic]", "magic", "unknown key"),
        ("[pictures.own]\nssin = 0.9", "pictures.own.ssin", "unknown key"),
        ("pictures = 3", "pictures", "got 3"),
        ("[pictures.own.ssim]\na = 1", "pictures.own.ssim", "number"),
        ("[pictures.own]\nssim = '0.9'", "pictures.own.ssim", "number"),
        ("[pictures.own]\nssim = true", "pictures.own.ssim", "number"),
        ("[pictures.own]\nssim = 1.1", "pictures.own.ssim", "less than or equal to 1"),
        ("[pictures.own]\nssim = nan", "pictures.own.ssim", "got nan"),
        ("[aovs]\ndepth = inf", "aovs.depth", "finite"),
        ("[aovs]\ndepth = -1e-5", "aovs.depth", "greater than or equal to 0"),
        ("[hits]\nwrong = 0.5", "hits.wrong", "integer"),
        ("[hits]\nwrong = true", "hits.wrong", "integer"),
        ("[aovs]\ndepth = '1'", "aovs.depth", "number"),
        ("[hits]\nwrong = -1", "hits.wrong", "greater than or equal to 0"),
        ("[hits\nwrong = 1", "TOML", "syntax error"),
    ],
)
def test_what_is_no_threshold_is_refused_with_its_place(text: str, where: str, why: str, tmp_path: Path) -> None:
    path = write(tmp_path, text)
    with pytest.raises(ValueError) as refused:
        load_thresholds(path)
    message = str(refused.value)
    assert message.startswith(f"{path}: ") and where in message and why in message


def test_no_utf8_is_refused_and_a_missing_file_is_an_os_error(tmp_path: Path) -> None:
    (tmp_path / "latin.toml").write_bytes(b"# caf\xe9")
    with pytest.raises(ValueError, match=r"latin\.toml: expected TOML"):
        load_thresholds(tmp_path / "latin.toml")
    with pytest.raises(FileNotFoundError, match=r"nowhere\.toml"):
        load_thresholds(tmp_path / "nowhere.toml")
    with pytest.raises(OSError):
        load_thresholds(tmp_path)
