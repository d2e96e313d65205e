"""Extreme cases 18 to 32: meshes that are hard to build a tree over, or that are not valid meshes."""

import resource
import time
from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray

from renderer import BruteForce, Hits, Mesh, Octree, load_mesh
from renderer.mesh.shapes import grid, icosphere, torus
from validation.hits.compare import RTOL, RTOL_GRAZING, HitArrays
from validation.hits.rays import RayFamily, float32_exact
from validation.meshes import loose
from validation.promises.refused import refused
from validation.references.embree import Embree
from validation.scenes import SCENES
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import (
    SEED,
    Accelerator,
    against_brute_force,
    against_exact,
    as_exact,
    closest,
    embree_says,
    float32_mesh,
    hits_in_words,
    octrees,
    of,
    one_t,
    ray_batch,
    rotation,
    same_bits,
    unit_rows,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Triangle = list[tuple[float, float, float]]

MEMORY_LIMIT_GB = 6.0


def _pins(side: float) -> list[Triangle]:
    """Two small triangles at opposite corners of [0, side]^3, so that this cube is the root's cell."""
    end = side - 1 / 64
    return [[(0, 0, 0), (1 / 64, 0, 0), (0, 1 / 64, 0)], [(side, side, side), (end, side, side), (side, end, side)]]


def _rays_at(rng: np.random.Generator, mesh: Mesh, count: int) -> RayFamily:
    """Rays from around the mesh at random points of random faces, half of them at vertices; float32-exact."""
    lower, upper = mesh.bounds
    radius = float(np.linalg.norm(upper - lower))
    weights = rng.dirichlet((1, 1, 1), count)
    weights[::2] = np.eye(3)[rng.integers(0, 3, (count + 1) // 2)]
    targets = np.einsum("nk,nkj->nj", weights, mesh.triangles[rng.integers(0, len(mesh.faces), count)])
    origins = float32_exact((lower + upper) / 2 + radius * unit_rows(rng, count))
    return ray_batch(origins, float32_exact(targets - origins))


def _expected_t(mesh: Mesh, rays: RayFamily, t: float, digits: float) -> Outcome:
    """Check the first ray's t by every tree: it must be exact, and within ``digits`` of the table's number."""
    answers = [closest(tree, rays) for tree in octrees(mesh)]
    holds = all(as_exact(against_exact(mesh, rays, hits)) and abs(float(hits.t[0]) - t) <= digits for hits in answers)
    return Outcome(one_t(answers[0].t, answers[0].face), holds, *embree_says(mesh, rays, one_t))


def _face_without_vertex_in_cell(quick: bool) -> Outcome:
    sheets: list[Triangle] = [[(0.25, 0.25, z), (3.75, 0.25, z), (0.25, 3.75, z)] for z in 2.5 + 0.01 * np.arange(8)]
    mesh = float32_mesh(loose(_pins(4) + sheets))
    # Float32 moves z = 2.57 by less than 2^-23.
    return _expected_t(mesh, ray_batch((1.5, 1.5, 5), (0, 0, -1)), 2.43, 2.0**-23)


def _early_exit(quick: bool) -> Outcome:
    first_seen: Triangle = [(0.5, 0.5, 0.95), (1.95, 0.1, 0.3), (1.95, 0.9, 0.3)]
    nearer: Triangle = [(1.25, 0.3, 0.3), (1.25, 0.7, 0.3), (1.25, 0.5, 0.8)]
    mesh = float32_mesh(loose([*_pins(2), first_seen, nearer]))
    # x = 1.25 is exact; only the kernel rounds t.
    return _expected_t(mesh, ray_batch((-1, 0.5, 0.5), (1, 0, 0)), 2.25, 1e-15)


def _on_split_planes(quick: bool) -> Outcome:
    rng, count = np.random.default_rng(SEED), 5_000 if quick else 50_000
    mesh = loose(rng.integers(0, 9, (500, 3, 3)))
    origins = rng.integers(-2, 11, (count, 3)).astype(float)
    directions = rng.integers(-3, 4, (count, 3)).astype(float)
    directions[~directions.any(axis=1)] = (0, 0, 1)
    rays = ray_batch(origins, directions)
    differing, ours = against_brute_force(mesh, rays, octrees(mesh))
    return Outcome(ours, differing == 0, *embree_says(mesh, rays, hits_in_words))


def _coincident(quick: bool) -> Outcome:
    count = 200_000
    vertices, faces = [(0.0, 0, 1), (4, 0, 1), (0, 4, 1)], np.tile(np.arange(3, dtype=np.int32), (count, 1))
    begin = time.perf_counter()
    octree = Octree(vertices, faces)
    seconds = time.perf_counter() - begin
    rays = ray_batch([(1, 1, 4), (0.5, 2, -1), (3, 3, 4)], [(0, 0, -1), (0, 0, 2), (0, 0, -1)])
    hits, stats = closest(octree, rays), octree.stats
    right = hits.t.tolist() == [3, 1, np.inf] and hits.face.tolist() == [0, 0, -1]
    ours = f"{stats.references:,} references, {seconds:.2f} s, t = {hits.t[0]:g}, face {hits.face[0]}"
    return Outcome(ours, right and stats.references == count, *embree_says(octree.mesh, rays, one_t))


def _fan(quick: bool) -> Outcome:
    rng, count, shots = np.random.default_rng(SEED), 100_000, 500 if quick else 2_000
    angle = np.arange(count) * (2 * np.pi / count)
    rim = np.column_stack([np.cos(angle), np.sin(angle), 0.1 * np.sin(40 * angle)])
    corner = np.arange(count, dtype=np.int32)
    faces = np.column_stack([np.full(count, count), corner, (corner + 1) % count]).astype(np.int32)
    mesh = Mesh(float32_exact(np.vstack([rim, (0, 0, 0.25)])), faces)
    octree, rays = Octree.from_mesh(mesh), _rays_at(rng, mesh, shots)
    (differing, compared), stats = against_brute_force(mesh, rays, [octree]), octree.stats
    # A node has at least two children, and a leaf at least one face.
    bounded = stats.references == count and stats.nodes < stats.leaves <= count
    ours = f"{stats.references:,} references, {stats.nodes:,} nodes, depth {stats.depth}; {compared}"
    return Outcome(ours, bounded and differing == 0, *embree_says(mesh, rays, hits_in_words))


def _tiny_bounds(quick: bool) -> Outcome:
    rng = np.random.default_rng(SEED)
    mesh = loose(1e6 + np.spacing(1e6) * rng.integers(0, 3, (1000, 3, 3)))
    trees = octrees(mesh)
    rays = ray_batch(mesh.triangles.mean(axis=1) + np.array([0, 0, 1]), (0, 0, -1))
    differing, compared = against_brute_force(mesh, rays, trees)
    ended = [tree.stats.references == 1000 for tree in trees]
    ours = f"{of(ended, 'builds end')}, depth {trees[0].stats.depth}; {compared}"
    return Outcome(ours, all(ended) and differing == 0, *embree_says(mesh, rays, hits_in_words))


def _teapot_in_stadium(quick: bool) -> Outcome:
    rng = np.random.default_rng(SEED)
    loaded = load_mesh(SCENES / "models" / "teapot.ply")
    teapot = float32_mesh(Mesh(loaded.vertices / float(loaded.extent.max()), loaded.faces))
    field, stands = grid(8, 8, (1e5, 1e5)), torus(5e4, 1e4)
    mesh = float32_mesh(Mesh.concatenate([teapot, field, stands]))
    few = _rays_at(rng, teapot, 500 if quick else 4_000)
    octree = Octree.from_mesh(mesh)
    differing, compared = against_brute_force(mesh, few, [octree])

    many = _rays_at(rng, teapot, 20_000 if quick else 200_000)
    inside, alone = _seconds(lambda: closest(octree, many)), Octree.from_mesh(teapot)
    slowdown = inside / _seconds(lambda: closest(alone, many))
    ours = f"{compared}; takes {slowdown:.1f} times as long as the teapot alone"
    return Outcome(ours, differing == 0, *embree_says(mesh, few, hits_in_words))


def _seconds(run: Callable[[], object]) -> float:
    """The shortest of three runs."""
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return min(times)


def _without_area(quick: bool) -> Outcome:
    rng, count = np.random.default_rng(SEED), 2_000 if quick else 20_000
    vertices = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 2, 3), (2, 4, 6), (1, 0, 0)], dtype=np.float64)
    faces = np.array([(0, 1, 1), (0, 0, 0), (3, 0, 3), (0, 1, 2), (0, 3, 4), (4, 3, 0), (1, 5, 2)], dtype=np.int32)
    mesh = Mesh(vertices, faces)
    rays = _rays_at(rng, mesh, count)
    exact_aim = ray_batch(vertices[rng.integers(0, 6, count)] - rays.directions, rays.directions)
    beside = ray_batch(rays.origins, rays.directions + 1e-9 * rng.normal(size=(count, 3)))
    wrong = np.zeros(count, dtype=np.bool_)
    trees: list[Accelerator] = [*octrees(mesh), BruteForce.from_mesh(mesh)]
    for tree in trees:
        for batch in (rays, exact_aim):
            hits = closest(tree, batch)
            on_ray = batch.origins + np.where(hits.hit, hits.t, 0.0)[:, None] * batch.directions
            # Faces 0 to 2 have two equal corners.
            near = np.abs(hits.points - on_ray).max(axis=1) <= 1e-9
            wrong |= hits.hit & ~(near & (hits.face >= 3))
        wrong |= tree.any_hit(beside.origins, beside.directions)
    return Outcome(f"{of(wrong)} where none is", not wrong.any(), *embree_says(mesh, rays, hits_in_words))


