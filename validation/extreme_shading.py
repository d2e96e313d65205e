"""Extreme cases 33 to 45: spawned rays, refraction, media, mirrors, highlights and lights."""

from validation import extreme_lights, extreme_refraction, extreme_spawned
from validation.extreme import ExtremeCase

CASES: tuple[ExtremeCase, ...] = (*extreme_spawned.CASES, *extreme_refraction.CASES, *extreme_lights.CASES)
