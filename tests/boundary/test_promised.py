"""What the library and its commands do that no other file of tests asks."""

import doctest
import inspect
import io
import json
import sys
import time
import tracemalloc
import urllib.error
import urllib.request
import warnings
from dataclasses import fields, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import igl
import numpy as np
import pytest
import trimesh

import renderer
from renderer import (
    BruteForce,
    CutWarning,
    Dielectric,
    DirectionalLight,
    Mesh,
    Mirror,
    Octree,
    PerspectiveCamera,
    Phong,
    PointLight,
    Scene,
    SceneObject,
    load_scene,
    needs_of,
    prepare,
    render,
)
from renderer.cli.main import main
from renderer.materials import columns
from renderer.materials.base import appearance_of
from renderer.mesh.shapes import icosphere
from renderer.picture import prepare as preparing
from renderer.scene.light import light_row
from renderer.shade import records
from renderer.system.threads import available_threads

SCENES = Path(__file__).parents[2] / "scenes"
GLASS, STAIRS, BLOCK = SCENES / "glass.toml", SCENES / "stairs.toml", SCENES / "models" / "block.ply"
SIZE = (24, 16)


def through(count: int) -> tuple[Any, Any]:
    """Rays downwards over the unit sphere."""
    x, y = np.random.default_rng(3).uniform(-0.5, 0.5, (2, count))
    return np.stack([x, y, np.full(count, 3.0)], 1), [0.0, 0.0, -1.0]


# Queries


Expected = dict[type, list[tuple[Any, tuple[int, ...]]]]


def assert_arrays(expected: Expected) -> None:
    """Each array has the type under which it stands, and its shape; a number of Python's own is no array."""
    for dtype, arrays in expected.items():
        for number, (array, shape) in enumerate(arrays):
            assert isinstance(array, np.ndarray | np.generic), (dtype, number)
            assert (array.dtype, array.shape) == (dtype, shape), (dtype, number)


@pytest.mark.judges(
    "AllHits", "AllHits.counts", "AllHits.normals", "AllHits.points", "AllHits.ray", "ClosestPoints",
    "ClosestPoints.found", "ClosestPoints.points", "Hits", "Hits.hit", "Hits.normals", "Hits.points", "Hits.shaped",
    "Octree.any_hit", "Octree.contains", "Octree.count_hits", "Octree.signed_distance", "Octree.visible",
    "Octree.winding_number", "Steps",
)  # fmt: skip
@pytest.mark.parametrize("kind", [Octree, BruteForce])
@pytest.mark.parametrize("shape", [(), (5,), (4, 15)])
def test_answers_have_their_types_and_the_dimensions_of_what_is_asked(kind: Any, shape: tuple[int, ...]) -> None:
    """Of one ray, of a few, which go one by one, and of many, in two dimensions; some of them miss."""
    count = int(np.prod(shape))
    start = (3.0 * through(60)[0])[:count].reshape(*shape, 3)
    rays, target = (start, [0.0, 0.0, -1.0]), kind.from_mesh(icosphere(2))
    hits, rows = target.closest_hit(*rays, t_error=True), target.all_hits(*rays, t_error=True)
    steps, found, hit = target.count_steps(*rays), len(rows.t), int(np.count_nonzero(hits.hit))
    assert count == 1 or 0 < hit < count
    near, far = target.closest_point(start), target.closest_point(start, 1e-3)
    assert near.found.all() and not far.found.any()
    expected: Expected = {
        np.float64: [
            *((numbers, shape) for numbers in (hits.t, hits.u, hits.v, hits.t_error)),
            *((numbers, (found,)) for numbers in (rows.t, rows.u, rows.v, rows.t_error)),
            *((vectors, (*shape, 3)) for vectors in (hits.points, hits.normals, near.points, far.points)),
            *((vectors, (found, 3)) for vectors in (rows.points, rows.normals)),
            *((numbers, shape) for some in (near, far) for numbers in (some.distance, some.u, some.v)),
            (target.winding_number(start), shape), (target.signed_distance(start), shape),
        ],
        np.int64: [
            (rows.offsets, (count + 1,)), (rows.face, (found,)), (rows.ray, (found,)), (rows.counts, shape),
            *((numbers, shape) for numbers in (hits.face, target.count_hits(*rays), near.face, far.face)),
            (steps.nodes, shape), (steps.triangles, shape),
        ],
        np.bool_: [
            (hits.hit, shape), (target.any_hit(*rays), shape), (target.contains(start), shape),
            (target.visible(start, [0.0, 0.0, 9.0]), shape), (near.found, shape), (far.found, shape),
        ],
    }  # fmt: skip
    assert_arrays(expected)