def _not_finite(quick: bool) -> Outcome:
    good = [(0.0, 0, 0), (1, 0, 0), (0, 1, 0)]
    rays, faces = ray_batch([(0.25, 0.25, 1), (3.25, 0.25, 1)], (0, 0, -1)), [(0, 1, 2), (3, 4, 5)]
    named, left = [], []
    for bad in (np.nan, np.inf, -np.inf):
        vertices = np.array([*good, (3.0, 0, 0), (4, bad, 0), (3, 1, 0)])
        said = refused(Octree, vertices, faces) or ""
        named.append("vertices" in said and "in row 4" in said)
        mesh, repairs = Mesh.repaired(vertices, faces)
        hits = closest(Octree.from_mesh(mesh), rays)
        left.append(hits.t.tolist() == [1, np.inf] and list(repairs.dropped_faces) == [1])
    # Embree gets plain arrays, because ``Mesh`` refuses these vertices.
    says = [hits_in_words(*Embree(vertices, faces, robust=mode).closest_hit(rays.origins, rays.directions))
            for mode in (False, True)]  # fmt: skip
    ours = f"{of(named, 'named')}; repaired: {of(left, 'without the bad face')}"
    return Outcome(ours, all(named) and all(left), *says)


def _out_of_range(quick: bool) -> Outcome:
    vertices = [(0.0, 0, 0), (1, 0, 0), (0, 1, 0)]
    named = []
    for i, make in product((99, 3, -1), (Mesh, Octree, BruteForce)):
        said = refused(make, vertices, [(0, 1, 2), (0, 1, i)]) or ""
        named.append("faces" in said and str(i) in said and "row 1" in said)
    return Outcome(of(named, "refused by value and row"), all(named))


