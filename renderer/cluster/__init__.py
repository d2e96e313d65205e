"""Studies, pictures and ray queries on a Dask cluster: the mesh goes to each worker once, and the tree is built there.

``pip install '.[cluster]'`` in a checkout installs what it needs. The functions are those of ``__init__.pyi``, imported
when they are first used.
"""

from renderer.lazy_names import attach_stub as _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__)
