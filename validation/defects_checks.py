"""What runs against a defect: small versions of the suite's sections, with the suite's own judges and thresholds.

Each check returns gates. They stand for those of the sections: the same quantities and thresholds over fewer rays and
one small picture, so that one defect takes seconds.
"""

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from renderer.camera import PerspectiveCamera, primary_rays
from renderer.image import srgb
from renderer.mesh import Mesh
from renderer.octree import Octree
from renderer.render import render
from renderer.scene import Scene, load_scene
from renderer.shapes import icosphere
from validation import compare_hits, compare_images, exact, gates, numerical, stability, watertight
from validation.cases import SCENES
from validation.compare_hits import HitArrays
from validation.embree import Embree
from validation.extreme_judgement import against_brute_force, octrees
from validation.gates import Gate
from validation.rays import RayBatch, face_rays, families, float32_exact

SEED = 2029
# Glass, mirror, highlights, two lights, ambient light, smooth and flat meshes: what every rung of the pictures needs.
_SCENE = SCENES / "glass.toml"
_SIZE = 128
# Enough for packets and streams in every family; a defect that one ray in a thousand shows is still found.
_RAYS, _EXACT, _LEAKS = 3_000, 40, 200_000
# The sound renderer leaves up to 961 disagreements a family to exact arithmetic; beyond these all count as wrong.
_JUDGED = 1_500
# Seconds each, and what they say about size no defect here touches.
_LARGE = (21, 22, 23, 24, 32)


def hits() -> Iterator[Gate]:
    """Ray families against Embree and exact arithmetic: a round mesh and triangles in no order."""
    ball = icosphere(4)
    rng = np.random.default_rng(SEED)
    corners = float32_exact(rng.normal(size=(400, 1, 3)) + 0.1 * rng.normal(size=(400, 3, 3)))
    soup = Mesh(corners.reshape(-1, 3), np.arange(1200, dtype=np.int32).reshape(-1, 3))
    for name, mesh in (("sphere", Mesh(float32_exact(ball.vertices), ball.faces)), ("triangle soup", soup)):
        octree, embree = Octree.from_mesh(mesh), Embree(mesh.vertices, mesh.faces, robust=True)
        for rays in (*families(mesh.vertices, mesh.faces, _RAYS, SEED), face_rays(mesh.vertices, mesh.faces)):
            yield from _against(f"{name}, {rays.name} rays", mesh, octree, embree, rays)


def _against(subject: str, mesh: Mesh, octree: Octree, embree: Embree, rays: RayBatch) -> Iterator[Gate]:
    hits = octree.closest_hit(rays.origins, rays.directions)
    found, theirs = HitArrays(hits.t, hits.face), HitArrays(*embree.closest_hit(rays.origins, rays.directions))
    compared = compare_hits.compare(found, theirs, mesh.vertices, mesh.faces, rays)
    judged = compare_hits.judge(compared, mesh.vertices, mesh.faces, most=_JUDGED)
    yield _none("hits", subject, "rays on which we are wrong", judged.ours_wrong)
    picked = np.linspace(0, len(rays) - 1, min(_EXACT, len(rays))).astype(int)
    part = rays.select(picked)
    truth = exact.closest_hits(mesh.vertices, mesh.faces, part.origins, part.directions)
    ours = HitArrays(found.t[picked], found.face[picked])
    errors = compare_hits.exact_errors(ours, truth, mesh.vertices, mesh.faces, part)
    yield _none("hits", subject, "of the exact sample, rays on which we are wrong", errors.wrong)
    occluded = octree.any_hit(rays.origins, rays.directions)
    yield _none("hits", subject, "any-hit differs from closest hit", int((occluded != found.hit).sum()))


def leaks() -> Iterator[Gate]:
    """Rays from inside a closed mesh at its edges and vertices, near zero and far away."""
    for level, offset in ((5, 0.0), (3, 1e4)):
        placed = watertight.Placement(
            watertight.Closed(f"icosphere {level}", icosphere(level), lambda rng, n: rng.uniform(-0.4, 0.4, (n, 3))),
            turned=True, offset=offset, scale=1.0,
        )  # fmt: skip
        octree = Octree(placed.vertices(), placed.closed.mesh.faces)
        for kind in watertight.KINDS:
            rays = placed.rays(kind, _LEAKS, np.random.default_rng(SEED))
            subject = f"icosphere {level} moved by {offset:g}, {kind} rays from inside"
            yield _none("hits", subject, "leaks", watertight.leaks(octree, rays))


