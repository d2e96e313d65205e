"""What the pages of the API show, and the examples of pages and docstrings."""

import doctest
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import renderer
from renderer import cluster, radiosity, shapes, studies
from renderer.lazy import lazy
from renderer.mesh.heightfield import heightfield_mesh

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), *sorted(ROOT.glob("[CS]*.md"))]
_PYTHON = re.compile(r"```python\n(.*?)```", re.DOTALL)


def members(kind: type) -> Iterator[tuple[str, Any]]:
    """The public methods and properties that this package wrote, by the names of their class and their own."""
    for base in kind.__mro__:
        if base.__module__.partition(".")[0] == renderer.__name__:
            for name, value in vars(base).items():
                if not name.startswith("_") and (inspect.isroutine(value) or isinstance(value, property | lazy)):
                    yield f"{base.__name__}.{name}", value


def documented() -> dict[str, Any]:
    """What the pages of the API show, by name: public names and members, and the function that is not exported."""
    found: dict[str, Any] = {"heightfield_mesh": heightfield_mesh}
    for module in (renderer, shapes, studies, radiosity, cluster):
        for name in module.__all__:
            found[name] = thing = getattr(module, name)
            found.update(members(thing) if inspect.isclass(thing) else ())
    return found


def examples_of(thing: Any) -> list[doctest.Example]:
    return doctest.DocTestParser().get_examples(inspect.getdoc(thing) or "")


def scripts() -> dict[str, str]:
    """Each block of Python of the pages, and each docstring's example, by a name of its own."""
    found = {f"{page.stem}_{i}": block for page in PAGES for i, block in enumerate(_PYTHON.findall(page.read_text()))}
    found |= {name: "".join(example.source for example in examples_of(of)) for name, of in documented().items()}
    return {re.sub(r"\W", "_", name): text for name, text in found.items() if text}