@pytest.mark.judges(
    "Mesh", "Mesh.bounds", "Mesh.extent", "Mesh.face_normals", "Mesh.triangles", "Mesh.vertex_normals", "Repairs"
)
@pytest.mark.parametrize("corners", [0, 3, None])
def test_arrays_of_meshes_have_their_types_and_dimensions(corners: int | None) -> None:
    """A mesh of many faces, one of vertices alone and one of nothing, made from lists, which have no type."""
    places = icosphere(2).vertices[:corners].tolist()
    triangles = icosphere(2).faces.tolist() if corners is None else []
    colors, texcoords = (np.abs(places).reshape(-1, 3)[:, :width].tolist() for width in (3, 2))
    given: dict[str, Any] = {"normals": places, "colors": colors, "texcoords": texcoords} if places else {}
    repaired, repairs = Mesh.repaired(places, triangles, **given)
    count, faces = len(places), len(triangles)
    for mesh in (Mesh(places, triangles, **given), repaired):
        expected: Expected = {
            np.float64: [
                *((vectors, (count, 3)) for vectors in (mesh.vertices, mesh.vertex_normals())),
                (mesh.triangles, (faces, 3, 3)), (mesh.face_normals(), (faces, 3)), (mesh.extent, (3,)),
                *((corner, (3,)) for corner in mesh.bounds),
                *([(mesh.normals, (count, 3)), (mesh.texcoords, (count, 2))] if given else []),
            ],
            np.float32: [(mesh.colors, (count, 3))] if given else [],
            np.int32: [(mesh.faces, (faces, 3))],
            np.int64: [
                (mesh.open_edges, (0, 2)), (mesh.odd_edges, (0, 2)), (repairs.kept_faces, (faces,)),
                *((none, (0,)) for none in (repairs.dropped_faces, repairs.bad_vertices, repairs.bad_normals)),
            ],
        }  # fmt: skip
        assert_arrays(expected)


@pytest.mark.judges(
    "Image", "Image.srgb", "OrthographicCamera.frame", "OrthographicCamera.rows", "PerspectiveCamera.frame",
    "PerspectiveCamera.rows", "SceneObject.matrix",
)  # fmt: skip
def test_arrays_of_pictures_cameras_and_objects_have_their_types_and_dimensions() -> None:
    scene = load_scene(STAIRS)
    image, views = render(scene, resolution=SIZE), (scene.camera, load_scene(GLASS).camera)
    assert [view.type for view in views] == ["orthographic", "perspective"]
    expected: Expected = {
        np.float64: [
            (image.depth, (16, 24)), *((view.rows(24, 16), (6, 3)) for view in views),
            *((axis, (3,)) for view in views for axis in view.frame()),
            *((thing.matrix(), (4, 4)) for thing in scene.objects),
        ],
        np.float32: [(image.radiance, (16, 24, 3)), (image.normal, (16, 24, 3))],
        np.int32: [(image.face, (16, 24)), (image.rays, (16, 24))],
        np.uint8: [(image.srgb, (16, 24, 3))],
    }  # fmt: skip
    assert_arrays(expected)


def test_the_examples_of_all_docstrings_hold() -> None:
    finder, runner = doctest.DocTestFinder(exclude_empty=True), doctest.DocTestRunner()
    for name in renderer.__all__:
        thing = getattr(renderer, name)
        own = vars(sys.modules[thing.__module__]).copy() if hasattr(thing, "__module__") else {}
        members = [value for base in getattr(thing, "__mro__", ()) if base.__module__.startswith("renderer.")
                   for member, value in vars(base).items() if not member.startswith("_")]  # fmt: skip
        for documented in (thing, *members):
            for example in finder.find(documented, name, globs=own) if inspect.getdoc(documented) else ():
                runner.run(example)
    assert runner.tries > 50 and runner.failures == 0


