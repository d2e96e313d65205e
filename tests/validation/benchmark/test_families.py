"""The rays, points and meshes of a run: what their names say, exact in float32, and no family asks nothing."""

import numpy as np
import pytest

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.benchmark.measures.families import cosine_distributed, points
from validation.benchmark.peers.contender import Family


def test_every_family_hits_and_shadow_rays_end_at_one_light(octree: Octree, rays: tuple[Family, ...]) -> None:
    assert [family.name for family in rays] == ["camera", "shadow", "random", "bounce", "misses", "short"]
    for family in rays:
        assert len(family) == 600
        share = octree.any_hit(family.origins, family.directions, t_max=family.t_max).mean()
        assert share == 0.0 if family.name == "misses" else 0.05 < share < 0.95, (
            family.name
        )  # else a contender would be timed on an empty scene
        for array in (family.origins, family.directions):
            assert np.array_equal(array, array.astype(np.float32))
    shadow, misses, short = rays[1], rays[4], rays[5]
    assert [family.name for family in rays if family.beyond] == ["short"] and short.at_most(5).beyond
    lower, upper = octree.mesh.bounds
    assert np.isinf(misses.t_max) and short.t_max == pytest.approx(0.02 * np.linalg.norm(upper - lower))
    assert np.linalg.norm(short.directions, axis=1) == pytest.approx(1.0)
    assert octree.closest_point(short.origins).distance.max() <= 0.50001 * short.t_max
    # The box of the misses is half as large again as the mesh's, and they fill it.
    reach = np.abs(misses.origins - (lower + upper) / 2) / (upper - lower) * 2
    assert 1.45 < reach.max() < 1.5000001
    # The ends differ by the rounding of the directions to float32 alone: below 16, that is 2^-21 up or down.
    assert np.ptp(shadow.origins + shadow.directions, axis=0).max() <= 2.0**-20
    assert shadow.t_max == 1.0


def test_points_are_where_their_names_say(mesh: Mesh, octree: Octree) -> None:
    wide, inner, near = points(mesh, 3_000)
    lower, upper = mesh.bounds
    assert [p.name for p in (wide, inner, near)] == ["wide", "box", "near"]
    for family in (wide, inner, near):
        assert family.points.shape == (3_000, 3)
        assert np.array_equal(family.points, family.points.astype(np.float32))
        assert 0.05 < octree.contains(family.points).mean() < 0.95, family.name
    reach = np.abs(wide.points - (lower + upper) / 2).max(axis=0) / (upper - lower) * 2
    # The largest of 3,000 uniform numbers is 1/3,000 below the end in the mean, and 0.3 % below it once in e^9.
    assert (reach < 1.2000001).all() and (reach > 1.19).all()
    assert (inner.points >= lower - 1e-6).all() and (inner.points <= upper + 1e-6).all()
    share = octree.closest_point(near.points).distance / np.linalg.norm(upper - lower)
    assert 0.009 < share.max() < 0.0100001 and np.quantile(share, 0.5) > 0.003


def test_bounce_rays_follow_the_cosine() -> None:
    normals = np.tile([0.0, 0.0, 1.0], (20_000, 1))
    d = cosine_distributed(normals, np.random.default_rng(0))
    cosine = d[:, 2] / np.linalg.norm(d, axis=1)
    assert cosine.min() >= 0.0
    # E[cos] = 2/3, E[cos^2] = 1/2; five standard errors of 20,000 samples are 0.009 and 0.011.
    assert abs(cosine.mean() - 2 / 3) < 0.009
    assert abs((cosine**2).mean() - 1 / 2) < 0.011
