"""Every public name and member has an example, which works as a reader would paste it."""

import doctest
from typing import Any

import pytest
from cases import cases
from documented import ROOT, documented, examples_of, members

import renderer

# Names without an example, each for its reason.
WITHOUT = {
    "__version__": "a string",
    "shapes": "a module, whose functions have examples",
    "Queries.tree": "arrays for the kernels",
    "PreparedScene.picture": "render calls it with arguments that it has checked; users call render",
}


DOCUMENTED = documented()


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
