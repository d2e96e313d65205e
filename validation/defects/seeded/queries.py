"""Defects of inside, distances, all hits and views."""

from typing import Any

import numpy as np

from validation.defects.changes import Change, Constant, Function, Rule, Wrapped, after
from validation.defects.edits import call, choice, compare, drop, element, value, without
from validation.defects.seeded.defect import Defect


def _with_boundary(sound: Any, tree: Any, mesh: Any, points: Any, boundary: bool, *rest: Any) -> Any:
    return sound(tree, mesh, points, True, *rest)


def _always_nonzero(sound: Any, *arguments: Any) -> Any:
    *before, _, winding, threads = arguments
    return sound(*before, "nonzero", winding, threads)


_ROUNDED_PRODUCT = """
def _add_pair(parts, count, pair):
    return _add(parts, count, pair[0])
"""

_CHANGES: dict[str, Change] = {
    "points on an edge are not moved off it": Rule("move-off-edge", drop),
    "signs of areas are believed however small": Constant("crossings._AREA_ERROR", "0.0"),
    "signs of volumes are believed however small": Constant("crossings._VOLUME_ERROR", "0.0"),
    "points on upright faces are not seen": Rule("on-upright-face", element(1, "0")),
    "expansions forget what products round off": Function("_add_pair", _ROUNDED_PRODUCT),
    "exact signs forget what products round off": Rule("product-tails", choice(otherwise="0.0")),
    "hits at one edge are contacts of their own": Rule("merge-at-edge", value("False")),
    "a corner is taken for one of its edges": Rule("corner-of-edges", value("False")),
    "of hits at one t the highest face comes first": Rule("order-at-t", compare(">", nth=2)),
    "max_hits keeps one more": Rule("max-hits", call("minimum", "minimum(_0, _1 + (1 if _1 < 1000 else 0))")),
    "blocks of which a ray sees the first face alone are left out": Rule("seen-blocks", compare(">", "1")),
    "the nearest point is never a corner": Rule("nearest-corner", value("False")),
    "points beside an edge are taken as over the face": Rule("over-face", without("and", 2)),
    "points near a plane lose their digits": Rule("cancelled-height", value("False")),
    "points near an edge lose their digits": Rule("cancelled-area", value("False")),
    "of faces equally near any may come": Rule("equally-near", without("and", 1)),
    "boxes are taken as a hundredth farther": Constant("nearest._LESS", "1.02"),
    "a face's least distance bounds the search": Rule(
        "bound-of-block", call("select", "select(_0, _1 * splat4(0.5), _2)")
    ),
    "a distance is reached only short of it": Rule("reach-is-closed", compare("<", nth=1)),
    "distances of scaled meshes keep the tree's units": Rule("distance-in-mesh-units", without("/", 1)),
    "distances whose products vanish are believed": Rule("lost-products", without("and", 0)),
    "distances are negative outside": after("signed.signed_distance", lambda distance: -distance),
    "an end hides itself": Rule("room-before-end", without("-", 1)),
    "a way is seen to its middle": after("visible._between", lambda rays: rays._replace(t_max=rays.t_max * 0.5)),
    "points on the surface are inside without it": Wrapped("contains.contains", _with_boundary),
    "parity is taken as winding": Wrapped("contains.contains", _always_nonzero),
    "the drop-in lists each face at an edge": Rule(
        "hits-of-drop-in", call("all_hits", "_call(_0, _1, max_hits=_max_hits, contacts=False)")
    ),
    "a limited distance loses its sign": after(
        "signed.signed_distance", lambda distance: np.where(np.isinf(distance), np.inf, distance)
    ),
    "views leave room by where they begin alone": Rule("room-at-ends", call("maximum", "_0")),
    "-0.0 is another place than 0.0": Rule("zero-without-sign", without("+", 1)),
}
QUERIES = tuple(Defect("queries", name, change) for name, change in _CHANGES.items())