@pytest.mark.judges("AllHits.ray")
def test_rays_of_several_dimensions_are_counted_in_c_order() -> None:
    origins = np.array([[[0.0, 0.0, 3.0], [9.0, 0.0, 3.0]], [[0.1, 0.0, 3.0], [0.2, 0.0, 3.0]]])
    found = Octree.from_mesh(icosphere(2)).all_hits(origins, [0.0, 0.0, -1.0], max_hits=1)
    assert found.ray.tolist() == [0, 2, 3] and found.counts.tolist() == [[1, 0], [1, 1]]


@pytest.mark.judges("Octree.all_hits")
def test_memory_of_all_hits_grows_with_what_is_found() -> None:
    vertices = np.tile([[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]], (400, 1))
    vertices[:, 2] = np.repeat(np.arange(400.0), 3)
    octree = Octree(vertices, np.arange(1200).reshape(-1, 3))
    origins = np.concatenate([np.random.default_rng(1).uniform(-0.4, 0.4, (5000, 2)), np.full((5000, 1), 500.0)], 1)
    peaks = []
    for t_max in (110.0, 600.0):  # of 500 to 101: ten hits, and all 400
        octree.all_hits(origins[:9], [0.0, 0.0, -1.0], t_max=t_max)
        tracemalloc.start()
        found = octree.all_hits(origins, [0.0, 0.0, -1.0], t_max=t_max)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert len(found.t) == 2_000_000
    # A fortieth is found: a third leaves room for what depends on the rays alone.
    assert peaks[0] < peaks[1] / 3


@pytest.mark.judges("Octree.signed_distance")
def test_signs_of_distances_are_those_of_libigl_and_not_of_trimesh() -> None:
    mesh = icosphere(2)
    points = np.random.default_rng(2).uniform(-1.4, 1.4, (200, 3))
    ours = Octree.from_mesh(mesh).signed_distance(points)
    assert (ours > 0.01).any() and (ours < -0.01).any()
    assert np.allclose(ours, igl.signed_distance(points, mesh.vertices, mesh.faces)[0], atol=1e-12)
    theirs = trimesh.proximity.signed_distance(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), points)
    assert np.allclose(ours, -theirs, atol=1e-7)


@pytest.mark.judges("BruteForce.mesh", "Octree.mesh")
def test_the_mesh_of_a_tree_is_the_one_built_over_and_then_the_moved_one() -> None:
    mesh = icosphere(1)
    for built in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        assert built.mesh is mesh
        built.refit(mesh.vertices * 2.0)
        assert np.array_equal(built.mesh.vertices, mesh.vertices * 2.0)
        assert np.array_equal(built.mesh.faces, mesh.faces)


@pytest.mark.judges("Octree.refit")
def test_a_refit_keeps_what_belongs_to_vertices() -> None:
    mesh = icosphere(1)
    full = Mesh(mesh.vertices, mesh.faces, mesh.vertices, np.abs(mesh.vertices), mesh.vertices[:, :2])
    octree = Octree.from_mesh(full)
    octree.refit(mesh.vertices * 2.0)
    for name in ("normals", "colors", "texcoords"):
        assert np.array_equal(getattr(octree.mesh, name), getattr(full, name))


@pytest.mark.judges("Mesh")
def test_meshes_compare_and_hash_by_identity() -> None:
    first, second = icosphere(0), icosphere(0)
    assert first != second and len({first, second, first}) == 2


@pytest.mark.judges("Mesh.is_closed")
def test_closed_is_judged_by_position() -> None:
    mesh = icosphere(0)
    soup = Mesh(mesh.triangles.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))
    assert mesh.is_closed() and soup.is_closed()
    assert not Mesh(soup.vertices, soup.faces[1:]).is_closed()


# Meshes


@pytest.mark.judges("Mesh.triangles")
def test_triangles_are_a_new_array_each_time() -> None:
    mesh = icosphere(0)
    first, second = mesh.triangles, mesh.triangles
    first[:] = 9.0
    assert not np.shares_memory(first, second) and not np.shares_memory(second, mesh.vertices)
    assert np.array_equal(second, mesh.vertices[mesh.faces])


def named(edges: Any) -> list[list[int]]:
    return sorted(sorted(edge) for edge in edges.tolist())


