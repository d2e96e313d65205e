"""Every public function against bad values: a clear ``ValueError`` that names the argument, or what clean input gives.

A matrix of calls and values. What single functions say about single faults is in their own tests.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from meshes import assert_same_hits, make_mesh, rays_at
from numpy.typing import NDArray

import renderer
from renderer import (
    AllHits,
    BruteForce,
    ClosestPoints,
    Image,
    Mesh,
    MeshError,
    Needs,
    Octree,
    Scene,
    SceneError,
    Steps,
    load_mesh,
    load_scene,
    needs_of,
    render,
)
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box

pytestmark = pytest.mark.judges(
    "BruteForce.from_mesh", "Hits.hit", "Mesh.concatenate", "Mesh.repaired", "Octree.all_hits", "Octree.count_steps",
    "Octree.save", "Octree.signed_distance", "Octree.winding_number", "needs_of", "prepare", "render", "srgb",
)  # fmt: skip


VERTICES, FACES = make_mesh("lattice", 5, 30)
ORIGINS, DIRECTIONS = rays_at(VERTICES, FACES, 5, 8)
COUNT = len(ORIGINS)
BOX = Mesh(box().vertices, box().faces)
ROWS = len(BOX.vertices)
OCTREE, BRUTE = Octree(VERTICES, FACES), BruteForce(VERTICES, FACES)
SCENE = Scene.model_validate(
    {
        "camera": {"eye": (0.3, 0.4, 4.0), "target": (0.2, 0.2, 0.0)},
        "materials": {"grey": {}},
        "objects": [{"mesh": BOX, "material": "grey"}],
        "ambient": 0.5,
    }
)


@dataclass(frozen=True)
class Call:
    """A public callable with good arguments, of which one after the other is replaced by a bad value."""

    function: Callable[..., Any]
    good: dict[str, Any]

    def __call__(self, **bad: Any) -> Any:
        return self.function(**{**self.good, **bad})


RAYS = {"origins": ORIGINS, "directions": DIRECTIONS, "t_min": 0.0, "t_max": np.inf}
ATTRIBUTES = {"normals": np.ones((ROWS, 3)), "colors": np.full((ROWS, 3), 0.5), "texcoords": np.ones((ROWS, 2))}
MESH = {"vertices": BOX.vertices, "faces": BOX.faces}
POINTS = ORIGINS + 0.25
CALLS = {
    "Octree.contains": Call(Octree.from_mesh(BOX).contains, {"points": POINTS}),
    "Octree.closest_point": Call(OCTREE.closest_point, {"points": POINTS}),
    "Octree.signed_distance": Call(Octree.from_mesh(BOX).signed_distance, {"points": POINTS}),
    "Octree.winding_number": Call(OCTREE.winding_number, {"points": POINTS}),
    "BruteForce.winding_number": Call(BRUTE.winding_number, {"points": POINTS}),
    "Octree.visible": Call(OCTREE.visible, {"points": POINTS, "targets": ORIGINS[::-1]}),
    "Octree.closest_hit": Call(OCTREE.closest_hit, RAYS),
    "Octree.all_hits": Call(OCTREE.all_hits, RAYS),
    "Octree.count_hits": Call(OCTREE.count_hits, RAYS),
    "Octree.count_steps": Call(OCTREE.count_steps, RAYS),
    "Octree.any_hit": Call(OCTREE.any_hit, RAYS),
    "BruteForce.closest_hit": Call(BRUTE.closest_hit, RAYS),
    "BruteForce.any_hit": Call(BRUTE.any_hit, RAYS),
    "Octree": Call(Octree, MESH),
    "BruteForce": Call(BruteForce, MESH),
    "Octree repair": Call(lambda **arrays: Octree(**arrays, repair=True), MESH),
    "BruteForce repair": Call(lambda **arrays: BruteForce(**arrays, repair=True), MESH),
    "Mesh": Call(Mesh, MESH | ATTRIBUTES),
    "Mesh.repaired": Call(Mesh.repaired, MESH | ATTRIBUTES),
    "Mesh.transformed": Call(BOX.transformed, {"matrix": np.eye(4)}),
}
ARRAYS = [(name, argument) for name, call in CALLS.items() for argument in call.good]
OPTIONAL = set(ATTRIBUTES)
BOUNDS = {"t_min", "t_max"}


def refusal(name: str, argument: str, value: Any) -> str:
    """The message of the ``ValueError`` that this value is refused with, checked to begin with the argument's name."""
    with pytest.raises(ValueError) as caught:
        CALLS[name](**{argument: value})
    message = str(caught.value)
    assert message.startswith(f"{argument}: ") and "expected" in message and "got" in message
    return message


