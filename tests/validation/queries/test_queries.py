"""The section on queries: each kind of wrong answer turns a gate red."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from cases import cases

from renderer import Octree
from renderer.trimesh_ray import RayMeshIntersector
from validation.job import Job
from validation.oracle.contacts import contacts
from validation.oracle.inside import winding_number
from validation.oracle.vectors import rational
from validation.queries.contacts import check_contacts
from validation.queries.distances import check_distances, meshes
from validation.queries.drop_in import FAULTS, OURS, check_drop_in
from validation.queries.inside import check_inside
from validation.queries.peers import LIBIGL, OPEN3D, TRIMESH, peers
from validation.queries.shapes import families, shapes
from validation.queries.solids import nasty_points, random_points, solids
from validation.references.trimesh_queries import TrimeshQueries
from validation.thresholds import Thresholds

JOB = Job(True, Thresholds(), Path(), lambda name: None)


def wrong(rows):
    return {row["subject"]: row["wrong"] for row in rows if row["wrong"]}


def test_the_solids_are_judged_as_rational_arithmetic_judges_them():
    rng = np.random.default_rng(0)
    for solid in solids():
        points = np.concatenate([nasty_points(solid, rng, 12), random_points(solid, rng, 6)])
        winding, on = solid.winding(points)
        triangles = [rational(triangle) for triangle in solid.mesh().triangles]
        numbers = [winding_number(point, triangles) for point in rational(points)]
        assert on.tolist() == [number is None for number in numbers]
        assert winding[~on].tolist() == [number for number in numbers if number is not None]


@pytest.mark.parametrize("change", [lambda a: ~a, lambda a: np.append(a[:-1], not a[-1]), np.zeros_like])
def test_wrong_answers_to_inside_are_counted(monkeypatch, change):
    contains = Octree.contains
    monkeypatch.setattr(Octree, "contains", lambda *a, **k: change(contains(*a, **k)))
    assert len(wrong(check_inside(240, 240, 4, JOB))) == 12


@pytest.mark.parametrize("name", ["distance", "face"])
def test_wrong_distances_are_counted(monkeypatch, name):
    closest_point = Octree.closest_point

    def changed(*arguments, **options):
        found = closest_point(*arguments, **options)
        found.distance *= 1.0 + 2.0**-51 * (name == "distance")
        found.face += name == "face"
        return found

    monkeypatch.setattr(Octree, "closest_point", changed)
    assert len(wrong(check_distances(6, JOB))) == len(meshes())


@cases("query", ["all_hits", "count_hits", "closest_hit", "any_hit"])
def test_wrong_contacts_are_counted(monkeypatch, query):
    asked = getattr(Octree, query)

    def changed(*arguments):
        found = asked(*arguments)
        if query == "all_hits":
            found.t[:] = np.nextafter(found.t, np.inf)
        elif query == "closest_hit":
            found.face += 1
        else:
            found = found + 1 if query == "count_hits" else ~found
        return found

    monkeypatch.setattr(Octree, query, changed)
    assert len(wrong(check_contacts(8, JOB))) == len(solids())


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_the_drop_in_are_counted(monkeypatch, fault):
    asked = RayMeshIntersector.intersects_location

    def changed(*arguments, **options):
        places, rays, faces = asked(*arguments, **options)
        if fault == "number":
            return places[1:], rays[1:], faces[1:]
        return (places, rays, np.roll(faces, 1)) if fault == "faces" else (places * (1 + 2.0**-38), rays, faces)

    monkeypatch.setattr(RayMeshIntersector, "intersects_location", changed)
    rows = check_drop_in(1, JOB)
    assert all(row["faults"][OURS][fault] == row["wrong"] > 0 for row in rows)


def test_rays_of_the_drop_in_touch_edges_and_corners_and_the_shapes_are_what_they_say():
    kinds = shapes()
    assert sum(map(len, kinds.values())) == 50
    assert all(mesh.area_faces.min() > 0 for mesh in kinds["as made"])
    for aim in list(families().values())[:3]:
        mesh = kinds["as made"][1]
        origins, directions = aim(mesh, np.random.default_rng(0), 60)
        found = [contacts(mesh.vertices, mesh.faces, *ray) for ray in zip(origins, directions, strict=True)]
        assert {1, 2} <= {len(contact.faces) for ray in found for contact in ray} and max(map(len, found)) == 2
        # Slopes in fourths, which float64 holds.
        assert (np.abs(directions).max(axis=1) == 4).all() and (directions == np.round(directions)).all()


@pytest.mark.parametrize("installed", [False, True])
def test_open3d_is_asked_where_it_is_installed(monkeypatch, installed):
    answers = SimpleNamespace(Open3dQueries=TrimeshQueries) if installed else None
    monkeypatch.setitem(sys.modules, "validation.references.open3d_queries", answers)
    monkeypatch.setattr("validation.queries.inside.peers", peers.__wrapped__)
    (row, *_) = check_inside(240, 240, 4, JOB)
    assert list(row["others"]) == [TRIMESH, LIBIGL, *([OPEN3D] if installed else [])]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of infinities less each other
@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_distances_that_are_none_are_wrong(monkeypatch, value):
    """What is asked again within them is refused by the renderer itself."""
    asked = Octree.closest_point

    def changed(self, points, *most, **limits):
        found = asked(self, points, *most, **limits)
        found.distance[:] = value
        return found

    monkeypatch.setattr(Octree, "closest_point", changed)
    assert set(wrong(check_distances(4, JOB)).values()) == {4} and len(meshes()) == len(check_distances(4, JOB))
