"""Defects of scenes of placed meshes."""

from typing import Any

from validation.defects.changes import Change, Constant, Function, Rule, Wrapped, after
from validation.defects.edits import call, choice, element, operand, value, without
from validation.defects.seeded.defect import Defect


def _number_first_alone(sound: Any, members: Any, instances: Any) -> Any:
    return sound(members[:1], instances)


def _write_in_place(sound: Any, scene: Any) -> Any:
    return scene._instances


def _place_all_but_last(sound: Any, member: Any, records: Any, matrices: Any) -> Any:
    sound(member, records[:-1] if len(records) > 1 else records, matrices)


_OTHER_ORDER = """
def _along(matrix, row, x, y, z):
    m = offset(matrix, row)
    return x * load(m, 0) + (y * load(m, 1) + (z * load(m, 2) + load(m, 3)))
"""

_CHANGES: dict[str, Change] = {
    "corners are placed by another order of sums": Function("instances._along", _OTHER_ORDER),
    "places of instances are rounded to float32": Rule("placed-corner", operand("+", 3, "np.float64(narrow(_))")),
    "corners of mirrored instances are not exchanged": Rule(
        "mirrored-corners", call("_PlacedRows", "_call(_0, _1, _2, _3, 12, 24)")
    ),
    "faces of scenes are numbered one too high": Rule("faces-of-scene", choice(then="_ + np.int32(1)")),
    "faces are hit from the side that is left out too": Rule("facing", value("True")),
    "masks of rays are not asked": Rule("mask-of-ray", without("and", 0)),
    "ignored instances are hit": Rule("mask-of-ray", without("and", 1)),
    "instances get no room for rounding": Rule("room-of-instance", value("0.0")),
    "streams in scenes exit at half their best hit": Rule("resume-in-scene", element(1, "_ * np.float32(0.5)")),
    "a ray that left an instance goes on in its frame": Constant(
        "instances._LEFT", "(0x7F800000 << 32) | (_LEAVE & 0xFFFFFFFF)"
    ),
    "boxes of placed meshes get no room": Constant("instances._BOX_ROOM", "np.float32(0.0)"),
    "nearly singular matrices are taken": Constant("placing.SINGULAR", "1e300"),
    "instances cannot be hidden": Constant("instances.HIDDEN", "0"),
    "faces of the first object alone are numbered": Wrapped("built.number_faces", _number_first_alone),
    "a change is written into the records that queries read": Wrapped("RayScene._writable", _write_in_place),
    "the last instance that moves stays": Wrapped("rayscene.scene._place", _place_all_but_last),
    "u and v of mirrored instances stay those of the placed face": after(
        "BuiltScene.located", lambda at: at._replace(u=at.v, v=at.u)
    ),
}
SCENES = tuple(Defect("scenes", name, change) for name, change in _CHANGES.items())
