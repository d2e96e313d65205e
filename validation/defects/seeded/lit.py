"""Defects of scenes lit by radiosity."""

from typing import Any

import numpy as np

from validation.defects.changes import Change, Rule, Wrapped
from validation.defects.edits import call, value
from validation.defects.seeded.defect import Defect


def _unlit_by_emission(sound: Any, factors: Any, emission: Any, reflectance: Any, **options: Any) -> Any:
    found = sound(factors, emission, reflectance, **options)
    object.__setattr__(found, "values", emission)
    return found


def _grey(sound: Any, mesh: Any, values: Any, **options: Any) -> Any:
    return sound(mesh, np.repeat(values.mean(axis=1), 3).reshape(-1, 3), **options)


_CHANGES: dict[str, Change] = {
    "lights of patches fall off with the distance": Rule("patch-inverse-square", value("np.cbrt(_) ** 2")),
    "nothing hides lights from patches": Rule("patch-shadows", call("where", "_2")),
    "nothing hides lamps from patches": Rule("lamp-shadows", call("where", "_2")),
    "surfaces only emit": Wrapped("lit.radiosity", _unlit_by_emission),
    "lit surfaces have no hue": Wrapped("lit.vertex_colors", _grey),
}
LIT = tuple(Defect("lit", name, change) for name, change in _CHANGES.items())