# --- what is no array of real numbers -------------------------------------------------------------------------

WRONG_KINDS: dict[str, Callable[[NDArray[Any]], Any]] = {
    "complex": lambda a: a.astype(complex),
    "object": lambda a: np.where(np.arange(a.size).reshape(a.shape) == 1, None, a.astype(object)),
    "str": lambda a: a.astype(str),
    "bytes": lambda a: a.astype("S8"),
    "bool": lambda a: np.ones(a.shape, bool),
    "datetime": lambda a: np.zeros(a.shape, "datetime64[s]"),
    "timedelta": lambda a: np.zeros(a.shape, "timedelta64[s]"),
    "structured": lambda a: np.zeros(a.shape, [("x", "f8"), ("y", "f8")]),
    "huge integers": lambda a: np.full(a.shape, 10**400, object),
    "Nones": lambda a: np.full(a.shape, None),
    "a string": lambda a: "abc",
    "a table": lambda a: {"x": 1},
    "a set": lambda a: {1.0, 2.0},
    "a generator": lambda a: (row for row in [1.0]),
    "a function": lambda a: len,
    "ragged": lambda a: [[1, 2, 3], [1, 2]],
    "an ellipsis": lambda a: ...,
}


@cases("kind", WRONG_KINDS)
@cases(("name", "argument"), ARRAYS)
def test_other_kinds_are_refused(name: str, argument: str, kind: str) -> None:
    refusal(name, argument, WRONG_KINDS[kind](np.asarray(CALLS[name].good[argument])))


@cases(("name", "argument"), [pair for pair in ARRAYS if pair[1] not in OPTIONAL])
def test_none_is_refused_where_it_means_nothing(name: str, argument: str) -> None:
    refusal(name, argument, None)


# --- shapes ---------------------------------------------------------------------------------------------------

WRONG_SHAPES: dict[str, Callable[[NDArray[Any]], Any]] = {
    "0-d": lambda a: a.reshape(-1)[0],
    "1-d": lambda a: a.reshape(-1),
    "3-d": lambda a: a[None],
    "a column more": lambda a: np.concatenate([a, a[:, :1]], axis=1),
    "a column less": lambda a: a[:, :-1],
    "no column": lambda a: a[:, :0],
    "transposed": lambda a: a[:1].T,
    "an empty row": lambda a: [[]],
    "empty 3-d": lambda a: np.empty((0, *a.shape)),
}


# Queries keep leading dimensions, and those of two arguments are broadcast.
SHAPED = {"origins", "directions", "points", "targets"}


@cases("shape", WRONG_SHAPES)
@cases(("name", "argument"), [pair for pair in ARRAYS if pair[1] not in BOUNDS])
def test_other_shapes_are_refused(name: str, argument: str, shape: str) -> None:
    if argument in SHAPED and shape in {"3-d", "empty 3-d"}:
        return
    assert "shape" in refusal(name, argument, WRONG_SHAPES[shape](np.asarray(CALLS[name].good[argument])))


@cases("name", [name for name, call in CALLS.items() if call.good is RAYS])
@cases("bound", sorted(BOUNDS))
@cases("shape", [(COUNT - 1,), (COUNT + 1,), (0,), (COUNT, 3), (COUNT, 1, 2)])
def test_bounds_of_other_shapes_are_refused(name: str, bound: str, shape: tuple[int, ...]) -> None:
    assert "shape" in refusal(name, bound, np.ones(shape))


