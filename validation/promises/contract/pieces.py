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
_SENTENCE = re.compile(r"(?<=[.:;])\s+(?=[A-Z(`\"])")


class Piece(NamedTuple):
    """A sentence, the definition of a name or a field: where it stands, such as "Octree.save", and what it says."""

    where: str
    says: str


def contract() -> list[Piece]:
    """Every piece, in the order of names; what a class inherits stands where it is written, once."""
    return list(dict.fromkeys([*_documented(), *_helped()]))


def _documented() -> Iterator[Piece]:
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
    """The help of each option, from the parser: how it is laid out differs between versions of Python."""
    whole = cli.make_parser()
    commands = next(action for action in whole._actions if isinstance(action, argparse._SubParsersAction))
    for name, command in commands.choices.items():
        where = f"{whole.prog} {name}"
        yield from pieces(where, command.description or "")
        for option in command._actions:
            if option.help and option.dest != "help":
                flag = (option.option_strings or [option.dest])[-1]
                yield Piece(f"{where} {flag}", " ".join(option.help.split()))


def pieces(where: str, text: str) -> Iterator[Piece]:
    """The pieces of a text, without its examples and headings."""
    for paragraph in _paragraphs(text):
        defined = _DEFINITION.match(paragraph)
        said = " ".join(paragraph.split())
        for part in [said] if defined else _SENTENCE.split(said):
            if len(part.split()) > 1:
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