@pytest.mark.judges("Mesh.odd_edges", "Mesh.open_edges")
def test_open_and_odd_edges_are_named_by_their_vertices() -> None:
    places = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]]
    square = Mesh(places, [[0, 1, 2], [1, 0, 3]])
    assert named(square.open_edges) == named(square.odd_edges) == [[0, 2], [0, 3], [1, 2], [1, 3]]
    # The second face turned over: its edge to the first is passed twice in one direction, by an even number of faces.
    turned = Mesh(places, [[0, 1, 2], [0, 1, 3]])
    assert named(turned.open_edges) == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3]]
    assert named(turned.odd_edges) == [[0, 2], [0, 3], [1, 2], [1, 3]]
    fin = Mesh(places, [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    assert [0, 1] in named(fin.open_edges) and [0, 1] in named(fin.odd_edges)
    # Vertices doubled, as in soup: each open edge is named once, by one vertex at each of its ends.
    soup = Mesh(square.triangles.reshape(-1, 3), [[0, 1, 2], [3, 4, 5]])
    assert named(soup.open_edges) == named(soup.odd_edges) == [[0, 2], [1, 2], [3, 5], [4, 5]]
    assert square.open_edges.dtype == np.int64 and icosphere(0).open_edges.shape == (0, 2)


@pytest.mark.judges("Mesh.concatenate")
def test_joined_meshes_have_texture_coordinates_where_all_have_them() -> None:
    ball = icosphere(0)
    mapped = Mesh(ball.vertices, ball.faces, texcoords=ball.vertices[:, :2])
    joined = Mesh.concatenate([mapped, mapped]).texcoords
    assert joined is not None and np.array_equal(joined, np.tile(ball.vertices[:, :2], (2, 1)))
    assert Mesh.concatenate([mapped, ball]).texcoords is None


# Scenes and pictures


def test_rows_for_kernels_have_their_columns() -> None:
    for material in (Dielectric(), Mirror(), Phong()):
        row = appearance_of(material).row()
        assert row.shape == (columns.MATERIAL_COLUMNS,) and row.dtype == np.float64
    for light in (PointLight(position=(0, 1, 0)), DirectionalLight(direction=(0, 1, 0), irradiance=2)):
        row = light_row(light)
        assert row.shape == (records.LIGHT_COLUMNS,) and row.dtype == np.float64


def test_the_kind_of_phong_follows_its_colours() -> None:
    black, grey = (0.0, 0.0, 0.0), (0.5, 0.5, 0.5)
    kinds = [appearance_of(Phong(diffuse=d, specular=s)).kind for d in (black, grey) for s in (black, grey)]
    assert kinds == [columns.UNLIT, columns.PHONG, columns.LAMBERT, columns.PHONG]


@pytest.mark.judges("CutWarning", "Image", "Image.cut_message")
def test_cut_counts_the_pixels_that_miss_rays_and_the_warning_says_it() -> None:
    scene = load_scene(GLASS)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        image = render(scene, resolution=SIZE, max_rays=3)
    whole = render(scene, resolution=SIZE)
    assert image.cut == np.count_nonzero(image.rays < whole.rays) > 0
    assert [str(one.message) for one in said if one.category is CutWarning] == [image.cut_message(3)]
    assert f"{image.cut:,} of {SIZE[0] * SIZE[1]:,} pixels" in image.cut_message(3)


@pytest.mark.judges("Image", "PreparedScene")
def test_a_prepared_scene_holds_what_it_says() -> None:
    scene = load_scene(GLASS)
    render(scene, resolution=SIZE)  # what is compiled counts for nothing
    began = time.perf_counter()
    prepared, brute = prepare(scene), prepare(scene, accelerator="brute")
    image = render(prepared, resolution=SIZE)
    elapsed = time.perf_counter() - began
    assert prepared.scene is scene
    triangles = np.concatenate([instance.mesh.triangles for instance in scene.instances])
    assert np.array_equal(prepared.mesh.triangles, triangles)
    assert type(prepared.octree) is Octree and type(brute.octree) is BruteForce
    assert prepared.octree.mesh is prepared.mesh
    for feature in fields(prepared.needs):
        assert getattr(prepared.needs, feature.name) >= getattr(needs_of(scene), feature.name), feature.name
    assert image.build_seconds == prepared.build_seconds > 0.0 < image.render_seconds
    assert prepared.build_seconds + brute.build_seconds + image.render_seconds <= elapsed


@pytest.mark.judges("Scene.altered")
def test_an_altered_scene_has_checked_values_and_the_meshes_of_the_other() -> None:
    """Silent until they were tried: a misspelt name, and fields that place meshes."""
    scene = load_scene(GLASS)
    for name, value in {"floor": None, "objects": (), "up": "z"}.items():
        with pytest.raises(ValueError, match=f"^{name}: .* Make a new Scene for another {name}"):
            scene.altered(**{name: value})
    with pytest.raises(ValueError, match=r"got 'backgrund'\. Did you mean 'background'"):
        scene.altered(backgrund=1)
    with pytest.raises(ValueError, match=r"lights\.0"):
        scene.altered(lights=[3])
    with pytest.raises(ValueError, match=r"objects\.0\.material"):
        scene.altered(materials={})
    altered = scene.altered(sky=None, background=1, lights=list(scene.lights))
    assert altered.background == (1.0, 1.0, 1.0) and altered.lights == scene.lights
    assert altered.instances is scene.instances


@pytest.mark.judges("RenderSettings")
def test_min_weight_bounds_no_error_where_rays_branch() -> None:
    """Panes that reflect half and let half through: the rays of each bounce carry 1 together, and the fewer each."""
    wall = np.array([[-6.0, -5.0, 0.0], [6.0, -5.0, 0.0], [0.2, 9.0, 0.0]])
    panes = Mesh(np.concatenate([np.add(wall, [0.0, 0.0, z]) for z in range(-15, 15)]), np.arange(90).reshape(-1, 3))
    scene = Scene(
        camera=PerspectiveCamera(eye=(0, 0, 0.5), target=(0, 0, 2), fov=20),
        materials={"m": Phong(diffuse=0.0, ambient=1.0, reflectance=0.5, transmittance=0.5, ior=1.0)},
        objects=(SceneObject(mesh=panes, material="m"),),
        ambient=1.0,
    )
    whole, cut = (render(scene, resolution=(1, 1), max_depth=10, min_weight=w).radiance[0, 0, 0] for w in (0.0, 0.1))
    assert (whole, cut) == (11.0, 4.0)  # weights from 1 to 1/8 are above 0.1


@pytest.mark.judges("prepare", "render")
def test_render_and_prepare_hand_on_their_options(monkeypatch: pytest.MonkeyPatch) -> None:
    """``split``, ``threads`` and ``needs``: pictures are the same anyhow, so what is built and who works is watched."""
    built, workers, scene = [], [], load_scene(STAIRS)
    from_mesh, for_chunks = Octree.from_mesh, preparing.for_chunks

    def watched(mesh: Mesh, **options: Any) -> Octree:
        built.append((options["split"], options["threads"]))
        return from_mesh(mesh, **options)

    def chunks(work: Any, count: int, size: int, threads: int, finished: Any) -> None:
        workers.append(threads)
        for_chunks(work, count, size, threads, finished)

    monkeypatch.setattr(preparing.Octree, "from_mesh", watched)
    monkeypatch.setattr(preparing, "for_chunks", chunks)
    more = replace(needs_of(scene), octree=True, refraction=True)
    options: dict[str, Any] = {"accelerator": "octree", "split": "midpoint", "needs": more, "threads": 3}
    ready = prepare(scene, **options)
    assert ready.needs == more and prepare(scene).needs == needs_of(scene) != more
    render(scene, resolution=SIZE, **options)
    render(scene, resolution=SIZE, accelerator="octree")
    render(ready, resolution=SIZE, threads=2)
    assert [one for one in built if one[0] == "midpoint"] == [("midpoint", 3)] * 2
    assert workers == [3, available_threads(), 2] and built[-1] == ("sah", available_threads())


# Commands


@pytest.mark.judges("octree-render render --output")
def test_the_command_writes_an_exr_file_of_the_librarys_bits(tmp_path: Path, mitsuba: Any) -> None:
    path = tmp_path / "a.exr"
    assert main(["render", str(GLASS), "--resolution", "24x16", "-o", str(path), "--quiet"]) == 0
    read, image = mitsuba.Bitmap(str(path)), render(load_scene(GLASS), resolution=SIZE)
    channels = {field.name: np.array(read)[..., i] for i, field in enumerate(read.struct_())}
    assert np.array_equal(np.stack([channels[name] for name in "RGB"], -1), image.radiance)
    assert np.array_equal(channels["Z"], image.depth.astype(np.float32)) and len(channels) == 7


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.judges("octree-render render --quiet")
@pytest.mark.parametrize("quiet", [False, True])
def test_quiet_shows_no_bar_on_a_terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, quiet: bool) -> None:
    said, shown = Terminal(), Terminal()
    monkeypatch.setattr(sys, "stdout", said)
    monkeypatch.setattr(sys, "stderr", shown)
    given = ["render", str(STAIRS), "--resolution", "70x40", "-o", str(tmp_path / "a.npy")]
    assert main([*given, "--quiet"] if quiet else given) == 0
    assert ("tile" in shown.getvalue()) == ("70 x 40" in said.getvalue()) == (not quiet)
    assert not quiet or shown.getvalue() == said.getvalue() == ""


@pytest.mark.judges(
    "octree-render render --accelerator", "octree-render render --max-depth", "octree-render render --max-rays",
    "octree-render render --min-weight", "octree-render render --output", "octree-render render --resolution",
    "octree-render render --samples", "octree-render render --split", "octree-render render --threads",
)  # fmt: skip
def test_what_the_command_is_told_is_handed_on_and_the_rest_left_to_the_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[dict[str, Any]] = []
    small = render(load_scene(STAIRS), resolution=(2, 2))

    def noting(scene: Any, **options: Any) -> Any:
        told.append(options)
        return small

    monkeypatch.setattr(import_module("renderer.picture.render"), "render", noting)
    monkeypatch.chdir(tmp_path)
    command = ["render", str(STAIRS), "--quiet"]
    given = {"max_depth": 7, "samples": 9, "min_weight": 0.25, "max_rays": 99, "accelerator": "brute",
             "split": "midpoint", "threads": 5}  # fmt: skip
    # The ends of their ranges: 0 is a value like any other, not one that was left out.
    ends: list[dict[str, Any]] = [{"max_depth": 0, "min_weight": 0.0}, {"max_depth": 64, "min_weight": 1.0 - 2.0**-53}]
    for options in (given, *ends):
        flags = [word for name, value in options.items() for word in (f"--{name.replace('_', '-')}", str(value))]
        assert main([*command, *flags, "--resolution", "30X20"]) == 0
    assert main(command) == 0
    left = {**dict.fromkeys(given), "accelerator": "auto", "split": "sah"}
    expected = [
        *({**left, **options, "resolution": (30, 20)} for options in (given, *ends)),
        {**left, "resolution": None},
    ]
    for options, said in zip(told, expected, strict=True):
        assert {name: options[name] for name in said} == said
    assert [path.name for path in tmp_path.iterdir()] == ["out.png"]


@pytest.mark.judges("octree-render view --host", "octree-render view --port", "octree-render view scene")
def test_the_command_shows_a_scene_on_this_machine_at_any_free_port(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    told: list[dict[str, Any]] = []

    def noting(scene: Any, **options: Any) -> Any:
        told.append(options)
        raise ValueError("enough is known")

    monkeypatch.setattr(import_module("renderer.viewer.view"), "view", noting)
    assert main(["view", str(STAIRS)]) == main(["view", str(STAIRS), "--host", "::1", "--port", "8123"]) == 2
    assert [(options["host"], options["port"]) for options in told] == [("127.0.0.1", 0), ("::1", 8123)]


@pytest.mark.judges("octree-render info --split")
def test_info_cuts_the_octree_by_area_unless_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(STAIRS)]) == 0
    assert "octree (sah): " in capsys.readouterr().out


