"""Properties that are computed once, when they are first read."""

from functools import cached_property
from typing import Any, TypeVar

T = TypeVar("T")


class lazy(cached_property[T]):  # noqa: N801  # a decorator, used like a function
    """``functools.cached_property`` without the lock that it has in Python 3.11, one for all objects of a class.

    A process that is forked while another thread holds that lock would wait for it for ever. Two threads may compute
    the value at once here; both get the one that is kept first.
    """

    def __get__(self, instance: Any, owner: type[Any] | None = None) -> Any:
        """The kept value of ``instance``, computed now if it is not there."""
        if instance is None:
            return self
        assert self.attrname is not None
        values = instance.__dict__
        if self.attrname not in values:
            values.setdefault(self.attrname, self.func(instance))
        return values[self.attrname]
