"""Which tests touch which code, as ``validation.mutants.plugin`` measured it while the sound renderer passed them."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from renderer.jit.digest import PACKAGE, reached
from validation.mutants.sites import Mutant

Touched = Mapping[str, Mapping[str, Any]]
# Tests that read the sources' text: any change of it fails them, whatever it does.
_READERS = ("tests/validation/defects/", "tests/validation/mutants/", "tests/documents/test_documents.py")


def read(folder: Path, root: Path) -> Touched:
    """What the processes wrote: test file to ``lines`` {file: lines}, ``kernels`` [files] and ``seconds``, by paths
    relative to ``root``.
    """
    merged: dict[str, dict[str, Any]] = {}
    for path in sorted(folder.glob("*.json")):
        for test, found in json.loads(path.read_text(encoding="utf-8")).items():
            one = merged.setdefault(test, {"lines": {}, "kernels": [], "seconds": 0.0})
            for file, lines in found["lines"].items():
                if not Path(file).is_relative_to(root):  # of an installed copy that a test looked into
                    continue
                name = Path(file).relative_to(root).as_posix()
                one["lines"][name] = sorted({*one["lines"].get(name, []), *lines})
            one["kernels"] = sorted({*one["kernels"], *_closure(found["kernels"], root)})
            one["seconds"] += found["seconds"]
    return merged


def touching(mutant: Mutant, touched: Touched) -> list[str]:
    """The test files that run a mutant's code: those in the folder of its module first, then the shortest;
    at last the others in that folder."""
    package, *folders = Path(mutant.file).parent.parts
    # The front door's modules are in no room.
    room = Path("tests", *(folders or ["front"]) if package == "renderer" else (package, *folders)).as_posix()
    usable = {test: found for test, found in touched.items() if not test.startswith(_READERS)}
    near = [
        test for test, found in usable.items() if mutant.file in found["kernels"] or found["lines"].get(mutant.file)
    ]
    exact = [test for test in near if mutant.file in usable[test]["kernels"]
             or mutant.line in usable[test]["lines"].get(mutant.file, [])]  # fmt: skip
    # What stands at a module's top runs once, in whichever test imports it first; so does what is called from there.
    some = near if mutant.at_top or not exact else exact
    # What runs in other processes is not measured; the tests in the module's own folder may start them.
    own = [test for test in usable if Path(test).parent.as_posix() == room and test not in some]
    return sorted(
        [*some, *own],
        key=lambda test: (test not in some, Path(test).parent.as_posix() != room, touched[test]["seconds"]),
    )


def _closure(files: Sequence[str], root: Path) -> set[str]:
    """Files of the package in ``root`` with all that they import, by paths relative to it."""
    own = [Path(file).relative_to(root) for file in files if Path(file).is_relative_to(root / PACKAGE.name)]
    # What a file imports is told of this process's own package.
    found = reached(PACKAGE.parent / file for file in own)
    return {file.relative_to(PACKAGE.parent).as_posix() for file in found}
