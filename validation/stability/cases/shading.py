"""Extreme cases 33 to 45, 47 and 48: spawned rays, refraction, media, mirrors, highlights, lights and limits."""

from validation.stability.cases import lights, limits, refraction, spawned
from validation.stability.cases.case import ExtremeCase

CASES: tuple[ExtremeCase, ...] = (
    *spawned.CASES,
    *refraction.CASES,
    *lights.CASES,
    *limits.CASES,
)
