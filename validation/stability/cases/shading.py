"""Extreme cases 33 to 45, 47 and 48: spawned rays, refraction, media, mirrors, highlights, lights and limits."""

from validation.stability.cases import lights as extreme_lights
from validation.stability.cases import limits as extreme_limits
from validation.stability.cases import refraction as extreme_refraction
from validation.stability.cases import spawned as extreme_spawned
from validation.stability.cases.case import ExtremeCase

CASES: tuple[ExtremeCase, ...] = (
    *extreme_spawned.CASES,
    *extreme_refraction.CASES,
    *extreme_lights.CASES,
    *extreme_limits.CASES,
)
