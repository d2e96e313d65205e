"""The base of the scene classes: types of fields, checks for unknown and wrong values, and one line per fault."""

import math
import re
import warnings
from collections.abc import Callable, Iterable
from functools import wraps
from typing import Annotated, Any, Concatenate, ParamSpec

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from renderer.errors import SceneError, expect_known
from renderer.lazy import lazy

_Number = Annotated[float, Field(allow_inf_nan=False, strict=True)]
FiniteVector = tuple[_Number, _Number, _Number]


# The place of a fault: names of fields and places in lists.
Keys = tuple[int | str, ...]


def one_for(count: int) -> BeforeValidator:
    """Let one number stand for ``count`` that are equal: red, green and blue, or width and height."""

    def spread(value: object) -> object:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return (value,) * count
        if isinstance(value, str | bytes | dict) or not isinstance(value, Iterable):
            raise ValueError(f"expected a number or a list of {count}, got {_value(value)}")
        return value

    return BeforeValidator(spread)


_Channel = Annotated[float, Field(ge=0.0, allow_inf_nan=False, strict=True)]
Color = Annotated[tuple[_Channel, _Channel, _Channel], one_for(3)]


class SceneWarning(UserWarning):
    """A value that is allowed, and that is probably a slip: an angle in radians, a colour from 0 to 255, a scale of 0.

    Examples
    --------
    >>> import warnings
    >>> from renderer import Phong
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     red = Phong(diffuse=(255, 0, 0))
    >>> print(caught[0].message)
    Phong: diffuse: expected numbers from 0 to 1, got (255.0, 0.0, 0.0), used as given. Divide 8-bit colours by 255.
    """


class Fields(BaseModel):
    """A record whose fields are checked when it is made, and do not change.

    Raises ``SceneError``, which is a ``ValueError``, with one line that names the field.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True, ignored_types=(lazy,))

    def __init__(self, /, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise SceneError(f"{type(self).__name__}: {first_fault(error, self._union_member)}") from None
        for slip in self._slips():
            warnings.warn(f"{type(self).__name__}: {slip}", SceneWarning, stacklevel=3)

    def __dir__(self) -> list[str]:
        """Fields and methods of this project, without those of pydantic."""
        return [name for name in super().__dir__() if name.startswith("__") or not hasattr(BaseModel, name)]

    def _slips(self) -> Iterable[str]:
        """A line for each value that is allowed and looks like a slip."""
        return ()

    @model_validator(mode="before")
    @classmethod
    def _plain(cls, values: Any) -> Any:
        """NumPy's numbers and arrays as Python's own, which the fields' types know. Unknown keys are refused."""
        if not isinstance(values, dict):
            return values
        for key in values:
            if key not in cls.model_fields:
                raise _unknown(key, values[key], cls.model_fields)
        return {key: _unpacked(value) for key, value in values.items()}

    # Without it pydantic would call __init__ for each record within another, and lose the place of a fault.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @staticmethod
    def _union_member(keys: Keys) -> int | None:
        """The place in ``keys`` of the name of a union's member; see ``first_fault``."""
        return None


def in_degrees(field: str, value: float) -> str:
    """The slip of an angle that looks like radians."""
    return f"{field}: expected degrees, got {value:.6g}. If these are radians, write {field}={math.degrees(value):.6g}."


Stated = ParamSpec("Stated")


def stated(signature: Callable[Concatenate[Any, Stated], None]) -> Callable[Concatenate[Any, Stated], None]:
    """``Fields.__init__`` with the signature that a class states, for type checkers and ``help``.

    Fields are typed by what they hold, such as three numbers; the signature has all that they are made of.
    """

    @wraps(signature)
    def init(self: Fields, /, *unnamed: object, **values: Any) -> None:
        if unnamed:
            keys = ", ".join(f"{key}=..." for key in type(self).model_fields if key != "type")
            call = f"{type(self).__name__}({keys})"
            raise TypeError(f"expected keywords, as in {call}, got {shown(unnamed[0])} without its name")
        Fields.__init__(self, **values)

    init.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # as for that of ``Fields``
    return init


