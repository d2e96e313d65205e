"""Every contender answers like ours on a small mesh; families hit something; what is not installed is named.

Which answers count as differing is tested in ``test_benchmark_kinds``.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.octree import Octree
from validation import timing
from validation.benchmark.measures import calls, queries
from validation.benchmark.measures.families import cosine_distributed, families, points
from validation.benchmark.measures.kinds import FIRST, KINDS
from validation.benchmark.measures.meshes import displaced_spheres, named
from validation.benchmark.peers import ours, systems
from validation.benchmark.peers.contender import Family, HitLists, Points, System
from validation.benchmark.peers.ours import OURS, OURS_ONE, OURS_TWO, Ours


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
        hits = octree.closest_hit(family.origins, family.directions, t_max=family.t_max)
        query = peer.closest(family)
        if query is None:
            assert name in ("open3d", "trimesh") and family.name == "short"
            continue
        t = query.read(query.trace())
        assert np.array_equal(np.isfinite(t), hits.hit), family.name
        # Embree's float32 error of a point is some 2^-24 of the coordinates, 2 here, and t is a share of the ray; the
        # shortest t are those of bounces into the next face, about 1e-3 of it. Seen: 3e-5.
        assert np.allclose(t[hits.hit], hits.t[hits.hit], rtol=1e-3, atol=1e-6), family.name
        asked = peer.any(family)
        if asked is None:
            assert name == "trimesh" and family.name == "shadow"
        else:
            expected = octree.any_hit(family.origins, family.directions, t_max=family.t_max)
            assert np.array_equal(asked.read(asked.trace()), expected), family.name


_MORE = {
    OURS_ONE: {"all", "count", "contains", "nearest", "signed"},
    "open3d": {"all", "count", "contains", "nearest", "signed"},
    "trimesh_embreex": {"all", "contains"},
    "libigl": {"contains", "nearest", "signed"},
    "trimesh": {"nearest"},
    "embree": set[str](),
}


@pytest.mark.parametrize("name", _MORE)
def test_a_contender_agrees_with_ours_on_all_hits_and_points(
    name: str, mesh: Mesh, octree: Octree, rays: tuple[Family, ...]
) -> None:
    own, peer = (_system(n).loaded(mesh.vertices, mesh.faces) for n in (OURS, name))
    found = set()
    for kind in KINDS.values():
        for asked in (*rays, *points(mesh, 600)):
            query = kind.ask(peer, asked) if asked.name in kind.families else None
            if query is not None and kind.name not in FIRST:
                expected = kind.ask(own, asked)
                assert expected is not None
                known, answer = expected.read(expected.trace()), query.read(query.trace())
                assert len(kind.hit(answer)) == 600 and kind.hit(known).sum() > 100
                assert not kind.differing(octree, asked, known, answer).any(), (kind.name, asked.name)
                found.add(kind.name)
    assert found == _MORE[name]


@pytest.mark.parametrize("name", [OURS, "open3d", "trimesh_embreex", "trimesh", "libigl"])
def test_a_contender_answers_for_a_box_as_geometry_says(name: str) -> None:
    mesh = box()
    peer = _system(name).loaded(mesh.vertices, mesh.faces)
    o, d = np.array([[0.25, 0.5, 2.0], [0.25, 0.5, 0.5], [3.0, 3.0, 3.0]]), np.array([[0.0, 0.0, -2.0]] * 3)
    lists, count = peer.all(Family("some", o, d)), peer.count(Family("some", o, d))
    if lists is not None:
        hits = lists.read(lists.trace())
        assert isinstance(hits, HitLists) and hits.counts.tolist() == [2, 1, 0]
        assert hits.t == pytest.approx([0.5, 1.0, 0.25], abs=1e-6)
        assert set(mesh.vertices[mesh.faces[hits.face]][:, :, 2].mean(axis=1)) == {0.0, 1.0}
    assert count is None or count.read(count.trace()).tolist() == [2, 1, 0]
    at = Points("some", np.array([[0.25, 0.5, 0.625], [0.25, 0.5, 3.0], [-3.0, 0.5, 5.0]]))
    for query, expected in ((peer.contains(at), [True, False, False]), (peer.nearest(at), [0.25, 2.0, 5.0]),
                            (peer.signed(at), [-0.25, 2.0, 5.0])):  # fmt: skip
        assert query is None or query.read(query.trace()).tolist() == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("name", ["open3d", "trimesh_embreex"])
def test_all_hits_of_rays_with_an_end_are_not_asked_where_there_is_no_argument_for_it(name: str, mesh: Mesh) -> None:
    peer = _system(name).loaded(mesh.vertices, mesh.faces)
    ended = Family("one", np.zeros((1, 3)), np.ones((1, 3)), 1.0)
    assert peer.all(ended) is None and peer.count(ended) is None


def test_a_ray_with_an_end_has_fewer_hits_of_ours() -> None:
    peer = _system(OURS).loaded(box().vertices, box().faces)
    ended = Family("one", np.array([[0.25, 0.5, 2.0]]), np.array([[0.0, 0.0, -2.0]]), 0.75)
    lists, count = peer.all(ended), peer.count(ended)
    assert lists is not None and count is not None
    assert lists.read(lists.trace()).t.tolist() == [0.5] and count.read(count.trace()).tolist() == [1]


def test_lists_of_hits_are_sorted_by_ray_then_t_then_face() -> None:
    ray, t, face = np.array([2, 0, 2, 2, 0]), np.array([3.0, 1.0, 0.5, 3.0, 0.25]), np.array([7, 1, 2, 6, 0])
    hits = HitLists.sorted(4, ray, t, face)
    assert hits.counts.tolist() == [2, 0, 3, 0]
    assert hits.t.tolist() == [0.25, 1.0, 0.5, 3.0, 3.0] and hits.face.tolist() == [0, 1, 2, 6, 7]


@pytest.mark.parametrize("name", [OURS, "embree", "open3d", "mitsuba_scalar", "mitsuba_llvm"])
def test_a_ray_ends_where_it_should(name: str) -> None:
    vertices, faces = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32)
    peer = _system(name).loaded(vertices, faces)
    o, d = np.array([[0.25, 0.25, 2.0]]), np.array([[0.0, 0.0, -2.0]])
    for t_max, expected in ((0.75, False), (1.25, True), (np.inf, True)):
        query = peer.any(Family("one", o, d, t_max))
        assert query is not None
        assert query.read(query.trace()).tolist() == [expected]


@pytest.mark.parametrize("name", ["embree", "open3d", "mitsuba_llvm"])
def test_short_rays_end_for_a_contender_too(name: str, mesh: Mesh, octree: Octree, rays: tuple[Family, ...]) -> None:
    short = next(family for family in rays if family.name == "short")
    asked = _system(name).loaded(mesh.vertices, mesh.faces).any(short)
    assert asked is not None
    expected = octree.any_hit(short.origins, short.directions, t_max=short.t_max)
    # Else nothing is told by what follows: without their end, more of them hit.
    assert expected.sum() < 0.8 * octree.any_hit(short.origins, short.directions).sum()
    assert np.array_equal(asked.read(asked.trace()), expected)


def test_every_family_hits_and_shadow_rays_end_at_one_light(octree: Octree, rays: tuple[Family, ...]) -> None:
    assert [family.name for family in rays] == ["camera", "shadow", "random", "bounce", "misses", "short"]
    for family in rays:
        assert len(family) == 600
        share = octree.any_hit(family.origins, family.directions, t_max=family.t_max).mean()
        assert share == 0.0 if family.name == "misses" else 0.05 < share < 0.95, (
            family.name
        )  # else a contender would be timed on an empty scene
        for array in (family.origins, family.directions):
            assert np.array_equal(array, array.astype(np.float32))
    shadow, misses, short = rays[1], rays[4], rays[5]
    assert [family.name for family in rays if family.beyond] == ["short"] and short.at_most(5).beyond
    lower, upper = octree.mesh.bounds
    assert np.isinf(misses.t_max) and short.t_max == pytest.approx(0.02 * np.linalg.norm(upper - lower))
    assert np.linalg.norm(short.directions, axis=1) == pytest.approx(1.0)
    assert octree.closest_point(short.origins).distance.max() <= 0.50001 * short.t_max
    # The box of the misses is half as large again as the mesh's, and they fill it.
    reach = np.abs(misses.origins - (lower + upper) / 2) / (upper - lower) * 2
    assert 1.45 < reach.max() < 1.5000001
    # The ends differ by the rounding of the directions to float32 alone: below 16, that is 2^-21 up or down.
    assert np.ptp(shadow.origins + shadow.directions, axis=0).max() <= 2.0**-20
    assert shadow.t_max == 1.0


def test_points_are_where_their_names_say(mesh: Mesh, octree: Octree) -> None:
    wide, inner, near = points(mesh, 3_000)
    lower, upper = mesh.bounds
    assert [p.name for p in (wide, inner, near)] == ["wide", "box", "near"]
    for family in (wide, inner, near):
        assert family.points.shape == (3_000, 3)
        assert np.array_equal(family.points, family.points.astype(np.float32))
        assert 0.05 < octree.contains(family.points).mean() < 0.95, family.name
    reach = np.abs(wide.points - (lower + upper) / 2).max(axis=0) / (upper - lower) * 2
    # The largest of 3,000 uniform numbers is 1/3,000 below the end in the mean, and 0.3 % below it once in e^9.
    assert (reach < 1.2000001).all() and (reach > 1.19).all()
    assert (inner.points >= lower - 1e-6).all() and (inner.points <= upper + 1e-6).all()
    share = octree.closest_point(near.points).distance / np.linalg.norm(upper - lower)
    assert 0.009 < share.max() < 0.0100001 and np.quantile(share, 0.5) > 0.003


def test_bounce_rays_follow_the_cosine() -> None:
    normals = np.tile([0.0, 0.0, 1.0], (20_000, 1))
    d = cosine_distributed(normals, np.random.default_rng(0))
    cosine = d[:, 2] / np.linalg.norm(d, axis=1)
    assert cosine.min() >= 0.0
    # E[cos] = 2/3, E[cos^2] = 1/2; five standard errors of 20,000 samples are 0.009 and 0.011.
    assert abs(cosine.mean() - 2 / 3) < 0.009
    assert abs((cosine**2).mean() - 1 / 2) < 0.011


def test_misses_are_repeated_where_there_are_few_and_a_flat_mesh_has_some(monkeypatch: pytest.MonkeyPatch) -> None:
    octree = Octree.from_mesh(displaced_spheres(1_000))
    whole = families(octree, 500)[4]
    assert len(np.unique(whole.origins, axis=0)) == 500
    monkeypatch.setattr("validation.benchmark.measures.families._BATCHES", 1)
    few = families(octree, 500)[4]
    distinct = len(np.unique(few.origins, axis=0))
    assert len(few) == 500 and 50 < distinct < 500
    assert np.array_equal(few.origins[distinct:], few.origins[: 500 - distinct])
    # Seen from above, a tilted square is flat in no axis and hides nothing; a level one is flat in y.
    corners = np.array([[-1.0, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])
    level = families(Octree(corners, np.array([[0, 2, 1], [0, 3, 2]])), 300)
    assert np.ptp(level[4].origins[:, 1]) > 0.05 and len(level[4]) == 300


def test_fewer_rays_are_spread_over_the_family() -> None:
    family = Family("f", np.arange(30.0).reshape(10, 3), np.ones((10, 3)), 1.0)
    few = family.at_most(4)
    assert few.origins[:, 0].tolist() == [0.0, 9.0, 18.0, 27.0]
    assert few.t_max == 1.0
    assert family.at_most(10) is family
    at = Points("p", np.arange(30.0).reshape(10, 3))
    assert at.at_most(4).points[:, 0].tolist() == [0.0, 9.0, 18.0, 27.0] and at.at_most(10) is at


def test_the_meshes_have_the_size_that_was_asked_for_and_their_hills_do_not_depend_on_it() -> None:
    small, large = displaced_spheres(10_000), displaced_spheres(40_000)
    assert abs(len(small.faces) / 10_000 - 1) < 0.1 and abs(len(large.faces) / 40_000 - 1) < 0.1
    assert small.is_float32
    assert np.allclose(small.bounds, large.bounds, atol=0.03)
    centres = 1.05 * np.sign(small.triangles.mean(axis=1))
    outward = np.einsum("ij,ij->i", small.face_normals(), small.triangles.mean(axis=1) - centres)
    assert (outward > 0).all()
    assert not len(small.open_edges) and not len(large.open_edges)


def test_measured_rows_say_who_hit_what(mesh: Mesh) -> None:
    chosen = [_system(name) for name in (OURS, OURS_ONE, "embree", "mitsuba_scalar")]
    kinds = [KINDS["closest"], KINDS["any"]]
    rows = queries.measure(mesh, chosen, 30_000, lambda _: None, kinds)
    assert [(r["family"], r["query"]) for r in rows] == [
        (f, q) for f in ("camera", "shadow", "random", "bounce", "misses", "short") for q in ("closest", "any")
    ]
    for row in rows:
        seconds = {name: np.array(c["seconds"]) / c["rays"] for name, c in row["contenders"].items()}
        assert set(row["ratios_one_thread"]) == {"embree", "mitsuba_scalar"}
        for name, found in row["ratios_one_thread"].items():
            assert found == pytest.approx(np.median(seconds[name] / seconds[OURS_ONE]))
        assert row["ratios"]["embree"] == pytest.approx(np.median(seconds["embree"] / seconds[OURS]))
        assert row["agree"] and set(row["ratios"]) == {OURS_ONE, "embree", "mitsuba_scalar"}
        scalar = row["contenders"]["mitsuba_scalar"]
        assert scalar["rays"] == 20_000 and len(scalar["seconds"]) == 5
        assert scalar["hits"] / 20_000 == pytest.approx(row["hit_share"], abs=0.02)
        assert row["contenders"][OURS]["hits"] == pytest.approx(row["hit_share"] * 30_000)


def test_measured_rows_of_all_hits_and_points(mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "REST", 0.0)
    kinds = [KINDS[name] for name in ("all", "count", "contains", "nearest", "signed")]
    chosen = [_system(name) for name in (OURS, OURS_ONE, "trimesh_embreex", "libigl")]
    few = [replace(chosen[-1], most_rays=150)]
    rows = queries.measure(mesh, chosen[:-1] + few, 4_000, lambda _: None, kinds)
    assert [(r["family"], r["query"], r["rays"], set(r["ratios"])) for r in rows] == [
        ("random", "all", 4_000, {OURS_ONE, "trimesh_embreex"}),
        ("random", "count", 4_000, {OURS_ONE}),
        ("wide", "contains", 4_000, {OURS_ONE, "trimesh_embreex", "libigl"}),
        ("box", "nearest", 400, {OURS_ONE, "libigl"}),
        ("box", "signed", 400, {OURS_ONE, "libigl"}),
        ("near", "nearest", 400, {OURS_ONE, "libigl"}),
        ("near", "signed", 400, {OURS_ONE, "libigl"}),
    ]
    octree = Octree.from_mesh(mesh)
    wide = points(mesh, 4_000)[0].points
    assert rows[2]["contenders"][OURS]["hits"] == octree.contains(wide).sum() == round(rows[2]["hit_share"] * 4_000)
    for row in rows:
        assert row["agree"] and row["contenders"][OURS]["differing"] == 0
        igl = row["contenders"].get("libigl")
        assert igl is None or (igl["rays"] == 150 and igl["ns"] == pytest.approx(1e9 * igl["median"] / 150))
        assert row["query"] != "nearest" or row["hit_share"] == 1.0


@pytest.mark.parametrize("name", ["embree", "trimesh_embreex", "libigl", "trimesh", "open3d"])
def test_a_contender_that_sees_another_scene_is_found(name: str, mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    def elsewhere(vertices: Any, faces: Any) -> Callable[[], Any]:
        return _system(name).load(vertices + 0.1, faces)

    monkeypatch.setattr(timing, "REST", 0.0)
    wrong = System("wrong", "wrong", 1, "float32", elsewhere)
    rows = [r for r in queries.measure(mesh, [_system(OURS), wrong], 500, lambda _: None) if "wrong" in r["contenders"]]
    assert rows and not any(row["agree"] for row in rows)


def test_a_mesh_that_is_open_is_not_asked_what_is_inside(mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "REST", 0.0)
    opened = Mesh(mesh.vertices, mesh.faces[1:])
    rows = queries.measure(opened, [_system(OURS)], 300, lambda _: None)
    assert {row["query"] for row in rows} == set(KINDS) - {"contains", "signed"}


def test_the_queries_of_one_mesh_alone(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "REST", 0.0)
    monkeypatch.setattr(queries, "available", lambda: ([_system(OURS), _system("libigl")], {"nobody": "find them"}))
    assert queries.main(["1000", "--rays", "300", "--only", "contains"]) == 0
    first, ours, theirs, missing = capsys.readouterr().out.splitlines()
    assert first == "spheres_1k: wide points, inside, all agree" and ours.split()[0] == OURS
    assert theirs.split()[0] == "libigl" and "0 of 300 differ" in theirs and "times as fast" in theirs
    assert missing == "not measured: nobody; find them"
    with pytest.raises(SystemExit):
        queries.main(["1000", "--rays", "0"])


def test_other_kinds_of_meshes_are_asked_in_brief_and_fast_contenders_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "REST", 0.0)
    chosen = [_system(name) for name in (OURS, "embree", "libigl", "mitsuba_scalar")]
    rows = queries.measure(named("city_300"), chosen, 300, lambda _: None, brief=True)
    closest = [(family, "closest") for family in ("camera", "shadow", "random", "bounce", "misses", "short")]
    assert sorted((r["family"], r["query"]) for r in rows) == sorted([*closest, ("shadow", "any"), ("short", "any")])
    assert all(set(r["contenders"]) == {OURS, "embree"} and r["agree"] for r in rows)
    # Without our one thread, nothing is compared to it.
    assert all(r["ratios_one_thread"] == {} and r["efficiency"] is None for r in rows)


def test_a_miss_that_hits_and_a_scene_without_hits_are_found(mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "REST", 0.0)
    asked = families(Octree.from_mesh(mesh), 300)
    for name, family in (("misses", asked[0]), ("camera", asked[4])):
        wrong = (replace(family, name=name),)
        monkeypatch.setattr(queries, "families", lambda *_, wrong=wrong: wrong)
        rows = queries.measure(mesh, [_system(OURS)], 300, lambda _: None, [KINDS["closest"]])
        assert [row["agree"] for row in rows] == [False]


def test_the_efficiency_is_that_of_two_threads() -> None:
    each = {OURS: [1.0, 2.0, 4.0], OURS_ONE: [8.0, 8.0, 8.0], OURS_TWO: [5.0, 5.0, 5.0]}
    assert queries._efficiency(each, 16) == pytest.approx(0.8)
    assert queries._efficiency(each, 2) == pytest.approx(2.0)
    del each[OURS_TWO]
    assert queries._efficiency(each, 16) is None and queries._efficiency(each, 1) is None


@pytest.mark.parametrize(("threads", "names"), [(1, []), (2, []), (16, [OURS_TWO])])
def test_two_threads_are_a_contender_where_all_are_more(
    threads: int, names: list[str], mesh: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ours, "available_threads", lambda: threads)
    found = ours.systems()
    assert [s.name for s in found] == [OURS, OURS_ONE, *names] and not any(s.times_build for s in found[1:])
    peers = queries._peers(mesh, [replace(s, threads=s.threads) for s in found])
    first = peers[OURS]
    assert isinstance(first, Ours)
    for name, expected in ((OURS_ONE, 1), (OURS_TWO, 2)):
        other = peers.get(name)
        if isinstance(other, Ours):
            assert other.octree.threads == expected and other.octree.mesh is first.octree.mesh


def test_calls_of_few_rays_are_compared_thread_by_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "REST", 0.0)
    monkeypatch.setattr(calls, "_CALLS", 3)
    single = _system("embree")
    chosen = [_system(OURS), _system(OURS_ONE), single, replace(single, name="open3d", threads=2)]
    rows = calls.measure(chosen, lambda _: None)
    assert [row["rays"] for row in rows] == [1, 10, 100]
    for row in rows:
        micros = {name: np.array(runs) for name, runs in row["micros"].items()}
        assert set(micros) == {OURS, OURS_ONE, "embree", "open3d"} and set(row["ratios"]) == {"embree", "open3d"}
        assert row["ratios"]["embree"] == pytest.approx(np.median(micros["embree"] / micros[OURS_ONE]))
        assert row["ratios"]["open3d"] == pytest.approx(np.median(micros["open3d"] / micros[OURS]))
        assert row["median"][OURS] == pytest.approx(np.median(micros[OURS])) and row["median"][OURS] > 0.1


def test_what_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> Any:
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(systems, "import_module", absent)
    found, missing = systems.available()
    assert {system.name for system in found} - {OURS_TWO} == {OURS, OURS_ONE}
    assert set(missing) == set(systems._PEERS) | {"mitsuba_llvm"}
    assert "pip install open3d" in missing["open3d"] and "libllvm19" in missing["mitsuba_llvm"]
