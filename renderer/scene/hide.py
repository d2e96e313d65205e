"""Scenes without some of their objects."""

from collections.abc import Collection

from renderer.errors import expect
from renderer.scene.scene import Scene

FLOOR = "floor"


def object_names(scene: Scene) -> tuple[str, ...]:
    """The names of objects, as in errors of scene files: ``objects.0`` and so on, and ``floor`` if there is one.

    >>> from renderer import load_scene
    >>> object_names(load_scene("scenes/stairs.toml"))
    ('objects.0', 'floor')
    """
    return (*(f"objects.{i}" for i in range(len(scene.objects))), *((FLOOR,) if scene.floor else ()))


def without(scene: Scene, hidden: Collection[str]) -> Scene:
    """``scene`` without the objects of these names. It shares the other meshes: none is loaded or placed again.

    Raises ``ValueError`` for an unknown name.

    >>> from renderer import load_scene
    >>> scene = load_scene("scenes/stairs.toml")
    >>> len(scene.instances), len(without(scene, ["floor"]).instances)
    (2, 1)
    """
    names = object_names(scene)
    for name in hidden:
        expect(name in names, "hide", f"objects among {list(names)}", repr(name))
    if not hidden:
        return scene
    kept = [i for i in range(len(scene.objects)) if names[i] not in hidden]
    floor = None if FLOOR in hidden else scene.floor
    instances = [scene.instances[i] for i in kept] + list(scene.instances[len(scene.objects) :] if floor else ())
    objects = tuple(scene.objects[i] for i in kept)
    return scene.model_copy(update={"objects": objects, "floor": floor, "instances": tuple(instances)})
