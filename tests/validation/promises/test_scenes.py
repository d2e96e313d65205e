"""Each check of scenes finds what is broken."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import RayScene
from renderer.rayscene import hits as rayscene_hits
from renderer.rayscene.hits import SceneHits
from validation.promises.scenes import attributes, choices, moments, queries

CHECKS: dict[str, Callable[[np.random.Generator], list[dict[str, Any]]]] = {
    "attributes": attributes.check_attributes,
    "choices": choices.check_choices,
    "moments": moments.check_moments,
    "queries": queries.check_queries,
}


@pytest.fixture(autouse=True)
def fewer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer rays and points than in the suite."""
    for module, name, number in (
        (choices, "_RAYS", 64), (moments, "_QUERIES", 20), (moments, "_RAYS", 3000), (queries, "_POINTS", 12),
        (queries, "_COUNT", 2), (attributes, "_RAYS", 200),
    ):  # fmt: skip
        monkeypatch.setattr(module, name, number)


def rows(name: str) -> list[dict[str, Any]]:
    return CHECKS[name](np.random.default_rng(7))


def broken(name: str) -> set[str]:
    return {row["promise"] for row in rows(name) if row["broken"]}


def without(monkeypatch: pytest.MonkeyPatch, option: str) -> None:
    """Let all queries of rays forget an option."""
    for name in ("closest_hit", "any_hit", "all_hits", "count_hits"):
        sound = getattr(RayScene, name)
        monkeypatch.setattr(
            RayScene,
            name,
            lambda scene, *given, sound=sound, **options: sound(
                scene, *given, **{key: value for key, value in options.items() if key != option}
            ),
        )


@cases("option", ["mask", "ignore", "faces"])
def test_options_that_are_forgotten_are_found(option: str, monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, option)
    names = {"closest_hit", "any_hit", "count_hits", "count_hits of each face", "all_hits"}
    assert {f"a ray hits what it may: {name}" for name in names} < broken("choices")


def test_instances_that_stay_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RayScene, "show", lambda *_, **__: None)
    assert "a ray hits what it may: closest_hit" in broken("choices")


def test_a_change_in_the_records_that_hits_have_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RayScene, "_writable", lambda scene: scene._records.array)
    assert "hits keep the scene that they hit" in broken("moments")


def test_a_change_that_is_lost_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RayScene, "refit", lambda *_: None)
    assert "an octree and a scene that has it do not change each other" in broken("moments")


@cases("name", ["points", "normals", "colors", "texcoords", "u", "v"])
def test_attributes_a_little_off_are_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = getattr(rayscene_hits._Places, name).fget
    monkeypatch.setattr(rayscene_hits._Places, name, property(lambda found: sound(found) * (1.0 + 1e-8)))
    said = {"colors": "colours", "texcoords": "texture coordinates", "u": "u and v", "v": "u and v"}.get(name, name)
    expected = {f"a scene's {query} know their {said}" for query in ("closest hits", "all hits", "closest points")}
    assert expected <= broken("attributes")


def test_colours_that_trimesh_may_share_are_found_beside_mitsuba(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = SceneHits.texcoords.fget  # type: ignore[attr-defined]
    monkeypatch.setattr(SceneHits, "texcoords", property(lambda found: sound(found)[..., ::-1]))
    assert "a scene's closest hits have colours and texture coordinates" in broken("attributes")


@cases("name", ["contains", "signed_distance", "winding_number", "visible"])
def test_wrong_answers_about_points_are_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = getattr(RayScene, name)
    monkeypatch.setattr(RayScene, name, lambda *given, **options: 1 - 1 * sound(*given, **options))
    assert broken("queries")
