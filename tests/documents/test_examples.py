"""Every public name and member has an example, which works as a reader would paste it."""

import doctest
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from cases import cases

import renderer
from renderer import cluster, studies
from renderer.lazy import lazy
from renderer.mesh.heightfield import heightfield_mesh

ROOT = Path(__file__).parents[2]

# Names without an example, each for its reason.
WITHOUT = {
    "__version__": "a string",
    "Queries.tree": "arrays for the kernels",
    "PreparedScene.picture": "render calls it with arguments that it has checked; users call render",
    "Phong.kind": "a number for the kernels",
    "Phong.row": "numbers for the kernels",
    "Mirror.row": "numbers for the kernels",
    "Dielectric.row": "numbers for the kernels",
    "DirectionalLight.row": "numbers for the kernels",
    "PointLight.row": "numbers for the kernels",
}


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
    for module in (renderer, studies, cluster):
        for name in module.__all__:
            found[name] = thing = getattr(module, name)
            found.update(members(thing) if inspect.isclass(thing) else ())
    return found


DOCUMENTED = documented()


def examples_of(thing: Any) -> list[doctest.Example]:
    return doctest.DocTestParser().get_examples(inspect.getdoc(thing) or "")


def names_without(things: dict[str, Any]) -> set[str]:
    return {name for name, thing in things.items() if not any(example.want for example in examples_of(thing))}


def test_every_public_name_and_member_has_an_example_that_shows_a_result() -> None:
    assert names_without(DOCUMENTED) == set(WITHOUT)


def test_a_member_without_an_example_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    for doc in (None, "Its area.", "Its area.\n\n>>> from renderer import Mesh\n"):
        monkeypatch.setattr(renderer.Mesh, "area", property(lambda self: 0.0, doc=doc), raising=False)
        assert names_without(dict(members(renderer.Mesh))) == {"Mesh.area"}


@cases("name", sorted(set(DOCUMENTED) - set(WITHOUT)))
def test_an_example_works_as_a_reader_pastes_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a new session, at the root of the repository."""
    monkeypatch.chdir(ROOT)
    test = doctest.DocTest(examples_of(DOCUMENTED[name]), {}, name, None, None, None)
    runner = doctest.DocTestRunner(verbose=False)
    runner.run(test)
    assert runner.tries == len(test.examples) > 0 and runner.failures == 0
