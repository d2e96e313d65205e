"""The ways to break the renderer by name: a marked rule, a constant, a function of a kernel, a function of Python."""

import ast
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from validation.defects.edits import Edit
from validation.defects.places import find_definition, find_rule


@dataclass(frozen=True)
class Altered:
    """A module's altered text; ``compiled`` tells that kernels depend on what was altered."""

    path: Path
    module: str
    text: str
    compiled: bool


@dataclass(frozen=True)
class Rule:
    """The statement that carries the name ``name`` in the source is edited."""

    name: str
    edit: Edit

    def altered(self, package: Path) -> Altered:
        """Raises ``ValueError`` unless one statement has that name and the edit fits it."""
        place = find_rule(package, self.name)
        return Altered(place.path, place.module, place.text_with(self.edit(place.node)), place.compiled)


@dataclass(frozen=True)
class Constant:
    """A module-level constant has another value, an expression."""

    name: str
    value: str

    def altered(self, package: Path) -> Altered:
        """Raises ``ValueError`` unless there is one such constant."""
        place = find_definition(package, self.name)
        # Below the assignment, because that may assign other names too.
        statement = ast.parse(f"{self.name.rpartition('.')[2]} = {self.value}").body[0]
        return Altered(place.path, place.module, place.text_with(place.node, statement), True)


@dataclass(frozen=True)
class Function:
    """A function has another body: ``text`` defines it, with the decorators of the sound one, which it may call as
    ``sound``.
    """

    name: str
    text: str

    def altered(self, package: Path) -> Altered:
        """Raises ``ValueError`` unless there is one such function."""
        place = find_definition(package, self.name)
        sound, broken = place.node, ast.parse(textwrap.dedent(self.text)).body[0]
        if not isinstance(sound, ast.FunctionDef) or not isinstance(broken, ast.FunctionDef):
            raise ValueError(f"{self.name}: expected a function")
        if len(sound.args.args) != len(broken.args.args):
            raise ValueError(f"{self.name}: expected {len(sound.args.args)} arguments, got {len(broken.args.args)}")
        broken.name, broken.decorator_list = sound.name, sound.decorator_list
        sound.name = "sound"
        return Altered(place.path, place.module, place.text_with(sound, broken), place.compiled)


@dataclass(frozen=True)
class Wrapped:
    """Every call of a function or method of Python goes to ``wrapper``, with the sound function and the arguments.

    The name may be one that a module imports: "sky.check_weights" is what ``sky`` calls by that name, and no other.
    """

    name: str
    wrapper: Callable[..., Any]


Change = Rule | Constant | Function | Wrapped


def after(name: str, change: Callable[[Any], Any]) -> Wrapped:
    """``change`` is applied to what a function returns: it gives another result, or None where it changed that one."""

    def wrapper(sound: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
        result = sound(*arguments, **options)
        changed = change(result)
        return result if changed is None else changed

    return Wrapped(name, wrapper)
