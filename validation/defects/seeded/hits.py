"""Defects of rays and hits."""

from dataclasses import replace
from typing import Any

import numpy as np

from validation.defects.changes import Change, Constant, Function, Rule, Wrapped
from validation.defects.edits import argument, call, choice, compare, drop, element, value, without
from validation.defects.seeded.defect import Defect


def _fill_all_but(lost: Any) -> Wrapped:
    """Blocks in whose places the faces for which ``lost`` is true are missing."""

    def fill(sound: Any, vertices: Any, faces: Any, block_faces: Any, threads: int) -> Any:
        return sound(vertices, faces, np.where(lost(block_faces), -1, block_faces).astype(np.int32), threads)

    return Wrapped("fill_blocks", fill)


def _fill_rounded(sound: Any, vertices: Any, *rest: Any) -> Any:
    return sound(vertices.astype(np.float32).astype(np.float64), *rest)


def _refit_leaving_blocks(sound: Any, tree: Any, *rest: Any) -> Any:
    return replace(sound(tree, *rest), blocks=tree.blocks)


def _refit_leaving_upper_z(sound: Any, tree: Any, *rest: Any) -> Any:
    from renderer.trace.layout import CHILDREN, NODE_WORDS

    moved = sound(tree, *rest)
    was, now, links = (words.reshape(-1, NODE_WORDS) for words in (tree.nodes, moved.nodes, moved.links))
    leaves = links[:, CHILDREN : CHILDREN + 8] < 0
    now[:, 40:48][leaves] = was[:, 40:48][leaves]
    return moved


def _refit_in_old_units(sound: Any, tree: Any, vertices: Any, faces: Any, scale: float, threads: int) -> Any:
    return sound(tree, vertices, faces, tree.scale, threads)


def _any_beyond_one(sound: Any, tree: Any, threads: int, *arrays: Any) -> Any:
    from renderer.trace.batch import RayBatch

    rays = RayBatch(*arrays)
    return sound(tree, threads, *rays._replace(t_min=np.maximum(rays.t_min, 1.0)))


def _closest_but_last_of_chunks(sound: Any, tree: Any, mesh: Any, threads: int, *arrays: Any) -> Any:
    from renderer.trace.batch import RayBatch

    rays = RayBatch(*arrays)
    ends = np.broadcast_to(rays.t_max, rays.number).copy()
    ends[8191::8192] = 0.0
    return sound(tree, mesh, threads, *rays._replace(t_max=ends))


def _few_an_ulp_farther(
    sound: Any, tree: Any, origins: Any, directions: Any, t_min: Any, t_max: Any, starts: Any, t: Any, *others: Any
) -> int:
    row = sound(tree, origins, directions, t_min, t_max, starts, t, *others)
    t *= 1.0 + 2.0**-52
    return int(row)


def _points_moved(sound: Any, mesh: Any, face: Any, u: Any, v: Any) -> Any:
    return sound(mesh, face, u, v) + 1e-9 * mesh.vertices[mesh.faces[face][:, 0]]


def _normals_turned(sound: Any, mesh: Any, face: Any) -> Any:
    return sound(mesh, face) * np.where(face % 2 == 0, -1.0, 1.0)[:, None]


_ROUNDED_SLOPE = """
def slope_of(face, d):
    n = heads(face.normal)
    x = n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
    return 1 if x > 0.0 else (-1 if x < 0.0 else 0)
"""
_NEAREST_FLOAT = """
def round_up(x):
    return narrow(x)
"""

