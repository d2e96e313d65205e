"""Each check of promises finds a rule that is broken."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer.diagnostics import tree_boxes
from renderer.mesh import obj, polygons
from renderer.octree import Octree
from renderer.picture import camera_rays, image, maps, pack, prepare
from renderer.queryable import Queries
from renderer.results import hits
from renderer.scene import file_material, filters, scene
from renderer.scene.cameras import distortion
from renderer.trace.layout import Tree
from validation.promises.hits import (
    alone,
    batches,
    bounds,
    counts,
    errors,
    files,
    kept,
    limits,
    outlines,
    places,
    planes,
    refusals,
    shapes,
    starts,
    trees,
)
from validation.promises.pictures import (
    bounces,
    cameras,
    codes,
    filed,
    floors,
    images,
    nesting,
    openings,
    placing,
    projections,
    reconstruction,
    refraction,
    saved,
    shining,
    surfaces,
    textures,
)
from validation.promises.row import row

CHECKS: dict[str, Callable[[], list[dict[str, Any]]]] = {
    "places": lambda: places.check_places(np.random.default_rng(5), 256),
    "bounds": lambda: bounds.check_bounds(np.random.default_rng(5), 256),
    "errors": lambda: errors.check_errors(np.random.default_rng(5)),
    "limits": limits.check_limits,
    "counts": lambda: counts.check_counts(np.random.default_rng(5)),
    "alone": lambda: alone.check_alone(np.random.default_rng(5)),
    "kept": lambda: kept.check_kept(np.random.default_rng(5)),
    "shapes": lambda: shapes.check_shapes(np.random.default_rng(5)),
    "refusals": lambda: refusals.check_refusals(np.random.default_rng(5)),
    "saved": saved.check_saved,
    "codes": codes.check_codes,
    "planes": planes.check_planes,
    "files": lambda: files.check_files(np.random.default_rng(5)),
    "starts": lambda: starts.check_starts(np.random.default_rng(5)),
    "batches": lambda: batches.check_batches((17, 1025)),
    "refits": batches.check_refits,
    "trees": lambda: trees.check_trees(np.random.default_rng(5)),
    "outlines": lambda: outlines.check_outlines(np.random.default_rng(5), 1500),
    "openings": lambda: openings.check_openings(np.random.default_rng(5), 20),
    "cameras": lambda: cameras.check_cameras(np.random.default_rng(5), 20),
    "placing": lambda: placing.check_placing(np.random.default_rng(5), 12),
    "floors": floors.check_floors,
    "bounces": bounces.check_bounces,
    "filters": reconstruction.check_filters,
    "nesting": nesting.check_nesting,
    "shining": shining.check_shining,
    "images": lambda: images.check_images(np.random.default_rng(5)),
    "filed": lambda: filed.check_filed(np.random.default_rng(5)),
    "projections": lambda: projections.check_projections(np.random.default_rng(5), 20),
    "textures": lambda: textures.check_textures(np.random.default_rng(5)),
    "surfaces": lambda: surfaces.check_surfaces(np.random.default_rng(5)),
    "refraction": lambda: refraction.check_refraction(np.random.default_rng(5), 100),
}


def broken(name: str) -> set[str]:
    """The first words of the promises that a check finds broken."""
    return {" ".join(row["promise"].split()[:2]) for row in CHECKS[name]() if row["broken"]}


def test_bounds_that_are_open_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = Octree.closest_hit

    def shrunk(self: Octree, o: Any, d: Any, *, t_min: Any, t_max: Any = np.inf) -> Any:
        return sound(self, o, d, t_min=np.nextafter(t_min, np.inf), t_max=t_max)

    monkeypatch.setattr(Octree, "closest_hit", shrunk)
    assert "[t_min, t_max]" in broken("bounds")


def test_a_start_on_its_face_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = Octree.all_hits

    def unmoved(self: Octree, *given: Any, leaving: Any, **options: Any) -> Any:
        return sound(self, *given, **options)

    monkeypatch.setattr(Octree, "all_hits", unmoved)
    assert broken("starts") == {"a ray", "each query"}


def test_a_refit_that_does_nothing_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Octree, "refit", lambda self, vertices: None)
    assert broken("refits") == {"a refit"}


def altered(tree: Tree, change: Callable[[Any, Any, Any], None]) -> Tree:
    """A copy of a tree whose boxes, links and faces ``change`` alters."""
    nodes, faces = tree.nodes.copy(), tree.faces.copy()
    change(nodes.reshape(-1, 64)[:, :48].reshape(-1, 3, 2, 8), nodes.view(np.int32).reshape(-1, 64)[:, 48:56], faces)
    return replace(tree, nodes=nodes, faces=faces)


def one_leaf_wider(boxes: Any, links: Any, faces: Any) -> None:
    node, place = np.argwhere((links < 0) & (boxes[:, 0, 0] <= boxes[:, 0, 1]))[-1]
    boxes[node, 1, 1, place] += 4 * np.spacing(np.abs(boxes[node, 1, 1, place]))


def an_empty_octant_with_a_box(boxes: Any, links: Any, faces: Any) -> None:
    node, place = np.argwhere(boxes[:, 0, 0] > boxes[:, 0, 1])[0]
    boxes[node, 2, :, place] = 0.0


def two_faces_exchanged(boxes: Any, links: Any, faces: Any) -> None:
    faces[[0, -4]] = faces[[-4, 0]]


def one_face_twice(boxes: Any, links: Any, faces: Any) -> None:
    faces[0] = faces[-4]


def one_block_twice(boxes: Any, links: Any, faces: Any) -> None:
    node, place = np.argwhere((links < 0) & (boxes[:, 0, 0] <= boxes[:, 0, 1]))[-1]
    links[node, place] = ~((~links[node, place] >> 3 << 3) - 8)


@cases(
    ("change", "expected"),
    [
        (one_leaf_wider, "a leaf's"),
        (an_empty_octant_with_a_box, "an octant"),
        (two_faces_exchanged, "blocks hold"),
        (one_face_twice, "every face"),
        (one_block_twice, "every place"),
    ],
)
def test_a_tree_that_is_altered_is_found(change: Any, expected: str, monkeypatch: pytest.MonkeyPatch) -> None:
    octree = Octree(np.random.default_rng(5).normal(size=(900, 3)), np.arange(900).reshape(-1, 3))
    octree.tree = altered(octree.tree, change)
    monkeypatch.setattr(trees, "_octrees", lambda rng: [octree])
    assert expected in broken("trees")


def test_fans_over_notches_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def fans(positions: Any, corners: Any, starts: Any) -> Any:
        lengths = np.diff(starts)
        return polygons.Cut(polygons._fans(starts), np.repeat(np.arange(len(lengths)), lengths - 2), np.zeros(0, int))

    monkeypatch.setattr(obj, "triangulate", fans)
    assert broken("outlines") == {"triangles cover"}


def test_boxes_beyond_the_best_hit_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tree_boxes, "_limit", lambda ray, t: np.inf)
    assert broken("openings") == {"a ray"}


def test_scaling_in_another_order_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = scene.SceneObject.matrix

    def other(self: scene.SceneObject) -> Any:
        turned = sound(self.model_copy(update={"scale": (1.0, 1.0, 1.0)}))
        turned[:3, :3] = np.diag(self.scale) @ turned[:3, :3]
        return turned

    monkeypatch.setattr(scene.SceneObject, "matrix", other)
    assert "objects are" in broken("placing")


def test_samples_at_one_place_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filters, "sample_offsets", lambda samples: np.full((samples, 2), 0.5))
    assert broken("floors") == {"samples lie"}


def test_a_filter_of_another_width_or_weight_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = camera_rays.film_samples
    changes = [lambda p, w: (0.8 * (p - 0.5) + 0.5, w), lambda p, w: (p, np.ones_like(w))]
    for change in changes:
        monkeypatch.setattr(camera_rays, "film_samples", lambda *told, change=change: change(*sound(*told)))
        assert broken("filters") == {"a pixel"}


def test_a_light_that_is_left_out_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = pack.light_rows
    monkeypatch.setattr(pack, "light_rows", lambda scene, needs: sound(scene, needs) * ([1.0] * 4 + [1.0, 0.0, 0.0]))
    assert "a light" in broken("shining")


def test_images_in_another_space_or_without_alpha_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = maps._linear
    monkeypatch.setattr(maps, "linear_of_srgb", lambda encoded: encoded)
    assert broken("textures") == {"integers of"} and broken("surfaces") == {"colours of"}
    monkeypatch.setattr(maps, "_linear", lambda pixels, is_srgb: sound(pixels[..., :3], is_srgb))
    assert {"rays pass", "light shines", "a surface"} <= broken("surfaces")


def test_mip_maps_that_blur_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(maps._FILTERS, "mipmap", maps.LINEAR)
    assert broken("textures") == {"a pixel", "one sample"}


def test_materials_of_files_of_another_look_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = file_material.material_of

    def other(own: Any, colors: Any = None) -> Any:
        return sound(replace(own, alpha_mode="opaque", metallic=0.5 * own.metallic, unlit=False), colors)

    monkeypatch.setattr(file_material, "material_of", other)
    assert broken("filed") == {"an unlit", "a file's", "metal scatters,"}


def test_lenses_that_bend_otherwise_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = distortion.Distortion.bent
    monkeypatch.setattr(distortion.Distortion, "bent", lambda lens, x, y: sound(lens._replace(p1=lens.p2), x, y))
    assert broken("projections") == {"points appear"} and broken("cameras") == {"the depth"}


def test_media_around_the_eye_in_another_order_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    # Stripes as narrow as ever, of a floor that reaches no farther than the rays.
    monkeypatch.setattr(nesting, "_WIDTH", nesting._WIDTH / 2)
    monkeypatch.setattr(nesting, "_STRIPES", nesting._STRIPES // 2)
    sound = pack.media_around
    for module, promise in ((pack, "an eye"), (prepare, "another camera")):
        with monkeypatch.context() as patch:
            patch.setattr(module, "media_around", lambda *given: sound(*given)[::-1].copy())
            assert broken("nesting") == {promise}


def test_a_tree_that_forgets_its_repairs_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded = Octree.load

    def forgetful(path: Any, **options: Any) -> Octree:
        octree = loaded(path, **options)
        octree.repairs = None
        return octree

    monkeypatch.setattr(Octree, "load", forgetful)
    assert broken("kept") == {"a loaded"}


def test_counts_of_places_and_of_padding_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = counts.BruteForce.count_steps

    def padded(self: Any, *given: Any) -> Any:
        steps = sound(self, *given)
        return replace(steps, triangles=-(-steps.triangles // 4) * 4)

    stats = Octree.stats.fget  # type: ignore[attr-defined]
    monkeypatch.setattr(counts.BruteForce, "count_steps", padded)
    monkeypatch.setattr(Octree, "stats", property(lambda self: replace(stats(self), leaves=8)))
    assert broken("counts") == {"stats counts", "brute force"}


def test_codes_a_step_off_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = image.srgb
    for exact in ("_start", "_reinhard", "_aces"):  # are asked with the same numbers in both cases
        monkeypatch.setattr(codes, exact, cache(getattr(codes, exact)))
    monkeypatch.setattr(codes, "srgb", lambda linear: sound(np.asarray(linear, np.float64) * (1.0 + 1e-9)))
    assert broken("codes") == {"sRGB codes"}
    monkeypatch.setattr(codes, "srgb", lambda linear: sound(np.asarray(linear, np.float64) * (
        1.0 + 1e-7 * (getattr(linear, "dtype", None) == np.float32))))  # fmt: skip
    assert broken("codes") == {"float32 numbers"}


def test_a_tone_curve_a_step_off_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = codes.toned
    monkeypatch.setattr(codes, "toned", lambda radiance, tone: sound(radiance * np.float32(1.001), tone))
    assert broken("codes") == {"tone curves"}


def test_a_cosine_without_its_last_digits_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def lossy(d: Any, n: Any, n1: float, n2: float) -> Any:
        return np.sqrt(max(1e-300, 1.0 - (n1 / n2) ** 2 * d[0] ** 2)), None

    monkeypatch.setattr(refraction, "refract", lossy)
    assert broken("refraction") == {"the cosine"}


def test_planes_that_show_something_else_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = images.render

    def other(scene: Any, **given: Any) -> Any:
        image = sound(scene, **{name: value for name, value in given.items() if value})
        return replace(image, normal=np.abs(image.normal), rays=image.rays + 1, cut=1, depth=image.depth * 2.0)

    monkeypatch.setattr(images, "render", other)
    assert {"a picture's", "a picture", "only surfaces", "arguments of", "pixels are"} <= broken("images")
    monkeypatch.setattr(saved, "render", other)
    assert broken("saved") == {"an EXR"}


def test_what_is_not_refused_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    moved, asked = Octree.refit, Octree.count_hits

    def quiet(self: Any, *given: Any, **options: Any) -> Any:
        try:
            return asked(self, *given, **options)
        except ValueError:
            return None

    def anyhow(self: Octree, vertices: Any) -> None:
        moved(self, self.mesh.vertices * 2.0)
        moved(self, vertices)

    monkeypatch.setattr(Octree, "count_hits", quiet)
    assert broken("refusals") == {"a ray", "numbers that", "bounds that"}
    monkeypatch.setattr(Octree, "refit", anyhow)
    assert broken("refusals") == {"a ray", "numbers that", "bounds that", "vertices that"}


def test_files_that_are_understood_otherwise_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = files.load_mesh

    def other(path: Any) -> Any:
        mesh = sound(path)
        colors = None if mesh.colors is None else mesh.colors * np.float32(255 / 256)
        return replace(mesh, normals=None, faces=mesh.faces[:, ::-1], colors=colors)

    monkeypatch.setattr(files, "load_mesh", other)
    assert broken("files") == {"an OBJ", "every second", "an index", "colours of"}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # an infinity less itself, where a hit is lost
@cases("every", [1, 2])
@cases("name", ["places", "bounds", "errors", "limits", "alone", "planes", "batches", "refits"])
def test_hits_that_are_lost_are_broken_promises_and_no_exceptions(
    name: str, every: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Judges that raise judge nothing: a defect with which half of the hits were lost turned no gate red."""
    sound = Queries.closest_hit

    def losing(*given: Any, **options: Any) -> hits.Hits:
        found = sound(*given, **options)
        lost = np.arange(found.t.size).reshape(found.t.shape) % every == 0
        some = {"t": (found.t, np.inf), "face": (found.face, -1), "u": (found.u, np.nan), "v": (found.v, np.nan)}
        if found.t_error is not None:
            some["t_error"] = (found.t_error, np.nan)
        return replace(found, **{key: np.where(lost, none, values) for key, (values, none) in some.items()})

    monkeypatch.setattr(Queries, "closest_hit", losing)
    monkeypatch.setattr(planes, "_SIDE", 40)
    monkeypatch.setattr(planes, "_PIXELS", 16)
    monkeypatch.setattr(errors, "_ALONG", 100)
    monkeypatch.setattr(bounds, "_PLANES", 10)
    assert broken(name)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of the last place of an infinity
@cases("member", ["t", "t_error"])
@cases("value", [np.nan, np.inf])
def test_hits_at_no_number_are_broken_promises(member: str, value: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(errors, "_ALONG", 100)
    for query in ("closest_hit", "all_hits"):
        sound = getattr(Queries, query)

        def spoilt(*given: Any, sound: Any = sound, **options: Any) -> Any:
            found = sound(*given, **options)
            return replace(found, **{member: np.full_like(getattr(found, member), value)})

        monkeypatch.setattr(Queries, query, spoilt)
    # An error of t that is infinite bounds any, but is not that of the ray.
    assert broken("errors") >= {"t_error belongs", "t_error of"} | ({"t_error bounds"} if np.isnan(value) else set())


def test_a_promise_that_was_never_asked_is_broken() -> None:
    assert row("a promise", "nobody", np.array([]))["broken"] == 1
    assert row("a promise", "somebody", np.array([True, False]))["broken"] == 1
    assert row("a promise", "somebody", np.array([True]))["broken"] == 0
