"""Whole numbers that float64 does not hold are refused by each public function and method that takes an array."""

import inspect
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from cases import cases
from numpy.typing import ArrayLike

import renderer
from renderer import Mesh, Octree, studies
from renderer.mesh.heightfield import heightfield_mesh
from renderer.trimesh_ray import RayMeshIntersector

CLASSES = [renderer.Octree, renderer.BruteForce, renderer.Mesh, renderer.Hits, renderer.AllHits, RayMeshIntersector]
# Whole numbers for each argument that stands for an array.
THREE, UP, CORNERS = [0, 0, 0], [0, 0, 1], [[0, 0, 1], [1, 0, 1], [0, 1, 1]]
WHOLE: dict[str, Any] = {
    **dict.fromkeys(["points", "targets", "origins", "directions", "normals", "sun_directions", "vertices", "colors",
                     "pattern", "linear", "grid"], CORNERS),
    **dict.fromkeys(["leaving", "reaching", "side", "t_min", "t_max", "max_distance", "origin", "eye"], THREE),
    **dict.fromkeys(["up", "normal", "weights", "azimuth"], UP), "elevation": THREE, "transmittance": [0, 0],
    "north": [0, 1, 0], "texcoords": [[0, 0], [1, 0], [0, 1]], "spacing": [1, 1],
    "distance": 1, "tolerance": 1, "bounds": [[0, 0, 0], [1, 1, 1]],
    "values": THREE, "values of take": [0, 0], "matrix": np.eye(4).tolist(),
}  # fmt: skip
# Beside these, what each needs: `side` goes with faces alone.
BESIDE: dict[str, Any] = {"side": {"leaving": THREE}, "bounds": {"spacing": 1}}
OCTREE = Octree(CORNERS, [[0, 1, 2], [0, 2, 1]])  # closed, as some ask
HITS = OCTREE.closest_hit(THREE, UP)
# These are never made float64: the corners, materials and groups of faces, masks and numbers of objects.
UNROUNDED = {"faces", "face_materials", "mask", "through", "groups"}


def public() -> dict[str, Any]:
    """Functions of the packages and methods of the classes, by their names."""
    of_packages = [getattr(home, name) for home in (renderer, studies) for name in home.__all__]
    found = {one.__name__: one for one in of_packages if inspect.isfunction(one)}
    for one in CLASSES:
        found |= {n: f for n, f in inspect.getmembers(one, callable) if not n.startswith("_")}
    return found


def is_array(parameter: inspect.Parameter) -> bool:
    """Whether an argument stands for an array, or is a number that is checked as one."""
    stated = parameter.annotation
    named = "ArrayLike" in stated if isinstance(stated, str) else set(get_args(ArrayLike)) <= set(get_args(stated))
    return named or parameter.name in {"distance", "tolerance"}


def array_arguments() -> list[tuple[str, str]]:
    """Each function and method that takes an array, and the argument; but for those of trimesh, which ask ours."""
    callables = public() | {"heightfield_mesh": heightfield_mesh, "Mesh": Mesh.repaired}  # of the same arguments
    return [
        (name, p.name)
        for name in callables.keys() - vars(RayMeshIntersector).keys()
        for p in inspect.signature(callables[name]).parameters.values()
        if is_array(p) and p.name not in UNROUNDED
    ]


def _whole(name: str, argument: str) -> Any:
    return WHOLE.get(f"{argument} of {name}", WHOLE[argument])


@cases("whole", [2**53 + 1, -(2**53) - 1, 2**63 - 1, -(2**63)])
@cases(("name", "argument"), sorted(array_arguments()))
def test_a_whole_number_that_float64_does_not_hold_is_refused(
    name: str, argument: str, whole: int, tmp_path: Path
) -> None:
    """By the name of its argument; the same numbers with another in its place are taken."""
    homes = (OCTREE.mesh, OCTREE, studies, HITS, renderer, import_module(heightfield_mesh.__module__))
    asked = getattr(next(home for home in homes if hasattr(home, name)), name)
    known = inspect.signature(asked).parameters
    given = {n: _whole(name, n) for n, p in known.items() if p.default is p.empty and n in WHOLE}
    given |= BESIDE.get(argument, {}) | ({"octree": OCTREE} if "octree" in known else {})
    given |= {"faces": [[0, 1, 2]]} if "faces" in known else {}
    given |= {"rule": "even-odd"} if "rule" in known else {}  # by which a face and its back are closed
    given |= {"path": tmp_path / "a.ply"} if name == "save" else {}
    values = np.array(_whole(name, argument), np.int64)
    asked(**given | {argument: values})
    values.flat[-1] = whole
    with pytest.raises(ValueError, match=rf"^{argument}: expected numbers that float64 holds, got the integer \d+, "):
        asked(**given | {argument: values})
