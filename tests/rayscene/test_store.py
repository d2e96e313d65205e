"""Scenes in files, copies and pickles: the same bits again, each mesh once, and one clear error for other content."""

import copy
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from forged import Change, forge, header_of
from numpy.typing import NDArray

from renderer import Mesh, Octree, RayScene
from renderer.mesh.shapes import box, icosphere
from renderer.rayscene import store
from renderer.trace.instances import OBJECT
from renderer.trace.layout import CACHE_LINE, CHILDREN, NODE_WORDS
from renderer.tree.store import _KINDS

pytestmark = pytest.mark.judges("RayScene.load", "RayScene.save")

MAPPED = pytest.mark.parametrize("mmap", [False, True], ids=["read", "mapped"])
RNG = np.random.default_rng(5)
ORIGINS, DIRECTIONS = RNG.uniform(-9, 9, (400, 3)), RNG.normal(size=(400, 3))
BALL = icosphere(3)


def transforms(count: int, seed: int = 1) -> NDArray[np.float64]:
    """Turns, shears and mirrors."""
    rng = np.random.default_rng(seed)
    return np.concatenate([rng.normal(size=(count, 3, 3)), rng.uniform(-8, 8, (count, 3, 1))], axis=2)


def crowd() -> RayScene:
    """An octree that two objects share, a mesh, masks, hidden instances, and numbers of which one is free."""
    scene, ball = RayScene(threads=2), Octree(BALL)
    scene.add(ball, transforms(30), mask=np.arange(30) + 1)
    gone = scene.add(box(), transforms(3, 2))
    scene.add(ball, transforms(4, 3), mask=1 << 31, name="a\ud800ü")
    scene.add(Mesh(BALL.vertices, BALL.faces, -BALL.vertices, abs(BALL.vertices), BALL.vertices[:, :2]))
    scene.show(0, np.arange(30) % 4 > 0)
    scene.remove(gone)
    return scene


def extreme() -> RayScene:
    """Meshes that are scaled in their trees, of which one has no face, and an object without instances."""
    scene = RayScene()
    for size in (1e-200, 1e200):
        scene.add(Mesh(BALL.vertices * size, BALL.faces), transforms(3) * [1 / size, 1 / size, 1 / size, 1])
    scene.add(Mesh(np.eye(3), np.empty((0, 3), int)))
    scene.add(box(), np.empty((0, 3, 4)))
    return scene


SAVED: dict[str, Callable[[], RayScene]] = {"crowd": crowd, "extreme": extreme, "nothing": RayScene}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "it.scene"


def state(scene: RayScene) -> tuple[Any, ...]:
    """All that can be read of a scene: objects, and the bits of answers."""
    hits, every = scene.closest_hit(ORIGINS, DIRECTIONS, mask=5), scene.all_hits(ORIGINS, DIRECTIONS)
    numbers = (hits.t, hits.object, hits.instance, hits.face, hits.u, hits.v, hits.points, every.t, every.offsets)
    if scene._built.count:
        near = scene.closest_point(ORIGINS[:50])
        numbers += (near.distance, near.object, near.instance, near.face)
    objects = [(k, scene.name(k), scene.instance_names(k), scene.transforms(k).tobytes()) for k in scene.objects]
    return objects, [array.tobytes() for array in numbers]


def changed(scene: RayScene) -> RayScene:
    """The scene after each kind of change."""
    first = scene.objects[0]
    scene.move(first, scene.transforms(first)[:1] * 0.75, instances=[1])
    scene.refit(first, scene.mesh(first).vertices * [1, 0.5, 2])
    scene.show(first, False)
    scene.show(first, True)
    scene.remove(scene.objects[-1])
    assert scene.add(box()) not in scene.objects[:-1]
    return scene


# --- the same again ---------------------------------------------------------------------------------------------


@MAPPED
@pytest.mark.parametrize("kind", SAVED)
def test_a_loaded_scene_is_the_one_that_was_saved(kind: str, mmap: bool, path: Path) -> None:
    saved = SAVED[kind]()
    saved.save(path)
    loaded = RayScene.load(path, mmap=mmap, threads=1)
    assert state(loaded) == state(saved) and loaded.threads == 1
    loaded.save(path.with_name("again"))
    assert path.with_name("again").read_bytes() == path.read_bytes()
    if kind != "nothing":
        assert state(changed(loaded)) == state(changed(saved)) != state(SAVED[kind]())


