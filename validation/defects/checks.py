"""The checks that run against a defect: the suite's own sections with a small effort, so that each takes seconds.

The gates are the sections' gates, with their names and the suite's thresholds.
"""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.scene.scene import load_scene
from validation.gates import Gate
from validation.hits import mirrors, seams, starts, watertight
from validation.hits.rays import float32_exact
from validation.hits.refit import check_refit
from validation.hits.scenes import check_parts, check_scenes
from validation.hits.section import HitEffort, check_leaks, check_mesh
from validation.hits.walks import check_walks
from validation.job import Job
from validation.pictures.plan import PictureEffort
from validation.pictures.section import check_cameras, check_scene
from validation.pictures.unseen import check_unseen
from validation.promises import section as promises
from validation.queries import section
from validation.references.table import REFERENCES
from validation.scenes import SCENES
from validation.stability import sweeps
from validation.stability.section import CASES, check_case
from validation.studies import section as study_section
from validation.studies.factors import judge
from validation.studies.lit import judge as lit_judge
from validation.thresholds import Thresholds

SEED = 2029
# The scene glass has what every rung of the ladder needs: mirrors, highlights, two lights, ambient light, smooth and
# flat meshes. Random paths through it make a separate picture. The scene stairs has the other camera.
_SCENES = {"glass": PictureEffort(size=128, lower=64), "stairs": PictureEffort(size=64)}
# Enough for packets and streams in every family; a defect that shows on one ray in a thousand is still found. One
# reference is enough to raise a disagreement; exact arithmetic decides which side is wrong.
_EMBREE = tuple(reference for reference in REFERENCES if reference.key == "embree_robust")
_HITS = HitEffort(rays=3_000, exact=40, leaks=20_000, references=_EMBREE)
# Without other libraries: they judge nothing here.
_QUERIES = section.QueryEffort(random=3_000, nasty=12_000, beside=0, distances=240, rays=40, drop_in=1)
# Some hundred rays from each body, a few of which are judged to their end.
_STARTS = starts.StartEffort(rays=20_000, exact=1_200)
_WALKS, _MIRRORS = 12, 150
# Leak rays of each kind in each placement: the rarest of these defects leaks one in 20,000.
_LEAKS = 200_000
# The extreme case of a million triangles; no defect here affects what it tests about size.
_LARGE = 32


def run(group: str) -> list[Gate]:
    """The gates of every check in ``group``, a key of ``GROUPS``."""
    with TemporaryDirectory(prefix="defect-") as folder:
        job = Job(True, Thresholds(), Path(folder), lambda _: None)
        return [gate for check in GROUPS[group] for gate in check(job)]


def pictures(job: Job) -> Iterator[Gate]:
    """Two scenes: AOVs, the ladder's rungs against their references, and random paths through glass. Cameras."""
    for name, effort in _SCENES.items():
        _, found = check_scene(name, "", load_scene(SCENES / f"{name}.toml"), effort, job)
        yield from found
    yield from check_cameras(job)


def extreme(first: int, last: int) -> Callable[[Job], Iterator[Gate]]:
    """A check of the extreme cases ``first`` to ``last``, without the one whose mesh is too large here."""

    def check(job: Job) -> Iterator[Gate]:
        for case in CASES:
            if first <= case.number <= last and case.number != _LARGE:
                yield check_case(case, job.quick)[1]

    return check


def sweep(job: Job) -> list[Gate]:
    """Rays from inside a closed mesh at its edges and vertices: near zero, and far away in a crowded tree."""
    spheres = {f"icosphere {level}": icosphere(level) for level in (5, 3)}
    counts: list[watertight.LeakCount] = []
    for (name, mesh), offset in zip(spheres.items(), (0.0, 1e4), strict=True):
        closed = watertight.ClosedMesh(name, mesh, lambda rng, n: rng.uniform(-0.4, 0.4, (n, 3)))
        placement = watertight.Placement(closed, turned=True, offset=offset, scale=1.0)
        build = watertight.BuildOptions("midpoint", 4, 32)
        counts += watertight.shoot(placement, [build], _LEAKS / placement.weight, np.random.default_rng(SEED))
    return watertight.gates(counts)


def from_surfaces(job: Job) -> Iterator[Gate]:
    """Rays that start on surfaces, go through them, and are reflected within them."""
    yield from starts.check_starts(job, _STARTS)[1]
    yield from check_walks(job, _WALKS)[1]
    yield from mirrors.check_mirrors(job, _MIRRORS)[1]


def unseen(job: Job) -> list[Gate]:
    """Closed mirrors from within, glass on the ground, glass on glass."""
    return check_unseen(job)[1]


def curves(job: Job) -> list[Gate]:
    """Error of t against offset, scale, angle and sliver height."""
    return [gate for index in range(len(sweeps.SWEEPS)) for gate in sweeps.curve(index, job.quick)[1]]


def hits(job: Job) -> Iterator[Gate]:
    """Every family of rays on a model and on unordered triangles, and rays from inside closed meshes."""
    rng = np.random.default_rng(SEED)
    corners = float32_exact(rng.normal(size=(400, 1, 3)) + 0.1 * rng.normal(size=(400, 3, 3)))
    soup = Mesh(corners.reshape(-1, 3), np.arange(1200, dtype=np.int32).reshape(-1, 3))
    for name, mesh in (("teapot", load_mesh(SCENES / "models" / "teapot.ply")), ("triangle soup", soup)):
        yield from check_mesh(name, mesh, _HITS, job)[1]
    yield from check_leaks(_HITS, job)[1]
    yield from check_refit(job)[1]


def promised(checks: dict[str, promises.Check]) -> Callable[[Job], list[Gate]]:
    """A check of some promises."""
    return lambda job: promises.gates(promises.judge(checks, job))


def queries(job: Job) -> list[Gate]:
    """Inside, distances and all hits of some solids."""
    found: list[Gate] = section.judge(_QUERIES, job)[1]
    return found


def scenes(job: Job) -> Iterator[Gate]:
    """Rays at placed meshes, at seams between them, and through bodies of placed parts."""
    yield from check_scenes(job)[1]
    yield from seams.check_seams(job)[1]
    yield from check_parts(job)[1]


def studies(job: Job) -> list[Gate]:
    """Closed forms, bits beside Embree and at corners, and what holds exactly."""
    return study_section.without_factors(job)


def factors(job: Job) -> list[Gate]:
    """Closed forms and laws of view factors, rooms beside Embree, and errors."""
    return judge.run(job)


def lit(job: Job) -> list[Gate]:
    """Pictures by radiosity beside random paths, and a furnace."""
    return lit_judge.run(job)


# A defect in the picture's modules cannot change a hit, and a defect in hits needs no picture to be caught.
GROUPS: dict[str, tuple[Callable[[Job], Iterable[Gate]], ...]] = {
    "hits": (
        promised(promises.HITS),
        hits,
        extreme(1, 32),
        extreme(46, 46),
        extreme(49, 52),
        sweep,
        curves,
        from_surfaces,
    ),
    "queries": (promised(promises.QUERIES), queries, extreme(51, 54)),
    "scenes": (promised(promises.SCENES), scenes),
    "studies": (studies,),
    "factors": (factors,),
    "lit": (lit,),
    "pictures": (promised(promises.PICTURES), pictures, unseen, extreme(33, 45), extreme(47, 48)),
}