# --- values ---------------------------------------------------------------------------------------------------


@cases("value", [np.nan, np.inf, -np.inf])
@cases("row", [0, -1])
@cases(
    ("name", "argument"),
    [
        (name, argument)
        for name, argument in ARRAYS
        if argument not in {"faces", "t_max"} and not (argument in {"vertices", "normals"} and "repair" in name)
    ],
)
def test_values_that_are_not_finite_are_refused(name: str, argument: str, row: int, value: float) -> None:
    array = np.array(np.broadcast_to(CALLS[name].good[argument], (COUNT,)) if argument in BOUNDS else
                     CALLS[name].good[argument], float)  # fmt: skip
    array[(row, *[-1] * (array.ndim - 1))] = value
    message = refusal(name, argument, array)
    assert argument == "matrix" or f"in row {row % len(array)}" in message


@cases("value", [np.longdouble("1e4000"), np.longdouble("-1e4000")])
@cases(
    ("name", "argument"),
    [pair for pair in ARRAYS if pair[1] not in {"faces", "t_max"} and pair != ("Mesh.repaired", "normals")],
)
def test_numbers_beyond_float64_are_refused_without_a_warning(name: str, argument: str, value: Any) -> None:
    if np.finfo(np.longdouble).max <= np.finfo(np.float64).max:
        assert np.isinf(value)  # here they are plain infinities, and the test above has them
    good = CALLS[name].good[argument]
    if argument == "vertices" and "repair" in name:
        assert CALLS[name](vertices=np.full(good.shape, value), **{a: None for a in OPTIONAL & set(CALLS[name].good)})
        return
    array = np.full(np.shape(good), value)
    refusal(name, argument, array if array.ndim else value)


@cases("index", [-1, ROWS, 2**31, 2**63 - 1, -(2**63), np.uint64(2**64 - 1)])
@cases("corner", range(3))
def test_indices_out_of_range_are_refused_or_repaired(index: Any, corner: int) -> None:
    faces = BOX.faces.astype(np.uint64 if isinstance(index, np.uint64) else np.int64)
    faces[4, corner] = index
    for name in ("Mesh", "Octree", "BruteForce"):
        assert f"got {index} in row 4" in refusal(name, "faces", faces)
    for accelerator in (Octree, BruteForce):
        built = accelerator(BOX.vertices, faces, repair=True)
        assert built.repairs is not None and built.repairs.dropped_faces.tolist() == [4]


POINT_OPTIONS: dict[str, list[Any]] = {
    "tolerance": [None, -1, np.nan, np.inf, "1e-3", [1e-3], True, 1j, 10**400],
    "winding": [None, 0, 1.0, "true", [True], np.array([True, False])],
    "boundary": [None, 0, 1.0, "true", [True]],
    "rule": [None, "x", 0, ["nonzero"], b"nonzero", np.array(["nonzero"])],
}


@cases(("name", "bad"), [(n, b) for n, values in POINT_OPTIONS.items() for b in values])
def test_options_of_questions_of_points(name: str, bad: Any) -> None:
    solid = Octree.from_mesh(BOX)
    asked = {"tolerance": [solid.winding_number], "boundary": [solid.contains]}
    for ask in asked.get(name, [solid.contains, solid.signed_distance]):
        with pytest.raises(ValueError, match=rf"^{name}: expected .*, got ") as caught:
            ask(POINTS, **{name: bad})
        assert "ambiguous" not in str(caught.value)


# --- what is unusual and right --------------------------------------------------------------------------------


def _strided(array: NDArray[Any]) -> NDArray[Any]:
    wide = np.full([2 * n for n in array.shape], 77, array.dtype)
    view = wide[tuple(slice(None, None, 2) for _ in array.shape)]
    view[...] = array
    return view


def _reversed(array: NDArray[Any]) -> NDArray[Any]:
    return array[::-1].copy()[::-1]


def _locked(array: NDArray[Any]) -> NDArray[Any]:
    array = array.copy()
    array.flags.writeable = False
    return array


