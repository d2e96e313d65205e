"""``cases``, which is used like ``pytest.mark.parametrize`` and makes one test of all cases.

A test of its own costs pytest some milliseconds, more than most cases take.
"""

import inspect
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any


def cases(names: str | tuple[str, ...], values: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Run the test for each of ``values``, in order; a failure says of which case it is.

    Each case has a folder ``tmp_path`` and an output ``capsys`` of its own, and undoes what it did by ``monkeypatch``.
    """
    arguments = [name.strip() for name in names.split(",")] if isinstance(names, str) else list(names)
    rows = [(value,) if len(arguments) == 1 else tuple(value) for value in values]
    assert rows, "no case would be no test"

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @wraps(test)
        def all_cases(*args: Any, **fixtures: Any) -> None:
            for number, row in enumerate(rows):
                case = dict(zip(arguments, row, strict=True))
                with _named(case), _apart(number, fixtures) as own:
                    test(*args, **own, **case)

        signature = inspect.signature(test)
        left = [parameter for name, parameter in signature.parameters.items() if name not in arguments]
        assert len(left) + len(arguments) == len(signature.parameters), test.__name__
        all_cases.__signature__ = signature.replace(parameters=left)  # type: ignore[attr-defined]
        return all_cases

    return decorate


@contextmanager
def _named(case: dict[str, Any]) -> Iterator[None]:
    try:
        yield
    except BaseException as error:
        error.add_note("case: " + ", ".join(f"{name}={value!r:.200}" for name, value in case.items()))
        raise


@contextmanager
def _apart(number: int, fixtures: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The fixtures as a case alone would have them."""
    own = dict(fixtures)
    if "tmp_path" in own:
        own["tmp_path"] = own["tmp_path"] / str(number)
        own["tmp_path"].mkdir()
    if "capsys" in own:
        own["capsys"].readouterr()
    if "monkeypatch" not in own:
        yield own
        return
    with own["monkeypatch"].context() as patch:
        yield {**own, "monkeypatch": patch}
