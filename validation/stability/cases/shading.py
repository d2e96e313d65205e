"""Extreme cases 33 to 45, 47 and 48: spawned rays, refraction, media, mirrors, highlights, lights and limits."""

from validation import extreme_lights, extreme_limits, extreme_refraction, extreme_spawned
from validation.extreme import ExtremeCase

CASES: tuple[ExtremeCase, ...] = (
    *extreme_spawned.CASES,
    *extreme_refraction.CASES,
    *extreme_lights.CASES,
    *extreme_limits.CASES,
)