def _empty(quick: bool) -> Outcome:
    rays = ray_batch(unit_rows(np.random.default_rng(SEED), 100), (0, 0, 1))
    no_faces = np.empty((0, 3), np.int32)
    meshes = [Mesh(np.empty((0, 3)), no_faces), Mesh(np.eye(3), no_faces)]
    hit = np.zeros(len(rays), dtype=np.bool_)
    for mesh in meshes:
        for tree in octrees(mesh):
            hit |= closest(tree, rays).hit | tree.any_hit(rays.origins, rays.directions)
    return Outcome(of(~hit, "missed"), not hit.any(), *embree_says(meshes[0], rays, hits_in_words))


def _single(quick: bool) -> Outcome:
    rng, count = np.random.default_rng(SEED), 200 if quick else 2_000
    flat = np.array([(0, 0, 0), (2, 0, 0), (0, 1, 0)], dtype=np.float64)
    turns = [np.roll(np.eye(3), k, axis=0) for k in range(3)] + [rotation(rng) for _ in range(5)]
    wrong, hits_in_all, texts = 0, 0, []
    for turn in turns:
        mesh = float32_mesh(loose(flat @ turn))
        targets = rng.dirichlet((2, 2, 2), count) @ mesh.vertices
        origins = float32_exact(3 * unit_rows(rng, count))
        rays = ray_batch(origins, float32_exact(targets - origins))
        hits = closest(Octree.from_mesh(mesh), rays)
        errors = against_exact(mesh, rays, hits)
        wrong, hits_in_all = wrong + errors.wrong + errors.near_edge, hits_in_all + int(hits.hit.sum())
        texts.append(embree_says(mesh, rays, lambda t, face: str((face >= 0).sum())))
    rays_in_all = count * len(turns)
    said = [f"{sum(map(int, numbers)):,} of {rays_in_all:,} hits" for numbers in zip(*texts, strict=True)]
    # From all around, with roundings of 1e-7, all but a few grazing rays hit.
    holds = wrong == 0 and hits_in_all > 0.99 * rays_in_all
    return Outcome(f"{hits_in_all:,} of {rays_in_all:,} hits, {wrong} otherwise than exact", holds, *said)


