"""Light and visibility studies of any size: what each of a million points sees, in rays that are never written down.

The functions are those of ``__init__.pyi``, imported when they are first used. They take an ``Octree`` first.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
