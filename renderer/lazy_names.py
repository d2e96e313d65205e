"""Public names of a package that are imported when they are first used."""

import pkgutil
import re
import sys
from collections.abc import Callable
from importlib import import_module

from renderer.collector import resting

_LINE = re.compile(r"^from (\.[\w.]*) import (\w+) as \2$", re.MULTILINE)


def attach_stub(package: str) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """``__getattr__``, ``__dir__`` and ``__all__`` of a package by its ``__init__.pyi``, which type checkers read.

    The stub has a line ``from .module import name as name`` for each public name, and ``from . import name as name``
    for a module. Unlike ``lazy_loader.attach_stub``
    this finds it in a zip file too.
    """
    stub = pkgutil.get_data(package, "__init__.pyi")
    assert stub is not None  # any loader of a package reads its files
    homes = {name: module for module, name in _LINE.findall(stub.decode())}
    listed = sorted(homes)

    def find(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home = homes[name]
        with resting():
            value = import_module(f".{name}", package) if home == "." else getattr(import_module(home, package), name)
        setattr(sys.modules[package], name, value)
        return value

    return find, lambda: listed, listed
