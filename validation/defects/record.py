"""What a run of the seeded defects found: a record for JSON, and the gates on it."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from validation.defects.answers import Answer
from validation.defects.seeded.defect import Defect
from validation.gates import Gate

_PATHS = "checks the other reference, whose recursion is like ours: a rule that both have wrong shows on paths alone"
# Quantities that measure the same as another: over other pixels, or the same verdict on other rays.
_VIEWS = {
    "ssim_foreground": "ssim",
    "fragile share of the glass": "fragile_share",
    "pixels whose position is off": "pixels whose distance is off",
    "of the exact sample, rays on which we are wrong": "rays on which we are wrong",
    "wrong verdicts": "rays on which we are wrong",
    "t beyond its bound": "rays on which we are wrong",
}
# Kinds of gates that are kept though they catch no defect alone, by the beginning of their names, with the reasons.
KEPT = {
    "extreme case": "each is a promise for one construct, and says in words what broke",
    "ssim": "others publish it, and it tells broken structure from wrong brightness; FLIP and the maximum see more",
    "asked a few at a time": "few rays go by a kernel of their own, which other gates ask by chance only",
    "references that judge it": "guards the others: without it a rung that nobody judges would pass",
    "rays on which we are wrong": "judges all families by the thousand; extreme cases see the same faults on few rays",
    "differ from a new build": "asks every mesh again after it moved, of which extreme cases have two",
    "rays within float64 rounding": "guards the count of wrong rays, which excuses what float64 cannot decide",
    "rays stopped at once, or not, against the law": "judges each ray by exact signs; sees what others see on few rays",
    "rays that name no face, stopped against the law": "the same rays where they leave nothing: ties at t = 0",
    "rays from inside that are lost": "counts all rays where the exact sample has a few",
    "of the exact sample, rays from a surface with a wrong hit": "judges what is hit beyond the start, to its t",
    "rays that go through other faces than all": "asks faces that coincide, one after the other, as users go through",
    "pixels that see what they cannot": "what users see of the law, through all that pictures do with it",
    "reflected rays": "what users see of the law: each reflection starts where the one before ended, fifty times",
    "points with another sky where their face is named": "asks all points, of which exact arithmetic judges some",
    "slope of log RMSE": _PATHS,
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
    found = [Gate("defects", "no defect", "gates turned red", red, "at most", 0.0, "what is sound must pass")]
    for defect, answer in zip(chosen, answers, strict=True):
        count = float("nan") if answer.error else float(len(answer.red))
        reason = "a suite that lets a defect through proves nothing"
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
    return next((reason for begin, reason in KEPT.items() if kind.startswith(begin)), None)