def _duplicates(quick: bool) -> Outcome:
    rng, count = np.random.default_rng(SEED), 5_000 if quick else 50_000
    mesh = float32_mesh(icosphere(3))
    order = rng.permutation(np.repeat(np.arange(len(mesh.faces)), 10))
    shuffled = Mesh(mesh.vertices, mesh.faces[order])
    lowest = np.unique(order, return_index=True)[1]
    # Rays at the insides of faces, where only duplicates tie.
    origins = float32_exact(2 * unit_rows(rng, count))
    targets = np.einsum("nk,nkj->nj", rng.dirichlet((2, 2, 2), count),
                        mesh.triangles[rng.integers(0, len(mesh.faces), count)])  # fmt: skip
    rays = ray_batch(origins, float32_exact(targets - origins))
    once = closest(BruteForce.from_mesh(mesh), rays)
    expected = Hits(once.t, np.where(once.hit, lowest[once.face], -1), once.u, once.v, shuffled)
    same = np.all([same_bits(closest(tree, rays), expected) for tree in octrees(shuffled)], axis=0)

    def say(t: Floats, face: Ints) -> str:
        return of((face == expected.face)[once.hit], "lowest")

    return Outcome(of(same, "t bit-equal, lowest face"), bool(same.all()), *embree_says(shuffled, rays, say))


def _not_manifold(quick: bool) -> Outcome:
    rng, count = np.random.default_rng(SEED), 4_000 if quick else 40_000
    angle = np.arange(5) * (2 * np.pi / 5)
    pages = np.column_stack([2 * np.cos(angle), 2 * np.sin(angle), np.full(5, 0.5)])
    book = Mesh(np.vstack([[(0, 0, 0), (0, 0, 1)], pages]), [(0, 1, k) for k in range(2, 7)])
    ball = icosphere(3)
    bowl = Mesh(ball.vertices + np.array([5, 0, 0]), ball.faces[ball.triangles[:, :, 1].max(axis=1) < 0.3])
    mesh = float32_mesh(Mesh.concatenate([book, bowl]))
    some = [_rays_at(rng, part, count) for part in (mesh, float32_mesh(book))]
    rays = ray_batch(*(np.concatenate([getattr(r, name) for r in some]) for name in ("origins", "directions")))
    differing, ours = against_brute_force(mesh, rays, octrees(mesh))
    return Outcome(ours, differing == 0, *embree_says(mesh, rays, hits_in_words))


def _ten_million(quick: bool) -> Outcome:
    rng = np.random.default_rng(SEED)
    mesh = _terrain(708 if quick else 2237)
    begin = time.perf_counter()
    octree = Octree.from_mesh(mesh)
    seconds = time.perf_counter() - begin
    # The peak of this process so far, before Embree builds; Linux counts in kB.
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    rays = _rays_at(rng, mesh, 10_000)
    hits = closest(octree, rays)
    answers = []
    for robust in (False, True):
        embree = Embree(mesh.vertices, mesh.faces, robust=robust)
        answers.append(embree.closest_hit(rays.origins, rays.directions))
        del embree  # two scenes of ten million faces need 4 GB
    wrong = sum(_is_wrong(mesh, rays, hits, row, answers[1][1]) for row in _differing(rays, hits, answers[1][0]))
    stats = octree.stats
    holds = wrong == 0 and stats.references == len(mesh.faces) and peak < MEMORY_LIMIT_GB and bool(hits.hit.any())
    ours = (
        f"{len(mesh.faces):,} faces in {seconds:.1f} s, tree {stats.bytes / 2**20:,.0f} MB, peak {peak:.2f} GB, "
        f"{wrong} of {len(rays):,} wrong"
    )
    differing = [f"{len(_differing(rays, hits, t)):,} of {len(rays):,} differ" for t, _ in answers]
    return Outcome(ours, holds, *differing)


