"""The public contract, piece by piece: the docstrings of what ``renderer`` exports, the fields of its scenes, and the
help of its commands.
"""

import argparse
import inspect
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from pydantic import BaseModel

import renderer
from renderer import cli
from validation.promises.contract.fields import described

# A line that begins the definition of a name: "t_max   the last ..." or "faces : (F, 3) ...".
_DEFINITION = re.compile(r"^\s*[\w.]+(?:, [\w.]+)*(?:  +| : )(?=\S)")
# What stands before citations.
_HEADINGS = ("Source:", "Sources:")
_SENTENCE = re.compile(r"(?<=[.:;])\s+(?=[A-Z(`\"])")


class Piece(NamedTuple):
    """A sentence, the definition of a name or a field: where it stands, such as "Octree.save", and what it says."""

    where: str
    says: str


def contract() -> list[Piece]:
    """Every piece, in the order of names; what a class inherits stands where it is written, once."""
    return list(dict.fromkeys([*_documented(), *_helped()]))


def _documented() -> Iterator[Piece]:
    yield from pieces(renderer.__name__, inspect.getdoc(renderer) or "")
    for name in sorted(renderer.__all__):
        thing = getattr(renderer, name)
        if callable(thing):
            yield from pieces(name, inspect.getdoc(thing) or "")
        if inspect.isclass(thing):
            for owner, member, value in _members(thing):
                yield from pieces(f"{owner}.{member}", inspect.getdoc(value) or "")
            if issubclass(thing, BaseModel):
                yield from (Piece(where, says) for where, says in described(thing))


def _members(kind: type) -> Iterator[tuple[str, str, Any]]:
    """The class that defines it, name and value of each public member that this package wrote."""
    for base in kind.__mro__:
        if base.__module__.partition(".")[0] == renderer.__name__:
            for name, value in vars(base).items():
                documented = inspect.isroutine(value) or isinstance(value, property)
                if documented and not name.startswith("_"):
                    yield base.__name__, name, value


def _helped() -> Iterator[Piece]:
    """The texts of each command and option, from the parser: how they are laid out differs between versions of Python;
    and what each option takes.
    """
    whole = cli.make_parser()
    commands = next(action for action in whole._actions if isinstance(action, argparse._SubParsersAction))
    yield from (Piece(f"{whole.prog} {short.dest}", short.help or "") for short in commands._choices_actions)
    for where, command in [
        (whole.prog, whole),
        *((f"{whole.prog} {name}", of) for name, of in commands.choices.items()),
    ]:
        yield from (piece for text in (command.description, command.epilog) for piece in pieces(where, text or ""))
        for option in command._actions:
            if option is not commands and option.dest not in ("help", "version"):
                flag = f"{where} {(option.option_strings or [option.dest])[-1]}"
                if option.help:
                    yield Piece(flag, " ".join(option.help.split()))
                yield Piece(flag, _taken(option))


def _taken(option: argparse.Action) -> str:
    """What an option takes, as in "Path, required", "'a' or 'b', default 'a'" or "a flag"."""
    if option.choices:
        kind = " or ".join(map(repr, option.choices))
    else:
        kind = "a flag" if option.nargs == 0 else getattr(option.type, "__name__", "text").strip("_")
    given = f"sets {option.dest} to {option.const!r}" if option.const not in (None, True) else ""
    default = "required" if option.required else f"default {option.default}"
    return ", ".join(part for part in (kind, given, default if option.nargs != 0 else "") if part)


def pieces(where: str, text: str) -> Iterator[Piece]:
    """The pieces of a text, without its examples and headings."""
    for paragraph in _paragraphs(text):
        defined = _DEFINITION.match(paragraph)
        said = " ".join(paragraph.split())
        for part in [said] if defined else _SENTENCE.split(said):
            if part not in _HEADINGS:
                yield Piece(where, part)


def _paragraphs(text: str) -> Iterator[str]:
    """Runs of lines; the definition of a name begins one of its own."""
    lines: list[str] = []
    example = False
    for line in [*text.splitlines(), ""]:
        example = line.strip().startswith(">>>") or (example and bool(line.strip()))
        if lines and (not line.strip() or _DEFINITION.match(line) or example):
            yield "\n".join(lines)
            lines = []
        if line.strip() and not example:
            lines.append(line)
