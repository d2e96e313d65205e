"""The result of a run of the seeded defects: a record for JSON, and the gates on it."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from validation.defects.answers import Answer
from validation.defects.seeded.defect import Defect
from validation.gates import Gate

_PATHS = "checks the Whitted reference, whose recursion is like ours: only paths show an error that both share"
_REFLECTED = "shows what users would see: fifty reflections, each from where the last one ended"
# Quantities that measure the same as another: over other pixels, or the same verdict on other rays.
_VIEWS = {
    "ssim_foreground": "ssim",
    "fragile share of the glass": "fragile_share",
    "pixels whose position is off": "pixels whose distance is off",
    "wrong hits in the exact sample": "wrong hits",
    "t beyond its bound": "wrong hits",
}
# Kinds of gates that are kept though they catch no defect alone, with the reasons; a key is a kind, see ``kind_of``.
KEPT = {
    "extreme case": "each tests one construct, and names what broke",
    "ssim": "widely published, and separates broken structure from wrong brightness",
    "other hits in small batches": "small batches use a kernel of their own, which other gates reach by chance",
    "references": "guards the others: without it a step without a reference would pass",
    "wrong hits": "judges thousands of rays of each family; extreme cases see the same faults on few rays",
    "hits that differ from a new build": "traces every mesh again after it moved; extreme cases have two such meshes",
    "rays within rounding of an edge": "guards the count of wrong hits, which excuses what float64 cannot decide",
    "rays that wrongly stop or pass at their start": "judges each ray by exact signs; others see few of them",
    "rays without leaving that wrongly stop or pass": "the same rays where they leave nothing: ties at t = 0",
    "rays that escape from inside": "counts all rays where the exact sample has a few",
    "wrong hits from surfaces in the exact sample": "judges the hits beyond the start, with t",
    "rays that pass other faces than their lines": "passes coinciding faces one after the other, as users do",
    "pixels that see the hidden sky": "shows in pictures what users would see",
    "reflected rays that escape": _REFLECTED,
    "reflected rays that stay in place": _REFLECTED,
    "points whose sky changes when their face is named": "checks all points, of which exact arithmetic judges some",
    "RMS of mip maps beside many samples": "states the error of the filter, of which closed forms see the exact cases",
    "mean relative error": "bounds the error where a meshing error is so large that it could hide it",
    "relative error of all light": "tells light that is lost from light that is blurred",
    "largest error by radiosity": "a closed form, to float32; pictures beside random paths see percents",
    "error over what is allowed": "closed forms of view factors, the only truth that is no other program's",
    "stated error over that requested": "holds what rtol promises: defects that miss it miss closed forms too",
    "standard errors from Embree's rays": "judges rooms without a closed form",
    "mean square of true over stated error": "tells errors that are stated too small from errors that are too large",
    "distance of the slope of log RMSE from -1/2": _PATHS,
    "p-value of the largest z": _PATHS,
}


def record(chosen: Sequence[Defect], control: Answer, answers: Sequence[Answer]) -> dict[str, Any]:
    """For JSON: a row for each defect with the gates that failed, and the defects that each kind of gate caught.

    A kind is a measure: a gate's quantity without the place where it is measured, i.e. the section, mesh, rays, rung of
    the ladder, reference or offset rule. ``alone`` lists the defects that no other kind caught; ``kept`` says why a
    kind is kept though it catches none alone, None without a reason.
    """
    rows = [_row(defect, answer) for defect, answer in zip(chosen, answers, strict=True)]
    caught = Counter(kind for row in rows for kind in row["kinds"])
    alone = {kind: [row["name"] for row in rows if row["kinds"] == [kind]] for kind in caught}
    kinds = list(dict.fromkeys(kind_of(name) for name in control.gates))
    return {
        "control": {"gates": len(control.gates), "red": list(control.red), "error": control.error,
                    "seconds": control.seconds},
        "defects": rows,
        "caught": sum(row["caught"] for row in rows),
        "gates": [
            {"gate": kind, "caught": caught[kind], "alone": alone.get(kind, []), "kept": _kept(kind)} for kind in kinds
        ],
    }  # fmt: skip


def _row(defect: Defect, answer: Answer) -> dict[str, Any]:
    return {
        "name": defect.name,
        "place": defect.change.name,
        "group": defect.group,
        "caught": bool(answer.red),
        "red": list(answer.red),
        "kinds": sorted({kind_of(name) for name in answer.red}, key=lambda kind: (kind.startswith("extreme"), kind)),
        "error": answer.error,
        "seconds": answer.seconds,
    }


def gates(chosen: Sequence[Defect], control: Answer, answers: Sequence[Answer]) -> list[Gate]:
    """The control must fail no gate; each defect at least one. A process that ended with an error proves neither."""
    red = float("nan") if control.error else float(len(control.red))
    found = [Gate("defects", "no defect", "gates turned red", red, "at most", 0.0, "the sound renderer must pass")]
    for defect, answer in zip(chosen, answers, strict=True):
        count = float("nan") if answer.error else float(len(answer.red))
        reason = "a suite that misses a defect proves nothing"
        found.append(Gate("defects", defect.name, "gates turned red", count, "at least", 1.0, reason))
    return found


def idle(found: dict[str, Any]) -> Gate:
    """Gate on a record of the whole list: each kind of gate caught a defect alone, or has a reason to be kept."""
    count = sum(not (row["alone"] or row["kept"]) for row in found["gates"])
    quantity, reason = "that caught no defect alone and are not kept", "a measure that tells nothing new is dropped"
    return Gate("defects", "kinds of gates", quantity, float(count), "at most", 0.0, reason)


def kind_of(name: str) -> str:
    """The measure in a gate's name, see ``record``; an extreme case has no quantity and is its own kind."""
    _, _, measured = name.partition(": ")
    subject, _, quantity = measured.rpartition(": ")
    if subject.startswith("extreme case"):
        return subject.partition(":")[0]
    return _VIEWS.get(quantity, quantity)


def _kept(kind: str) -> str | None:
    return KEPT.get("extreme case" if kind.startswith("extreme case") else kind)