def _unaligned(array: NDArray[Any]) -> NDArray[Any]:
    return np.frombuffer(b"x" + array.tobytes(), array.dtype, offset=1).reshape(array.shape)


LAYOUTS: dict[str, Callable[[NDArray[Any]], Any]] = {
    "fortran": np.asfortranarray,
    "strided": _strided,
    "reversed": _reversed,
    "read-only": _locked,
    "unaligned": _unaligned,
    "big-endian": lambda a: a.astype(a.dtype.newbyteorder(">")),
    "little-endian": lambda a: a.astype(a.dtype.newbyteorder("<")),
    "lists": lambda a: a.tolist(),
    "tuples": lambda a: tuple(map(tuple, a.tolist())) if a.ndim == 2 else tuple(a.tolist()),
    "matrix of numpy's subclass": lambda a: a.view(np.recarray),
    "longdouble": lambda a: a.astype(np.longdouble) if a.dtype.kind == "f" else a,
    "list of arrays": lambda a: list(a),
}
# float16 holds these numbers exactly, so any type must give the same bits.
INTEGER_RAYS = (
    np.array([[1, 2, 9], [0, 0, 7], [3, 1, 8], [2, 2, 20]]),
    np.array([[0, 0, 1], [1, 0, 2], [1, 1, 1], [0, 3, 1]]),
)
TYPES = ["f2", "f4", "f8", ">f2", ">f4", ">f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", ">i2", ">u4", ">i8"]


def same_mesh(got: Mesh, expected: Mesh) -> None:
    for attribute in ("vertices", "faces", "normals", "colors", "texcoords"):
        a, b = getattr(got, attribute), getattr(expected, attribute)
        assert (a is None) == (b is None)
        if a is not None:
            assert a.dtype == b.dtype and a.dtype.isnative and a.flags.c_contiguous and a.tobytes() == b.tobytes()


def same(got: Any, expected: Any) -> None:
    """The same bits, whatever the call returned."""
    if isinstance(got, tuple):
        same_mesh(got[0], expected[0])
    elif isinstance(got, Mesh):
        same_mesh(got, expected)
    elif isinstance(got, np.ndarray):
        assert got.tobytes() == expected.tobytes()
    elif isinstance(got, Octree | BruteForce):
        same_mesh(got.mesh, expected.mesh)
        assert got.stats == expected.stats
    elif isinstance(got, Steps):
        assert (
            got.nodes.tobytes() == expected.nodes.tobytes() and got.triangles.tobytes() == expected.triangles.tobytes()
        )
    elif isinstance(got, ClosestPoints):
        for name in ("distance", "face", "u", "v"):
            assert getattr(got, name).tobytes() == getattr(expected, name).tobytes()
    else:
        assert_same_hits(got, expected)


@cases("layout", LAYOUTS)
@cases(("name", "argument"), ARRAYS)
def test_any_layout_gives_the_same(name: str, argument: str, layout: str) -> None:
    good = CALLS[name].good[argument]
    clean = np.full(COUNT, 0.125 if argument == "t_min" else 3.0) if argument in BOUNDS else np.asarray(good)
    before = clean.tobytes()
    given = LAYOUTS[layout](clean)
    same(CALLS[name](**{argument: given}), CALLS[name](**{argument: clean}))
    assert clean.tobytes() == before
    assert np.array_equal(np.asarray(given), clean)  # the caller's array stays as it was


@cases("type_", TYPES)
@cases("accelerator", [OCTREE, BRUTE])
def test_any_type_of_rays_gives_the_same(accelerator: Any, type_: str) -> None:
    origins, directions = INTEGER_RAYS
    directions = -directions if type_[-2] in "fi" else directions
    expected = accelerator.closest_hit(origins.astype(float), directions.astype(float), 1.0, 40.0)
    number = np.dtype(type_).type
    bounds = number(1), np.full(len(origins), 40, type_)
    arrays = origins.astype(type_), directions.astype(type_)
    assert_same_hits(accelerator.closest_hit(*arrays, *bounds), expected)
    assert accelerator.any_hit(*arrays, *bounds).tolist() == expected.hit.tolist()


