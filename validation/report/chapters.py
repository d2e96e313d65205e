"""The order of the page: its sections, the parts of the suite that each shows, and what the run did not do."""

from collections.abc import Mapping
from typing import Any, NamedTuple


class Partial(NamedTuple):
    """A section of the suite on the page: its title, and the template of its record m.<section>."""

    title: str
    template: str


class Chapter(NamedTuple):
    """A section of the page and an entry of its navigation bar; ``parts`` are sections of the suite."""

    key: str
    entry: str
    title: str
    parts: tuple[str, ...]


PARTIALS = {
    "hits": Partial("Hits", "hits.html"),
    "images": Partial("Pictures", "pictures.html"),
    "queries": Partial("Queries", "queries.html"),
    "studies": Partial("Studies", "studies.html"),
    "stability": Partial("Stability", "stability.html"),
    "random": Partial("Random input", "random.html"),
    "promises": Partial("Promises", "promises.html"),
    "efficiency": Partial("Efficiency", "efficiency.html"),
}
CHAPTERS = (
    Chapter("hits", "Hits", "Hits", ("hits",)),
    Chapter("pictures", "Pictures", "Pictures", ("images",)),
    Chapter("queries", "Queries", "Queries", ("queries",)),
    Chapter("studies", "Studies", "Studies", ("studies",)),
    Chapter("stability", "Stability", "Stability", ("stability", "random")),
    Chapter("checks", "Checks", "How the checks are checked", ("promises",)),
    Chapter("appendix", "Appendix", "Appendix", ("efficiency",)),
)


def present(metrics: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The chapters that have something to show, each with its rows of the matrix and its failing gates."""
    matrix = {row["section"]: row for row in metrics["matrix"]}
    found = []
    for chapter in CHAPTERS:
        rows = [matrix[part] for part in chapter.parts if part in matrix]
        failing = [gate for gate in metrics["gates"] if gate["section"] in chapter.parts and not gate["passed"]]
        if rows or chapter.key == "appendix" or (chapter.key == "checks" and "defects" in metrics):
            found.append(chapter._asdict() | {"rows": rows, "failing": failing})
    return found


def absent(metrics: Mapping[str, Any]) -> str:
    """The parts that the run left out, with the reasons, in one line; empty if none."""
    titles: dict[str, list[str]] = {}
    for part, reason in metrics["left_out"].items():
        titles.setdefault(reason, []).append(PARTIALS[part].title)
    if "defects" not in metrics:
        titles["no run is stored; python -m validation --defects makes one in one to two hours"] = ["seeded defects"]
    return "; ".join(f"{', '.join(names)} ({reason})" for reason, names in titles.items())
