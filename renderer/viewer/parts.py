"""The objects of a shown scene, as its page names them, and which of them a face belongs to."""

from typing import NamedTuple

import numpy as np

from renderer.scene.hide import FLOOR, object_names
from renderer.scene.instance import Instance
from renderer.scene.scene import Scene
from renderer.viewer.shown import ShownScene


class Part(NamedTuple):
    """An object: its name as of ``object_names``, and what it is made of."""

    name: str
    instances: tuple[Instance, ...]

    @property
    def label(self) -> str:
        """Its name for users: that of its mesh, if that has one."""
        return FLOOR if self.name == FLOOR else self.instances[0].mesh.name or self.name

    @property
    def faces(self) -> int:
        return sum(instance.faces for instance in self.instances)

    @property
    def bounds(self) -> list[list[float]] | None:
        """Its least and greatest corner; None without vertices."""
        corners = [instance.mesh.bounds for instance in self.instances if len(instance.mesh.vertices)]
        if not corners:
            return None
        lower, upper = zip(*corners, strict=True)
        return [np.min(lower, axis=0).tolist(), np.max(upper, axis=0).tolist()]


def parts_of(scene: Scene) -> list[Part]:
    """All objects of ``scene``, in the order of their faces."""
    names, count = object_names(scene), len(scene.objects)
    pieces = [scene.instances[i : i + 1] for i in range(count)] + [scene.instances[count:]]
    return [Part(name, piece) for name, piece in zip(names, pieces, strict=False)]


def part_of_face(shown: ShownScene, face: int) -> Part:
    """The object that a face of the shown mesh belongs to."""
    seen = [part for part in parts_of(shown.whole.scene) if part.name not in shown.hidden]
    ends = np.cumsum([part.faces for part in parts_of(shown.scene)])  # those that sections leave
    return seen[int(np.searchsorted(ends, face, side="right"))]
