"""The benchmark's curves against the number of faces, drawn from its record alone."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from validation.benchmark.measures.kinds import title as title_of
from validation.report.plots import Panel, Series, draw

Record = Mapping[str, Any]
# The memory of smaller meshes is a few pages of 4 kB, or none where the allocator had free ones.
_FEWEST_FACES = 5_000


def query_figures(record: Record) -> list[dict[str, str]]:
    """For each family and kind of query: rays or points a second."""
    rows = _series(record, record["queries"])
    found = []
    for family, kind in dict.fromkeys((r["family"], r["query"]) for r in rows):
        of = [r for r in rows if (r["family"], r["query"]) == (family, kind)]
        curves = _curves(record, of, "contenders", lambda c, _: c["mrays"])
        name = title_of(family, kind)
        svg = draw([Panel(curves, "million a second")], x_label="faces", title=name)
        found.append({"title": f"{name}: million a second against faces.", "svg": svg})
    return found


def build_figures(record: Record) -> list[dict[str, str]]:
    """Build time against faces, and memory a face."""
    found = []
    if rows := _series(record, record["builds"]):
        curves = _curves(record, rows, "contenders", lambda c, _: c["median"])
        svg = draw([Panel(curves, "seconds")], x_label="faces", title="Build time")
        title = "Seconds to build (to the first answered query, less a warm one) against faces."
        found.append({"title": title, "svg": svg})
    if rows := [r for r in _series(record, record["memory"]) if r["faces"] >= _FEWEST_FACES]:
        rest = _curves(record, rows, "systems", lambda s, faces: s["rest"] / faces)
        peak = _curves(record, rows, "systems", lambda s, faces: s["peak"] / faces)
        panels = [Panel(rest, "bytes a face, rest", linear=True), Panel(peak, "bytes a face, peak", linear=True)]
        svg = draw(panels, x_label="faces", title="Memory a face")
        title = (
            "Resident memory by which a fresh process grows, in bytes a face: at rest once built, below at its peak."
        )
        found.append({"title": title, "svg": svg})
    return found


def tree_figures(record: Record) -> list[dict[str, str]]:
    """For each family of rays: time and bytes of trees with other options, against the time to build them."""
    of = record["trees"]
    points = {p["name"]: p for p in of["points"]}
    rows = {sweep: [points[name] for name in names] for sweep, names in of["sweeps"].items()}
    seconds = {sweep: [p["build_seconds"] for p in row] for sweep, row in rows.items()}
    found = []
    for family, names in of["fronts"].items():
        panels = [
            Panel(
                [Series(k, seconds[k], [p["ns_per_ray"][family] for p in row]) for k, row in rows.items()], "ns a ray"
            ),
            Panel([Series(k, seconds[k], [p["bytes"] for p in row]) for k, row in rows.items()], "bytes"),
        ]
        name = f"Options of the tree, {family} rays"
        title = f"{name}: nanoseconds a ray and bytes against seconds to build. On the front: {'; '.join(names)}."
        found.append({"title": title, "svg": draw(panels, x_label="build, seconds", title=name)})
    return found


def _curves(record: Record, rows: Sequence[Record], key: str, value: Callable[[Record, int], float]) -> list[Series]:
    """One curve for each contender under ``key`` of the rows: ``value`` of its entry and the number of faces."""
    curves = []
    for name in dict.fromkeys(name for r in rows for name in r[key]):
        of = [r for r in rows if name in r[key]]
        y = [value(r[key][name], r["faces"]) for r in of]
        curves.append(Series(_label(record, name), [r["faces"] for r in of], y, _look(record, name)))
    return curves


def _series(record: Record, rows: Sequence[Record]) -> list[Record]:
    return [r for r in rows if r["mesh"] in record["series"]]


def _look(record: Record, name: str) -> int | None:
    """The contender's look, so that it has the same colour in every figure."""
    return list(record["systems"]).index(name) if name in record["systems"] else None


def _label(record: Record, name: str) -> str:
    known = record["systems"].get(name)
    return str(known["label"]) if known else name.replace("_", " ")
