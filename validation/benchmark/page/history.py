"""The ideas that were tried, kept or dropped, with their measured ratios: ``validation/benchmark/history.toml``.

The file begins with a comment that tells its form; ``read`` checks it.
"""

import tomllib
from datetime import date
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

FILE = Path(__file__).resolve().parents[1] / "history.toml"

_Text = Annotated[str, Field(min_length=1)]
_Commit = Annotated[str, Field(pattern=r"^[0-9a-f]{7,40}$")]
_FORM = ConfigDict(extra="forbid", frozen=True, strict=True)


class Measured(BaseModel):
    """What was measured and ``ratio``: the time before over the time after, above 1 where the idea made it faster."""

    model_config = _FORM

    mesh: _Text
    family: _Text
    threads: Annotated[int, Field(ge=1)]
    ratio: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class Idea(BaseModel):
    """One idea, the commits without and with it, and what it brought; a dropped one need not have a commit with it."""

    model_config = _FORM

    idea: _Text
    kept: bool
    before: _Commit
    after: _Commit | None = None
    date: date
    machine: _Text
    command: _Text
    rows: Annotated[list[Measured], Field(min_length=1)]

    @model_validator(mode="after")
    def _kept_has_a_commit(self) -> "Idea":
        if self.kept and self.after is None:
            raise ValueError("after: expected the commit with the idea, because it was kept, got none")
        return self


class _File(BaseModel):
    model_config = _FORM

    ideas: list[Idea] = []


def read(path: Path | None = None) -> list[Idea]:
    """The ideas of a file, in its order. Raises ``ValueError`` with one line that names the place of the fault."""
    path = path or FILE
    try:
        return _File.model_validate(tomllib.loads(path.read_text(encoding="utf-8"))).ideas
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path}: {error}") from None
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(key) for key in first["loc"])
        raise ValueError(f"{path}: {place}: {first['msg']}") from None