@cases("type_", TYPES)
def test_any_type_of_mesh_gives_the_same(type_: str) -> None:
    vertices, expected = box((0, 0, 0), (1, 2, 3)).vertices.astype(type_), box((0, 0, 0), (1, 2, 3))
    faces = expected.faces.astype(type_) if type_[-2] in "iu" else expected.faces
    same_mesh(Mesh(vertices, faces), expected)  # type: ignore[arg-type]
    same_mesh(Mesh.repaired(vertices, faces)[0], expected)
    for accelerator in (Octree, BruteForce):
        same_mesh(accelerator(vertices, faces).mesh, expected)
    same_mesh(expected.transformed(np.eye(4).astype(type_)), expected)


@cases("type_", ["f2", "f4", "f8", "i4", "u8", ">f8"])
@cases("built", [OCTREE, BRUTE, Octree([], []), BruteForce([], [])])
def test_no_rays_give_no_hits(built: Any, type_: str) -> None:
    none = np.empty((0, 3), type_)
    for t_max in (np.inf, np.empty(0), []):
        hits = built.closest_hit(none, none, t_max=t_max)
        assert hits.t.shape == hits.face.shape == hits.u.shape == hits.v.shape == hits.hit.shape == (0,)
        assert hits.points.shape == hits.normals.shape == (0, 3)
        assert built.any_hit(none, none, t_max=t_max).shape == (0,)


@cases("accelerator", [Octree, BruteForce])
@cases("vertices", [[], np.empty((0, 3)), VERTICES])
def test_no_faces_are_missed_by_all(accelerator: Any, vertices: Any) -> None:
    built = accelerator(vertices, np.empty((0, 3), np.int64))
    hits = built.closest_hit(ORIGINS, DIRECTIONS)
    assert (hits.face == -1).all() and np.isinf(hits.t).all() and np.isnan(hits.points).all()
    assert np.isnan(hits.normals).all() and built.stats.faces == built.stats.references == 0
    found = built.all_hits(ORIGINS, DIRECTIONS)
    assert isinstance(found, AllHits) and not len(found.t) and not found.counts.any()


@cases("scale", [1e-300, 1e-160, 1.0, 1e160, 1e300])
@cases("mirror", [1, -1])
def test_maps_of_any_size_keep_outside_outside(scale: float, mirror: int) -> None:
    mesh = Mesh(BOX.vertices, BOX.faces, normals=BOX.vertices - 0.5)
    moved = mesh.transformed(np.diag([mirror * scale, scale, scale, 1.0]))
    expected = mesh.transformed(np.diag([mirror, 1.0, 1.0, 1.0]))
    assert np.array_equal(moved.faces, expected.faces) and moved.normals is not None and expected.normals is not None
    # Three products and a division of numbers near one.
    np.testing.assert_allclose(moved.normals, expected.normals, rtol=4e-15, atol=1e-15)


# --- Hits, Mesh and their sizes -------------------------------------------------------------------------------


NOT_MESHES = [None, "x", 3, np.ones((3, 3)), [BOX], Mesh, {"vertices": []}]


@pytest.mark.parametrize("bad", NOT_MESHES, ids=lambda bad: type(bad).__name__)
class TestWhatIsNoMesh:
    @pytest.mark.parametrize("accelerator", [Octree, BruteForce])
    def test_from_mesh(self, accelerator: Any, bad: Any) -> None:
        with pytest.raises(ValueError, match=r"^mesh: expected a renderer.Mesh, got"):
            accelerator.from_mesh(bad)

    def test_concatenate(self, bad: Any) -> None:
        with pytest.raises(MeshError, match=r"^pot: meshes: expected an iterable of Mesh, got .* in row 1"):
            Mesh.concatenate([BOX, bad], name="pot")