def asked(url: str) -> int:
    """The status with which a server answers."""
    try:
        with urllib.request.urlopen(url, timeout=30.0) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


@pytest.mark.judges("view")
def test_a_view_that_other_machines_reach_wants_the_token() -> None:
    pytest.importorskip("uvicorn", reason="the extra viewer is not installed")
    with renderer.view(STAIRS, host="0.0.0.0", browser=False) as viewing:
        plain, _, token = viewing.url.partition("?token=")
        assert len(token) >= 32 and asked(viewing.url) == 200 and asked(plain) == 403


@pytest.mark.judges("octree-render view --host", "octree-render view --write-scene")
def test_the_command_view_takes_host_and_writes_the_scene_of_a_mesh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("uvicorn", reason="the extra viewer is not installed")
    from renderer.viewer.server import ViewerServer

    monkeypatch.setattr(ViewerServer, "wait", lambda self: None)
    monkeypatch.setattr(ViewerServer, "close", lambda self: None)
    written = tmp_path / "a.toml"
    given = ["view", str(BLOCK), "--write-scene", str(written), "--host", "0.0.0.0", "--no-browser"]
    assert main(given) == 0
    assert "?token=" in capsys.readouterr().out
    assert len(load_scene(written).instances) == len(load_scene(BLOCK).instances)


