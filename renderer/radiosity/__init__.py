"""Radiosity: the light, or the heat, that diffuse surfaces send each other, from their view factors.

``renderer.studies.view_factors`` computes these.
"""

from renderer.lazy_names import attach_stub as _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__)
