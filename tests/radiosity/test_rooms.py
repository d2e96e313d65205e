"""Radiosity and heat of meshes: view factors by `view_factors`, against closed forms."""

import enclosures
import numpy as np
import pytest

from renderer import Mesh, Octree
from renderer.mesh.shapes import box, icosphere
from renderer.radiosity import Shooting, adaptive, net_heat, patches, radiosity
from renderer.radiosity.surfaces import check_factors
from renderer.radiosity.thermal import SIGMA
from renderer.studies import view_factors


def turned(mesh):
    """The mesh seen from within."""
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


@pytest.fixture(scope="module")
def cellar():
    """A room with a block in it, of patches, and its view factors."""
    room = Mesh.concatenate(turned(box(upper=(3, 2, 2))), box((1.0, 0.5, 0.25), (1.5, 1.0, 1.0)))
    cut = patches(room, 1.2)
    return cut, view_factors(Octree.from_mesh(cut.mesh), rtol=0.1)


def test_in_a_closed_room_b_is_one_and_no_heat_is_made(cellar):
    cut, factors = cellar
    rng = np.random.default_rng(2)
    rho = rng.uniform(0.0, 0.95, (len(cut.faces), 3))
    found = radiosity(factors, 1.0 - rho, rho)
    assert np.abs(found.values - 1.0).max() <= found.bound <= 1e-6
    assert (np.abs(found.balance.error) <= factors.areas.sum() * found.residual + 1e-12).all()
    heat = net_heat(factors, rng.uniform(0.1, 1.0, len(rho)), rng.uniform(280.0, 320.0, len(rho)))
    assert np.abs(heat.net).max() > 1.0 and abs(heat.net.sum()) < 1e-6
    still = net_heat(factors, rng.uniform(0.1, 1.0, len(rho)), 300.0)
    assert np.abs(still.flux).max() < 1e-6


def test_rays_in_place_of_a_matrix(cellar):
    """The same system as by the matrix that the operator has on unit vectors, and a bound that holds."""
    cut, _ = cellar
    rng = np.random.default_rng(3)
    n = len(cut.faces)
    factors = view_factors(Octree.from_mesh(cut.mesh), form="rays", max_rays=1024)
    emission, rho = rng.random((n, 3)), rng.random((n, 3)) * 0.9
    found = radiosity(factors, emission, rho, rtol=1e-9)
    matrix = (factors.exchange @ np.eye(n)) / factors.areas[:, None]
    exact = [np.linalg.solve(np.eye(n) - rho[:, [k]] * matrix, emission[:, k]) for k in range(3)]
    assert np.abs(found.values.T - exact).max() <= found.bound <= 1e-9 * found.values.max()
    assert abs(net_heat(factors, 0.5, rng.uniform(280.0, 320.0, n)).net.sum()) < 1e-4
    # Sums of more terms than there are surfaces.
    leaving = factors.exchange.targets
    terms = 1024 + np.bincount(leaving.ravel(), minlength=n)[:n].max()
    assert check_factors(factors).slack == (terms + 12) * np.finfo(float).eps
    with pytest.raises(ValueError, match=r"^scene: expected an octree, or view factors with form='matrix', got some"):
        Shooting(factors, emission, rho)


def test_a_lamp_in_a_cube():
    """Walls without patches: three unknowns by symmetry, and Howell's view factors of a cube."""
    factors = view_factors(Octree.from_mesh(turned(box())), np.repeat(np.arange(6), 2))
    lamp = np.array([0.0, 0, 0, 0, 0, 1.0])
    found = radiosity(factors, lamp, 0.7, rtol=1e-12).values[:, 0]
    exact = radiosity(enclosures.cube(), lamp, 0.7, rtol=1e-12).values[:, 0]
    np.testing.assert_allclose(np.sort(found), np.sort(exact), rtol=1e-8)


def test_heat_between_a_sphere_and_one_around_it():
    """Each face of the inner one sees the outer one alone; so do polyhedra, by their own areas."""
    inner, outer = icosphere(2), turned(icosphere(2).transformed(np.diag([2.0, 2.0, 2.0, 1.0])))
    groups = np.repeat([0, 1], [len(inner.faces), len(outer.faces)])
    factors = view_factors(Octree.from_mesh(Mesh.concatenate(inner, outer)), groups, rtol=0.01)
    first, second = factors.areas
    flow = SIGMA * (350.0**4 - 290.0**4) / (0.5 / (first * 0.5) + 1 / first + 0.2 / (second * 0.8))
    np.testing.assert_allclose(net_heat(factors, [0.5, 0.8], [350.0, 290.0]).net, [flow, -flow], rtol=1e-8)


def test_shots_by_rays_come_near_the_solution(cellar):
    cut, factors = cellar
    emission, rho = np.where(cut.faces == 0, 1.0, 0.0), 0.6
    exact = radiosity(factors, emission, rho).values
    shots = Shooting(Octree.from_mesh(cut.mesh), emission, rho, rtol=1e-4)
    unshot = [shot.unshot for shot in shots][-1]
    sent, differences = exact[:, 0] * factors.areas, (shots.values() - exact)[:, 0] * factors.areas
    # Rows err by up to 0.02 of their largest entry, differently each; their sums do not.
    assert np.abs(differences).sum() < 0.02 * sent.sum()
    power = (emission * factors.areas).sum()
    assert 0.0 <= -differences.sum() <= 0.6 / (1.0 - 0.6) * unshot * power + 1e-5


def test_adaptive_patches_of_a_room_keep_its_energy():
    room = turned(box())
    lamp = np.repeat([0.0, 1.0], [10, 2])
    found = adaptive(patches(room, 0.8), lamp, 0.5, rounds=1, contrast=0.05)
    assert len(found.patches.faces) > len(patches(room, 0.8).faces)
    # A lamp of area 1; all is absorbed.
    np.testing.assert_allclose(found.radiosity.balance.emitted, 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.radiosity.balance.absorbed, 1.0, rtol=1e-5)
