"""The benchmark's targets, their reasons, and whether each was reached: computed from the record alone."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from validation.benchmark.measures import calls, frames, processes
from validation.benchmark.measures.kinds import title
from validation.benchmark.measures.scenes import INSTANCES, OCTREE
from validation.benchmark.page import heat
from validation.benchmark.peers.ours import OURS

# Sizes of the meshes on which points, all hits, builds and memory are judged: smaller ones fit into the caches and time
# the loop around them.
FEWEST_FACES, MOST_FACES = 70_000, 5_000_000


@dataclass(frozen=True)
class Target:
    """One quantity with its two bounds. ``better`` is "above" or "below"; ``measured`` is None without a measurement.

    measured : the worst of the rows that count, or the median of a single thing.
    of_mean : the aim is for ``mean``, the geometric mean of the rows, and not for the worst of them.
    """

    subject: str
    unit: str
    better: str
    at_least: float
    aim: float | None
    measured: float | None
    where: str
    reason: str
    mean: float | None = None
    of_mean: bool = False

    def reaches(self, value: float | None, bound: float | None) -> bool | None:
        """Whether ``value`` reaches ``bound``; None where there is none of either."""
        if value is None or bound is None:
            return None
        return value >= bound if self.better == "above" else value <= bound

    def record(self) -> dict[str, Any]:
        """The target, ready for JSON."""
        aimed = self.reaches(self.mean if self.of_mean else self.measured, self.aim)
        return asdict(self) | {"met": self.reaches(self.measured, self.at_least), "aimed": aimed}


_NEVER = "the aim is that for no mesh and no rays another library is the better choice"
# First hits as a ratio to a peer, on every row of the heat map: peer, at least, aim, and why.
_FIRST_HITS = (
    ("embree", 1.0, 1.5, f"{_NEVER}; ours in float64, theirs in float32"),
    ("open3d", 1.0, 1.6, f"{_NEVER}; both use all threads"),
    ("mitsuba_llvm", 1.0, 1.6, "Mitsuba compiles the whole query and is the fastest peer known; both use all threads"),
)  # fmt: skip
# Rays or points a second as a ratio to a peer on the same ones: family, query, peer, at least, aim, and why.
_ONCE = "the tree is searched once for all hits of a ray"
_BOTH = "both use all threads, ours in float64, theirs in float32"
_FOURS = "its tree has two boxes a node and one face a leaf, ours eight, and four faces at a time; both use all threads"
_QUERIES = (
    ("random", "all", "open3d", 1.5, 3.0, f"{_ONCE}, by Open3D once to count and once to list; {_BOTH}"),
    ("random", "all", "trimesh_embreex", 5.0, 10.0, f"{_ONCE}, by trimesh anew behind each hit, on one thread"),
    ("wide", "contains", "open3d", 2.0, 4.0, f"a half-line along an axis is less than a ray through the box; {_BOTH}"),
    ("wide", "contains", "trimesh_embreex", 10.0, 20.0, "a half-line, not two rays with all their hits on one thread"),
    ("box", "nearest", "open3d", 1.0, 2.0, f"no slower for being exact; {_BOTH}"),
    ("box", "nearest", "libigl", 3.0, 6.0, _FOURS),
    ("near", "nearest", "open3d", 1.0, 2.0, f"no slower for being exact; {_BOTH}"),
    ("near", "nearest", "libigl", 3.0, 6.0, _FOURS),
)  # fmt: skip
# Closest hits of scenes as a ratio: beside what, in which scenes, at least, aim, and why.
_ALONE = "one mesh where it is, against its octree"
_SCENES = (
    ("against Embree's instances in Mitsuba", INSTANCES, 0.8, 1.2, "theirs in float32, with gaps between instances"),
    ("against one octree of all placed faces", OCTREE, 0.6, 0.8, "faces are placed anew for each ray, in less memory"),
    (_ALONE, OCTREE, 0.97, 1.0, "who has one mesh pays for no others"),
)


def judged(record: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All targets with their values in ``record``."""
    makers: tuple[Callable[[Mapping[str, Any]], Iterator[Target]], ...]
    makers = (
        _first_hits,
        _threads,
        _queries,
        _builds,
        _memory,
        _calls,
        _studies,
        _scenes,
        _frames,
        _processes,
        _first_answers,
    )
    return [target.record() for make in makers for target in make(record)]


def _first_hits(record: Mapping[str, Any]) -> Iterator[Target]:
    found = {of["peer"]: of for of in heat.summary(record)}
    for peer, least, aim, reason in _FIRST_HITS:
        of = found.get(peer, {"least": None, "where": "not measured", "mean": None})
        yield Target(f"first hits, against {peer}, {heat.PEERS[peer]}", "times", "above", least, aim, of["least"],
                     of["where"], reason, of["mean"], of_mean=True)  # fmt: skip


def _threads(record: Mapping[str, Any]) -> Iterator[Target]:
    rows = [r for r in heat.first_rows(record) if r["efficiency"] is not None and r["faces"] >= heat.MEAN_FACES]
    of = [(r["efficiency"], heat.place(r)) for r in rows]
    worst, where = _worst(of, min)
    yield Target("first hits, efficiency of two threads", "share", "above", 0.95, None, worst, where,
                 "rays know nothing of each other: what two threads lose is our own splitting and waiting",
                 heat.geometric_mean(value for value, _ in of))  # fmt: skip


