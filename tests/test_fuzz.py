"""A short run of tests/fuzz.py, and proof that its checks find what they are there to find."""

from pathlib import Path
from typing import Any

import fuzz
import numpy as np
import pytest
from numpy.random import default_rng

from renderer import mesh_io, octree, ply
from renderer.errors import MeshError
from renderer.mesh import Mesh
from renderer.shapes import box

INPUTS = 400


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    fuzz.prepare(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", fuzz.SEEDS)
def test_mutated_files_are_refused_or_right(folder: Path, name: str) -> None:
    outcomes = [fuzz.check(folder / name, fuzz.mutated(name, 0, index), index) for index in range(INPUTS)]
    # Both ways were gone: mutations that all fail, or that all load, would test one of them only.
    assert 0 < outcomes.count("refused") < INPUTS


@pytest.mark.parametrize("name", fuzz.SEEDS)
def test_the_seed_files_load(folder: Path, name: str) -> None:
    counted = Path(name).suffix in fuzz.COUNTERS
    assert fuzz.check(folder / name, fuzz.SEEDS[name], 0) == ("counted" if counted else "loaded")


@pytest.mark.parametrize("name", fuzz.SEEDS)
def test_inputs_are_the_same_again_and_differ_from_each_other(name: str) -> None:
    inputs = [fuzz.mutated(name, 3, index) for index in range(40)]
    assert inputs == [fuzz.mutated(name, 3, index) for index in range(40)]
    assert len(set(inputs)) > 30 and inputs != [fuzz.mutated(name, 4, index) for index in range(40)]


def test_finds_an_exception_that_is_let_through(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def careless(content: bytes, repairs: Any = None) -> Mesh:
        raise KeyError("x")

    monkeypatch.setitem(mesh_io._PARSERS, ".ply", careless)
    with pytest.raises(KeyError):
        fuzz.check(folder / "ascii.ply", fuzz.SEEDS["ascii.ply"], 0)


@pytest.mark.parametrize("name", ["ascii.ply", "little.ply", "big.ply"])
def test_finds_a_face_that_is_dropped_silently(folder: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    cut = ply._polygons
    monkeypatch.setattr(ply, "_polygons", lambda *given: cut(*given)[:-1])
    with pytest.raises(AssertionError, match="a silent drop"):
        fuzz.check(folder / name, fuzz.SEEDS[name], 0)


def test_finds_a_repair_without_its_warning(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = folder / "plain.obj"
    content = fuzz.SEEDS["plain.obj"] + b"f 1 2 99\n"
    assert fuzz.check(path, content, 0) == "repaired"
    monkeypatch.setattr(mesh_io.warnings, "warn", lambda *_, **__: None)
    with pytest.raises(AssertionError, match="without its warning"):
        fuzz.check(path, content, 0)


def test_finds_a_line_that_is_dropped_silently(folder: Path) -> None:
    content = fuzz.SEEDS["plain.obj"]
    assert fuzz.triangles_by_lines(content) == 15 == fuzz.triangles_by_lines(content.replace(b"\n", b"\r\n"))
    assert fuzz.triangles_by_lines(content + b"f 1 2 3 4 5\n") == 18


def test_finds_a_reader_that_does_not_end(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def endless(content: bytes, repairs: Any = None) -> Mesh:
        while True:
            pass

    monkeypatch.setitem(mesh_io._PARSERS, ".ply", endless)
    monkeypatch.setattr(fuzz, "SECONDS", 0.05)
    with pytest.raises(TimeoutError):
        fuzz.check(folder / "ascii.ply", fuzz.SEEDS["ascii.ply"], 0)


def test_finds_a_wrong_hit(monkeypatch: pytest.MonkeyPatch) -> None:
    right = octree.BruteForce.closest_hit

    def wrong(self: octree.BruteForce, *rays: Any) -> Any:
        hits = right(self, *rays)
        hits.t[hits.hit] = np.nextafter(hits.t[hits.hit], 0.0)
        return hits

    assert fuzz.check_mesh(box(), default_rng(0))
    monkeypatch.setattr(octree.BruteForce, "closest_hit", wrong)
    with pytest.raises(AssertionError):
        fuzz.check_mesh(box(), default_rng(0))


def test_meshes_that_no_octree_holds_are_told_apart() -> None:
    spread = Mesh([[0, 0, 0], [1e-300, 0, 0], [0, 1e300, 0]], [[0, 1, 2]])  # type: ignore[arg-type]
    with pytest.raises(MeshError):
        octree.Octree.from_mesh(spread)
    assert not fuzz.check_mesh(spread, default_rng(0))
