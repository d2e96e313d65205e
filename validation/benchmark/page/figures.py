"""The benchmark's curves, drawn from its record alone."""

from collections.abc import Mapping, Sequence
from typing import Any

from validation.benchmark.measures.fit import Fit
from validation.benchmark.measures.kinds import title as title_of
from validation.benchmark.peers.ours import OURS
from validation.report.plots import PLAIN, Panel, Series, draw

Record = Mapping[str, Any]
# The memory of smaller meshes is a few pages of 4 kB, or none where the allocator had free ones.
_FEWEST_FACES = 5_000


def query_figures(record: Record) -> list[dict[str, str]]:
    """For each family and kind: rays or points a second, and nanoseconds for one with the fit through ours."""
    keys = dict.fromkeys((r["family"], r["query"]) for r in record["queries"])
    return [figure for key in keys if (figure := _query_figure(record, *key)) is not None]


def _query_figure(record: Record, family: str, kind: str) -> dict[str, str] | None:
    rows = _series(record, [r for r in record["queries"] if (r["family"], r["query"]) == (family, kind)])
    if not rows:
        return None
    fit = next((f for f in record["fits"] if (f["family"], f["query"], f["contender"]) == (family, kind, OURS)), None)
    ns = _curves(record, rows, lambda c: c["ns"], slow=False)
    said = ""
    if fit is not None:
        x = [r["faces"] for r in rows]
        curve = Fit(fit["a"], fit["b"], fit["residual"])
        ns.append(Series("fit to ours", x, [curve.at(n) for n in x], PLAIN))
        said = f" Ours: {curve.a:.1f} log2 N {curve.b:+.0f} ns, residual {curve.residual:.1f} ns."
    panels = [Panel(_curves(record, rows, lambda c: c["mrays"], slow=True), "million a second"),
              Panel(ns, "ns for one", linear=True)]  # fmt: skip
    name = title_of(family, kind)
    title = f"{name}: million a second, and below nanoseconds for one by the fast contenders, against faces.{said}"
    return {"title": title, "svg": draw(panels, x_label="faces", title=name)}


def build_figures(record: Record) -> list[dict[str, str]]:
    """Build time against faces, and memory a face."""
    rows = _series(record, record["builds"])
    names = dict.fromkeys(name for r in rows for name in r["contenders"])
    seconds = [Series(_label(record, n), *_seconds(rows, n)) for n in names]
    found = []
    if rows:
        svg = draw([Panel(seconds, "seconds")], x_label="faces", title="Build time")
        title = "Seconds to build (to the first answered query, less a warm one) against faces."
        found.append({"title": title, "svg": svg})
    rows = [r for r in _series(record, record["memory"]) if r["faces"] >= _FEWEST_FACES]
    if rows:
        found.append(_memory_figure(record, rows))
    return found


def _memory_figure(record: Record, rows: Sequence[Record]) -> dict[str, str]:
    names = dict.fromkeys(name for r in rows for name in r["systems"])
    panels = [
        Panel(
            [Series(_label(record, n), *_a_face(rows, n, key), _look(record, n)) for n in names],
            f"bytes a face, {key}",
            linear=True,
        )
        for key in ("rest", "peak")
    ]
    title = "Resident memory by which a fresh process grows, in bytes a face: at rest once built, below at its peak."
    return {"title": title, "svg": draw(panels, x_label="faces", title="Memory a face")}


def _a_face(rows: Sequence[Record], name: str, key: str) -> tuple[list[float], list[float | None]]:
    of = [r for r in rows if name in r["systems"]]
    return [r["faces"] for r in of], [r["systems"][name][key] / r["faces"] for r in of]


def _curves(record: Record, rows: Sequence[Record], value: Any, slow: bool) -> list[Series]:
    """One curve a contender; ``slow`` says whether those with fewer rays are shown too."""
    names = dict.fromkeys(name for r in rows for name in r["contenders"])
    shown = [n for n in names if slow or record["systems"][n]["most_rays"] is None]
    curves = []
    for name in shown:
        of = [r for r in rows if name in r["contenders"]]
        y = [value(r["contenders"][name]) for r in of]
        curves.append(Series(_label(record, name), [r["faces"] for r in of], y, _look(record, name)))
    return curves


def _seconds(rows: Sequence[Record], name: str) -> tuple[list[float], list[float | None]]:
    of = [r for r in rows if name in r["contenders"]]
    return [r["faces"] for r in of], [r["contenders"][name]["median"] for r in of]


def _series(record: Record, rows: Sequence[Record]) -> list[Record]:
    return [r for r in rows if r["mesh"] in record["series"]]


def _look(record: Record, name: str) -> int | None:
    """The contender's look, so that it has the same colour in every figure."""
    return list(record["systems"]).index(name) if name in record["systems"] else None


def _label(record: Record, name: str) -> str:
    known = record["systems"].get(name)
    return str(known["label"]) if known else name.replace("_", " ")
