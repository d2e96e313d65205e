"""The section on promises: rules of the contract that random rays and pictures may miss, each judged by itself."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from validation.gates import Gate
from validation.job import Job, Task
from validation.promises.hits.alone import check_alone
from validation.promises.hits.batches import check_batches, check_refits
from validation.promises.hits.bounds import check_bounds
from validation.promises.hits.counts import check_counts
from validation.promises.hits.errors import check_errors
from validation.promises.hits.files import check_files
from validation.promises.hits.kept import check_kept
from validation.promises.hits.limits import check_limits
from validation.promises.hits.outlines import check_outlines
from validation.promises.hits.places import check_places
from validation.promises.hits.planes import check_planes
from validation.promises.hits.refusals import check_refusals
from validation.promises.hits.shapes import check_shapes
from validation.promises.hits.starts import check_starts
from validation.promises.hits.trees import check_trees
from validation.promises.pictures.bounces import check_bounces
from validation.promises.pictures.cameras import check_cameras
from validation.promises.pictures.codes import check_codes
from validation.promises.pictures.filed import check_filed
from validation.promises.pictures.floors import check_floors
from validation.promises.pictures.images import check_images
from validation.promises.pictures.nesting import check_nesting
from validation.promises.pictures.openings import check_openings
from validation.promises.pictures.placing import check_placing
from validation.promises.pictures.projections import check_projections
from validation.promises.pictures.reconstruction import check_filters
from validation.promises.pictures.refraction import check_refraction
from validation.promises.pictures.saved import check_saved
from validation.promises.pictures.shining import check_shining
from validation.promises.pictures.skies import check_skies
from validation.promises.pictures.surfaces import check_surfaces
from validation.promises.pictures.textures import check_textures
from validation.promises.queries.angles import check_angles, check_halves
from validation.promises.queries.edges import check_edges
from validation.promises.queries.inside import check_inside
from validation.promises.queries.nearest import check_nearest
from validation.promises.queries.piles import check_piles
from validation.promises.queries.series import check_series
from validation.promises.queries.signed import check_signed
from validation.promises.queries.views import check_views
from validation.promises.scenes.attributes import check_attributes
from validation.promises.scenes.choices import check_choices
from validation.promises.scenes.moments import check_moments
from validation.promises.scenes.queries import check_queries

_SEED = 2031
_RAYS = 4096
_PLACED = 60
_POLYGONS = 4000
_OPENED = 40
_REFRACTED = 1000
Rows = list[dict[str, Any]]


def _random() -> np.random.Generator:
    return np.random.default_rng(_SEED)


class Check(NamedTuple):
    """A check, and the public names that each of its promises judges."""

    ask: Callable[[], Rows]
    judged: tuple[str, ...]


def _of_both(*queries: str) -> tuple[str, ...]:
    """The public names of queries that a check asks a tree and brute force."""
    return tuple(f"{kind}.{query}" for query in queries for kind in ("Octree", "BruteForce"))


def _of_scenes(*queries: str) -> tuple[str, ...]:
    """The public names of methods of a scene."""
    return tuple(f"RayScene.{query}" for query in queries)


# What hits on scenes know.
_KNOWN_OF_HITS = (
    *(f"{kind}.{name}" for kind in ("SceneHits", "SceneAllHits", "SceneClosestPoints")
      for name in ("object", "instance", "face", "u", "v", "points", "normals", "colors", "texcoords", "interpolate",
                   "take")),
    "SceneHits.hit", "SceneHits.through", "SceneAllHits.counts", "SceneAllHits.ray", "SceneClosestPoints",
)  # fmt: skip
_RAYS_ASKED = _of_both("closest_hit", "any_hit", "count_hits", "all_hits")
HITS = {
    "places of hits": Check(
        lambda: check_places(_random(), _RAYS),
        (*_of_both("closest_hit", "all_hits"), "Hits.points", "Hits.normals", "AllHits.points", "AllHits.normals"),
    ),
    "bounds of rays": Check(lambda: check_bounds(_random(), _RAYS), _of_both("closest_hit", "any_hit", "count_hits")),
    "planes from afar": Check(check_planes, ("Octree.closest_hit", "Octree.any_hit")),
    "errors of t": Check(lambda: check_errors(_random()), _of_both("closest_hit", "all_hits")),
    "ends of float64": Check(check_limits, _RAYS_ASKED),
    "starts": Check(lambda: check_starts(_random()), _RAYS_ASKED),
    "sizes of batches": Check(
        check_batches,
        (
            "Octree.closest_hit",
            "Octree.any_hit",
            "Octree.count_hits",
            "Octree.all_hits",
            "AllHits.ray",
            "Octree.closest_point",
            "Octree.visible",
        ),
    ),
    "rays alone": Check(lambda: check_alone(_random()), ("Octree.closest_hit", "Octree.any_hit")),
    "refits": Check(check_refits, ("Octree.refit",)),
    "trees": Check(lambda: check_trees(_random()), ("Octree", "Octree.tree", "Octree.refit")),
    "counts": Check(lambda: check_counts(_random()), ("Octree.stats", "Octree.from_mesh", *_of_both("count_steps"))),
    "mesh files": Check(lambda: check_files(_random()), ("load_mesh", "MeshMaterial", "Texture")),
    "kept arrays": Check(
        lambda: check_kept(_random()), ("Mesh", "Octree", "BruteForce", "Octree.save", "Octree.load", "Octree.refit")
    ),
    "shapes of rays": Check(lambda: check_shapes(_random()), (*_RAYS_ASKED, *_of_both("closest_point"))),
    "refusals": Check(lambda: check_refusals(_random()), (*_RAYS_ASKED, *_of_both("count_steps", "refit"))),
    "polygons": Check(lambda: check_outlines(_random(), _POLYGONS), ("load_mesh",)),
}
QUERIES = {
    "points inside": Check(lambda: check_inside(_random()), _of_both("contains")),
    "open edges": Check(
        lambda: check_edges(_random()), ("Mesh.is_closed", "Mesh.open_edges", "Mesh.odd_edges", "Octree.contains")
    ),
    "winding numbers": Check(lambda: check_angles(_random()), ("Octree.winding_number",)),
    "sides of a half": Check(lambda: check_halves(_random()), ("Octree.contains", "Octree.winding_number")),
    "series": Check(lambda: check_series(_random()), ("Octree.winding_number",)),
    "nearest faces": Check(lambda: check_nearest(_random()), (*_of_both("closest_point"), "ClosestPoints")),
    "signed distances": Check(lambda: check_signed(_random()), _of_both("signed_distance")),
    "views": Check(lambda: check_views(_random()), _of_both("visible")),
    "piles of hits": Check(lambda: check_piles(_random()), _of_both("all_hits")),
}
PICTURES = {
    "cameras": Check(
        lambda: check_cameras(_random(), _PLACED),
        (
            "PerspectiveCamera",
            "OrthographicCamera",
            "PinholeCamera",
            "FisheyeCamera",
            "OpenCVCamera",
            "OpenCVFisheyeCamera",
            "EquirectangularCamera",
            "Image",
        ),
    ),
    "points on films": Check(
        lambda: check_projections(_random(), _PLACED),
        tuple(
            f"{kind}.{name}" for kind in ("OpenCVCamera", "OpenCVFisheyeCamera") for name in ("from_opencv", "project")
        ),
    ),
    "objects placed": Check(
        lambda: check_placing(_random(), _PLACED), ("SceneObject", "Scene.instances", "Mesh.transformed")
    ),
    "floors and samples": Check(
        check_floors, ("Floor", "scene.floor.materials", "scene.floor.squares", "scene.render.samples")
    ),
    "filters": Check(check_filters, ("scene.render.filter",)),
    "bounces": Check(check_bounces, ("scene.render.max_depth", "scene.render.min_weight", "prepare")),
    "lights": Check(check_shining, ("DirectionalLight", "PointLight", "scene.render.glass_shadows")),
    "skies": Check(
        check_skies,
        ("Sky", "scene.sky", "Scene.all_lights", "Mesh.creased", "scene.objects.crease", "scene.render.terminator"),
    ),
    "textures": Check(lambda: check_textures(_random()), ("Texture", "Texture.checker", "TextureImage")),
    "surfaces": Check(
        lambda: check_surfaces(_random()),
        ("Phong", "Texture", "scene.render.glass_shadows", "Mirror.receives_light", "Dielectric.receives_light"),
    ),
    "materials of files": Check(lambda: check_filed(_random()), ("MeshMaterial", "scene.objects.material")),
    "planes of pictures": Check(lambda: check_images(_random()), ("Image", "scene.render.max_rays")),
    "files of pictures": Check(check_saved, ("Image.save",)),
    "nested media": Check(check_nesting, ("Dielectric",)),
    "refraction": Check(lambda: check_refraction(_random(), _REFRACTED), ("Dielectric",)),
    "codes": Check(check_codes, ("srgb", "Image.toned")),
    "boxes shown": Check(lambda: check_openings(_random(), _OPENED), ()),
}
SCENES = {
    "choices of instances": Check(
        lambda: check_choices(_random()),
        (
            *_of_scenes("closest_hit", "any_hit", "count_hits", "all_hits"),
            *_of_scenes("add", "add_scene", "mask", "show", "remove"),
            "SceneAllHits",
        ),
    ),
    "scenes that change": Check(
        lambda: check_moments(_random()),
        (
            "RayScene",
            *_of_scenes("add", "move", "refit", "show", "remove", "objects", "name", "mesh", "transforms"),
            "SceneHits",
        ),
    ),
    "attributes of hits": Check(
        lambda: check_attributes(_random()),
        (*_KNOWN_OF_HITS, *_of_scenes("closest_hit", "all_hits", "closest_point")),
    ),
    "points and placed bodies": Check(
        lambda: check_queries(_random()),
        _of_scenes(
            "contains", "signed_distance", "closest_point", "winding_number", "visible", "count_steps", "merged"
        ),
    ),
}
_CHECKS = {**HITS, **QUERIES, **PICTURES, **SCENES}
_REASON = "a promise holds in every check"


def steps(job: Job) -> int:
    """Number of calls of ``job.step``: one for each check."""
    return len(_CHECKS)


def run(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Ask everything; returns a record for JSON, and a gate for each promise that it was never broken."""
    parts = job.each([Task(_step(name), partial(_asked, name)) for name in _CHECKS])
    rows = [row for part in parts for row in part]
    return {"rows": rows, "costs": dict.fromkeys(row["judge"] for row in rows)}, gates(rows)


def judge(checks: dict[str, Check], job: Job) -> Rows:
    """The rows of some checks."""
    rows: Rows = []
    for name, check in checks.items():
        job.step(_step(name))
        rows += _rows(check)
    return rows


def _asked(name: str) -> Rows:
    return _rows(_CHECKS[name])


def _rows(check: Check) -> Rows:
    return [row | {"judged": check.judged} for row in check.ask()]


def _step(name: str) -> str:
    return f"promises: {name}"


def gates(rows: Rows) -> list[Gate]:
    """A gate for each row, on its figure or on the count of its broken checks."""
    found = []
    for row in rows:
        quantity, value, most = row.get("figure", ("broken checks", row["broken"], 0.0))
        found.append(Gate("promises", row["promise"], quantity, value, "at most", most, _REASON, row["judged"]))
    return found
