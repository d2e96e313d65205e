"""The judges of radiosity notice broken renderers."""

from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from validation.defects.changes import Wrapped
from validation.defects.seeded.lit import LIT
from validation.studies.lit import judge, scenes


@cache
def random_paths() -> Any:
    """Mitsuba's picture of the room, which is the same in each test."""
    return judge.global_light.global_light(scenes.room(), judge._SIZE, judge._SIZE, judge._QUICK_PATHS)


@pytest.fixture
def room(mitsuba: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(judge, "LIT", {"a room by radiosity": judge.LIT["a room by radiosity"]})
    drawn = random_paths()
    monkeypatch.setattr(judge.global_light, "global_light", lambda *_: drawn)


def failed(record: dict[str, Any]) -> list[str]:
    return [gate.quantity for gate in judge.gates(record) if not gate.passed]


def found() -> dict[str, Any]:
    return judge.record(iter([task.do() for task in judge.tasks(quick=True)]))


@pytest.mark.parametrize("defect", [d for d in LIT if isinstance(d.change, Wrapped)], ids=lambda d: d.name)
def test_a_broken_one_fails(room: None, monkeypatch: pytest.MonkeyPatch, defect: Any) -> None:
    from renderer.radiosity import lit

    name = defect.change.name.removeprefix("lit.")
    sound = getattr(lit, name)
    monkeypatch.setattr(lit, name, lambda *given, **options: defect.change.wrapper(sound, *given, **options))
    assert "mean relative error" in failed(found())


def test_light_that_is_lost_is_noticed(room: None, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = judge.shown
    monkeypatch.setattr(judge, "shown", lambda scene, edge: 0.97 * sound(scene, edge))
    assert "relative error of all light" in failed(found())


def test_a_furnace_that_is_not_even_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    from renderer.radiosity import lit

    sound = lit.vertex_colors

    def darker(mesh: Any, values: Any, **options: Any) -> Any:
        return sound(mesh, np.asarray(values) * 0.9999, **options)

    monkeypatch.setattr(lit, "vertex_colors", darker)
    assert judge.check_furnace()["error"] > judge._FURNACE