@pytest.mark.parametrize("kind", SAVED)
def test_copies_and_pickles_are_the_scene_and_change_alone(kind: str) -> None:
    scene, expected = SAVED[kind](), state(SAVED[kind]())
    scene.mark = "own"  # type: ignore[attr-defined]
    for made in (copy.copy(scene), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert state(made) == expected and made.mark == "own" and made.threads == scene.threads
        if kind != "nothing":
            changed(made)
    assert state(scene) == expected


def test_hits_travel_without_addresses() -> None:
    """Those of the process that made them would be read as the scene's memory."""
    hits = crowd().closest_hit(ORIGINS, DIRECTIONS)
    code = "import pickle, sys; sys.stdout.buffer.write(pickle.load(sys.stdin.buffer).points.tobytes())"
    done = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(hits), capture_output=True, check=True)
    assert done.stdout == hits.points.tobytes()


def test_a_class_of_ones_own_is_loaded_as_such(path: Path) -> None:
    class Mine(RayScene):
        pass

    Mine().save(path)
    assert type(Mine.load(path)) is Mine


def test_instances_follow_an_object_that_gets_another_place() -> None:
    """They kept the address of its former record, in memory that others use."""
    scene = crowd()
    words = scene._built.top.instances.view(np.int64)
    for m in scene._built.members:
        assert (words[scene._built.members.rows(m), OBJECT] == m.row.ctypes.data).all()


# --- once each --------------------------------------------------------------------------------------------------


def test_an_octree_of_several_objects_is_kept_once(path: Path) -> None:
    scene, ball = RayScene(), Octree(icosphere(5))
    scene.add(ball)
    scene.save(path)
    size, pickled = os.path.getsize(path), len(pickle.dumps(scene))
    for _ in range(3):
        scene.add(ball)
    scene.save(path)
    assert os.path.getsize(path) < size + 2000 and len(pickle.dumps(scene)) < pickled + 2000
    for made in (RayScene.load(path), RayScene.load(path, mmap=True), pickle.loads(pickle.dumps(scene)),
                 copy.deepcopy(scene)):  # fmt: skip
        assert len({id(member.built) for member in made._built.members}) == 1


def test_a_map_is_viewed_and_not_copied(path: Path) -> None:
    crowd().save(path)
    owners = set()
    for member in RayScene.load(path, mmap=True)._built.members:
        for array in (*vars(member.built.mesh).values(), *vars(member.built.tree).values()):
            if isinstance(array, np.ndarray) and array.dtype != np.int64:
                assert array.ctypes.data % CACHE_LINE == 0 and not array.flags.writeable
                while isinstance(array, np.ndarray):
                    array = array.base
                owners.add(array)
    assert len(owners) == 1