@cases("bad", [None, 3, "x", BOX, np.array(3)])
def test_concatenate_takes_meshes_only(bad: Any) -> None:
    with pytest.raises(MeshError, match=r"^meshes: expected an iterable of Mesh, got"):
        Mesh.concatenate(bad if bad is not BOX else [BOX, None])


# --- files ----------------------------------------------------------------------------------------------------


@cases("bad", [None, 3, 1.5, [], {}, np.ones(3), len])
def test_paths_are_strings_or_paths(bad: Any) -> None:
    image = renderer.render(PREPARED, resolution=(1, 1))
    for call in (load_mesh, load_scene, Octree.load, OCTREE.save, image.save):
        with pytest.raises(ValueError, match=r"^path: expected a string or path, got "):
            call(bad)


@cases("bad", ["", ".", "\0", "a\0.ply", "no/such/folder/a.ply", "x" * 5000 + ".ply", "/", "\ud800.ply"])
def test_paths_that_lead_nowhere(bad: str) -> None:
    with pytest.raises(MeshError):
        load_mesh(bad)
    with pytest.raises(SceneError):
        load_scene(bad)
    for mmap in (False, True):
        with pytest.raises(ValueError, match=re.escape(f"{Path(bad)}: ")):
            Octree.load(bad, mmap=mmap)
    with pytest.raises((OSError, ValueError)):
        OCTREE.save(bad)


def test_colours_beyond_float32_are_refused_without_a_warning(tmp_path: Path) -> None:
    """Found by fuzzing."""
    header = "ply\nformat ascii 1.0\nelement vertex 3\n"
    header += "".join(f"property float {name}\n" for name in ("x", "y", "z", "red", "green", "blue"))
    header += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "a.ply").write_text(header + "0 0 0 0 0 1e300\n1 0 0 0 0 0\n0 1 0 0 0 0\n3 0 1 2\n")
    (tmp_path / "a.obj").write_text("v 0 0 0 0 0 1e300\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n")
    for name in ("a.ply", "a.obj"):
        with pytest.raises(MeshError, match=r"colors: expected finite values, got .* in row 0"):
            load_mesh(tmp_path / name)


@cases("separator", ["\x0b", "\x0c", "\x1c", "\x85", "\u2028", "\u2029"])
def test_separators_within_a_comment_end_no_line(tmp_path: Path, separator: str) -> None:
    text = f"# a{separator}b\ng c{separator}d\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text, encoding="utf-8")
    assert load_mesh(tmp_path / "a.obj").faces.tolist() == [[0, 1, 2]]


@cases("bad", [None, 1, 0, "yes", [], np.True_])
def test_repair_of_files_is_true_or_false(bad: Any, tmp_path: Path) -> None:
    save_ply(BOX, tmp_path / "box.ply")
    with pytest.raises(MeshError, match=r"^repair: expected True or False, got"):
        load_mesh(tmp_path / "box.ply", repair=bad)


@cases("suffix", [".png", ".npy"])
@cases("bad", [np.nan, np.inf, -np.inf])
def test_pictures_of_what_is_not_finite_are_saved_or_refused_without_a_warning(
    tmp_path: Path, suffix: str, bad: float
) -> None:
    """The renderer makes none; a caller may. NaN has no colour, so PNG may only refuse it."""
    film = render(SCENE, resolution=(4, 4), threads=1)
    radiance = film.radiance.copy()
    radiance[1, 2] = bad
    image = Image(radiance, film.depth, film.normal, film.face, film.rays, 0.0, 0.0)
    path = tmp_path / f"a{suffix}"
    if suffix == ".png" and np.isnan(bad):
        with pytest.raises(ValueError, match=r"^radiance: expected"):
            image.save(path)
        assert not path.exists()
    else:
        image.save(path)
        assert path.stat().st_size > 0


# --- render ---------------------------------------------------------------------------------------------------