def _queries(record: Mapping[str, Any]) -> Iterator[Target]:
    for family, kind, peer, least, aim, reason in _QUERIES:
        of = [r for r in _counting(record["queries"]) if (r["family"], r["query"]) == (family, kind)]
        worst, where = _worst([(r["ratios"][peer], r["mesh"]) for r in of if peer in r["ratios"]], min)
        yield Target(f"{title(family, kind)}, against {peer}", "times", "above", least, aim, worst, where, reason)


def _builds(record: Mapping[str, Any]) -> Iterator[Target]:
    rows = _counting(record["builds"])
    moved = "a mesh that moves is built again or refitted for each picture"
    for what, key, reason in (
        ("build", "ratios", f"{moved}: half of Embree's time on as many threads leaves time for rays"),
        ("refit", "ratios_refit", f"{moved}: the tree stays, so it must cost less than any build"),
    ):
        of = [(1.0 / r[key]["open3d"], r["mesh"]) for r in rows if "open3d" in r[key]]
        yield _shares(f"{what}, of Embree's build time (Open3D's first query)", 0.5, 0.3, of, reason)


def _memory(record: Mapping[str, Any]) -> Iterator[Target]:
    rows = [(heat.memory_ratios(r), r["mesh"]) for r in _counting(record["memory"])]
    of = [(1.0 / ratios["open3d"], mesh) for ratios, mesh in rows if "open3d" in ratios]
    reason = "both hold their own copy of the triangles; what is saved decides which meshes fit"
    yield _shares("memory at rest, of Embree's (Open3D)", 0.7, 0.5, of, reason)


def _shares(subject: str, most: float, aim: float, of: Sequence[tuple[float, str]], reason: str) -> Target:
    """A share of the peer's that should be small on every mesh, and on the mean of all."""
    worst, where = _worst(of, max)
    mean = heat.geometric_mean(share for share, _ in of)
    return Target(subject, "share", "below", most, aim, worst, where, reason, mean, of_mean=True)


def _calls(record: Mapping[str, Any]) -> Iterator[Target]:
    ratios = {row["rays"]: row["ratios"] for row in record["calls"]}
    for count in calls.COUNTS:
        for peer in calls.PEERS:
            reason = "people do call rays one by one; checks and Python must cost no more than theirs"
            measured = ratios.get(count, {}).get(peer)
            where = "not measured" if measured is None else heat.PEERS[peer]
            subject = f"a call of {count} ray{'s' if count > 1 else ''}, against {peer}"
            yield Target(subject, "times", "above", 1.0, 2.0, measured, where, reason)
    alone = next((row["median"][OURS] for row in record["calls"] if row["rays"] == 1), None)
    yield Target("call of 1 ours", "us", "below", 20.0, 8.0, alone, "first answers", "people do call rays one by one")


def _studies(record: Mapping[str, Any]) -> Iterator[Target]:
    rows = record["studies"]
    worst, where = _worst([(r["peers"]["open3d"]["whole"] / r["seconds"], r["mesh"]) for r in rows if r["peers"]], min)
    yield Target("145 directions from each point, against open3d", "times", "above", 1.5, 3.0, worst, where,
                 "theirs are written down by its user, in the best batches; ours never are")  # fmt: skip
    name, written = "145 directions from each point", "of rays that are written down"
    worst, where = _worst([(r["memory"] / r["array"], r["mesh"]) for r in rows], max)
    yield Target(f"{name}, memory, {written}", "share", "below", 0.1, None, worst, where,
                 "all rays at once do not fit into memory")  # fmt: skip
    worst, where = _worst([(r["rays"] / r["seconds"] / r["shadow"], r["mesh"]) for r in rows], min)
    yield Target(f"{name}, rays a second, of shadow rays of a picture", "share", "above", 0.8, None, worst, where,
                 "the same search, of rays that go the same way")  # fmt: skip


def _scenes(record: Mapping[str, Any]) -> Iterator[Target]:
    of = record["scenes"]
    where = f"{of['instances']} instances of {of['faces']} faces"
    yield Target("scene, memory beyond the mesh's", "bytes an instance", "below", 300.0, 200.0, of["bytes"], where,
                 "what stands many times is stored once")  # fmt: skip
    yield Target("scene, move of all instances", "ms", "below", 10.0, 3.0, 1e3 * of["move"]["median"], where,
                 "robots and cars move each frame: the top level alone is made anew")  # fmt: skip
    for name, peer, least, aim, reason in _SCENES:
        rows = [row for row in of["rows"] if peer in row["ratios"] and (row["instances"] == 1) == (name == _ALONE)]
        worst, at = _worst([(row["ratios"][peer], f"{row['scene']}, {row['family']} rays") for row in rows], min)
        yield Target(f"scene, {name}", "times", "above", least, aim, worst, at, reason)


def _frames(record: Mapping[str, Any]) -> Iterator[Target]:
    of, where = record["frames"], f"{record['frames']['size']} x {record['frames']['size']}"
    for name, least, aim, reason in (
        (frames.LISTS, 1.5, 2.5, "the fastest way that Mitsuba draws the same rays; the scene is loaded for both"),
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