def test_more_instances_than_a_scene_can_number_are_refused(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The products that say where their blocks are left int64."""
    scene = RayScene()
    scene.add(box(), transforms(3))
    scene.save(path)
    monkeypatch.setattr("renderer.rayscene.built.MOST_INSTANCES", 5)
    for add in (lambda: scene.add(box(), transforms(3)), lambda: scene.add_scene(scene, transforms(1))):
        with pytest.raises(ValueError, match="scene: expected at most 5 instances, got 6"):
            add()
    monkeypatch.setattr("renderer.rayscene.built.MOST_INSTANCES", 2)
    assert refusal(path).startswith("scene: expected at most 2 instances, got 3")


# --- files that are none ----------------------------------------------------------------------------------------


def refusal(path: Path, mmap: bool = False) -> str:
    """What ``load`` says of a file, checked to be one line that names it."""
    with pytest.raises(ValueError) as caught:
        RayScene.load(path, mmap=mmap)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and "\n" not in message and len(message) < 600
    return message.removeprefix(f"{path}: ")


def whole(path: Path) -> bytes:
    crowd().save(path)
    return path.read_bytes()


def starts(content: bytes) -> list[int]:
    """Where the scene and each octree begin."""
    return [0, *(at for at in range(0, len(content), CACHE_LINE) if content[at:].startswith(b"\x89OCTREE\n"))]


def test_the_file_is_as_its_description_says(path: Path) -> None:
    """Read by ``json``, from the text at the head of ``store.py``."""
    content, scene = whole(path), crowd()
    assert content[:8] == b"\x89SCENE\r\n" and content[12:16] == bytes([1, 0, 0, 0])
    told, end = header_of(content)
    objects = [{"id": k, "name": scene.name(k), "octree": octree, "instances": count}
               for k, octree, count in ((0, 0, 30), (2, 0, 4), (3, 1, 1))]  # fmt: skip
    assert {key: told[key] for key in told if key != "arrays"} == {"next": 4, "octrees": 2, "objects": objects}
    placed = np.frombuffer(content[end : end + 35 * 96], "<f8").reshape(35, 3, 4)
    assert np.array_equal(placed, np.concatenate([scene.transforms(k) for k in scene.objects]))
    flags = np.frombuffer(content[-(-(end + 35 * 96) // 64) * 64 :][: 35 * 8], "<i8")
    assert (flags[:30] & 0xFFFFFFFF == np.arange(30) + 1).all() and flags[30] == 1 << 31
    assert (flags[:30] >> 33 == (np.arange(30) % 4 == 0)).all()
    assert len(starts(content)) == 3


@MAPPED
def test_other_files_and_versions_are_refused(mmap: bool, path: Path) -> None:
    Octree(BALL).save(path)
    assert refusal(path, mmap).startswith("content: expected a scene that RayScene.save wrote, got ")
    crowd().save(path)
    with pytest.raises(ValueError, match="content: expected an octree that Octree"):
        Octree.load(path, mmap=mmap)
    content = path.read_bytes()
    path.write_bytes(content[:12] + bytes([2]) + content[13:])
    assert refusal(path, mmap) == "version: expected 1, which this release reads, got 2"
    with pytest.raises(FileNotFoundError, match="absent: cannot be read: No such file"):
        RayScene.load(path.with_name("absent"), mmap=mmap)


@MAPPED
def test_a_file_cut_off_or_grown_anywhere_is_refused(mmap: bool, path: Path) -> None:
    content = whole(path)
    begin = starts(content)[1]
    for size in [*range(0, begin, 97), *range(begin, len(content), 9973), *starts(content)[1:], len(content) - 1]:
        path.write_bytes(content[:size])
        refusal(path, mmap)
    for more in (b"\0", content[begin:]):
        path.write_bytes(content + more)
        assert refusal(path, mmap).startswith(f"size: expected {len(content)} bytes, as its header says, got ")


def test_a_flipped_bit_is_found_anywhere(path: Path) -> None:
    content, rng = whole(path), np.random.default_rng(1)
    begin = starts(content)[1]
    for place in map(int, [*rng.integers(0, begin, 60), *rng.integers(begin, len(content), 60), len(content) - 1]):
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        refusal(path)


def test_flipped_bits_in_a_map_are_refused_or_harmless(path: Path) -> None:
    content, rng, refused = whole(path), np.random.default_rng(2), 0
    begin = starts(content)[1]
    for place in map(int, [*rng.integers(0, begin, 100), *rng.integers(begin, len(content), 100)]):
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        try:
            state(RayScene.load(path, mmap=True))
        except ValueError as error:
            assert str(error).startswith(f"{path}: ")
            refused += 1
    assert 10 < refused < 190


# --- forged files -----------------------------------------------------------------------------------------------


def forged(content: bytes, change: Change, **arrays: NDArray[Any]) -> bytes:
    return forge(content, store._FORMAT.kinds, change, **arrays)


def of_first(**values: Any) -> Change:
    """A change of what the header says of the first object."""
    return lambda told: told["objects"][0].update(values)


HEADERS: dict[str, tuple[Change, str]] = {
    "no next": (lambda told: told.pop("next"), "header: expected the keys ['next', 'octrees', 'objects', 'arrays'], "),
    "next -1": (lambda told: told.update(next=-1), "next: expected the number of an object, got -1"),
    "next too low": (lambda told: told.update(next=3), "objects: expected id from 3, "),
    "octrees true": (lambda told: told.update(octrees=True), "octrees: expected their number, got True"),
    "octrees more": (lambda told: told.update(octrees=10**9), "octree 2: content: expected an octree"),
    "octrees fewer": (lambda told: told.update(octrees=1), "objects: expected id from 3, name, octree below 1"),
    "objects a dict": (lambda told: told.update(objects={}), "objects: expected a list, got {}"),
    "an object a list": (lambda told: told.update(objects=[[]]), "objects: expected id from 0"),
    "an object again": (lambda told: told["objects"].append(told["objects"][2]), "objects: expected id from 4"),
    "no objects": (lambda told: told.update(objects=[]), "objects: expected 35 instances in all, got 0"),
    "a key more": (of_first(more=1), "objects: expected id from 0, name, octree below 2, instances, got "),
    "a name 3": (of_first(name=3), "objects: expected id from 0"),
    "an octree none": (of_first(octree=-1), "objects: expected id from 0"),
    "instances -1": (of_first(instances=-1), "objects: expected id from 0"),
    "instances more": (of_first(instances=2**32 - 1), "objects: expected 35 instances in all, got 4294967300"),
    "names too few": (of_first(names=["a"]), "objects: expected id from 0"),
    "names numbers": (of_first(names=list(range(30))), "objects: expected id from 0"),
}  # fmt: skip


@MAPPED
@pytest.mark.parametrize("fault", HEADERS)
def test_a_forged_header_is_refused(fault: str, mmap: bool, path: Path) -> None:
    change, said = HEADERS[fault]
    content = whole(path)
    path.write_bytes(forged(content, of_first()))
    RayScene.load(path, mmap=mmap)  # so the forgery itself is sound
    path.write_bytes(forged(content, change))
    assert refusal(path, mmap).startswith(said)


def of_nothing(told: dict[str, Any]) -> None:
    """No change of the header."""


def placed(at: tuple[int, ...], value: float) -> dict[str, NDArray[Any]]:
    scene = crowd()
    matrices = np.concatenate([scene.transforms(k) for k in scene.objects])
    matrices[at] = value
    return {"transforms": matrices}


_PLACED = "transforms: expected matrices that can be inverted, with coordinates up to 1.15e+18 and factors of "


ARRAYS: dict[str, tuple[dict[str, NDArray[Any]], str]] = {
    "nan": (placed((3, 1, 3), np.nan), "transforms: expected finite matrices"),
    "singular": (placed((3, 1), 0.0), _PLACED),
    "far away": (placed((3, 1, 3), 1e300), _PLACED),
    "fewer transforms": ({"transforms": transforms(34)}, "flags: expected a row an instance, 34, got 35"),
    "more of both": (
        {"transforms": transforms(36), "flags": np.ones(36, np.int64)}, "objects: expected 36 instances in all, got 35",
    ),
    "other flags": ({"flags": np.full(35, 1 << 32)}, "flags: expected masks, and whether an instance is hidden"),
}  # fmt: skip


@MAPPED
@pytest.mark.parametrize("fault", ARRAYS)
def test_forged_arrays_are_refused(fault: str, mmap: bool, path: Path) -> None:
    arrays, said = ARRAYS[fault]
    path.write_bytes(forged(whole(path), of_first(), **arrays))
    assert refusal(path, mmap).startswith(said)


@MAPPED
def test_forged_octrees_are_refused_by_their_number(mmap: bool, path: Path) -> None:
    content = whole(path)
    begin = starts(content)[2]
    faces = BALL.faces.copy()
    faces[5, 1] = 10**6
    path.write_bytes(content[:begin] + forge(content[begin:], _KINDS, of_nothing, faces=faces))
    assert refusal(path, mmap).startswith("octree 1: faces: expected indices")


def links_of(nodes: NDArray[np.float32]) -> NDArray[np.int32]:
    """The links of nodes and their orders, which are checked."""
    return nodes.view(np.int32).reshape(-1, NODE_WORDS)[:, CHILDREN:]


@MAPPED
@pytest.mark.parametrize("fill", ["bits", "nan", "infinities", "scale"])
def test_any_numbers_in_boxes_and_blocks_crash_no_query(fill: str, mmap: bool, path: Path) -> None:
    """They may give any answer, or a scene whose instances cannot be placed."""
    content, rng = whole(path), np.random.default_rng(3)
    begin, tree = starts(content)[1], Octree(BALL).tree
    nodes, blocks = tree.nodes.copy(), tree.blocks.copy()
    links = links_of(nodes).copy()
    for array in (nodes, blocks):
        if fill == "bits":
            array.view(np.uint8)[:] = rng.integers(0, 256, array.nbytes)
        elif fill != "scale":
            array[:] = np.nan if fill == "nan" else rng.choice([-np.inf, np.inf], len(array))
    links_of(nodes)[:] = links
    for scale in (2.0**-1074, 2.0**1023) if fill == "scale" else (1.0,):
        rescaled = partial(dict.update, scale=scale)
        octrees = forge(content[begin:], _KINDS, rescaled, nodes=nodes, blocks=blocks)
        path.write_bytes(content[:begin] + octrees)
        try:
            state(RayScene.load(path, mmap=mmap))
        except ValueError as error:
            assert "transforms: expected " in str(error)
