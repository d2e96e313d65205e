"""The benchmark's targets, their reasons, and whether each was reached: computed from the record alone."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from validation.benchmark.measures import frames, processes
from validation.benchmark.measures.kinds import title
from validation.benchmark.peers.ours import OURS

# Sizes of the meshes on which rays and builds are judged: smaller ones fit into the caches and time the loop around
# them.
FEWEST_FACES, MOST_FACES = 70_000, 5_000_000


@dataclass(frozen=True)
class Target:
    """One quantity with its two bounds. ``better`` is "above" or "below"; ``measured`` is None without a measurement.

    measured : the worst of the meshes that count, or the median of a single thing.
    """

    subject: str
    unit: str
    better: str
    at_least: float
    aim: float | None
    measured: float | None
    where: str
    reason: str

    def reaches(self, bound: float | None) -> bool | None:
        """Whether ``bound`` is reached; None where nothing was measured."""
        if self.measured is None or bound is None:
            return None
        return self.measured >= bound if self.better == "above" else self.measured <= bound

    def record(self) -> dict[str, Any]:
        """The target, ready for JSON."""
        return asdict(self) | {"met": self.reaches(self.at_least), "aimed": self.reaches(self.aim)}


# Rays or points a second as a ratio to a peer on the same ones: family, query, peer, at least, aim, and why.
_EXPERIMENT = "an experiment with these kernels reached the lower bound, in float64, against the peer's float32"
_ONCE = "the tree is searched once for all hits of a ray"
_BOTH = "both use all threads, ours in float64, theirs in float32"
_FOURS = "its tree has two boxes a node and one face a leaf, ours eight, and four faces at a time; both use all threads"
_QUERIES = (
    ("camera", "closest", "embree", 2.2, 4.0, f"{_EXPERIMENT}; embreex has one thread only, ours all"),
    ("camera", "closest", "open3d", 1.15, 2.0, f"{_EXPERIMENT}; both use all threads"),
    ("camera", "closest", "mitsuba_llvm", 0.9, 1.5, "Mitsuba compiles the whole query: within a tenth of it is level"),
    ("random", "closest", "embree", 2.5, 4.0,
     f"{_EXPERIMENT}, with the rays sorted; embreex has one thread only, ours all"),
    ("random", "closest", "open3d", 1.2, 2.0, f"{_EXPERIMENT}, with the rays sorted; both use all threads"),
    ("random", "closest", "mitsuba_llvm", 1.0, 1.5, "level with the fastest peer known"),
    ("random", "all", "open3d", 1.5, 3.0, f"{_ONCE}, by Open3D once to count and once to list; {_BOTH}"),
    ("random", "all", "trimesh_embreex", 5.0, 10.0, f"{_ONCE}, by trimesh anew behind each hit, on one thread"),
    ("wide", "contains", "open3d", 2.0, 4.0, f"a half-line along an axis is less than a ray through the box; {_BOTH}"),
    ("wide", "contains", "trimesh_embreex", 10.0, 20.0, "a half-line, not two rays with all their hits on one thread"),
    ("box", "nearest", "open3d", 1.0, 2.0, f"no slower for being exact; {_BOTH}"),
    ("box", "nearest", "libigl", 3.0, 6.0, _FOURS),
    ("near", "nearest", "open3d", 1.0, 2.0, f"no slower for being exact; {_BOTH}"),
    ("near", "nearest", "libigl", 3.0, 6.0, _FOURS),
)  # fmt: skip


def judged(record: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All targets with their values in ``record``."""
    makers: tuple[Callable[[Mapping[str, Any]], Iterator[Target]], ...]
    makers = (_queries, _builds, _memory, _frames, _processes, _first_answers)
    return [target.record() for make in makers for target in make(record)]


def _queries(record: Mapping[str, Any]) -> Iterator[Target]:
    for family, kind, peer, least, aim, reason in _QUERIES:
        of = [r for r in _counting(record["queries"]) if (r["family"], r["query"]) == (family, kind)]
        worst, where = _worst([(r["ratios"][peer], r["mesh"]) for r in of if peer in r["ratios"]], min)
        yield Target(f"{title(family, kind)}, against {peer}", "times", "above", least, aim, worst, where, reason)


def _builds(record: Mapping[str, Any]) -> Iterator[Target]:
    of = [(1.0 / r["ratios"]["open3d"], r["mesh"]) for r in _counting(record["builds"]) if "open3d" in r["ratios"]]
    worst, where = _worst(of, max)
    reason = "a mesh that moves is built again for each picture: no slower than Embree on as many threads"
    yield Target("build, of Embree's time (Open3D's first query)", "share", "below", 1.0, 0.5, worst, where, reason)


def _memory(record: Mapping[str, Any]) -> Iterator[Target]:
    rows = [(r["systems"], r["mesh"]) for r in _counting(record["memory"])]
    of = [(s["ours"]["rest"] / s["open3d"]["rest"], mesh) for s, mesh in rows if {"ours", "open3d"} <= s.keys()]
    worst, where = _worst(of, max)
    yield Target("memory at rest, of Embree's (Open3D)", "share", "below", 1.0, 0.5, worst, where,
                 "both hold their own copy of the triangles; ours may keep float64 ones")  # fmt: skip


def _frames(record: Mapping[str, Any]) -> Iterator[Target]:
    of, where = record["frames"], f"{record['frames']['size']} x {record['frames']['size']}"
    for name, least, aim, reason in (
        (frames.LISTS, 1.0, 2.0, "the fastest way that Mitsuba draws the same rays; the scene is loaded for both"),
        (frames.SCALAR, 50.0, 100.0, "a recursion driven from Python, which compiling the frame must beat clearly"),
    ):
        measured = of["ratios"].get(name)
        subject = f"frame against {frames.LABELS[name]}"
        yield Target(subject, "times", "above", least, aim, measured, where, reason)


def _processes(record: Mapping[str, Any]) -> Iterator[Target]:
    for name, least, aim, reason in (
        (processes.WARM, 0.8, 0.5, "a command that answers within a second is not waited for"),
        (processes.IMPORT, 0.5, None, "a script that only reads a mesh should not wait for a compiler"),
    ):
        measured = record["processes"][name]["median"]
        yield Target(name.replace("_", " "), "s", "below", least, aim, measured, "whole process", reason)


# Of ``first_answers``: at least, aim, and why.
_FIRST = (
    ("first_hit_cpu", 8.0, 4.0, "an octree over a small float64 mesh and its first hits, nothing compiled before"),
    ("first_float32_hit_after_it_cpu", 1.0, 0.0, "the same kernels serve vertices that float32 holds"),
    ("first_picture_wall", 10.0, 6.0, "the main scene from the command line, nothing compiled before"),
    (f"call_of_1_{OURS}_us", 20.0, 8.0, "people do call rays one by one"),
)


def _first_answers(record: Mapping[str, Any]) -> Iterator[Target]:
    rows = (record["first_answers"] or {"rows": {}})["rows"]
    for name, least, aim, reason in _FIRST:
        row = rows.get(name, {"median": None, "unit": "not measured"})
        subject = name.rpartition("_")[0].replace("_", " ")
        yield Target(subject, row["unit"], "below", least, aim, row["median"], "first answers", reason)


def _counting(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    return [r for r in rows if FEWEST_FACES <= r["faces"] <= MOST_FACES]


def _worst(
    of: Sequence[tuple[float, str]], choose: Callable[[Sequence[tuple[float, str]]], tuple[float, str]]
) -> tuple[float | None, str]:
    return choose(of) if of else (None, "not measured")
