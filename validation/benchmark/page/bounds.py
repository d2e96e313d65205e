"""The page's table of limits: what a ray reads and tests, the bounds of its time, and the time that was measured."""

from collections.abc import Mapping
from typing import Any

from validation.benchmark.limits import roofline
from validation.benchmark.peers.ours import OURS_ONE

Record = Mapping[str, Any]


def rows(record: Record) -> list[dict[str, Any]]:
    """A row for each mesh and family that was counted: its counts, bounds, and where it was measured, its time.

    ns, share : of closest hits on one thread, and the share of it that the bound which holds explains; None without.
    threads : for each number of ``roofline.THREADS`` the efficiency that this machine's memory allows; None without.
    """
    measured = {(r["mesh"], r["family"]): r["contenders"].get(OURS_ONE) for r in record["queries"]
                if r["query"] == "closest"}  # fmt: skip
    rates, found = record["limits"]["rates"], []
    for row in record["limits"]["rows"]:
        bounds = roofline.bounds(row["ours"], rates)
        holds = roofline.holds(bounds)
        one = measured.get((row["mesh"], row["family"]))
        ns = None if one is None else one["ns"]
        found.append(dict(row) | {
            "bounds": bounds, "holds": holds, "ns": ns, "share": None if ns is None else bounds[holds] / ns,
            "threads": None if ns is None else [
                roofline.efficiency(row["ours"], rates, ns, threads) for threads in roofline.THREADS
            ],
        })  # fmt: skip
    return found
