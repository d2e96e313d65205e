"""Studies, pictures and ray queries on a Dask cluster: the mesh goes to each worker once, and the tree is built there.

``pip install '.[cluster]'`` in a checkout installs what it needs. The functions are those of ``__init__.pyi``, imported
when they are first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
