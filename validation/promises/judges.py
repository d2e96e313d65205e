"""The judges of each public name: the tests whose marker names it, and the gates of the run."""

import ast
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from validation.gates import Gate
from validation.promises.names import public_names

ROOT = Path(__file__).resolve().parents[2]
_COVERED = "a public name without a test may break unnoticed"
_KNOWN = "such a name is misspelled or was removed"
_MARKER = "pytest.mark.judges"


def check_names(gates: Sequence[Gate], left_out: Iterable[str], root: Path = ROOT) -> tuple[dict[str, Any], list[Gate]]:
    """The judges of each public name, and two gates: no name lacks one, and none judges a name that is not public.

    Where that cannot be known the record says why, and there is no gate: an installed wheel has no tests, and a run
    that left sections out lacks their gates.
    """
    reason = _unknowable(root, left_out)
    if reason:
        return {"left_out": reason}, []
    tests, sections, names = marked(root / "tests"), _gated(gates), public_names()
    rows = [{"name": name, "tests": tests.get(name, []), "gates": sections.get(name, {})} for name in names]
    missing = [row["name"] for row in rows if not (row["tests"] or row["gates"])]
    unknown = sorted({*tests, *sections}.difference(names))
    found = [
        Gate("promises", "public names", "public names without a test or gate", len(missing), "at most", 0.0, _COVERED),
        Gate("promises", "public names", "tested names that are not public", len(unknown), "at most", 0.0, _KNOWN),
    ]
    return {"rows": rows, "unknown": unknown}, found


def _unknowable(root: Path, left_out: Iterable[str]) -> str | None:
    if not (root / "pyproject.toml").is_file():
        return "only a checkout has the tests"
    sections = ", ".join(left_out)
    return f"the run left out {sections}" if sections else None


def marked(folder: Path) -> dict[str, list[str]]:
    """By name the tests that are marked as its judges: files, classes or functions. The files are read and not run."""
    found: dict[str, list[str]] = {}
    for path in sorted(folder.rglob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        if _MARKER in text:
            for place, names in _markers(ast.parse(text), (path.relative_to(folder).as_posix(),)):
                for name in names:
                    found.setdefault(name, []).append("::".join(place))
    return found


def _markers(node: ast.Module | ast.ClassDef, place: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], list[str]]]:
    """The place of each marker in a module or class, and the names that it gives."""
    for child in node.body:
        if isinstance(child, ast.Assign) and ast.unparse(child.targets[0]) == "pytestmark":
            yield place, _names_in(child.value)
        elif isinstance(child, ast.FunctionDef | ast.ClassDef):
            inner = (*place, child.name)
            yield from ((inner, _names_in(decorator)) for decorator in child.decorator_list)
            if isinstance(child, ast.ClassDef):
                yield from _markers(child, inner)


def _names_in(expression: ast.expr) -> list[str]:
    """The names that the markers in an expression give, each written out as text."""
    markers = [
        node for node in ast.walk(expression) if isinstance(node, ast.Call) and ast.unparse(node.func) == _MARKER
    ]
    return [ast.literal_eval(name) for marker in markers for name in marker.args]


def _gated(gates: Iterable[Gate]) -> Mapping[str, dict[str, int]]:
    """By name how many gates of each section judge it."""
    counts = Counter((name, gate.section) for gate in gates for name in gate.judged)
    found: dict[str, dict[str, int]] = {}
    for (name, section), number in counts.items():
        found.setdefault(name, {})[section] = number
    return found
