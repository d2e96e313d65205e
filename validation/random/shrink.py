"""Makes a failing scene or mesh smaller while it still fails: fewer parts, plainer materials, fewer faces."""

from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import TypeVar

import numpy as np

from renderer.mesh.mesh import Mesh
from validation.random.scenes import Drawn

Thing = TypeVar("Thing")

_PLAIN = {"diffuse": 0.5}
# Trials take a second each.
_MOST = 80


def shrunk(thing: Thing, smaller: Callable[[Thing], Iterator[Thing]], fails: Callable[[Thing], bool]) -> Thing:
    """The thing after all steps that ``smaller`` offers and that leave it failing, until none does."""
    left = _MOST
    while True:
        for other in smaller(thing):
            left -= 1
            if fails(other):
                thing = other
                break
            if left <= 0:
                return thing
        else:
            return thing


def smaller_scenes(drawn: Drawn) -> Iterator[Drawn]:
    """Scenes with a part less, the large parts first."""
    table = drawn.table
    for key in ("objects", "lights"):
        for number in range(len(table[key]) if len(drawn.meshes) > 1 or key == "lights" else 0):
            yield _changed(drawn, lambda t, key=key, number=number: t[key].pop(number))  # type: ignore[misc]
    if "floor" in table:
        yield _changed(drawn, lambda t: t.pop("floor"))
    if table["render"]["max_depth"] > 0:
        yield _changed(drawn, lambda t: t["render"].update(max_depth=t["render"]["max_depth"] - 1))
    for name, material in table["materials"].items():
        if material != _PLAIN:
            yield _changed(drawn, lambda t, name=name: t["materials"].update({name: dict(_PLAIN)}))  # type: ignore[misc]
    for name, mesh in drawn.meshes.items():
        for part in smaller_meshes(mesh):
            yield drawn._replace(meshes=drawn.meshes | {name: part})


def smaller_meshes(mesh: Mesh) -> Iterator[Mesh]:
    """Meshes without a half, a quarter or an eighth of the faces, one after another."""
    count = len(mesh.faces)
    for parts in (2, 4, 8):
        for part in range(parts if count >= parts else 0):
            begin, end = part * count // parts, (part + 1) * count // parts
            kept = np.concatenate([mesh.faces[:begin], mesh.faces[end:]])
            if len(kept):
                used, faces = np.unique(kept, return_inverse=True)
                yield Mesh(mesh.vertices[used], faces.reshape(-1, 3).astype(np.int32))


def _changed(drawn: Drawn, change: Callable[[dict], object]) -> Drawn:  # type: ignore[type-arg]
    table = deepcopy(drawn.table)
    change(table)
    used = {thing["mesh"] for thing in table["objects"]}
    return Drawn(table, {name: mesh for name, mesh in drawn.meshes.items() if name in used})
