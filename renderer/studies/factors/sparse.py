"""SciPy's sparse matrices, which only view factors and what is computed from them need."""

from types import ModuleType

from renderer.errors import extra_hint


def scipy_sparse() -> ModuleType:
    """The module ``scipy.sparse``. Raises ``ImportError`` naming the extra that installs it."""
    try:
        import scipy.sparse
        import scipy.sparse.linalg
    except ImportError as error:
        message = f"view factors need SciPy; {extra_hint('radiosity')}"
        raise ImportError(message, name=error.name) from None
    return scipy.sparse
