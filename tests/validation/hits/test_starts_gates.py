"""The gates of rays that start on surfaces: green for a tracer that keeps the law, red where it breaks one rule."""

from functools import cache
from pathlib import Path

import lawful
import numpy as np
import pytest
from cases import cases
from lawful import Lawful

from renderer.mesh.mesh import Mesh
from validation import meshes
from validation.hits import bodies, mirrors, starts, walks
from validation.hits.bodies import Body
from validation.job import Job
from validation.oracle.starts import Surface
from validation.thresholds import Thresholds

EFFORT = starts.StartEffort(rays=900, exact=60)


class Patient(Surface):
    """Whole numbers of all faces: at few faces they are sooner there than float64's sieve, which is the judge's."""

    holding = cache(Surface.holding)
    nearest = cache(lambda self, face, point: Surface.start_near(self, face, point))

    def possible(self, places, directions):
        return [np.arange(len(self.faces))] * len(places)

    def start_near(self, face, point):
        return self.nearest(face, tuple(point.tolist()))


@pytest.fixture(scope="module", autouse=True)
def _patient():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lawful, "Surface", Patient)
        yield


def job() -> Job:
    return Job(True, Thresholds(), Path(), lambda _: None)


def checked(body, make=Lawful, effort=EFFORT):
    return starts.check_body(body, effort, np.random.default_rng(1), make)


SAMPLES = {
    "tetrahedron": Body("", meshes.tetrahedron(), True),
    "notched": Body("", meshes.hilly(1), True),
    "reflex prism": Body("", meshes.prism(300.0), True),
    "raster": Body("", bodies.raster(5), False),
    "soup": Body("", meshes.loose(meshes.prism(60.0).triangles), True),
    "needle": Body("", bodies.needle(2.0**-40), True),
    "stack": Body("", bodies.stack(), False),
    "boxes": Body("", bodies.boxes_side_by_side(), False),
    "far away": Body("", Mesh(meshes.tetrahedron().vertices * 1e3 + 1e9, meshes.tetrahedron().faces), True),
}


@cases("name", SAMPLES)
def test_who_keeps_the_law_is_never_wrong(name):
    found = checked(SAMPLES[name])
    assert found.rays > 600 and found.exact > 30
    assert found[2:] == (0, 0, 0, 0)


class NoSides(Lawful):
    """The side is forgotten: no face that holds the start stops a ray."""

    def rule(self, side, through):
        return 0, through


class OtherSide(Lawful):
    def rule(self, side, through):
        return -side, through


class AlwaysBack(Lawful):
    """A ray that went through is taken for one that turned back."""

    def rule(self, side, through):
        return side, False


class Later(Lawful):
    """t = 0 becomes a little more."""

    def closest_hit(self, *arguments, **options):
        found = super().closest_hit(*arguments, **options)
        found.t = np.where(found.t == 0.0, 1e-300, found.t)
        return found


class Leaky(Lawful):
    """One ray in ten that leaves a face is lost."""

    def closest_hit(self, *arguments, leaving=None, side=None):
        found = super().closest_hit(*arguments, leaving=leaving, side=side)
        if leaving is not None:
            found.face[::10], found.t[::10] = -1, np.inf
        return found


class Farther(Lawful):
    """Hits beyond the start are a millionth too far."""

    def closest_hit(self, *arguments, **options):
        found = super().closest_hit(*arguments, **options)
        found.t *= 1.000001
        return found


@cases(
    ("make", "name", "red"),
    [
        (NoSides, "tetrahedron", {"at_once"}),
        (OtherSide, "tetrahedron", {"at_once"}),
        (AlwaysBack, "stack", {"at_once"}),
        (Later, "tetrahedron", {"at_once", "unnamed"}),
        (Leaky, "tetrahedron", {"at_once", "lost", "sample"}),
        (Farther, "tetrahedron", {"sample"}),
    ],
)
def test_each_broken_rule_is_seen(make, name, red):
    found = checked(SAMPLES[name], make, starts.StartEffort(rays=450, exact=60))
    assert {field for field in found._fields[2:] if getattr(found, field)} >= red


def test_a_gate_for_each_family_and_quantity(monkeypatch):
    chosen = [Body("some", SAMPLES["tetrahedron"].mesh, True), Body("others", SAMPLES["stack"].mesh, False)]
    monkeypatch.setattr(starts, "bodies", lambda: iter(chosen))
    said = []
    given = Job(True, Thresholds(), Path(), said.append)
    records, gates = starts.check_starts(given, EFFORT, NoSides)
    assert len(said) == starts.steps() == 2 and [one["family"] for one in records] == ["some", "others"]
    assert len(gates) == 8 and any(not gate.passed for gate in gates)
    records, gates = starts.check_starts(given, EFFORT, Lawful)
    assert all(gate.passed for gate in gates)


def test_mirrors_reflect_for_ever(monkeypatch):
    monkeypatch.setattr(mirrors, "BOUNCES", 12)
    _, gates = mirrors.check_mirrors(job(), 12, Lawful)
    assert len(gates) == 16 and all(gate.passed for gate in gates)


def test_a_ray_that_is_lost_or_stays_is_counted(monkeypatch):
    monkeypatch.setattr(mirrors, "BOUNCES", 20)
    mesh, rng = meshes.tetrahedron(), np.random.default_rng(3)
    rays = mirrors.aimed("vertex", mesh.vertices, mesh.faces, np.tile(mesh.vertices.mean(axis=0), (8, 1)), rng)

    class Stuck(Lawful):
        def closest_hit(self, *arguments, **options):
            found = super().closest_hit(*arguments, **options)
            found.t[0] = 0.0
            return found

    assert mirrors.reflected(Stuck(mesh.vertices, mesh.faces), rays.origins, rays.directions) == (0, 1)
    assert mirrors.reflected(Leaky(mesh.vertices, mesh.faces), rays.origins, rays.directions)[0] == 8


@cases("name", ["tetrahedron", "stack", "boxes", "notched", "soup"])
def test_a_ray_meets_all_on_its_way_once(name):
    assert walks.walk(SAMPLES[name], 30, np.random.default_rng(4), Lawful) == 0
    assert walks.walk(SAMPLES[name], 30, np.random.default_rng(4), Leaky) > 0


def test_coinciding_faces_are_not_passed_together(monkeypatch):
    assert walks.walk(SAMPLES["stack"], 30, np.random.default_rng(4), NoSides) > 0
    monkeypatch.setattr(walks, "bodies", lambda: iter([SAMPLES["stack"]]))
    (record,), (gate,) = walks.check_walks(job(), 10, Lawful)
    assert record["rays"] == 10 and gate.passed
    assert not walks.check_walks(job(), 10, NoSides)[1][0].passed
