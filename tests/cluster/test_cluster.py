"""Studies and rays on a cluster have the bits of those on this machine, whatever workers die."""

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import dask.array as da
import numpy as np
import pytest
from cases import cases

from renderer import Mesh, Octree, RayScene
from renderer.checkpoints.study import run
from renderer.cluster import Study, any_hit, closest_hit, connected, run_on
from renderer.studies import face_points
from renderer.studies.points import on_faces
from renderer.system.threads import checked_threads
from validation.benchmark.measures.meshes import named

pytestmark = pytest.mark.judges(
    "cluster.Study", "cluster.Study.evaluate", "cluster.any_hit", "cluster.closest_hit", "cluster.connected",
    "cluster.run_on",
)  # fmt: skip


SIZE = 64


@pytest.fixture(scope="module")
def octree() -> Octree:
    return Octree.from_mesh(named("city_2000"))


def test_a_study_on_workers_has_the_bits_of_one_process(client: Any, octree: Octree, tmp_path: Path) -> None:
    points, study = on_faces(octree).points, Study("sky", {"patches": 145})
    expected = study.evaluate(octree, points)
    here = run(octree, study, points, tmp_path / "here").joined()
    assert here.tobytes() == expected.tobytes()
    there = run_on(client, octree, study, points, str(tmp_path / "there"), size=SIZE)
    assert there.plan.parts > 10 and there.joined().tobytes() == expected.tobytes()
    places = face_points(octree.mesh)
    assert study.evaluate(octree, places).tobytes() == expected.tobytes()
    other = run_on(client, octree, study, places, tmp_path / "other", size=SIZE * 4, split="midpoint")
    assert 1 < other.plan.parts < there.plan.parts and other.joined().tobytes() == expected.tobytes()


def test_the_transmittance_of_faces_goes_to_workers(client: Any, octree: Octree, tmp_path: Path) -> None:
    """And belongs to a run: parts with other numbers are not taken over."""
    shares = np.random.default_rng(8).choice([0.0, 0.5, 1.0], len(octree.mesh.faces))
    places, study = face_points(octree.mesh), Study("sky", {"transmittance": shares})
    there = run_on(client, octree, study, places, tmp_path / "there", size=SIZE * 4)
    expected = study.evaluate(octree, places)
    assert there.joined().tobytes() == expected.tobytes() != Study("sky").evaluate(octree, places).tobytes()
    with pytest.raises(ValueError, match="of another"):
        run_on(client, octree, Study("sky", {"transmittance": shares / 2}), places, tmp_path / "there", size=SIZE * 4)


