"""Check of one picture of ours against one reference: its gates, its record and its files."""

import hashlib
import math
import re
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.picture.image import Image
from validation.gates import Gate
from validation.job import Job
from validation.pictures import compare
from validation.pictures.compare import ImageComparison, Picture
from validation.pictures.explain.pixels import Rule
from validation.pictures.files import write_failed, write_shown
from validation.thresholds import REASONS

# Half a step of an 8-bit picture is the rounding to whole numbers; the rest is float64's rounding of that half.
_STEPS = 0.5 + 1e-9
# The quantity of the gate on pictures of nothing.
SHOWN = "pixels with a surface"
_MAPS = ("difference", "flip_map")


class Pair(NamedTuple):
    """A picture of ours, made under an offset rule, a reference's picture, and the mask (h, w) of fragile pixels."""

    ours: Image
    rule: Rule
    reference: Picture
    fragile: NDArray[np.bool_]


def check(
    subject: str, pair: Pair, job: Job, *, shown: bool, verdict: Sequence[Gate] = ()
) -> tuple[dict[str, Any], list[Gate]]:
    """Compare a pair; returns the record and the gates, among them those of a verdict on the pair.

    The thresholds are those of the suite's own scenes. On others they bound what a user's file moved, and the rest is a
    figure of the record alone.

    shown : whether the report shows the pair, so that its PNGs are written even if it passes. A failing pair leaves its
        PNGs and EXRs in ``job.folder``/failed.
    """
    ours, hit = pair.ours.radiance, pair.ours.face >= 0
    result = compare.compare(ours, pair.reference, pair.fragile, hit if hit.any() else None)
    found = [*_gates(subject, pair, result, job), _encoding(subject, pair), *verdict]
    stem = re.sub(r"\W+", "-", subject)
    record: dict[str, Any] = {
        "subject": subject,
        **{name: value for name, value in vars(result).items() if name not in _MAPS},
        "ours_sha256": hashlib.sha256(ours.tobytes()).hexdigest(),
        "passed": all(gate.passed for gate in found),
    }
    if shown:
        record["files"] = write_shown(job.folder, stem, ours, pair.reference, result)
    if not record["passed"]:
        record["failed"] = write_failed(job.folder, stem, ours, pair.reference, result)
    return record, found


def _gates(subject: str, pair: Pair, result: ImageComparison, job: Job) -> list[Gate]:
    pictures, moved = job.thresholds.pictures, job.thresholds.moved()
    limits = pictures.matched if pair.rule == "matched" else pictures.own
    # A picture without foreground shows nothing of the scene and must not pass.
    shown = Gate("images", subject, SHOWN, float((pair.ours.face >= 0).sum()), "at least", 1.0,
                 "a picture of nothing shows no error", ("render",))  # fmt: skip
    found = [shown]
    for quantity, limit in limits.model_dump().items():
        if limit is None or not (job.own or f"pictures.{pair.rule}.{quantity}" in moved):
            continue
        value = getattr(result, quantity)
        bound: Literal["at least", "at most"] = "at least" if quantity.startswith("ssim") else "at most"
        number = math.nan if value is None else value
        found.append(Gate("images", subject, quantity, number, bound, limit, REASONS[quantity], ("render",)))
    if job.own and limits.max_error is not None:
        reason = "the maximum is judged outside these pixels, so they must stay few"
        share = result.fragile_share
        found.append(Gate("images", subject, "fragile_share", share, "at most", pictures.fragile_share, reason))
    return found


def _encoding(subject: str, pair: Pair) -> Gate:
    """Gate on ``Image.save``: the reference's radiance, saved and read back, against the formula of sRGB."""
    radiance = pair.reference.astype(np.float32)
    off = np.abs(_saved(replace(pair.ours, radiance=radiance)) - 255.0 * compare.srgb(radiance)).max()
    reason = "saved pixels follow the sRGB formula, rounded"
    return Gate(
        "images", subject, "8-bit steps from the formula", float(off), "at most", _STEPS, reason, ("Image.save",)
    )


def _saved(image: Image) -> NDArray[np.float64]:
    """The pixels of the PNG that ``image.save`` writes, (h, w, 3), whole numbers from 0 to 255."""
    from PIL import Image as Pillow

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "saved.png"
        image.save(path)
        with Pillow.open(path) as picture:
            return np.asarray(picture, np.float64)
