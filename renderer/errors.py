"""The errors that this package raises for bad input.

All of them are ``ValueError``s, so a caller can catch them as one; the command line turns each into one line.
"""

import difflib
from collections.abc import Iterable


class MeshError(ValueError):
    """The error for a mesh file or mesh arrays that cannot be used. It names the file or argument and the fault.

    Examples
    --------
    >>> from renderer import Mesh
    >>> Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 9]])
    Traceback (most recent call last):
        ...
    renderer.errors.MeshError: faces: expected indices from 0 to 2, got 9 in row 0
    """


class SceneError(ValueError):
    """The error for a scene that cannot be used. It names the file, the key, the expected value and the given one.

    Examples
    --------
    >>> from renderer import PerspectiveCamera
    >>> PerspectiveCamera(eye=(0, 0, 1), target=(0, 0, 0), fov=180)
    Traceback (most recent call last):
        ...
    renderer.errors.SceneError: PerspectiveCamera: fov: expected a number less than 180, got 180
    """


# A file that is not there is both bad input of this package and what Python's own functions raise.


class NoSuchFileError(FileNotFoundError, ValueError):
    """A file that is not there."""


class NoSuchMeshError(NoSuchFileError, MeshError):
    """A mesh file that is not there."""


class NoSuchSceneError(NoSuchFileError, SceneError):
    """A scene file that is not there."""


def expect(condition: bool, argument: str, expected: str, got: object) -> None:
    """Raise ``ValueError`` naming ``argument``, what was expected and what was given, unless ``condition``."""
    if not condition:
        raise ValueError(f"{argument}: expected {expected}, got {got}")


def expect_known(argument: str, name: object, known: Iterable[str]) -> None:
    """Raise ``ValueError`` unless ``name`` is one of ``known``; the message has them, and the most similar one."""
    names = list(known)
    if name not in names:
        like = difflib.get_close_matches(str(name), names, 1)
        hint = f". Did you mean {like[0]!r}?" if like else ""
        raise ValueError(f"{argument}: expected one of {', '.join(names)}, got {name!r}{hint}")


def extra_hint(name: str) -> str:
    """The command that installs what an optional part needs; there is no package on an index yet."""
    return f"in a checkout of octree-renderer: pip install '.[{name}]'; with a wheel: pip install 'FILE.whl[{name}]'"
