"""The README's chart as SVG: closest hits a second, and rays lost. On white, so that it is read on any page."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from validation.benchmark.page.heat import MEAN_FACES, geometric_mean

SPEED = {
    "ours": "octree-renderer, 2 threads", "open3d": "Open3D, 2 threads", "mitsuba_llvm": "Mitsuba, 2 threads",
    "ours_one_thread": "octree-renderer, 1 thread", "embree": "embreex, 1 thread",
}  # fmt: skip
LEAKS = {"ours": "octree-renderer", "Embree robust": "Embree, robust", "Embree default": "Embree", "libigl": "libigl"}
HEAD = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 880 {0}" width="880" height="{0}" role="img" \
aria-label="Closest hits a second, and rays lost, of octree-renderer and others">
  <style>
    text {{ font: 14px system-ui, sans-serif; fill: #1d2733 }}
    .name {{ font-weight: 600 }}
    .end {{ text-anchor: end }}
    .ours {{ fill: #2f86c9 }}
    .other {{ fill: #b9c4d0 }}
  </style>
  <rect width="880" height="{0}" fill="#ffffff"/>"""


class Bar(NamedTuple):
    """A name, a value, and the value as it is shown."""

    name: str
    value: float
    shown: str


def chart(record: dict[str, Any]) -> str:
    """Both panels side by side."""
    speed, leaks = _speed(record["bench AVX2"]["queries"]), _leaks(record["validate"]["leaks"].values())
    aimed = sum(of["rays"] for of in record["validate"]["leaks"].values())
    lost = f"Rays lost from closed meshes, of {aimed / 1e6:.0f} million"
    panels = [*_panel(20, 194, "Million closest hits a second", speed), *_panel(480, 120, lost, leaks)]
    return "\n".join([HEAD.format(52 + 26 * len(speed)), *panels, "</svg>\n"])


def _speed(queries: Iterable[dict[str, Any]]) -> list[Bar]:
    """Geometric means over the larger meshes and the kinds of rays that all systems answer."""
    of = [row["mrays"] for row in queries if row["query"] == "closest" and row["faces"] >= MEAN_FACES]
    measured = {name: label for name, label in SPEED.items() if any(name in rates for rates in of)}
    of = [rates for rates in of if rates.keys() >= measured.keys()]
    means = {label: geometric_mean(rates[name] for rates in of) or 0.0 for name, label in measured.items()}
    return [Bar(label, mean, f"{mean:.1f}") for label, mean in means.items()]


def _leaks(kinds: Iterable[dict[str, int]]) -> list[Bar]:
    """Leaks at edges and vertices together."""
    sums = {label: sum(of[name] for of in kinds) for name, label in LEAKS.items()}
    return [Bar(label, count, f"{count:,}") for label, count in sums.items()]


def _panel(left: int, indent: int, title: str, bars: Sequence[Bar]) -> Iterable[str]:
    """A title, and a row a bar: its name, the bar, its value."""
    yield f'  <text x="{left}" y="26" class="name">{title}</text>'
    most, x = max(bar.value for bar in bars), left + indent
    for row, bar in enumerate(bars):
        y, wide = 42 + 26 * row, bar.value / most * 150
        look = "ours" if bar.name.startswith("octree") else "other"
        yield f'  <text x="{x - 8}" y="{y + 14}" class="end">{bar.name}</text>'
        yield f'  <rect x="{x}" y="{y}" width="{wide:.1f}" height="18" class="{look}"/>'
        yield f'  <text x="{x + wide + 8:.1f}" y="{y + 14}">{bar.shown}</text>'
