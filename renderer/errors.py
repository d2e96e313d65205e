"""The errors that this package raises for bad input.

All of them are ``ValueError``s, so a caller can catch them as one; the command line turns each into one line.
"""


class MeshError(ValueError):
    """A mesh file or mesh arrays that cannot be used; names the file or argument and the fault.

    >>> from renderer import Mesh
    >>> Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 9]])
    Traceback (most recent call last):
        ...
    renderer.errors.MeshError: faces: expected indices from 0 to 2, got 9 in row 0
    """


class SceneError(ValueError):
    """A scene that cannot be used; names the file, the key's path, the value that was expected and the one given.

    >>> from renderer import PerspectiveCamera
    >>> PerspectiveCamera(eye=(0, 0, 1), target=(0, 0, 0), fov=180)
    Traceback (most recent call last):
        ...
    renderer.errors.SceneError: PerspectiveCamera: fov: expected a number less than 180, got 180
    """


def expect(condition: bool, argument: str, expected: str, got: object) -> None:
    """Raise ``ValueError`` naming ``argument``, what was expected and what was given, unless ``condition``."""
    if not condition:
        raise ValueError(f"{argument}: expected {expected}, got {got}")


def extra_hint(name: str) -> str:
    """The command that installs what an optional part needs; there is no package on an index yet."""
    return f"in a checkout of octree-renderer: pip install '.[{name}]'; with a wheel: pip install 'FILE.whl[{name}]'"
