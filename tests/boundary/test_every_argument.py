"""Each public function and method has a test that varies its arguments: a new one, or a new argument, needs one too."""

import ast
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

TESTS = Path(__file__).parents[1]
RAYS, POINTS = "trace/test_ray_twins.py", "distance/test_point_twins.py"
STUDIES, VIEWS, STATES = "studies/test_study_twins.py", "studies/test_view_twins.py", "process/test_travel_states.py"
# The files where the arguments of each are varied; of methods, by their names, in whatever class.
VARIED = {
    **dict.fromkeys(["closest_hit", "any_hit", "all_hits", "count_hits", "count_steps"], RAYS),
    **dict.fromkeys(["contains", "winding_number", "closest_point", "signed_distance", "visible"], POINTS),
    **dict.fromkeys(["occlusion", "sky_view_factor", "sun_hours", "ambient_occlusion", "openness"], STUDIES),
    "visible_faces": VIEWS, "depth_map": VIEWS, "scan": f"{VIEWS} studies/test_said.py",
    **dict.fromkeys(["fibonacci_hemisphere", "fibonacci_sphere", "cosine_hemisphere"], "studies/test_said.py"),
    **dict.fromkeys(["tregenza", "reinhart"], "studies/test_directions.py"), "face_points": "studies/test_said.py",
    **dict.fromkeys(["intersects_id", "intersects_location", "intersects_first", "intersects_any", "contains_points"],
                    "trimesh_ray/test_twins.py"),
    "refit": "tree/test_refit.py", "save": "tree/test_store.py", "load": "tree/test_store.py", "from_mesh": RAYS,
    "load_mesh": "mesh/test_repair.py", "load_scene": "scene/test_scene.py", "repaired": "mesh/test_repair.py",
    "concatenate": "mesh/test_mesh.py", "transformed": "mesh/test_mesh.py", "viewing": "mesh/test_mesh.py",
    "face_normals": "mesh/test_mesh.py", "vertex_normals": "mesh/test_mesh.py", "is_closed": "mesh/test_mesh.py",
    "render": "picture/test_render.py scene/test_needs.py shade/test_media.py",
    "prepare": f"{STATES} front/test_promised.py", "needs_of": "scene/test_needs.py",
    "srgb": "picture/test_image.py", "view": "viewer/test_viewer_commands.py",
    "through": RAYS, "shaped": STATES,
}  # fmt: skip
# What is shown while it runs is asked by other tests than those of answers.
SHOWN = {"progress"}
# Not given by any test: where a viewer listens, which the command's own tests ask.
LISTENING = {"view": {"host", "port"}}
CLASSES = [renderer.Octree, renderer.BruteForce, renderer.Mesh, renderer.Hits, renderer.AllHits, RayMeshIntersector]
# Whole numbers for each argument that stands for an array.
THREE, UP, CORNERS = [0, 0, 0], [0, 0, 1], [[0, 0, 1], [1, 0, 1], [0, 1, 1]]
WHOLE: dict[str, Any] = {
    **dict.fromkeys(["points", "targets", "origins", "directions", "normals", "sun_directions", "vertices", "colors",
                     "pattern", "linear", "grid"], CORNERS),
    **dict.fromkeys(["leaving", "reaching", "side", "t_min", "t_max", "max_distance", "origin", "eye"], THREE),
    **dict.fromkeys(["up", "normal", "weights"], UP), "texcoords": [[0, 0], [1, 0], [0, 1]], "spacing": [1, 1],
    "distance": 1, "tolerance": 1,
}  # fmt: skip
# Beside these, what each needs: `side` goes with faces alone.
BESIDE: dict[str, Any] = {"side": {"leaving": THREE}}
OCTREE = Octree(CORNERS, [[0, 1, 2], [0, 2, 1]])  # closed, as some ask
# The corners of faces are never made float64.
UNROUNDED = {"faces"}


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


def text_of(files: str) -> str:
    return "\n".join((TESTS / file).read_text(encoding="utf-8") for file in files.split())


def words_of(text: str) -> set[str]:
    """Names of arguments that a file gives, and its strings, which may be names that are drawn."""
    nodes = list(ast.walk(ast.parse(text)))
    return {node.arg for node in nodes if isinstance(node, ast.keyword) and node.arg} | {
        node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }


def test_each_public_function_and_method_is_here() -> None:
    assert public().keys() == VARIED.keys()
    assert callable(import_module("renderer.viewer.view").view)


@cases("name", VARIED)
def test_its_optional_arguments_are_given_there(name: str) -> None:
    parameters = inspect.signature(public()[name]).parameters.values()
    optional = {p.name for p in parameters if p.default is not p.empty and p.kind is not p.VAR_KEYWORD}
    text = text_of(VARIED[name])
    assert name in text and optional - SHOWN - LISTENING.get(name, set()) <= words_of(text)


@cases("whole", [2**53 + 1, -(2**53) - 1, 2**63 - 1, -(2**63)])
@cases(("name", "argument"), sorted(array_arguments()))
def test_a_whole_number_that_float64_does_not_hold_is_refused(name: str, argument: str, whole: int) -> None:
    """By the name of its argument; the same numbers with another in its place are taken."""
    homes = (OCTREE, studies, Mesh, renderer, import_module(heightfield_mesh.__module__))
    asked = getattr(next(home for home in homes if hasattr(home, name)), name)
    known = inspect.signature(asked).parameters
    given = {n: WHOLE[n] for n, p in known.items() if p.default is p.empty and n in WHOLE}
    given |= BESIDE.get(argument, {}) | ({"octree": OCTREE} if "octree" in known else {})
    given |= {"faces": [[0, 1, 2]]} if "faces" in known else {}
    values = np.array(WHOLE[argument], np.int64)
    asked(**given | {argument: values})
    values.flat[-1] = whole
    with pytest.raises(ValueError, match=rf"^{argument}: expected numbers that float64 holds, got the integer \d+, "):
        asked(**given | {argument: values})