def builds() -> Iterator[Gate]:
    """Trees of all options, and a refitted one, against brute force and a new build, bit for bit."""
    mesh = icosphere(3)
    thrice = Mesh(mesh.vertices, np.tile(mesh.faces, (3, 1)))
    for name, one in (("sphere", mesh), ("sphere, each face thrice", thrice)):
        rays = families(one.vertices, one.faces, _RAYS, SEED)
        for batch in rays[:2]:
            differing, _ = against_brute_force(one, batch, octrees(one))
            yield _none("hits", f"{name}, {batch.name} rays", "differ from brute force", differing)
    moved = mesh.vertices * np.array([2.0, 0.5, 1.0]) + np.array([3.0, 0.0, 0.0])
    refitted, anew = Octree.from_mesh(mesh), Octree(moved, mesh.faces)
    refitted.refit(moved)
    for batch in families(moved, mesh.faces, _RAYS, SEED)[:2]:
        first = refitted.closest_hit(batch.origins, batch.directions)
        second = anew.closest_hit(batch.origins, batch.directions)
        differing = int(((first.t != second.t) | (first.face != second.face)).sum())
        yield _none("hits", f"refitted sphere, {batch.name} rays", "differ from a new build", differing)


def packets() -> Iterator[Gate]:
    """Rays in the squares of sixteen pixels that go through the tree together, against brute force, bit for bit.

    A row of a small picture is too wide for that, so the camera rays of ``hits`` mostly go alone.
    """
    ball = icosphere(3)
    thrice = Mesh(ball.vertices, np.tile(ball.faces, (3, 1)))
    origins, directions = primary_rays(PerspectiveCamera(eye=(1.5, 1.0, 2.5), target=(0.0, 0.0, 0.0)), _SIZE, _SIZE)
    squares = (_SIZE // 4, 4, _SIZE // 4, 4)
    order = np.arange(_SIZE * _SIZE).reshape(squares).transpose(0, 2, 1, 3).ravel()
    rays = RayBatch("packet", origins[order], directions[order])
    trees = octrees(thrice)
    differing, _ = against_brute_force(thrice, rays, trees)
    yield _none("hits", "sphere, each face thrice, packet rays", "differ from brute force", differing)
    higher = sum(int((tree.closest_hit(rays.origins, rays.directions).face >= len(ball.faces)).sum()) for tree in trees)
    yield _none("hits", "sphere, each face thrice, packet rays", "another face than the lowest", higher)


def curves() -> Iterator[Gate]:
    """Error of t against offset, scale, angle and sliver height, by exact arithmetic."""
    for index, sweep in enumerate(stability.SWEEPS):
        xs = sweep.xs[:: max(1, len(sweep.xs) // 3)]
        seeded = ((x, np.random.default_rng([SEED, index, i])) for i, x in enumerate(xs))
        yield from stability.judge(sweep.name, [stability.point(sweep, x, 30, rng) for x, rng in seeded])


def camera() -> Iterator[Gate]:
    """Our primary rays against those of Mitsuba's own sensor."""
    from validation import mitsuba_camera

    shift = mitsuba_camera.largest_distance(load_scene(_SCENE).camera, _SIZE)
    reason = "our primary rays are Mitsuba's; both pictures are made with ours"
    yield Gate("images", "camera", "pixels between rays", shift, "at most", gates.CAMERA_PIXELS, reason)


def aovs() -> Iterator[Gate]:
    """Distance and shading normal at every primary hit against Mitsuba's."""
    from validation import mitsuba_whitted

    scene = load_scene(_SCENE)
    ours = render(scene, resolution=(_SIZE, _SIZE), samples=1, max_depth=0)
    theirs = mitsuba_whitted.aovs(scene, _SIZE, _SIZE)
    hit, other = ours.face >= 0, theirs.instance >= 0
    both = hit & other
    depth = np.abs(ours.depth[both] - theirs.depth[both]) / theirs.depth[both]
    normal = np.linalg.norm(ours.normal[both] - theirs.shading_normal[both], axis=-1)
    shares = {
        "pixels that only one of us hits": float(np.mean(hit != other)),
        "pixels whose distance is off": float(np.sum(~(depth <= gates.AOV_DEPTH)) / hit.size),
        "pixels whose normal is off": float(np.sum(~(normal <= gates.AOV_NORMAL)) / hit.size),
    }
    for quantity, share in shares.items():
        reason = "a float32 ray may flip an edge pixel"
        yield Gate("images", "AOVs", quantity, share, "at most", gates.AOV_SHARE, reason)


def pictures() -> Iterator[Gate]:
    """The Whitted picture over Mitsuba, under the same and under our own offset rule; and its 8-bit encoding."""
    from validation import mitsuba_whitted

    scene = load_scene(_SCENE)
    theirs = mitsuba_whitted.whitted(scene, _SIZE, _SIZE, max_depth=scene.render.max_depth)

    def picture(offset: float | Literal["mitsuba"], shift: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float32]:
        return render(_turned(scene, shift), resolution=(_SIZE, _SIZE), samples=1, offset=offset).radiance

    own = render(scene, resolution=(_SIZE, _SIZE), samples=1)
    fragile = compare_images.fragile_pixels(picture)
    for rule, ours, limits in (("matched", picture("mitsuba"), gates.MATCHED), ("own", own.radiance, gates.OWN)):
        result = compare_images.compare(ours, theirs, fragile, own.face >= 0)
        for quantity, limit in limits.items():
            bound: Literal["at least", "at most"] = "at least" if quantity.startswith("ssim") else "at most"
            value = getattr(result, quantity)
            yield Gate("images", f"{rule} offset", quantity, value, bound, limit, gates.REASONS[quantity])
    share = float(fragile.mean())
    reason = "the maximum is judged outside these pixels, so they must stay few"
    yield Gate("images", "own offset", "fragile_share", share, "at most", gates.FRAGILE_SHARE, reason)
    off = float(np.abs(srgb(theirs) / 255.0 - compare_images.srgb(theirs)).max()) * 255.0
    # Half a step is what rounding to whole numbers leaves, and float64's rounding of that half beside it.
    limit, reason = 0.5 + 1e-9, "what a saved picture shows"
    yield Gate("images", "8-bit sRGB", "steps from the formula", off, "at most", limit, reason)


def _turned(scene: Scene, shift: tuple[float, float]) -> Scene:
    """The scene with its camera turned by ``shift`` pixels, to first order; its meshes are not loaded again."""
    if shift == (0.0, 0.0):
        return scene
    camera = scene.camera
    right, up, _ = camera.frame()
    away = float(np.linalg.norm(np.subtract(camera.target, camera.eye)))
    pixel = 2.0 * away * np.tan(np.radians(camera.fov) / 2.0) / _SIZE  # type: ignore[union-attr]
    target = np.asarray(camera.target) + pixel * (shift[0] * right - shift[1] * up)
    copy = scene.model_copy(update={"camera": camera.model_copy(update={"target": tuple(target.tolist())})})
    copy.__dict__["instances"] = scene.instances
    return copy


def extreme(first: int, last: int) -> Iterator[Gate]:
    """The extreme cases from ``first`` to ``last``, less those whose meshes are too large for here."""
    for case in numerical.CASES:
        if first <= case.number <= last and case.number not in _LARGE:
            holds = float(bool(case.record(True)["holds"]))
            yield Gate("stability", f"extreme case {case.number}", "holds", holds, "at least", 1.0, case.tolerance)


def _none(section: str, subject: str, quantity: str, value: float) -> Gate:
    return Gate(section, subject, quantity, float(value), "at most", 0.0, "exact arithmetic or brute force says so")


# A defect of the picture's modules cannot change a hit, and one of a hit needs no picture to be seen.
GROUPS: dict[str, tuple[Callable[[], Iterator[Gate]], ...]] = {
    "hits": (hits, leaks, builds, packets, curves, lambda: extreme(1, 32)),
    "pictures": (camera, aovs, pictures, lambda: extreme(33, 45)),
}


def run(groups: tuple[str, ...]) -> list[Gate]:
    """The gates of every check in ``groups``."""
    return [gate for group in groups for check in GROUPS[group] for gate in check()]