BAD_SETTINGS: dict[str, list[Any]] = {
    "accelerator": [None, "x", 0, "", ["octree"], np.array(["octree", "brute"]), b"octree"],
    "split": [None, "x", 0, "SAH", ["sah"], {"sah": 1}, np.array(["sah", "sah"])],
    "offset": [None, "x", np.nan, -1, np.inf, 0.1, 1j, [0.01], np.array([0.01]), True, 10**400],
    "threads": [0, -1, 1.5, "2", True, [1], np.array([1, 2]), np.nan],
    "resolution": [
        "44",
        4.0,
        (4,),
        (4, 4, 4),
        (0, 4),
        (4, -1),
        (4.5, 4),
        (np.nan, 4),
        (1 << 40, 4),
        (True, 4),
        [[4, 4]],
    ],
    "samples": [0, -1, 2, 1.0, np.inf, "1", True, [1], 10**30],
    "max_depth": [-1, 65, 1.5, np.nan, True, "3", 10**40, [3]],
    "min_weight": [-1, 1, np.nan, np.inf, "0", 1j, [0.1], -1e-300],
    "shadows": [0, 1, "true", 1.0, [True]],
    "needs": [3, "x", {}, Needs, Needs(*[None] * 9), Needs(*[1] * 9), Needs(*[np.nan] * 9)],  # type: ignore[arg-type]
    "colour": [1],
}


@cases(("name", "bad"), [(n, b) for n, values in BAD_SETTINGS.items() for b in values])
def test_settings_of_render(name: str, bad: Any) -> None:
    with pytest.raises(ValueError, match=name) as caught:
        render(SCENE, **{"resolution": (4, 4), name: bad})
    assert "ambiguous" not in str(caught.value)


@cases("bad", [None, "scene.toml", 3, {"camera": {}}, BOX, np.ones(3)])
def test_render_takes_scenes(bad: Any) -> None:
    with pytest.raises(ValueError, match=r"^scene: expected a Scene or a PreparedScene, got") as caught:
        render(bad, resolution=(4, 4))
    assert ("load_scene" in str(caught.value)) == isinstance(bad, str)
    with pytest.raises(ValueError, match=r"^scene: expected a Scene, got"):
        needs_of(bad)


@cases("bad", [-1, 1.5, "1", True, np.nan, [1]])
def test_bounces_of_needs_of(bad: Any) -> None:
    with pytest.raises(ValueError, match=r"^max_depth: expected an integer >= 0 or None, got"):
        needs_of(SCENE, bad)


PREPARED = renderer.prepare(SCENE)


@cases(
    ("name", "bad"),
    [("accelerator", "octree"), ("split", "midpoint"), ("needs", needs_of(SCENE)), ("camera", SCENE), ("samples", 3)],
)
def test_what_a_prepared_scene_cannot_change_is_refused(name: str, bad: Any) -> None:
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        render(PREPARED, **{"resolution": (4, 4), name: bad})


@pytest.mark.parametrize("bad", [None, "scene.toml", PREPARED], ids=lambda b: type(b).__name__)
def test_prepare_takes_scenes(bad: Any) -> None:
    with pytest.raises(ValueError, match=r"^scene: expected a Scene, got"):
        renderer.prepare(bad)


# --- scenes from Python ---------------------------------------------------------------------------------------

EYE = {"eye": (0, 0, 4), "target": (0, 0, 0)}
# A good way to make each scene class, and fields with what they do not take.
CLASSES: list[tuple[type, dict[str, Any], dict[str, Any]]] = [
    (renderer.PerspectiveCamera, EYE, {"eye": "x", "target": (1, 2), "up": 3, "fov": 180.0, "zoom": 1}),
    (renderer.OrthographicCamera, {**EYE, "height": 2.0}, {"height": -1.0, "eye": (0, 0, np.nan)}),
    (renderer.Phong, {}, {"diffuse": -1.0, "shininess": "x", "ior": 0.0, "color": 1}),
    (renderer.Mirror, {}, {"reflectance": (1, 2), "type": "phong"}),
    (renderer.Dielectric, {"ior": 1.3}, {"ior": np.inf, "transmittance": None}),
    (renderer.DirectionalLight, {"direction": (0, -1, 0)}, {"direction": (0, 0, 0), "irradiance": "bright"}),
    (renderer.PointLight, {"position": (0, 3, 0)}, {"position": None, "intensity": -1.0}),
    (renderer.SceneObject, {"mesh": BOX, "material": "m"}, {"mesh": 3, "material": 3, "normals": "round", "scale": ()}),
    (renderer.Floor, {"min": (-1, -1), "max": (1, 1), "materials": ["m"]}, {"min": (1, 1), "squares": (0, 1)}),
    (renderer.RenderSettings, {}, {"resolution": 512.0, "samples": 5, "max_depth": -1, "min_weight": 1.0}),
    (Scene, {"camera": EYE, "materials": {}}, {"camera": 3, "lights": [{"type": "sun"}], "objects": [1]}),
]


