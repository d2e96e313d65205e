"""Defects of studies."""

from dataclasses import replace
from typing import Any

import numpy as np

from validation.defects.changes import Change, Rule, Wrapped, after
from validation.defects.edits import argument, call, choice, compare, operand, value
from validation.defects.seeded.defect import Defect


def _first_direction_open(sound: Any, request: Any, sky: Any, answers: Any) -> Any:
    limits = np.array(sky.limits)
    limits[:1] = 0.0
    return sound(request, sky._replace(limits=limits), answers)


def _mirrored_bytes(bits: Any) -> Any:
    return np.packbits(np.unpackbits(bits, axis=-1, bitorder="little"), axis=-1)


def _limits_in_directions(sound: Any, distance: float, directions: Any) -> Any:
    from renderer.studies.share import lengths_of

    return sound(distance, directions) * lengths_of(directions)


def _hours_alike(sound: Any, argument: str, weights: Any, count: int) -> Any:
    return np.ones(count) if argument == "weights" else sound(argument, weights, count)


def _without_room(sound: Any, tree: Any, mesh: Any, points: Any, room: Any, threads: int) -> Any:
    return sound(tree, mesh, points, 0.0 * room, threads)


def _turned_over(chosen: Any) -> Any:
    return replace(chosen, points=replace(chosen.points, normals=-chosen.points.normals))


_CHANGES: dict[str, Change] = {
    "what lies at a point's horizon is open": Rule("open-above-horizon", compare(">=")),
    "the first direction of all is open": Wrapped("share.run", _first_direction_open),
    "bits stand the other way round in their bytes": after("share.evaluate_bits", _mirrored_bytes),
    "rays of studies leave a face on its other side": Rule("side-of-study-ray", compare("<")),
    "the whole is without what the horizon hides": Rule("cosine-weight", call("abs", "max(_0, 0.0)")),
    "boxes seen along parallel rays have no depth": Rule("projected-box", operand("+", 1, None)),
    "a screen takes its share twice": Rule("share-of-pane", value("_ * _")),
    "patches weigh the same at all heights": Rule("cosine-of-patches", value("False")),
    "distances in units of the directions": Wrapped("share.limits_of", _limits_in_directions),
    "every sun stands for an hour": Wrapped("sky.check_weights", _hours_alike),
    "a scan's distances in units of its directions": Wrapped(
        "scanner.lengths_of", lambda sound, directions: np.ones(len(directions))
    ),
    "an eye sees faces by their middles, near or hidden": Rule("faces-in-view", value("np.ones_like(_)")),
    "at a corner the other side of the normal's region is taken": Rule("side-of-normal", compare("<")),
    "faces around a corner at the rim count as closed": Rule("closed-fan", argument(2, "1.0")),
    "points that rounding put off the surface are not on it": Wrapped("on_surface.closest_point", _without_room),
    "a scanner on a roof stands below it": Rule("outer-side-of-scanner", choice(then="-_")),
    "points of a file look the other way": after("of_file", _turned_over),
    "faces that hold the beginning of a view hide its end": Wrapped(
        "visible.offset_origins", lambda sound, rays, *rest: rays
    ),
}
STUDIES = tuple(Defect("studies", name, change) for name, change in _CHANGES.items())