def _terrain(side: int) -> Mesh:
    """Hills of 2 side^2 faces over [-1, 1]^2, float32-exact."""
    flat = grid(side, side, (2.0, 2.0))
    points = flat.vertices.copy()
    points[:, 1] = 0.1 * np.sin(7 * points[:, 0]) * np.cos(9 * points[:, 2])
    return Mesh(float32_exact(points), flat.faces)


def _differing(rays: RayFamily, hits: Hits, t: Floats) -> Ints:
    """Rays that only one of the two hits, or whose t differs by more than Embree's float32 explains."""
    differs = hits.hit != np.isfinite(t)
    both = np.flatnonzero(hits.hit & np.isfinite(t))
    directions = rays.directions[both]
    cosine = np.abs((hits.normals[both] * directions).sum(axis=1)) / np.linalg.norm(directions, axis=1)
    differs[both] = ~(np.abs(t[both] - hits.t[both]) * cosine <= (RTOL * cosine + RTOL_GRAZING) * hits.t[both])
    return np.flatnonzero(differs)


def _is_wrong(mesh: Mesh, rays: RayFamily, hits: Hits, row: int, their_face: Ints) -> bool:
    """Whether exact arithmetic contradicts our answer, on the faces that the two answers name."""
    named = sorted({int(hits.face[row]), int(their_face[row])} - {-1})
    local = named.index(int(hits.face[row])) if hits.face[row] >= 0 else -1
    ours = HitArrays(hits.t[row : row + 1], np.array([local]))
    return not as_exact(against_exact(loose(mesh.vertices[mesh.faces[named]]), rays.select([row]), ours))


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        18, "8 big faces over a cell that holds none of their vertices, o = (1.5,1.5,5), d = -z", "t = 2.43",
        ("exact", "Embree"), "the derived bound of t, and 2^-23 for 2.57 in float32", _face_without_vertex_in_cell,
    ),
    ExtremeCase(
        19, "a far hit on a face that begins in the first cell, o = (-1,.5,.5), d = +x", "t = 2.25, not 2.5038",
        ("exact", "Embree"), "the derived bound of t", _early_exit,
    ),
    ExtremeCase(
        20, "500 faces with vertices exactly on split planes", "as brute force", ("brute force",), "none: bit for bit",
        _on_split_planes,
    ),
    ExtremeCase(
        21, "200,000 coincident triangles", "the build ends, references = faces, t right, face 0",
        ("Embree", "rule"), "none: all numbers are exact", _coincident,
    ),
    ExtremeCase(
        22, "fan of 100,000 triangles at one vertex", "references = faces, no 8^depth; as brute force",
        ("brute force",), "none: bit for bit", _fan,
    ),
    ExtremeCase(
        23, "1,000 faces within 2 ulp at 1e6", "the build ends", ("rule", "brute force"), "none: bit for bit",
        _tiny_bounds,
    ),
    ExtremeCase(
        24, "teapot of size 1 in a stadium of 1e5", "as brute force; slowdown reported", ("brute force",),
        "none: bit for bit; the slowdown is no gate", _teapot_in_stadium,
    ),
    ExtremeCase(
        25, "triangles without area, repeated indices", "hit only where corners lie on a line, by rays at that line",
        ("Embree", "rule"), "1e-9 from ray and line: a line may fill a slit between its neighbours",
        _without_area,
    ),
    ExtremeCase(
        26, "NaN or infinite vertex beside a good triangle",
        "ValueError that names the vertex; repaired: the bad face dropped and reported", ("rule",), "none",
        _not_finite,
    ),
    ExtremeCase(27, "index 99, 3 or -1 of 3 vertices", "ValueError", ("rule",), "none", _out_of_range),
    ExtremeCase(28, "mesh without faces", "all miss", ("Embree", "rule"), "none", _empty),
    ExtremeCase(
        29, "one triangle, flat bounds", "hit", ("exact",), "the derived bound of t", _single
    ),
    ExtremeCase(
        30, "each face 10 times, shuffled", "t bit-equal, lowest face", ("rule",), "none: bit for bit", _duplicates
    ),
    ExtremeCase(
        31, "an edge with 5 faces; an open mesh", "as brute force", ("brute force",), "none: bit for bit",
        _not_manifold,
    ),
    ExtremeCase(
        32, "10 million triangles (quick: 1 million)", "builds within 6 GB, t = Embree's", ("Embree", "exact"),
        "3e-7 + 2e-7 / |cos| for Embree's float32; beyond it exact arithmetic judges", _ten_million,
    ),
)  # fmt: skip
