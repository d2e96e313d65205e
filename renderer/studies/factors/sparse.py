"""SciPy's sparse matrices, which only view factors and what is computed from them need."""

from types import ModuleType


def scipy_sparse() -> ModuleType:
    """The module ``scipy.sparse``. Raises ``ImportError`` naming the extra that installs it."""
    try:
        import scipy.sparse
        import scipy.sparse.linalg
    except ImportError as error:
        message = 'view factors need SciPy: pip install "octree-renderer[radiosity]"'
        raise ImportError(message, name=error.name) from None
    return scipy.sparse
