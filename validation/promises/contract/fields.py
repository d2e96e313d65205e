"""The fields of a scene, each in a line of its type, range and default, which changes where one of these does."""

import inspect
from collections.abc import Iterable, Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, BeforeValidator
from pydantic.fields import FieldInfo

# How the limits of a number or of a list are spelled, by the names that pydantic has for them.
_LIMITS = {"gt": "above", "ge": "from", "lt": "below", "le": "to", "min_length": "at least", "max_length": "at most",
           "multiple_of": "a multiple of", "pattern": "like"}  # fmt: skip
_FLAGS = {("strict", True): "strict", ("allow_inf_nan", False): "finite", ("discriminator", "type"): "told by type"}


def described(model: type[BaseModel]) -> Iterator[tuple[str, str]]:
    """Where each field is written, such as "Phong.diffuse", and its line; then the checks of the record as a whole."""
    decorators = model.__pydantic_decorators__
    checks = {name: found.info.fields for name, found in decorators.field_validators.items()}
    for name, field in model.model_fields.items():
        by = [f"checked by {check.strip('_')}" for check, names in checks.items() if name in names]
        by += [f"written {field.alias}"] if field.alias else []
        line = [_spelled(field.annotation, [field]), _default(field), *by]
        yield f"{_owner(model, name)}.{name}", "; ".join(line)
    if "extra" in model.model_config:
        owner = next(base for base in model.__mro__[::-1] if "extra" in getattr(base, "model_config", {}))
        yield owner.__name__, f"other fields: {model.model_config['extra']}"
    for name, found in decorators.model_validators.items():
        if found.info.mode == "after":
            yield _owner(model, name), f"its values are checked together by {name.strip('_')}"


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
        return f"table of {_named(parts[1])}"
    if get_origin(kind) is list:
        return _listed([_named(parts[0])], any_number=True)
    if get_origin(kind) is tuple:
        return _listed([_named(part) for part in parts if part is not Ellipsis], Ellipsis in parts)
    return "None" if kind is NoneType else str(kind.__name__)


def _listed(kinds: list[str], any_number: bool) -> str:
    """A list of any number of one type, of some of one type, or of several types in their order."""
    if any_number:
        return f"list of ({kinds[0]})"
    return f"{len(kinds)} of ({kinds[0]})" if len(set(kinds)) == 1 else f"({', '.join(kinds)})"


def _words(part: Any) -> Iterator[str]:
    """The limits and flags in what pydantic keeps beside a type."""
    if isinstance(part, BeforeValidator):
        made, given = part.func.__qualname__.partition(".")[0], inspect.getclosurevars(part.func).nonlocals
        yield " ".join(["by", made.strip("_"), *map(str, given.values())])
    if isinstance(part, AfterValidator):
        yield f"then by {part.func.__qualname__.strip('_')}"
    if isinstance(part, FieldInfo):
        for inner in part.metadata:
            yield from _words(inner)
    yield from (f"{word} {getattr(part, name)}" for name, word in _LIMITS.items() if hasattr(part, name))
    yield from (word for (name, value), word in _FLAGS.items() if getattr(part, name, None) == value)
