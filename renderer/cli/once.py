"""The parser of commands: an option that keeps one value is given once, as an earlier value would be lost."""

import argparse
from typing import Any


class Parser(argparse.ArgumentParser):
    """A parser, also of its commands, whose options without an action of their own are given once."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.register("action", None, _Once)


class _Once(argparse.Action):
    """Stores the value of an option. The names of those that were given are in ``given`` of the namespace."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option_string: Any = None
    ) -> None:
        given: set[str] = namespace.__dict__.setdefault("given", set())
        if self.dest in given:
            raise argparse.ArgumentError(self, "expected once, got twice")
        given.add(self.dest)
        setattr(namespace, self.dest, values)