@pytest.mark.judges("octree-render view --no-browser", "octree-render view scene")
@pytest.mark.parametrize("browser", [True, False])
def test_the_command_view_shows_a_mesh_file_and_opens_a_browser_unless_told_not_to(
    monkeypatch: pytest.MonkeyPatch, browser: bool
) -> None:
    pytest.importorskip("uvicorn", reason="the extra viewer is not installed")
    from renderer.viewer.server import ViewerServer

    opened: list[str] = []
    served: list[Any] = []

    def look(self: ViewerServer) -> None:
        if not served:
            with urllib.request.urlopen(f"{self.url}scene", timeout=30.0) as answer:
                served.append((self.url, json.load(answer)))

    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or True)
    monkeypatch.setattr(ViewerServer, "wait", look)
    assert main(["view", str(BLOCK), *([] if browser else ["--no-browser"])]) == 0
    ((url, told),) = served
    assert opened == ([url] if browser else [])
    # A floor of two triangles is put under the mesh.
    own = trimesh.load_mesh(BLOCK, process=False)
    assert told["name"] == "block.ply" and told["faces"] == len(own.faces) + 2 and told["sky"]["lights"] == 96


@pytest.mark.judges("view")
@pytest.mark.parametrize(
    ("argument", "value"), [("port", -1), ("port", 65536), ("port", "80"), ("host", 3), ("host", "no such host")]
)
def test_view_refuses_other_addresses_and_names_the_argument(argument: str, value: Any) -> None:
    pytest.importorskip("uvicorn", reason="the extra viewer is not installed")
    with pytest.raises(ValueError, match=f"^{argument}: expected .* got "):
        renderer.view(STAIRS, browser=False, **{argument: value})


