"""A room with a column, as a file with objects and materials: what commands of view factors are tried on."""

from pathlib import Path
from typing import Any

import numpy as np

from renderer.mesh.shapes import box

# The objects, two faces each but for the column, and the material of each.
OBJECTS = {
    "west": "plaster", "east": "plaster", "south": "plaster", "north": "glass", "floor": "wood", "ceiling": "plaster",
    "column": "wood",
}  # fmt: skip
MATERIALS = {"plaster": 0.8, "glass": 0.1, "wood": 0.4}
# The outward directions of the walls.
_AXES = {"west": (0, 0), "east": (0, 1), "south": (1, 0), "north": (1, 1), "floor": (2, 0), "ceiling": (2, 1)}


def room_objects(column: bool = True) -> dict[str, tuple[Any, Any]]:
    """Vertices and faces of each object of a unit room, whose walls face inwards, around a column that stands free."""
    cube, objects = box(), {}
    for name, (axis, side) in _AXES.items():
        on = (cube.vertices[cube.faces][:, :, axis] == side).all(axis=1)
        objects[name] = cube.vertices, cube.faces[on][:, ::-1]
    if column:
        inner = box((0.4, 0.45, 0.2), (0.6, 0.55, 0.8))
        objects["column"] = inner.vertices, inner.faces
    return objects


def write_room(folder: Path, column: bool = True) -> Path:
    """``room.obj`` with ``room.mtl`` in a folder."""
    lines, begin = ["mtllib room.mtl"], 1
    for name, (vertices, faces) in room_objects(column).items():
        lines += [f"o {name}", f"usemtl {OBJECTS[name]}"]
        lines += ["v {} {} {}".format(*vertex) for vertex in vertices.tolist()]
        lines += ["f {} {} {}".format(*face) for face in (faces + begin).tolist()]
        begin += len(vertices)
    (folder / "room.obj").write_text("\n".join(lines))
    shades = [f"newmtl {name}\nKd {shade} {shade} {shade}" for name, shade in MATERIALS.items()]
    (folder / "room.mtl").write_text("\n".join(shades))
    return folder / "room.obj"


def same_bits(one: Any, other: Any) -> bool:
    """Whether two ``ViewFactors`` have the same bits, names apart."""
    pairs = [(getattr(one, name), getattr(other, name)) for name in ("areas", "sky", "backs", "rays")]
    for name in ("exchange", "errors"):
        a, b = getattr(one, name), getattr(other, name)
        pairs += [(getattr(a, part), getattr(b, part)) for part in ("data", "indices", "indptr")]
    return all(np.asarray(a).tobytes() == np.asarray(b).tobytes() for a, b in pairs)
