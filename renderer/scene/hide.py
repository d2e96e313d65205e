"""Scenes without some of their objects, or without what lies on one side of a plane."""

import re
from collections.abc import Collection
from dataclasses import replace

from renderer.arguments.up import UP_AXES
from renderer.errors import expect
from renderer.mesh.cutting import cut
from renderer.scene.instance import Instance
from renderer.scene.scene import Scene

FLOOR = "floor"
# A half-space: all that has a coordinate greater, or less, than a number.
_SIDE = re.compile(r"([xyz]) *([<>]) *([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)")


def object_names(scene: Scene) -> tuple[str, ...]:
    """The names of objects, as in errors of scene files: ``objects.0`` and so on, and ``floor`` if there is one.

    >>> from renderer import load_scene
    >>> object_names(load_scene("scenes/stairs.toml"))
    ('objects.0', 'floor')
    """
    return (*(f"objects.{i}" for i in range(len(scene.objects))), *((FLOOR,) if scene.floor else ()))


def is_side(name: str) -> bool:
    """Whether ``name`` means all on one side of a plane, as ``x > 1.5``."""
    return _SIDE.fullmatch(name) is not None


def without(scene: Scene, hidden: Collection[str]) -> Scene:
    """``scene`` without the objects of these names, and without all on these sides of planes, as ``x > 1.5``.

    It shares the other meshes: none is loaded or placed again. Faces across a plane are cut.

    Raises ``ValueError`` for an unknown name.

    >>> from renderer import load_scene
    >>> scene = load_scene("scenes/stairs.toml")
    >>> len(scene.instances), len(without(scene, ["floor"]).instances)
    (2, 1)
    """
    names = object_names(scene)
    sides = [name for name in hidden if is_side(name)]
    for name in hidden:
        expect(name in names or name in sides, "hide", f"objects among {list(names)}, or 'x > 1.5'", repr(name))
    if not hidden:
        return scene
    kept = [i for i in range(len(scene.objects)) if names[i] not in hidden]
    floor = None if FLOOR in hidden else scene.floor
    instances = [scene.instances[i] for i in kept] + list(scene.instances[len(scene.objects) :] if floor else ())
    objects = tuple(scene.objects[i] for i in kept)
    for side in sides:
        instances = [_cut(instance, side) for instance in instances]
    return scene.model_copy(update={"objects": objects, "floor": floor, "instances": tuple(instances)})


def _cut(instance: Instance, side: str) -> Instance:
    axis, sign, at = _SIDE.fullmatch(side).groups()  # type: ignore[union-attr]
    # Smooth faces keep the normals that they have in the whole.
    mesh = replace(instance.mesh, normals=instance.normals) if instance.smooth else instance.mesh
    return Instance(cut(mesh, UP_AXES[axis], float(at), below=sign == ">"), instance.material, instance.smooth)
