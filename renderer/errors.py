"""The errors that this package raises for bad input.

All of them are ``ValueError``s, so a caller who does not care which part
complained can catch that; the command line turns them into one line.
"""


class MeshError(ValueError):
    """A mesh file or mesh arrays that cannot be used; names the file or argument and the fault."""


class SceneError(ValueError):
    """A scene that cannot be used; names the file, the key's path, what was expected and what stood there."""


def expect(condition: bool, argument: str, expected: str, got: object) -> None:
    """Raise ``ValueError`` naming ``argument``, what was expected and what came, unless ``condition``."""
    if not condition:
        raise ValueError(f"{argument}: expected {expected}, got {got}")


def extra_hint(name: str) -> str:
    """How to install what an optional part needs; there is no package on an index yet."""
    return f"in a checkout of octree-renderer: pip install '.[{name}]'"


def is_count(value: object) -> bool:
    """Whether it is an int >= 0, which True and False are not meant as."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0
