"""Studies, pictures and ray queries on a Dask cluster.

Each worker gets the mesh once and builds the tree. ``pip install '.[cluster]'`` in a checkout installs Dask.
"""

from renderer.lazy_names import attach_stub as _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__)
