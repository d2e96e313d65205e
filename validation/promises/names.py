"""The public names: what the packages export, the keys of a scene file, and the options of the commands."""

import argparse
import inspect
from collections.abc import Iterator
from functools import cached_property
from types import ModuleType
from typing import Any, get_args

from pydantic import BaseModel

import renderer
from renderer import cluster, radiosity, studies, trimesh_ray
from renderer.cli.main import make_parser as render_parser
from renderer.scene.scene import Scene
from validation.options import make_parser as validate_parser

# Each package, and what its names begin with.
_PACKAGES = (
    (renderer, ""),
    (studies, "studies."),
    (radiosity, "radiosity."),
    (cluster, "cluster."),
    (trimesh_ray, "trimesh_ray."),
)


def public_names() -> list[str]:
    """Every public name once, such as ``Octree.closest_hit``, ``scene.floor.min`` or ``octree-render view --port``."""
    exported = [name for package, prefix in _PACKAGES for name in _exported(package, prefix)]
    options = [*_options(render_parser(), "octree-render"), *_options(validate_parser(), "octree-validate")]
    return list(dict.fromkeys([*exported, *_keys(Scene, "scene"), *options]))


def _exported(package: ModuleType, prefix: str) -> Iterator[str]:
    """The names in ``__all__``, and of each class its public methods and properties, those that it inherits too."""
    for name in sorted(package.__all__):
        thing = getattr(package, name)
        yield prefix + name
        if inspect.isclass(thing):
            yield from (f"{prefix}{name}.{member}" for member in sorted(_members(thing)))


def _members(kind: type) -> set[str]:
    """The public methods and properties that this project wrote."""
    own = [base for base in kind.__mro__ if base.__module__.partition(".")[0] == renderer.__name__]
    found = [pair for base in own for pair in vars(base).items()]
    return {name for name, value in found if not name.startswith("_") and _is_member(value)}


def _is_member(value: object) -> bool:
    return inspect.isroutine(value) or isinstance(value, property | cached_property)


def _keys(model: type[BaseModel], path: str) -> Iterator[str]:
    """The keys of a table and of those within; a table of one of several types has its type before its keys."""
    for name, field in model.model_fields.items():
        yield f"{path}.{name}"
        inner = list(dict.fromkeys(_models(field.annotation)))
        for table in inner:
            kind = f".{table.model_fields['type'].default}" if len(inner) > 1 else ""
            yield from _keys(table, f"{path}.{name}{kind}")


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """The tables that an annotation allows, at any depth."""
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)


def _options(parser: argparse.ArgumentParser, command: str) -> Iterator[str]:
    """The options and arguments of a command, then each of its subcommands and theirs."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, subcommand in action.choices.items():
                yield f"{command} {name}"
                yield from _options(subcommand, f"{command} {name}")
        elif not isinstance(action, argparse._HelpAction):
            yield f"{command} {action.option_strings[-1] if action.option_strings else action.dest}"
