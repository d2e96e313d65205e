"""Every contender answers the question that ours answers; what is not installed is named.

Which answers count as differing is tested in ``test_kinds``.
"""

from typing import Any

import numpy as np
import pytest
from contenders import system

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.benchmark.measures.families import points
from validation.benchmark.measures.kinds import FIRST, KINDS
from validation.benchmark.peers import libllvm, systems
from validation.benchmark.peers.contender import Family, HitLists
from validation.benchmark.peers.ours import OURS, OURS_ONE, OURS_TWO


@pytest.mark.parametrize("name", [OURS_ONE, "embree", "open3d", "trimesh", "mitsuba_scalar", "mitsuba_llvm"])
def test_a_contender_agrees_with_ours(name: str, mesh: Mesh, octree: Octree, rays: tuple[Family, ...]) -> None:
    peer = system(name).loaded(mesh.vertices, mesh.faces)
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
    own, peer = (system(n).loaded(mesh.vertices, mesh.faces) for n in (OURS, name))
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


def test_lists_of_hits_are_sorted_by_ray_then_t_then_face() -> None:
    ray, t, face = np.array([2, 0, 2, 2, 0]), np.array([3.0, 1.0, 0.5, 3.0, 0.25]), np.array([7, 1, 2, 6, 0])
    hits = HitLists.sorted(4, ray, t, face)
    assert hits.counts.tolist() == [2, 0, 3, 0]
    assert hits.t.tolist() == [0.25, 1.0, 0.5, 3.0, 3.0] and hits.face.tolist() == [0, 1, 2, 6, 7]


@pytest.mark.parametrize("name", [OURS, "embree", "open3d", "mitsuba_scalar", "mitsuba_llvm"])
def test_a_ray_ends_where_it_should(name: str) -> None:
    vertices, faces = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32)
    peer = system(name).loaded(vertices, faces)
    o, d = np.array([[0.25, 0.25, 2.0]]), np.array([[0.0, 0.0, -2.0]])
    for t_max, expected in ((0.75, False), (1.25, True), (np.inf, True)):
        query = peer.any(Family("one", o, d, t_max))
        assert query is not None
        assert query.read(query.trace()).tolist() == [expected]


def test_what_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> Any:
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(systems, "import_module", absent)
    found, missing = systems.available()
    assert {system.name for system in found} - {OURS_TWO} == {OURS, OURS_ONE}
    assert set(missing) == set(systems._PEERS) | {"mitsuba_llvm"}
    assert "pip install open3d" in missing["open3d"] and "libllvm19" in missing["mitsuba_llvm"]


def test_a_libllvm_that_the_user_names_is_the_only_candidate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(libllvm.VARIABLE, "/nowhere/libLLVM.so")
    assert list(libllvm.candidates()) == ["/nowhere/libLLVM.so"]
    # Dr.Jit cannot load it, in its own process: here an answer comes back.
    assert libllvm.usable() is None


def test_too_old_a_libllvm_is_no_candidate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(libllvm.VARIABLE, raising=False)
    monkeypatch.setattr(libllvm, "_PLACES", ("x",))
    monkeypatch.setattr(libllvm, "glob", lambda _: ["/a/libLLVM-15.so", "/a/libLLVM.so.19.1", "/a/libLLVM.so.20.1"])
    assert list(libllvm.candidates()) == ["/a/libLLVM.so.20.1", "/a/libLLVM.so.19.1"]
