"""The fields of a scene, each in a line of its type, range and default, which changes where one of these does."""

import inspect
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, BeforeValidator, PlainValidator, WrapValidator
from pydantic.fields import FieldInfo

# How the limits of a number or of a list are spelled, by the names that pydantic has for them.
_LIMITS = {"gt": "above", "ge": "from", "lt": "below", "le": "to", "min_length": "at least", "max_length": "at most",
           "multiple_of": "a multiple of", "pattern": "like", "discriminator": "told by"}  # fmt: skip
_FLAGS = {("strict", True): "strict", ("allow_inf_nan", False): "finite"}
_VALIDATORS = {BeforeValidator: "by", AfterValidator: "then by", WrapValidator: "around by", PlainValidator: "only by"}
# What pydantic keeps beside a field and not among its limits.
_BESIDE = ("discriminator", "frozen", "exclude", "init", "description")
_ALIASES = ("alias", "validation_alias", "serialization_alias")
# Settings that Python's classes need and no file of a scene shows.
_INNER = ("arbitrary_types_allowed", "ignored_types")


def described(model: type[BaseModel]) -> Iterator[tuple[str, str]]:
    """Where each field is written, such as "Phong.diffuse", and its line; then what holds for the record as a whole."""
    decorators = model.__pydantic_decorators__
    checks = [(name, found.info) for name, found in decorators.field_validators.items()]
    for name, field in model.model_fields.items():
        by = [f"checked {_mode(info.mode)}by {check.strip('_')}"
              for check, info in checks if {name, "*"} & set(info.fields)]  # fmt: skip
        aliases = dict.fromkeys(getattr(field, kind) for kind in _ALIASES if getattr(field, kind) is not None)
        line = [_spelled(field.annotation, [field]), _default(field), *by, *(f"written {alias}" for alias in aliases)]
        yield f"{_owner(model, name)}.{name}", "; ".join(line)
    yield from _settings(model)
    for name, found in decorators.model_validators.items():
        yield _owner(model, name), f"its values are checked together {_mode(found.info.mode)}by {name.strip('_')}"


def _mode(mode: str) -> str:
    """When a check is made, where that is not after all others."""
    return "" if mode == "after" else f"{mode} the others " if mode == "before" else f"{mode} "


def _settings(model: type[BaseModel]) -> Iterator[tuple[str, str]]:
    """Each class that changes settings of the one above it, and all of its settings."""
    above: dict[str, Any] = {}
    for base in model.__mro__[::-1]:
        settings = {**getattr(base, "model_config", {})}
        if issubclass(base, BaseModel) and settings != above:
            above = settings
            yield base.__name__, "; ".join(f"{key}: {value}" for key, value in settings.items() if key not in _INNER)


def _default(field: FieldInfo) -> str:
    """What stands where the field is left out; of a record that has all its own defaults, its class."""
    default = field.get_default(call_default_factory=True, validated_data={})
    if isinstance(default, BaseModel) and default == type(default)():
        return f"default {type(default).__name__}()"
    return "required" if field.is_required() else f"default {default!r}"


def _owner(model: type[BaseModel], name: str) -> str:
    """The class that writes a field or a check."""
    return next(base.__name__ for base in model.__mro__ if name in inspect.get_annotations(base) or name in vars(base))


def _spelled(kind: Any, metadata: Iterable[Any] = ()) -> str:
    """A type with its limits, as in "float strict from 0.0 below 1.0"."""
    return " ".join([_named(kind), *(word for part in metadata for word in _words(part))])


def _named(kind: Any) -> str:
    """A type as the scene classes write it, but with the limits of the types within."""
    parts = get_args(kind)
    if get_origin(kind) is Annotated:
        return _spelled(parts[0], parts[1:])
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(map(_named, parts))
    if get_origin(kind) is Literal:
        return " or ".join(map(repr, parts))
    if get_origin(kind) is dict:
        return f"table of {_named(parts[1])}" + ("" if parts[0] is str else f" by {_named(parts[0])}")
    if get_origin(kind) is list:
        return _listed([_named(parts[0])], any_number=True)
    if get_origin(kind) is tuple:
        return _listed([_named(part) for part in parts if part is not Ellipsis], Ellipsis in parts)
    within = f" of ({', '.join(map(_named, parts))})" if parts else ""
    return "None" if kind is NoneType else f"{kind.__name__}{within}"


def _listed(kinds: list[str], any_number: bool) -> str:
    """A list of any number of one type, of some of one type, or of several types in their order."""
    if any_number:
        return f"list of ({kinds[0]})"
    return f"{len(kinds)} of ({kinds[0]})" if len(set(kinds)) == 1 else f"({', '.join(kinds)})"


def _words(part: Any) -> Iterator[str]:
    """The limits, flags and checks in what pydantic keeps beside a type, also those that have no word here."""
    if isinstance(part, FieldInfo):
        for inner in part.metadata:
            yield from _words(inner)
        told = {name: getattr(part, name) for name in _BESIDE}
    elif type(part) in _VALIDATORS:
        yield f"{_VALIDATORS[type(part)]} {_checker(part.func)}"
        return
    else:
        told = {f.name: getattr(part, f.name) for f in fields(part)} if is_dataclass(part) else {**vars(part)}
    for name, value in told.items():
        if value is not None:
            yield _FLAGS.get((name, value)) or f"{_LIMITS.get(name, name)} {_checker(value)}"


def _checker(value: Any) -> str:
    """A function by its name, or that of its maker and what this was given; anything else as Python writes it."""
    if not inspect.isroutine(value):
        return str(value)
    given = inspect.getclosurevars(value).nonlocals
    return " ".join([value.__qualname__.partition(".<locals>")[0].strip("_"), *map(str, given.values())])
