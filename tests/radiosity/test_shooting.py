"""Shooting: it converges to the solution, from below and as fast as it says, by the rays of one surface at a time."""

import enclosures
import numpy as np
import pytest
from cases import cases

from renderer import Octree
from renderer.mesh.shapes import box
from renderer.radiosity import Shooting, patches, radiosity
from renderer.radiosity.shooting import _Traced

pytestmark = pytest.mark.judges("radiosity.Shooting", "radiosity.Shooting.values", "radiosity.Shot")


def drawn(seed, n, is_open):
    rng = np.random.default_rng(seed)
    factors = enclosures.enclosure(rng, n, is_open)
    return factors, rng.random((n, 3)) * (rng.random((n, 1)) < 0.4), rng.random((n, 3)) * 0.9, rng.random(3)


def room(edge=0.5, lid=True):
    """A box from within, of patches; open above without its lid."""
    shape = box((0, 0, 0), (1, 1.5, 1))
    cut = patches(type(shape)(shape.vertices, shape.faces[: 12 if lid else 10, ::-1]), edge)
    return Octree.from_mesh(cut.mesh), cut.faces


@cases("n", [1, 2, 12, 60])
@cases("is_open", [False, True])
def test_it_converges_to_the_solution_from_below_as_fast_as_it_says(n, is_open):
    factors, emission, rho, sky = drawn(n, n, is_open) if n > 1 else (enclosures.sphere(np.ones(1)), 1.0, 0.9, 0.0)
    exact = radiosity(factors, emission, rho, sky=sky, rtol=1e-12).values
    shots = Shooting(factors, emission, rho, sky=sky, rtol=1e-9)
    areas, greatest = factors.areas[:, None], np.max(rho)
    first = (areas * shots.values()).sum()
    before = shots.values()
    for shot in shots:
        now = shots.values()
        assert (now >= before).all() and (now <= exact * (1 + 1e-9)).all()
        missing = (areas * (exact - now)).sum()
        assert missing <= greatest / (1 - greatest) * shot.unshot * first * (1 + 1e-6) + 1e-9 * first
        before = now
    assert shot.unshot <= 1e-9
    np.testing.assert_allclose(before, exact, atol=1e-8 * first / factors.areas.min())


def test_the_brightest_sends_first_and_of_equal_ones_the_first():
    factors = enclosures.cube()
    shots = Shooting(factors, [0.1, 0.5, 0.0, 0.5, 0.4, 0.0], 0.1, rtol=0.01)
    assert [next(shots).surface for _ in range(4)] == [1, 3, 4, 0]
    # Power counts: a large dim surface before a small bright one.
    shots = Shooting(enclosures.sphere(np.array([1.0, 10.0])), [2.0, 1.0], 0.5)
    assert next(shots).surface == 1


def test_without_light_there_is_no_shot():
    shots = Shooting(enclosures.cube(), 0.0, 0.5)
    assert list(shots) == [] and not shots.values().any()


def test_the_ambient_estimate_is_exact_where_light_is_even():
    # A sphere: unsent light does spread evenly.
    factors = enclosures.sphere(np.array([1.0, 2.0, 3.0]))
    emission, rho = np.array([0.0, 1.0, 0.5]), 0.6
    exact = radiosity(factors, emission, rho, rtol=1e-12).values
    shots = Shooting(factors, emission, rho)
    np.testing.assert_allclose(shots.values(ambient=True), exact, rtol=1e-9)
    next(shots)
    np.testing.assert_allclose(shots.values(ambient=True), exact, rtol=1e-9)
    # And nearer than without it elsewhere.
    factors, emission, rho, _ = drawn(3, 20, False)
    exact = radiosity(factors, emission, rho).values
    shots = Shooting(factors, emission, rho)
    next(shots)
    errors = [((exact - shots.values(ambient)) ** 2 * factors.areas[:, None]).sum() for ambient in (False, True)]
    assert errors[1] < errors[0]


@cases("lid", [True, False])
def test_rows_by_rays_converge_to_the_solution_of_these_rows(lid):
    octree, faces = room(1.0, lid)
    n = len(faces)
    emission, rho, sky = np.where(faces == 0, 1.0, 0.0), np.where(faces % 2, 0.8, 0.3), 0.5
    shots = Shooting(octree, emission, rho, sky=sky, rtol=1e-10, max_rays=512)
    for _ in shots:
        pass
    rows = _Traced(octree, 0.02, 512, None)
    shares = np.zeros((n, n))
    for surface in range(n):
        row = rows.row(surface)
        shares[surface, row.surfaces] = row.shares
    # What i sends arrives: A_j (F_ji as shot) = A_i F_ij.
    received = (rows.areas[:, None] * shares).T / rows.areas[:, None]
    source = emission + rho * sky * rows.sky()
    exact = np.linalg.solve(np.eye(n) - rho[:, None] * received, source)
    np.testing.assert_allclose(shots.values()[:, 1], exact, rtol=1e-7)
    # In a closed room all that rays carry arrives somewhere.
    outside = 1.0 - shares.sum(axis=1)
    assert np.abs(outside).max() < 1e-12 if lid else outside.max() > 0.1


def test_a_traced_room_has_the_energy_of_its_lamps():
    """In a closed room the absorbed power is that of the lamps, however the rows err."""
    octree, faces = room()
    emission, rho = np.where(faces == 3, 2.0, 0.0), 0.5
    shots = Shooting(octree, emission, rho, rtol=1e-10, max_rays=256)
    for _ in shots:
        pass
    areas = _Traced(octree, 0.02, 256, None).areas
    # B = E + rho H, so what is absorbed is (1 - rho) (B - E) / rho.
    absorbed = (areas * (1 - rho) / rho * (shots.values()[:, 0] - emission)).sum()
    np.testing.assert_allclose(absorbed, (areas * emission).sum(), rtol=1e-8)


def test_the_same_bits_on_any_number_of_threads():
    octree, faces = room(lid=False)
    runs = []
    for threads in (1, 2, 5):
        shots = Shooting(octree, np.where(faces == 0, 1.0, 0.0), 0.7, sky=[0.1, 0.2, 0.3], threads=threads)
        runs.append(([next(shots) for _ in range(5)], shots.values().tobytes()))
    assert runs[0] == runs[1] == runs[2]


@cases(
    ("arguments", "message"),
    [
        ({"scene": 3}, "octree: expected an Octree, a BruteForce or a RayScene, got int"),
        ({"emission": [1.0]}, "emission: expected one number, shape (12,) or (12, 3), a row a surface, got shape (1,)"),
        ({"reflectance": 1}, "reflectance: expected numbers less than 1, got [1.0, 1.0, 1.0] in row 0"),
        ({"sky": np.nan}, "sky: expected a finite number >= 0, three of them, or None, got nan"),
        ({"rtol": 1.0}, "rtol: expected a number between 0 and 1, got 1.0"),
        ({"max_rays": 3}, "max_rays: expected an integer from 256 to 16777216, got 3"),
        ({"threads": 0}, "threads: expected an integer >= 1 or None, got 0"),
    ],
)
def test_bad_input_is_named(arguments, message):
    given = {"scene": Octree.from_mesh(box()), "emission": 1.0, "reflectance": 0.5} | arguments
    with pytest.raises(ValueError) as caught:
        Shooting(**given)
    assert str(caught.value).startswith(message)
