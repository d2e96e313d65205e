"""Light and visibility studies of any size: what each of a million points sees, in rays that are never written down.

The functions are those of ``__init__.pyi``, imported when they are first used. They take an ``Octree`` first.
"""

from renderer.lazy_names import attach_stub as _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__)
