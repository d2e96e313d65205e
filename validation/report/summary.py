"""Summary of a run: the verdict, facts for the head of the report, sections by references."""

from collections.abc import Mapping, Sequence
from typing import Any

Record = Mapping[str, Any]


def verdict(gates: Sequence[Record]) -> dict[str, Any]:
    """Whether the run passed, and the numbers of gates and failures. A run without gates does not pass."""
    failed = sum(not gate["passed"] for gate in gates)
    return {"passed": bool(gates) and not failed, "gates": len(gates), "failed": failed}


def failure(gate: Record) -> str:
    """A failing gate in words: its value and the bound, with enough digits to distinguish them."""
    value, threshold = gate["value"], f"{gate['threshold']:.12g}"
    if value is None:
        shown = "not a number"
    else:
        short = f"{value:.6g}"
        shown = repr(value) if short == threshold else short
    return f"{gate['quantity']} is {shown}, expected {gate['bound']} {threshold}"


def matrix(records: Mapping[str, Record], gates: Sequence[Record]) -> list[dict[str, Any]]:
    """A row for each section that ran: its gates, its seconds, and the cost of each of its references."""
    rows = []
    for section, record in records.items():
        own = [gate for gate in gates if gate["section"] == section]
        failed = sum(not gate["passed"] for gate in own)
        rows.append({"section": section, "gates": len(own), "failed": failed, "seconds": record["seconds"],
                     "references": dict(record["costs"])})  # fmt: skip
    return rows


def facts(records: Mapping[str, Record], gates: Sequence[Record], defects: Record | None) -> list[dict[str, Any]]:
    """Up to five numbers for the head of the report; those whose gates did not run are left out."""
    wrong = [gate for gate in gates if (gate["section"], gate["quantity"]) == ("hits", "wrong hits")]
    leaks = [gate for gate in gates if gate["quantity"] == "leaks"]
    answers = [gate for gate in gates if gate["section"] == "queries"]
    similar = [gate["value"] for gate in gates if gate["quantity"] == "ssim" and gate["value"] is not None]
    cases = [gate for gate in gates if gate["quantity"] == "holds"]
    found: list[tuple[float | None, str]] = []
    if wrong:
        meshes = records["hits"].get("meshes", ())
        rays = sum(family["rays"] for mesh in meshes for family in mesh["families"])
        found.append((_sum(wrong), f"wrong hits in {rays:,} rays"))
    if leaks:
        found.append((_sum(leaks), f"leaks through closed meshes, in {len(leaks)} sets of rays"))
    if answers:
        asked = sum(row["asked"] for row in records["queries"].get("rows", ()))
        found.append((_sum(answers), f"wrong answers in {asked:,} queries: inside, distance, all hits"))
    if similar:
        found.append((min(similar), f"lowest SSIM beside Mitsuba, of {len(similar)} comparisons"))
    if cases:
        found.append((sum(gate["passed"] for gate in cases), f"of {len(cases)} extreme cases hold"))
    if defects is not None:
        found.append((defects["caught"], f"of {len(defects['defects'])} seeded defects caught"))
    return [{"value": value, "label": label} for value, label in found[:5]]


def _sum(gates: Sequence[Record]) -> float | None:
    """The sum of the values, None where one is not a number."""
    values = [gate["value"] for gate in gates]
    return None if None in values else sum(values)