def test_a_scene_goes_to_workers_as_its_merged_mesh(client: Any, octree: Octree, tmp_path: Path) -> None:
    scene = RayScene()
    scene.add(octree, [[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (0.0, 500.0)])
    points, study, whole = face_points(scene.merged), Study("ao", {"samples": 20}), Octree(scene.merged)
    there = run_on(client, scene, study, points, tmp_path / "parts", size=SIZE * 8)
    assert there.joined().tobytes() == study.evaluate(whole, points).tobytes()
    assert study.evaluate(scene, points).tobytes() == there.joined().tobytes()
    origins, down = points.points[::40] + np.array([0.1, 0.2, 200.0]), np.array([0.0, 0.0, -1.0])
    rays = da.from_array(origins, 50), da.from_array(np.tile(down, (len(origins), 1)), 50)
    expected = whole.closest_hit(origins, down)
    assert closest_hit(scene, *rays)["face"].compute(scheduler=client).tobytes() == expected.face.tobytes()
    assert (any_hit(scene, *rays).compute(scheduler=client) == expected.hit).all()


def test_hits_of_dask_arrays_stay_lazy_and_keep_chunks(client: Any, octree: Octree) -> None:
    rng = np.random.default_rng(3)
    lower, upper = octree.mesh.bounds
    origins, directions = rng.uniform(lower, upper, (1000, 3)), rng.standard_normal((1000, 3))
    expected = octree.closest_hit(origins, directions, t_max=50.0)
    lazy = closest_hit(octree, da.from_array(origins, (300, 2)), da.from_array(directions, (128, 3)), t_max=50.0)
    assert isinstance(lazy, da.Array) and lazy.chunks == ((300, 300, 300, 100),)
    hits = lazy.compute(scheduler=client)
    for name in ("t", "face", "u", "v"):
        assert np.ascontiguousarray(hits[name]).tobytes() == getattr(expected, name).tobytes()
    assert lazy["t"].compute(scheduler="threads").tobytes() == expected.t.tobytes()
    some = any_hit(octree, da.from_array(origins, 250), da.from_array(directions, 250), t_max=50.0)
    assert (some.compute(scheduler=client) == expected.hit).all() and 0 < expected.hit.sum() < 1000


@pytest.mark.parametrize(
    "origins, directions, said",
    [(np.zeros((2, 3)), da.zeros((2, 3)), "origins: expected a dask array, got ndarray"),
     (da.zeros((2, 2)), da.zeros((2, 2)), r"origins: expected shape \(n, 3\), got shape \(2, 2\)"),
     (da.zeros((2, 3)), da.zeros((3, 3)), r"directions: expected shape \(2, 3\) as origins have")],
)  # fmt: skip
def test_arrays_of_other_shapes_are_refused(octree: Octree, origins: Any, directions: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        closest_hit(octree, origins, directions)


def test_a_ray_out_of_range_raises_when_its_chunk_is_computed(octree: Octree) -> None:
    lazy = closest_hit(octree, da.zeros((4, 3)), da.zeros((4, 3)))
    with pytest.raises(ValueError, match="directions: expected"):
        lazy.compute(scheduler="threads")


def test_a_worker_keeps_few_trees() -> None:
    from renderer.cluster import workers

    vertices, faces = np.eye(3), np.array([[0, 1, 2]], np.int32)
    trees = [workers.SentMesh(str(i), vertices, faces, "midpoint").octree() for i in range(4)]
    assert len(workers._TREES) <= 2 and trees[0] is not trees[1]
    assert workers.SentMesh("3", vertices, faces, "midpoint").octree() is trees[3]
    assert isinstance(trees[0].mesh, Mesh)


def test_no_scheduler_and_wrong_arguments_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_module("renderer.cluster.clients"), "SECONDS", 0.5)
    with (
        pytest.raises(ValueError, match="workers: expected None, as the cluster has its own"),
        connected("tcp://x:1", workers=2),
    ):
        pass
    with pytest.raises(OSError, match=r"127\.0\.0\.1"), connected("tcp://127.0.0.1:9"):
        pass


def test_a_local_cluster_has_a_worker_of_one_thread_for_each_processor() -> None:
    with connected() as client:
        assert list(client.ncores().values()) == [1] * checked_threads(None)
    assert client.status == "closed"


@cases("address", ["nonsense", "", "x://y:1", "tcp://127.0.0.1", 3])
def test_what_is_no_address_is_told_at_once(address: Any) -> None:
    said = "address: expected a scheduler's, such as 'tcp://host:8786', got "
    with pytest.raises(ValueError, match=said), connected(address):
        pass


def test_without_the_extra_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"a cluster needs the package distributed; .*\[cluster\]"), connected():
        pass


@cases(
    "bad, said",
    [
        ({"client": None}, "client: expected a distributed.Client, got NoneType"),
        ({"size": 0}, "size: expected an int"),
        ({"split": "x"}, "split: expected one of"),
        ({"study": "sky"}, "study: expected a Study, got str"),
        ({"points": np.zeros((1, 3))}, "points: expected FacePoints, got ndarray"),
        ({"folder": 3}, "folder: expected a string"),
        ({"octree": 1}, "octree: expected an Octree"),
    ],
)
def test_bad_arguments_of_a_study_are_named(
    client: Any, octree: Octree, tmp_path: Path, bad: dict[str, Any], said: str
) -> None:
    good = {"client": client, "octree": octree, "study": Study("sky", {}), "points": on_faces(octree).points}
    with pytest.raises(ValueError, match=said):
        run_on(**(good | {"folder": tmp_path / "parts"} | bad))