_CHANGES: dict[str, Change] = {
    "a triangle missing from the tree": _fill_all_but(lambda faces: faces == 5),
    "one triangle in 512 missing beyond the 65,536th": _fill_all_but(
        lambda faces: (faces > 0xFFFF) & (faces % 512 == 0)
    ),
    "packets exit with their first hit": Rule("packet-limit", call("most_of", "_least(_0, _1)")),
    "single rays exit at half their best hit": Rule("resume-limit", element(0, "_ * np.float32(0.5)")),
    "no box padding": Constant("FAR_PADDING", "np.float32(1.0)"),
    "boxes rounded to nearest": Function("round_up", _NEAREST_FLOAT),
    "origins far beyond what boxes tell": Rule("origin-bounds", value("_ * np.float32(-(2.0**11))")),
    "eight rays end where the first of them does": Rule(
        "ends-of-eight", call("_often_one", "_often_one(_0, _1, np.int64(0), _3)", nth=1)
    ),
    "one ray in range vouches for eight": Rule("range-of-eight", compare(">", "0", nth=0)),
    "a packet's beam too narrow": Constant("_WIDER", "np.float32(-(2.0**-8))"),
    "streams lose a leaf's last block": Rule("rest-of-leaf", compare(">", "1")),
    "the highest face wins in streams": Rule("tie-in-streams", compare(">", nth=2)),
    "the highest face wins in packets": Rule("tie-in-blocks", compare(">", nth=3)),
    "float32 shear in the triangle test": Rule("shear", argument(6, "widen(narrow(_))")),
    "vertices of the triangle test in float32": Wrapped("fill_blocks", _fill_rounded),
    "an edge counts for neither side": Rule("inside-edges", compare(">", nth=0)),
    "faces are culled from behind": Rule("inside-edges", without("|", 1)),
    "hits in doubt are not settled": Rule("resolve-uncertain", without("or", 0)),
    "hits in doubt may lie before their boxes": Rule("t-within-box", drop),
    "faces of no area are never hit": Rule("t-on-line", element(0, "np.nan")),
    "a determinant that is noise is believed": Rule("uncertain-determinant", drop),
    "determinants that blow roundings up are not in doubt": Constant("SLANT", "2.0**-40"),
    "edges as rounded are believed": Rule("rounded-edge", compare("<")),
    "hits of scaled meshes keep the tree's t": Rule("t-in-mesh-units", without("/", 1)),
    "hits are in doubt too late": Constant("intersect.DOUBT", "2.0**-40"),
    "stale boxes of inner nodes after a refit": Wrapped("refit._fit_nodes", lambda sound, nodes, links: None),
    "stale triangles after a refit": Wrapped("refit_tree", _refit_leaving_blocks),
    "any hit forgets what is near": Wrapped("any_hits", _any_beyond_one),
    "of octants equally far one is lost": Rule("place-of-octant", without("|", 1)),
    "a packet drops what waits beyond eight octants": Rule("packet-stack", value("min(_, 8)")),
    "single rays skip a leaf's last block": Rule("blocks-of-leaf", argument(2, "max(_ - 1, 1)")),
    "uncertain hits of few rays are left out": Rule("uncertain-of-few", drop),
    "single rays are an ulp too far": Wrapped("closest._trace_few", _few_an_ulp_farther),
    "bad rays are let through": Wrapped("closest.reject", lambda sound, *arguments: None),
    "places of hits off by 1e-9 of a corner": Wrapped("hits.points_on", _points_moved),
    "normals of hits turned inwards on half the faces": Wrapped("hits._normals", _normals_turned),
    "u and v exchanged in packets": Rule("weights-of-hit", argument(2, "Best(_.t, _.face, _.v, _.u, _.w)")),
    "single rays accept hits up to 1.0001 t_max": Rule("first-limit", argument(0, "_ * 1.0001")),
    "the last ray of every full chunk is a miss": Wrapped("closest_hits", _closest_but_last_of_chunks),
    "a refit leaves each leaf's upper z": Wrapped("refit_tree", _refit_leaving_upper_z),
    "a refit counts in the units of the old size": Wrapped("refit_tree", _refit_in_old_units),
    "bounds of t lose the dimensions of the rays": Rule("bounds-in-shape", choice(otherwise="_.ravel()")),
    "a loaded tree forgets its repairs": Rule("repairs-of-file", value("None")),
    "normals of OBJ files of which some corners have one": Rule("all-have-normals", call("all", "_self.any()")),
    "a material of an OBJ file begins a face late": Rule(
        "last-use-before", call("searchsorted", "np.searchsorted(_0, _1)")
    ),
    "textures of glTF files turn the other way": Rule("turned-with-v-up", element(1, "(-_[0], _[1], _[2])")),
    "a face that holds a start is hit from there": Rule("met-once", argument(0, "0.0")),
    "faces beside a start are met from where it is rounded to": Rule("beside-start", value("np.int64(0)")),
    "a ray passes faces that coincide all at once": Rule("coincident-order", value("False")),
    "the foot of a wall does not part the face that it stands on": Rule("foot-of-wall", value("True")),
    "a fin stops rays that start beside it": Rule("bounds-one-side", without("and", 3)),
    "a start on an edge is beside the next face": Rule("start-on-edge", value("False")),
    "which side a ray leads to is told by a rounded normal": Function("slope_of", _ROUNDED_SLOPE),
    "starts beside an edge are moved as if inside": Rule("start-inside-face", value("True")),
}
HITS = tuple(Defect("hits", name, change) for name, change in _CHANGES.items())
