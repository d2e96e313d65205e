"""The verdict on our pictures of a rung: the reason of each pixel that differs visibly from Mitsuba's.

Under the media of normals, Mitsuba's rule, each pixel that differs is explained. Pixels in which our own rule for media
draws another picture are judged by that rule. Of the pixels that agree some are walked too: a fault that is too small
to be seen in a picture is seen in the steps of its rays.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.picture.image import Image
from renderer.picture.prepare import PreparedScene
from renderer.picture.render import prepare
from renderer.scene.scene import Scene
from validation.gates import Gate
from validation.pictures.compare import VISIBLE, Picture, srgb
from validation.pictures.explain.media import MediaJudge
from validation.pictures.explain.partings import way
from validation.pictures.explain.pixels import RED, SETTLED, Explained, Explainer, Pixel, Rule

# Pixels that agree and are walked all the same: a fault of all pixels is seen in each, one of a hundredth of them is
# missed by 64 with probability 1/2.
_SAMPLE = 64
_SEED = 45
# Pixels of one rung that the rule for media is judged in, spread over all of them.
_RULED = 200
# Pixels whose rays a record tells: all that are against us, and some of the others.
_TOLD = 32

# The reasons in a map of pixels: 0 is no difference, and these follow in order.
MAPPED = ("rounding", "offset", "coinciding faces", "media", "reference wrong", "ours wrong", "unexplained")


class Pictures(NamedTuple):
    """Pictures (h, w, 3) of one scene: ours by rule for offsets under the media of normals, ours under its own rules,
    and the reference.
    """

    ours: dict[Rule, Picture]
    stack: Picture
    reference: Picture


def judge(scene: Scene, pictures: Pictures) -> dict[str, Any]:
    """The verdict on the pictures of a scene, as plain values but for its ``map``, (h, w) uint8."""
    height, width, _ = pictures.reference.shape
    prepared = prepare(scene)
    explainer = Explainer(prepared, (width, height))
    reasons = np.zeros((height, width), np.uint8)
    told: list[dict[str, Any]] = []
    record: dict[str, Any] = {"offsets": {}, "left": {}, "sample": _sampled(explainer, pictures)}
    for rule, ours in pictures.ours.items():
        found = explainer.explain(rule, ours, _pixels(differs(ours, pictures.reference)), pictures.reference)
        record["offsets"][rule], record["left"][rule] = found.counts(), found.left
        told += [_told(rule, pixel, pictures) for pixel in _shown(found)]
        if rule == "own":
            for pixel in found.pixels:
                reasons[pixel.row, pixel.column] = 1 + MAPPED.index(pixel.reason)
    record["media"] = _ruled(prepared, pictures, reasons)
    return record | {"pixels": told, "map": reasons}


def primary_gate(subject: str, scene: Scene, image: Image, off: NDArray[np.bool_]) -> Gate:
    """The gate on the first hits of ``image``, a picture without bounces, in the pixels that are off, (h, w)."""
    height, width = off.shape
    explainer = Explainer(prepare(scene), (width, height))
    bad = sum(not explainer.explains_primary(image, row, column) for row, column in _pixels(off))
    reason = f"of {int(off.sum()):,} that differ; a float32 ray may hit the other face at an edge"
    return _none(subject, "pixels whose first hit differs without a reason", bad, reason)


def differs(one: Picture, other: Picture) -> NDArray[np.bool_]:
    """The pixels (h, w) in which two pictures differ visibly."""
    return np.asarray(np.abs(srgb(one) - srgb(other)).max(axis=2) > VISIBLE)


def _pixels(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    return [(row, column) for row, column in np.argwhere(mask).tolist()]


def _sampled(explainer: Explainer, pictures: Pictures) -> dict[str, int]:
    """The verdict on some pixels that do not differ."""
    alike = _pixels(~differs(pictures.ours["own"], pictures.reference))
    chosen = np.random.default_rng(_SEED).permutation(len(alike))[:_SAMPLE]
    found = explainer.explain("own", pictures.ours["own"], [alike[k] for k in chosen])
    return {"pixels": len(chosen), "red": sum(found.counts()[reason] for reason in RED)}


def _shown(found: Explained) -> list[Pixel]:
    """The pixels against us, and others spread over all."""
    red = [pixel for pixel in found.pixels if pixel.reason in RED]
    others = [pixel for pixel in found.pixels if pixel.reason not in RED]
    spread = np.linspace(0, len(others) - 1, min(_TOLD, len(others))).astype(int)
    return [*red, *(others[k] for k in spread)]


def _told(rule: Rule, pixel: Pixel, pictures: Pictures) -> dict[str, Any]:
    """A pixel for the report: its reason, both colours, and both ways to where the trees part."""
    at = pixel.row, pixel.column
    ours, theirs = way(*pixel.trees)
    return {
        "offset": rule,
        "row": pixel.row,
        "column": pixel.column,
        "reason": pixel.reason,
        "found": pixel.found,
        "colors": [pictures.ours[rule][at].tolist(), pictures.reference[at].tolist()],
        "ours": ours,
        "theirs": theirs,
    }


def _ruled(prepared: PreparedScene, pictures: Pictures, reasons: NDArray[np.uint8]) -> dict[str, Any]:
    """The verdict on the pixels that the rule for media decides, which are marked where no other reason is, and on some
    that it does not: a stack that is forgotten draws the picture of the normals.
    """
    decided = differs(pictures.stack, pictures.ours["own"])
    height, width = decided.shape
    judge = MediaJudge(prepared, (width, height))
    pixels, alike = _pixels(decided), _pixels(~decided)
    chosen = [pixels[k] for k in np.linspace(0, len(pixels) - 1, min(_RULED, len(pixels))).astype(int)]
    # Without glass there are no media.
    count = _SAMPLE if prepared.needs.refraction else 0
    sample = [alike[k] for k in np.random.default_rng(_SEED).permutation(len(alike))[:count]]
    found, others = judge.judge(pictures.stack, chosen), judge.judge(pictures.stack, sample)
    reasons[decided & (reasons == 0)] = 1 + MAPPED.index("media")
    why = [one.why for one in found if one.wrong is None and one.why is not None]
    wrong = [(one, one.wrong or "nothing lets the rules differ") for one in found if one.wrong or one.why is None]
    wrong += [(one, one.wrong) for one in others if one.wrong is not None]
    return {
        "share": float(decided.mean()),
        "judged": len(found) + len(others),
        "why": {reason: why.count(reason) for reason in sorted(set(why))},
        "wrong": [f"row {one.row}, column {one.column}: {text}" for one, text in wrong],
    }


def gates(subject: str, record: dict[str, Any]) -> list[Gate]:
    """The gates of a verdict, which all are at most 0."""
    found = []
    for rule, counts in record["offsets"].items():
        against, total, left = f"{subject} against whitted, {rule} offset", sum(counts.values()), record["left"][rule]
        unseen = f"; {left:,} more were not examined after {SETTLED} faults" if left else ""
        reason = (
            f"of {total:,} that differ visibly; the rays of both renderers were followed to where they diverge{unseen}"
        )
        found.append(_none(against, "pixels that differ without a reason", counts["unexplained"], reason))
        reason = f"of {total:,} that differ visibly: our hit contradicts exact arithmetic, or our picture its own rays"
        found.append(_none(against, "pixels in which our renderer is wrong", counts["ours wrong"], reason))
    sample, media = record["sample"], record["media"]
    reason = f"of {sample['pixels']} that agree: each step of their rays agrees within float32's rounding"
    found.append(_none(subject, "pixels whose rays differ at some step", sample["red"], reason))
    reason = f"of {media['judged']}: a second implementation of the stack of media and of optics"
    found.append(_none(subject, "pixels that break the rule for media", len(media["wrong"]), reason))
    return found


def _none(subject: str, quantity: str, value: int, reason: str) -> Gate:
    return Gate("images", subject, quantity, float(value), "at most", 0.0, reason)
