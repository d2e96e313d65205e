"""What mutants break: the renderer, or what judges it."""

from pathlib import Path

# The renderer, all of it. Of the validation suite what a verdict comes from: references, exact arithmetic, comparisons,
# gates and thresholds; the rest chooses rays, draws and prints.
TARGETS: dict[str, tuple[str, ...]] = {
    "renderer": ("renderer",),
    "judges": (
        "validation/references",
        "validation/oracle",
        "validation/hits/compare.py",
        "validation/hits/verdicts.py",
        "validation/pictures/compare.py",
        "validation/stability/cases/judgement.py",
        "validation/gates.py",
        "validation/thresholds.py",
    ),
}


def files(target: str, root: Path) -> list[Path]:
    """The files of a target in a checkout, in order."""
    paths = [root / name for name in TARGETS[target]]
    return sorted(file for path in paths for file in (path.rglob("*.py") if path.is_dir() else [path]))


def record_of(target: str, output: Path) -> Path:
    """Where the record of a target's mutants is."""
    return output / ("mutants.json" if target == "renderer" else f"mutants-{target}.json")
