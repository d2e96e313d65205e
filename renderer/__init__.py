"""An octree ray tracer for triangle meshes: ray queries, and Whitted pictures of scenes.

The names in ``__init__.pyi`` are imported when they are first used, so that ``import renderer`` costs nothing, and
reading meshes needs no compiler. Kernels are compiled by their first call, which one line on standard error reports,
and kept on disk; ``octree-render compile`` compiles them ahead. The line comes from the logger ``renderer.jit``:
``logging.getLogger("renderer").setLevel("ERROR")`` or OCTREE_RENDERER_QUIET=1 in the environment turns it off.
"""

from renderer.jit import loaded as _loaded  # noqa: F401  # before all others, to note the time
from renderer.lazy_names import attach_stub as _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__)
