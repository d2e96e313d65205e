"""Every contender answers like ours on a small mesh; families hit something; what is not installed is named."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.benchmark.measures import queries
from validation.benchmark.measures.families import cosine_distributed, families
from validation.benchmark.measures.meshes import displaced_spheres
from validation.benchmark.peers import systems
from validation.benchmark.peers.contender import Family, System
from validation.benchmark.peers.ours import OURS, OURS_ONE


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return displaced_spheres(1_000)


@pytest.fixture(scope="module")
def octree(mesh: Mesh) -> Octree:
    return Octree.from_mesh(mesh)


@pytest.fixture(scope="module")
def rays(octree: Octree) -> tuple[Family, ...]:
    return families(octree, 600)


def _system(name: str) -> System:
    if name == "open3d":
        pytest.importorskip("open3d", reason="pip install open3d")
    found, missing = systems.available()
    known = {system.name: system for system in found}
    if name == "mitsuba_llvm" and name in missing:
        pytest.skip(missing[name])
    return known[name]


@pytest.mark.parametrize("name", [OURS_ONE, "embree", "open3d", "trimesh", "mitsuba_scalar", "mitsuba_llvm"])
def test_a_contender_agrees_with_ours(name: str, mesh: Mesh, octree: Octree, rays: tuple[Family, ...]) -> None:
    peer = _system(name).loaded(mesh.vertices, mesh.faces)
    for family in rays:
        ours = octree.closest_hit(family.origins, family.directions, t_max=family.t_max)
        query = peer.closest(family)
        t = query.read(query.trace())
        assert np.array_equal(np.isfinite(t), ours.hit), family.name
        # Embree's float32 error of a point is some 2^-24 of the coordinates, 2 here, and t is a share of the ray; the
        # shortest t are those of bounces into the next face, about 1e-3 of it. Seen: 3e-5.
        assert np.allclose(t[ours.hit], ours.t[ours.hit], rtol=1e-3, atol=1e-6), family.name
        asked = peer.any(family)
        if asked is None:
            assert name == "trimesh" and family.name == "shadow"
        else:
            expected = octree.any_hit(family.origins, family.directions, t_max=family.t_max)
            assert np.array_equal(asked.read(asked.trace()), expected), family.name


@pytest.mark.parametrize("name", [OURS, "embree", "open3d", "mitsuba_scalar", "mitsuba_llvm"])
def test_a_ray_ends_where_it_should(name: str) -> None:
    vertices, faces = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32)
    peer = _system(name).loaded(vertices, faces)
    o, d = np.array([[0.25, 0.25, 2.0]]), np.array([[0.0, 0.0, -2.0]])
    for t_max, expected in ((0.75, False), (1.25, True), (np.inf, True)):
        query = peer.any(Family("one", o, d, t_max))
        assert query is not None
        assert query.read(query.trace()).tolist() == [expected]


def test_every_family_hits_and_shadow_rays_end_at_one_light(octree: Octree, rays: tuple[Family, ...]) -> None:
    assert [family.name for family in rays] == ["camera", "shadow", "random", "bounce"]
    for family in rays:
        assert len(family) == 600
        share = octree.any_hit(family.origins, family.directions, t_max=family.t_max).mean()
        assert 0.05 < share < 0.95, family.name  # else a contender would be timed on an empty scene
        for array in (family.origins, family.directions):
            assert np.array_equal(array, array.astype(np.float32))
    shadow = rays[1]
    # The ends differ by the rounding of the directions to float32 alone: below 16, that is 2^-21 up or down.
    assert np.ptp(shadow.origins + shadow.directions, axis=0).max() <= 2.0**-20
    assert shadow.t_max == 1.0


def test_bounce_rays_follow_the_cosine() -> None:
    normals = np.tile([0.0, 0.0, 1.0], (20_000, 1))
    d = cosine_distributed(normals, np.random.default_rng(0))
    cosine = d[:, 2] / np.linalg.norm(d, axis=1)
    assert cosine.min() >= 0.0
    # E[cos] = 2/3, E[cos^2] = 1/2; five standard errors of 20,000 samples are 0.009 and 0.011.
    assert abs(cosine.mean() - 2 / 3) < 0.009
    assert abs((cosine**2).mean() - 1 / 2) < 0.011


def test_fewer_rays_are_spread_over_the_family() -> None:
    family = Family("f", np.arange(30.0).reshape(10, 3), np.ones((10, 3)), 1.0)
    few = family.at_most(4)
    assert few.origins[:, 0].tolist() == [0.0, 9.0, 18.0, 27.0]
    assert few.t_max == 1.0
    assert family.at_most(10) is family


def test_the_meshes_have_the_size_that_was_asked_for_and_their_hills_do_not_depend_on_it() -> None:
    small, large = displaced_spheres(10_000), displaced_spheres(40_000)
    assert abs(len(small.faces) / 10_000 - 1) < 0.1 and abs(len(large.faces) / 40_000 - 1) < 0.1
    assert small.is_float32
    assert np.allclose(small.bounds, large.bounds, atol=0.03)
    centres = 1.05 * np.sign(small.triangles.mean(axis=1))
    outward = np.einsum("ij,ij->i", small.face_normals(), small.triangles.mean(axis=1) - centres)
    assert (outward > 0).all()


def test_measured_rows_say_who_hit_what(mesh: Mesh) -> None:
    chosen = [_system(name) for name in (OURS, OURS_ONE, "embree", "mitsuba_scalar")]
    rows = queries.measure(mesh, chosen, 30_000, lambda _: None)
    assert [(r["family"], r["query"]) for r in rows] == [
        (f, q) for f in ("camera", "shadow", "random", "bounce") for q in ("closest", "any")
    ]
    for row in rows:
        assert row["agree"] and set(row["ratios"]) == {OURS_ONE, "embree", "mitsuba_scalar"}
        scalar = row["contenders"]["mitsuba_scalar"]
        assert scalar["rays"] == 20_000 and len(scalar["seconds"]) == 5
        assert scalar["hits"] / 20_000 == pytest.approx(row["hit_share"], abs=0.02)
        assert row["contenders"][OURS]["hits"] == pytest.approx(row["hit_share"] * 30_000)


def test_a_contender_that_sees_another_scene_is_found(mesh: Mesh) -> None:
    def elsewhere(vertices: Any, faces: Any) -> Callable[[], Any]:
        return _system("embree").load(vertices + 0.1, faces)

    wrong = System("wrong", "wrong", 1, "float32", elsewhere)
    rows = queries.measure(mesh, [_system(OURS), wrong], 500, lambda _: None)
    assert not any(row["agree"] for row in rows)


def test_what_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> Any:
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(systems, "import_module", absent)
    found, missing = systems.available()
    assert [system.name for system in found] == [OURS, OURS_ONE]
    assert set(missing) == {"embree", "open3d", "trimesh", "mitsuba", "mitsuba_llvm"}
    assert "pip install open3d" in missing["open3d"] and "libllvm19" in missing["mitsuba_llvm"]