@pytest.mark.judges("view")
def test_view_raises_module_not_found_without_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "uvicorn" or "renderer.viewer." in name]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    with pytest.raises(ModuleNotFoundError, match="the viewer needs the package uvicorn") as caught:
        renderer.view(STAIRS)
    assert caught.value.name == "uvicorn"


@pytest.mark.judges(
    "octree-render compile --all", "octree-render compile --pictures", "octree-render compile --queries"
)
@pytest.mark.parametrize("what", ["queries", "pictures", "all", None])
def test_compile_compiles_what_it_is_told_and_all_by_default(what: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    from renderer import precompile

    asked_for: list[str] = []
    monkeypatch.setattr(precompile, "compile_ahead_in_two", lambda what, folder, began: asked_for.append(what))
    assert main(["compile", "--quiet", *([f"--{what}"] if what else [])]) == 0
    assert asked_for == [what or "all"]
    parts = [set(map(str, precompile.PARTS[one])) for one in ("queries", "pictures", "all")]
    assert parts[0] < parts[1] < parts[2]


@pytest.mark.judges("octree-render compile --quiet")
def test_compile_is_quiet_on_a_terminal(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    from renderer import precompile
    from renderer.cli import compiling

    monkeypatch.setattr(precompile, "compile_ahead_in_two", lambda what, folder, began: [*map(began, "ab")])
    monkeypatch.setattr(compiling, "on_terminal", lambda: True)
    assert main(["compile", "--quiet"]) == 0
    assert capfd.readouterr() == ("", "")
    assert main(["compile"]) == 0
    loud = capfd.readouterr()
    assert "compiled in" in loud.out and ("part" in loud.err or sys.platform == "win32")
