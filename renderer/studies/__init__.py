"""Studies of light and visibility: what each of many points sees of the sky, the sun and its surroundings.

Functions take an ``Octree`` first, then points, their normals and, if it is known, the face that each lies on.
"""

from renderer.lazy_names import attach_stub as _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__)