def _unpacked(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        # Those of three axes are images, and those of two if they are of bytes.
        is_image = value.ndim == 3 or (value.ndim == 2 and value.dtype in (np.uint8, np.uint16))
        return value if is_image else value.tolist()
    if isinstance(value, list):
        return [_unpacked(entry) for entry in value]
    return tuple(_unpacked(entry) for entry in value) if type(value) is tuple else value


def _unknown(key: object, value: object, known: Iterable[str]) -> PydanticCustomError:
    """The fault of a key that is none of ``known``."""
    try:
        expect_known(f"unknown key (its value is {shown(value)})", key, known)
    except ValueError as error:
        text = str(error)
    # The place of the fault is that of the table; ``first_fault`` adds the key.
    return PydanticCustomError("unknown_key", "{text}", {"text": text, "key": key})


# The most places of further faults that a line names.
_PLACES = 3


def first_fault(error: ValidationError, member: Callable[[Keys], int | None] = lambda keys: None) -> str:
    """One line for the first fault, with the number and the first places of others.

    For a union pydantic puts the name of a member among the keys, which no file has; ``member`` gives its place.
    """
    # Unknown keys first: one is likely a misspelling of a missing one.
    faults = sorted(error.errors(), key=lambda fault: fault["type"] != "unknown_key")
    first = faults[0]
    where, *others = (_place(fault, member) for fault in faults)
    places = f"{', '.join(others[:_PLACES])}{', ...' if len(others) > _PLACES else ''}"
    more = f" (and {len(others)} more, at {places})" if others else ""
    # It may quote the given value with its line breaks.
    message = _in_our_words(" ".join(first["msg"].split()))
    says_it = (first["type"] == "value_error" and ", got" in message) or isinstance(first["input"], dict)
    got = "" if says_it else f", got {_value(first['input'])}"
    if first["type"] in ("union_tag_not_found", "union_tag_invalid"):
        message, got = _type_message(first["ctx"]), ""
    if first["type"] == "missing" and isinstance(first["input"], dict):
        got = ", got none"
    return f"{where}: {message}{got}{more}" if where else f"{message}{got}{more}"


def _place(fault: Any, member: Callable[[Keys], int | None]) -> str:
    """The keys that lead to a fault."""
    keys = fault["loc"]
    own = [fault["ctx"]["key"]] if fault["type"] == "unknown_key" else []
    return ".".join(shown(k) for k in [*(k for i, k in enumerate(keys) if i != member(keys)), *own])


# Pydantic's words, and those of every other error of this package.
_WORDS = (
    (r"^Value error, ", ""),
    (r"^Input should (be|have) (a valid )?", "expected "),
    (r"^expected (greater|less) ", r"expected a number \1 "),
    (r"^expected (tuple|list)\b", "expected a list"),
    (r"^expected dictionary or instance of (\w+)", r"expected a table or a \1"),
    (r"^expected dictionary or object to extract fields from", "expected a table or an object of its class"),
    (r"^Field required", "expected a value"),
    (r"^Tuple should have (at \w+ \d+ items?) after validation.*", r"expected \1"),
    (r"^expected integer", "expected an integer"),
    (r"^expected (number|string|dictionary|boolean)\b", r"expected a \1"),
)


def _in_our_words(message: str) -> str:
    for theirs, ours in _WORDS:
        message = re.sub(theirs, ours, message)
    return message


def _type_message(told: dict[str, Any]) -> str:
    """The fault of the key that distinguishes the members of a union."""
    key, known = told["discriminator"], told.get("expected_tags", "")
    got = f", got {told['tag']!r}" if "tag" in told else ", got none"
    return f"expected {key} to be one of {known}{got}" if known else f"expected the key {key}{got}"


def _value(value: object) -> str:
    """A value on one line, text within quotes: "40" is no number."""
    return repr(value) if isinstance(value, str) else shown(value)


# The most characters of a value that an error quotes.
_MOST = 200


def shown(value: object) -> str:
    """A value or key on one line; Python writes no integer of more than 4300 digits."""
    if isinstance(value, str) and value.isprintable() and value:
        return value if value.replace("-", "").replace("_", "").isalnum() else repr(value)
    if type(value).__module__.partition(".")[0] == __name__.partition(".")[0]:
        return type(value).__name__
    try:
        text = repr(value)
        return text if len(text) <= _MOST else f"{' '.join(text[:_MOST].split())} ..."
    except ValueError:
        return "an integer of more than 4300 digits"
    except RecursionError:
        return "tables within tables, too many to show"
