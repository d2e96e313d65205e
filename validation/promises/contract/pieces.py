"""The public contract, piece by piece: the docstrings of what ``renderer``, its studies and its cluster export, the
fields of scenes, and the help of the commands.
"""

import argparse
import ast
import doctest
import inspect
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from pydantic import BaseModel

import renderer
from renderer import cluster, studies
from renderer.cli import main as cli
from validation.promises.contract.fields import described

# A line that begins the definition of a name: "t_max   the last ..." or "faces : (F, 3) ...".
_DEFINITION = re.compile(r"^\s*[\w.]+(?:, [\w.]+)*(?:  +| : )(?=\S)")
# What stands before citations.
_HEADINGS = ("Source:", "Sources:")
# What most options do: a value is kept as it is given, or a flag sets one.
_USUAL_ACTIONS = (argparse._StoreAction, argparse._StoreConstAction, argparse._SubParsersAction)
# Words of argparse itself, which may differ between versions of Python.
_VERSION_HELP = argparse._VersionAction(["--version"]).help
_SENTENCE = re.compile(r"(?<=[.:;])\s+(?=[A-Z(`\"])")


class Piece(NamedTuple):
    """A sentence, the definition of a name or a field: where it stands, such as "Octree.save", and what it says."""

    where: str
    says: str


def contract() -> list[Piece]:
    """Every piece, in the order of names; what a class inherits stands where it is written, once."""
    return list(dict.fromkeys([*_documented(), *_helped()]))


def _documented() -> Iterator[Piece]:
    """The docstrings of each public module and of what it exports; names within a part begin with the part's."""
    for module, part in ((renderer, ""), (studies, "studies."), (cluster, "cluster.")):
        yield from pieces(module.__name__, inspect.getdoc(module) or "")
        for name in sorted(module.__all__):
            thing = getattr(module, name)
            if callable(thing):
                yield from pieces(part + name, inspect.getdoc(thing) or "")
            if inspect.isclass(thing):
                for owner, member, value in _members(thing):
                    yield from pieces(f"{part}{owner}.{member}", inspect.getdoc(value) or "")
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
        texts = (command.description, command.epilog, *(group.description for group in command._action_groups))
        yield from (piece for text in texts for piece in pieces(where, text or ""))
        for option in command._actions:
            if not isinstance(option, argparse._HelpAction):
                flag = f"{where} {(option.option_strings or [option.metavar or option.dest])[-1]}"
                if option.help not in (None, _VERSION_HELP):
                    yield Piece(flag, " ".join(option.help.split()))
                yield Piece(flag, _taken(option, command))


def _taken(option: argparse.Action, command: argparse.ArgumentParser) -> str:
    """What an option takes, as in "Path, required, or -o", "'a' or 'b', default 'a'" or "a flag"."""
    given = f"sets {option.dest} to {option.const!r}" if option.const not in (None, True) else ""
    if option.required:
        default = "required"
    else:
        silent = option.default == argparse.SUPPRESS or (option.nargs == 0 and option.default is False)
        default = "" if silent else f"default {_value(option.default)}"
    others = [other.option_strings[-1] for other in _excluded(option, command)]
    parts = [
        _kind(option), given, default, f"or {' or '.join(option.option_strings[:-1])}",
        f"not with {' or '.join(others)}",
    ]  # fmt: skip
    return ", ".join(part for part in parts if part not in ("", "or ", "not with "))


def _kind(option: argparse.Action) -> str:
    """What may stand after an option, and how often."""
    if isinstance(option, argparse._VersionAction):
        return f"prints {'__version__' if option.version == renderer.__version__ else repr(option.version)}"
    if option.choices:
        kind = " or ".join(map(repr, option.choices))
    elif option.nargs == 0:
        kind = "a flag"
    else:
        kind = "text" if option.type is None else getattr(option.type, "__name__", str(option.type)).strip("_")
    one = option.nargs in (None, 0, argparse.PARSER)
    kind = kind if one else f"{option.nargs} of {kind}"
    return kind if isinstance(option, _USUAL_ACTIONS) else f"{kind} by {type(option).__name__}"


def _value(value: object) -> str:
    return repr(value) if isinstance(value, str) else str(value)


def _excluded(option: argparse.Action, command: argparse.ArgumentParser) -> list[argparse.Action]:
    """The options that may not stand beside one."""
    groups = [group._group_actions for group in command._mutually_exclusive_groups]
    return [other for group in groups if option in group for other in group if other is not option]


def pieces(where: str, text: str) -> Iterator[Piece]:
    """The pieces of a text, without its examples and headings."""
    for paragraph in _paragraphs(_prose(text)):
        defined = _DEFINITION.match(paragraph)
        said = " ".join(paragraph.split())
        for part in [said] if defined else _SENTENCE.split(said):
            if part not in _HEADINGS:
                yield Piece(where, part)


def _prose(text: str) -> str:
    """A text with an empty line in the place of each example."""
    parts = doctest.DocTestParser().parse(text)
    return "".join(part if isinstance(part, str) else f"\n{_after_output(part)}\n" for part in parts)


def _after_output(example: doctest.Example) -> str:
    """What stands directly below the output of an example.

    Doctest takes all lines down to an empty one for output, so a sentence could hide there. Here the output of
    ``print`` is one line, and any other is an expression of Python, which a sentence is not.
    """
    if example.exc_msg is not None:  # of this package's errors, a line
        return "\n".join(example.exc_msg.splitlines()[1:])
    lines = example.want.splitlines()
    last = ast.parse(example.source).body[-1]
    while isinstance(last, ast.With):  # its last statement shows its value, as one that stands alone does
        last = last.body[-1]
    if not isinstance(last, ast.Expr):
        return example.want
    if isinstance(last.value, ast.Call) and ast.unparse(last.value.func) == "print":
        return "\n".join(lines[1:])
    ends = (end for end in range(1, len(lines) + 1) if _is_expression("\n".join(lines[:end])))
    return "\n".join(lines[next(ends, 0) :])


def _is_expression(text: str) -> bool:
    try:
        ast.parse(text, mode="eval")
    except SyntaxError:
        return False
    return True


def _paragraphs(text: str) -> Iterator[str]:
    """Runs of lines; the definition of a name begins one of its own."""
    lines: list[str] = []
    for line in [*text.splitlines(), ""]:
        if lines and (not line.strip() or _DEFINITION.match(line)):
            yield "\n".join(lines)
            lines = []
        if line.strip():
            lines.append(line)