@cases(
    ("kind", "good", "field", "bad"),
    [(kind, good, field, bad) for kind, good, fields in CLASSES for field, bad in fields.items()],
)
def test_each_class_of_a_scene_says_on_one_line_what_is_wrong(
    kind: type, good: dict[str, Any], field: str, bad: Any
) -> None:
    kind(**good)
    with pytest.raises(SceneError) as caught:
        kind(**{**good, field: bad})
    message = str(caught.value)
    assert message.startswith(f"{kind.__name__}: ") and len(message.splitlines()) == 1 and "http" not in message
    # A direction or a rectangle is judged as a whole.
    assert field in message or "non-zero length" in message or "min < max" in message


@cases("bad", [{}, "x", None, [[1.0], [2.0, 3.0]], [1j]])
def test_srgb_takes_numbers_only(bad: Any) -> None:
    with pytest.raises(ValueError, match=r"^linear: expected "):
        renderer.srgb(bad)


GOOD_SCENE: dict[str, Any] = {
    "camera": {"eye": (0, 0, 4), "target": (0, 0, 0), "up": (0, 1, 0), "fov": 40},
    "materials": {"grey": {"diffuse": 0.5, "specular": 0.1, "shininess": 3.0, "ior": 1.5}},
    "lights": [
        {"type": "point", "position": (0, 3, 3), "intensity": 2.0},
        {"type": "directional", "direction": (0, -1, 0)},
    ],
    "objects": [{"mesh": BOX, "material": "grey", "scale": 1, "rotate": (0, 0, 0), "translate": (0, 0, 0)}],
    "floor": {"min": (-1, -1), "max": (1, 1), "materials": ["grey"], "squares": (1, 1)},
    "ambient": 0.5,
    "background": (0.1, 0.2, 0.3),
    "render": {"resolution": (4, 4), "samples": 1, "max_depth": 1, "min_weight": 0.0},
}
BAD_VALUES: list[Any] = [
    np.nan,
    np.inf,
    -np.inf,
    1j,
    "1",
    b"1",
    True,
    {},
    {1},
    [],
    (1,),
    [np.nan] * 3,
    [[1, 2, 3]],
    "",
    len,
]


def leaves(table: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all numbers and vectors in nested tables and lists of tables."""
    if isinstance(table, dict):
        return [leaf for key, value in table.items() for leaf in leaves(value, (*path, key))]
    if isinstance(table, list) and table and isinstance(table[0], dict):
        return [leaf for k, value in enumerate(table) for leaf in leaves(value, (*path, k))]
    return [path] if isinstance(table, int | float | tuple) else []


def replaced(table: Any, path: tuple[Any, ...], value: Any) -> Any:
    if not path:
        return value
    if isinstance(table, dict):
        return {k: replaced(v, path[1:], value) if k == path[0] else v for k, v in table.items()}
    return [replaced(v, path[1:], value) if k == path[0] else v for k, v in enumerate(table)]


@cases("path", leaves(GOOD_SCENE))
@cases("bad", BAD_VALUES)
def test_each_number_of_a_scene(path: tuple[Any, ...], bad: Any) -> None:
    with pytest.raises(ValueError) as caught:
        Scene.model_validate(replaced(GOOD_SCENE, path, bad))
    assert str(path[-1]) in str(caught.value)


# --- nothing is left out --------------------------------------------------------------------------------------
