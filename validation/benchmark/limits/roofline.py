"""The bounds of a ray's time that follow from its counts and the machine's rates, and a model of more threads."""

from collections.abc import Mapping
from typing import Any

# Bytes of a ray in and out: origin and direction, float64; t, u, v as float64 and the face as int64. What is written is
# read first, because a store fetches its line.
RAY_BYTES = 48 + 2 * 32
_LINE = 64
THREADS = (16, 64)


def bounds(counts: Mapping[str, Any], rates: Mapping[str, Any]) -> dict[str, float]:
    """Nanoseconds a ray on one thread: none of the three can be undercut, and the largest of them holds.

    compute    every step at the speed that it has where all data are near
    bandwidth  the lines from memory, and the ray's own bytes, at the speed of a long read
    latency    what a record waits for its farthest line: where rays travel in streams, as long as a load takes with 32
               of them under way; packets wait for their nodes one by one, but the processor looks ahead
    """
    packed = counts["packed"]
    each = packed * rates["packet_ray"] + (1.0 - packed) * rates["ray"]
    compute = (
        each + counts["nodes"] * rates["node"] + counts["blocks"] * rates["block"]
        + counts["beams"] * rates["beam"] + counts["leaf_boxes"] * rates["octant"]
    )  # fmt: skip
    memory = counts["from"][-1] * _LINE + RAY_BYTES
    waits = sum(n * ns for n, ns in zip(counts["waits"][1:], rates["overlapped"], strict=True))
    return {"compute": compute, "bandwidth": memory / rates["bandwidth"][0], "latency": waits}


def holds(found: Mapping[str, float]) -> str:
    """The name of the bound that holds: the largest."""
    return max(found, key=lambda name: found[name])


def efficiency(counts: Mapping[str, Any], rates: Mapping[str, Any], ns: float, threads: int) -> float:
    """The share of ``threads`` times one thread's speed, ``ns`` a ray, that memory allows, at most 1.

    The bandwidth is what two threads were seen to read. A machine for so many threads has more of it, so its share is
    no less: this is what stays without it.
    """
    needed = threads * (counts["from"][-1] * _LINE + RAY_BYTES) / ns
    return min(1.0, max(rates["bandwidth"]) / needed)
