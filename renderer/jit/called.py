"""The files of kernels as other kernels call them, which find them by their names."""

import sys
from typing import Any

from renderer.jit.cache import KernelStore


class CalledStore(KernelStore):
    """The files of a kernel that other kernels call."""

    def knows(self, signature: Any) -> bool:
        """Also that its callers find it by its name."""
        named = getattr(sys.modules.get(self._function.__module__), self._function.__qualname__, None)
        return getattr(named, "py_func", None) is self._function and super().knows(signature)
