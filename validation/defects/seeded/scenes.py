"""Defects of scenes of placed meshes."""

from typing import Any

from validation.defects.changes import Change, Constant, Function, Rule, Wrapped, after
from validation.defects.edits import call, choice, element, operand, value, without
from validation.defects.seeded.defect import Defect


def _write_in_place(sound: Any, scene: Any) -> Any:
    return scene._records.array


def _move_all_or_none(sound: Any, scene: Any, object: Any, transforms: Any = None, *, instances: Any = None) -> Any:
    return sound(scene, object, transforms) if instances is None else None


def _trace_alone(sound: Any, scene: Any, rays: Any, faces: Any) -> Any:
    return scene.members[0].built.tree if len(scene.top.instances) == 1 else sound(scene, rays, faces)


_OTHER_ORDER = """
def _along(matrix, row, x, y, z):
    m = offset(matrix, row)
    return x * load(m, 0) + (y * load(m, 1) + (z * load(m, 2) + load(m, 3)))
"""
_LEFT_IN_FRAME = """
def _return_to_top(tree, rays, prepared, r):
    store(prepared.integers, _NODES_AT + r, tree.top)
"""
_FARTHEST_TWO = """
def _trace_packet(tree, rays, stack, any_hit):
    top, more = sound(tree, rays, stack, any_hit)
    return min(top, np.int64(2)), more
"""

_CHANGES: dict[str, Change] = {
    "corners are placed by another order of sums": Function("instances._along", _OTHER_ORDER),
    "places of instances are rounded to float32": Rule("placed-corner", operand("+", 3, "np.float64(narrow(_))")),
    "corners of mirrored instances are not exchanged": Rule(
        "mirrored-corners", call("_PlacedRows", "_call(_0, _1, _2, _3, 12, 24)")
    ),
    "faces of scenes are numbered one too low": Rule("faces-of-scene", choice(then="np.int32(max(_ - 1, 0))")),
    "faces are hit from the side that is left out too": Rule("facing", value("True")),
    "masks of rays are not asked": Rule("mask-of-ray", without("and", 0)),
    "faces that a mask leaves out hold starts": Rule("holders-of-mask", value("False")),
    "ignored instances are hit": Rule("mask-of-ray", without("and", 1)),
    "instances get no room for rounding": Rule("room-of-instance", value("0.0 * a")),
    "streams in scenes exit at half their best hit": Rule("resume-in-scene", element(1, "_ * np.float32(0.5)")),
    "a ray that left an instance goes on in its frame": Function("instances._return_to_top", _LEFT_IN_FRAME),
    "packets forget all but the farthest two instances": Function("instances._trace_packet", _FARTHEST_TWO),
    "boxes of placed meshes get no room": Constant("instances._BOX_ROOM", "np.float32(0.0)"),
    "nearly singular matrices are taken": Constant("placing.SINGULAR", "1e300"),
    "instances cannot be hidden": Constant("instances.HIDDEN", "0"),
    "a change is written into the records that queries read": Wrapped("RayScene._writable", _write_in_place),
    "a move of some instances is forgotten": Wrapped("RayScene.move", _move_all_or_none),
    "one instance is traced where its mesh is": Wrapped("BuiltScene.tree_for", _trace_alone),
    "u and v of mirrored instances stay those of the placed face": after(
        "BuiltScene.located", lambda at: at._replace(u=at.v, v=at.u)
    ),
}
SCENES = tuple(Defect("scenes", name, change) for name, change in _CHANGES.items())
