"""Exact laws of studies: each check counts the answers that break one."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.checkpoints.study import Study
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, grid, icosphere
from renderer.octree import Octree
from renderer.scene.camera import OrthographicCamera
from renderer.studies import (
    ambient_occlusion,
    depth_map,
    face_points,
    fibonacci_sphere,
    occlusion,
    openness,
    scan,
    sky_view_factor,
    sun_hours,
    tregenza,
    visible_faces,
)
from renderer.studies.points import of_file, on_grid
from validation.meshes import tetrahedron
from validation.oracle.exact import closest_hits
from validation.oracle.starts import Surface
from validation.studies.bodies import FAR, bodies, street, terrain, touching, town
from validation.studies.checks import Asked, Check, counted, row_of

Floats = NDArray[np.float64]
_SEED = 2045
# Whole numbers, so that coordinates of whole multiples of 2^-18 are moved exactly: near Munich in UTM, metres.
UTM = np.array([691_008.0, 5_335_040.0, 519.0])


def _within(mesh: Mesh) -> Floats:
    """A point within each face, whose coordinates are exact where its corners' are whole multiples of 2^-14."""
    a, b, c = mesh.triangles.transpose(1, 0, 2)
    points: Floats = a + (b - a) / 4.0 + (c - a) / 4.0
    return points


def _bits(octree: Octree, points: Floats, normals: Floats, *, leaving: NDArray[np.int64]) -> Any:
    return occlusion(octree, points, normals, tregenza().directions, packed=True, leaving=leaving)


def moved_to_utm() -> Asked:
    """Moving mesh and points by the same integers changes no bit."""
    asked, wrong = 0, 0
    for mesh in (town(), terrain()):
        points, normals, faces = _within(mesh), mesh.face_normals(), np.arange(len(mesh.faces))
        near, far = Octree.from_mesh(mesh), Octree.from_mesh(Mesh(mesh.vertices + UTM, mesh.faces))
        for study in (sky_view_factor, _bits):
            here = study(near, points, normals, leaving=faces)
            there = study(far, points + UTM, normals, leaving=faces)
            number, bad = counted(here == there)
            asked, wrong = asked + number, wrong + bad
    return asked, wrong


def threads_order_and_company() -> Asked:
    """A point's answer does not depend on threads, order or batch."""
    mesh, rng = town(), np.random.default_rng(_SEED)
    octree, (points, normals, faces) = Octree.from_mesh(mesh), face_points(mesh)
    whole = sky_view_factor(octree, points, normals, leaving=faces, threads=1)
    mixed, some = rng.permutation(len(points)), np.sort(rng.choice(len(points), 77, replace=False))
    found = [
        sky_view_factor(octree, points, normals, leaving=faces, threads=3) == whole,
        sky_view_factor(octree, points[mixed], normals[mixed], leaving=faces[mixed]) == whole[mixed],
        sky_view_factor(octree, points[some], normals[some], leaving=faces[some]) == whole[some],
        [sky_view_factor(octree, points[i], normals[i], leaving=faces[i]) == whole[i] for i in some[:9]],
    ]
    return counted(np.concatenate(found))


def no_light_through_touching_walls() -> Asked:
    """Inside houses that touch, all directions are hidden, also those to seams and corners."""
    mesh, octree = touching(), Octree.from_mesh(touching())
    rng = np.random.default_rng(_SEED)
    points = rng.integers(1, 2**12, (40, 3)) / 2.0**12 * [2.0, 2.0, 2.0]
    corners = mesh.triangles
    aims = np.concatenate([corners.reshape(-1, 3), (corners[:, 0] + corners[:, 1]) / 2.0, corners.mean(axis=1)])
    asked, wrong = 0, 0
    for point in points:
        ways = np.concatenate([aims - point, fibonacci_sphere(200).directions])
        ways = ways[np.abs(ways).max(axis=1) > 0.0]
        packed: Any = occlusion(octree, [point], None, ways, packed=True)
        hidden = np.unpackbits(packed, axis=-1, count=len(ways))
        asked, wrong = asked + hidden.size, wrong + int((hidden == 0).sum())
    return asked, wrong


def no_shade_among_faces_of_a_plane() -> Asked:
    """Faces of one plane do not shade each other, level or turned."""
    mesh = touching()
    roofs = np.flatnonzero(mesh.face_normals()[:, 2] == 1.0)
    found = [sky_view_factor(Octree.from_mesh(mesh), _within(mesh)[roofs], [0, 0, 1], leaving=roofs) == 1.0]
    plate, rng = grid(30, 30, (3.0, 3.0)), np.random.default_rng(_SEED)
    for _ in range(4):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turned = Mesh(plate.vertices @ turn.T + rng.uniform(-1e3, 1e3, 3), plate.faces)
        points, normals, faces = face_points(turned)
        light = ambient_occlusion(Octree.from_mesh(turned), points, normals, leaving=faces, samples=200)
        found.append(light == 1.0)
    return counted(np.concatenate(found))


def two_sides_of_a_thin_plate() -> Asked:
    """A plate 1e-9 as thick as it is wide: its upper side sees all of the sky, its lower side none."""
    mesh = box((0.0, 0.0, 0.0), (1.0, 1.0, 1e-9))
    points, normals, faces = face_points(mesh)
    sky = sky_view_factor(Octree.from_mesh(mesh), points, normals, leaving=faces)
    level = normals[:, 2] != 0.0
    return counted(sky[level] == (normals[level, 2] > 0.0))


def dark_inside_bodies() -> Asked:
    """Points within closed bodies are hidden from all sides, whatever their normals."""
    rng = np.random.default_rng(_SEED)
    ball, points = Octree.from_mesh(icosphere(3)), rng.uniform(-0.5, 0.5, (300, 3))
    return counted(np.concatenate([
        openness(ball, points, samples=300) == 0.0, sky_view_factor(ball, points, rng.normal(size=(300, 3))) == 0.0,
        ambient_occlusion(ball, points, rng.normal(size=(300, 3))) == 0.0,
        occlusion(ball, points, None, fibonacci_sphere(64).directions) == 1.0,
    ]))  # fmt: skip


def hours_behind_walls() -> Asked:
    """Hours of sun on a street's floor follow from the angles to its walls, also for weighted suns."""
    width, depth = 2.0, 1.0
    octree = Octree.from_mesh(street(width, depth))
    angle = np.radians(np.arange(1, 180) + 0.5)
    suns = np.stack([np.cos(angle), np.zeros(179), np.sin(angle)], axis=1) * np.linspace(0.5, 9.0, 179)[:, None]
    hours = np.arange(1.0, 180.0) / 4.0
    x = np.linspace(-0.9, 0.9, 37)
    # The floor is cut along the line from x = -1, y = -FAR to x = 1, y = FAR.
    leaving = np.where(x > 0.0, 0, 1)
    found = sun_hours(octree, np.stack([x, x, 0 * x], axis=1), [0, 0, 1], suns, hours, leaving=leaving)
    low, high = np.arctan(depth / (1.0 - x)), np.pi - np.arctan(depth / (1.0 + x))
    known = [hours[(angle > a) & (angle < b)].sum() for a, b in zip(low, high, strict=True)]
    return counted(found == known)


def weights_and_distances_of_directions() -> Asked:
    """A share is the sum of hidden weights over that of all; a distance is in units of the scene, however long the
    directions are: a wall at x = 2 hides the two directions to it, and not beyond 1.
    """
    octree = Octree.from_mesh(box((2.0, -FAR, -FAR), (3.0, FAR, FAR)))
    ways, weights = np.array([[3, 0, 0], [-1, 0, 0], [0.25, 0, 0], [0, 0, 7]]), [1.0, 2.0, 4.0, 8.0]
    points = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0]]
    found = [
        occlusion(octree, points, None, ways, weights=weights),
        occlusion(octree, points, None, ways, weights=weights, distance=1.0),
        occlusion(octree, points, [0, 0, 1], ways, weights=weights),
    ]
    known = [[5 / 15, 5 / 15], [0.0, 5 / 15], [7 / 15, 7 / 15]]
    return counted(np.array(found) == known)


def light_through_screens() -> Asked:
    """Each of k screens that let half of the light through halves it, also along the diagonals of all: exactly 2^-k."""
    points, found, known = np.array([[0.5, 0.25, 0.0], [0.0, 0.0, 0.0]]), [], []
    suns = [[0.0, 0.0, 1.0], [1.0, 0.5, 4.0], [3.0, 3.0, 4.0]]
    for count in (1, 3, 20):
        mesh = Mesh.concatenate([box((-FAR, -FAR, 1.0 + k), (FAR, FAR, 1.5 + k)) for k in range(count)])
        octree, halves = Octree.from_mesh(mesh), np.full(len(mesh.faces), 0.5)
        left = 0.25**count  # below and above of each box
        found += [
            sun_hours(octree, points, None, suns, [1.0, 2.0, 4.0], transmittance=halves),
            occlusion(octree, points, [0, 0, 1], suns, transmittance=halves),
            sun_hours(octree, points, None, suns[:1], transmittance=halves, max_distance=1.75),
        ]
        known += [np.full(2, 7.0 * left), np.full(2, 1.0 - left), np.full(2, 0.25)]
    return counted(np.array(found) == known)


def faces_that_an_eye_sees() -> Asked:
    """Of a ball, an eye sees exactly the faces whose plane it is above."""
    mesh = icosphere(4)
    octree, wrong = Octree.from_mesh(mesh), 0
    eyes = 3.0 * fibonacci_sphere(12).directions
    for eye in eyes:
        corners = mesh.triangles
        above = np.einsum("ij,ij->i", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                          eye - corners[:, 0])  # fmt: skip
        seen = visible_faces(octree, eye)
        wrong += int((seen != (above > 0.0))[np.abs(above) > 1e-12].sum())
    return len(eyes) * len(mesh.faces), wrong


def clouds_and_depths() -> Asked:
    """Distances of a scan and a depth map equal those of exact hits within 4 ulp, and misses agree."""
    mesh = bodies()["balls"]
    octree, origin = Octree.from_mesh(mesh), np.array([0.25, -4.0, 0.5])
    ways = fibonacci_sphere(600).directions * np.linspace(0.25, 8.0, 600)[:, None]
    cloud = scan(octree, origin, ways)
    known = closest_hits(mesh.vertices, mesh.faces, np.tile(origin, (len(ways), 1)), ways)
    expected = np.array([float(hit.t) if hit else np.inf for hit in known]) * np.linalg.norm(ways, axis=1)
    found = np.full(len(ways), np.inf)
    found[cloud.rays] = cloud.distances
    camera = OrthographicCamera(eye=(0.0, 0.0, 9.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), height=4.0)
    depth = depth_map(octree, camera, 24, 24)
    x, y = np.meshgrid((np.arange(24) + 0.5) / 6.0 - 2.0, 2.0 - (np.arange(24) + 0.5) / 6.0)
    starts = np.stack([x.ravel(), y.ravel(), np.full(x.size, 9.0)], axis=1)
    lines = closest_hits(mesh.vertices, mesh.faces, starts, np.tile([0.0, 0.0, -1.0], (x.size, 1)))
    deep = np.array([float(hit.t) if hit else np.inf for hit in lines])
    return counted(np.concatenate([_near(found, expected), _near(depth.ravel(), deep)]))


def clouds_from_a_roof() -> Asked:
    """A scanner on a roof, at its edge or corner hits the roof at once where it looks through it; elsewhere exact
    arithmetic decides.
    """
    mesh = town(2, 3)
    octree, surface, ways = Octree.from_mesh(mesh), Surface(mesh.vertices, mesh.faces), fibonacci_sphere(300).directions
    top = np.flatnonzero(mesh.vertices[:, 2] == mesh.vertices[:, 2].max())
    middle = mesh.vertices[top].mean(axis=0)
    corner = mesh.vertices[top[0]]
    places = np.array([middle, (middle + corner) / 2.0, corner, (mesh.vertices[top[0]] + mesh.vertices[top[1]]) / 2.0])
    right = []
    for place, face in zip(places, octree.closest_point(places).face.tolist(), strict=True):
        start = surface.start_near(face, place)
        cloud = scan(octree, place, ways)
        found, faces = np.full(len(ways), np.inf), np.full(len(ways), -1)
        found[cloud.rays], faces[cloud.rays] = cloud.distances, cloud.faces
        law = [one[0] for one in surface.each([start] * len(ways), ways, [1] * len(ways), [False] * len(ways))]
        known = np.array([np.inf if one.t is None else float(one.t) for one in law])
        # How exact distances are, others tell: what is farther off than this is another hit.
        with np.errstate(invalid="ignore"):
            close = (found == known) | ((known > 0.0) & (np.abs(found - known) <= 1e-9 * known))
        right.append(close & [int(number) in (one.faces or (-1,)) for number, one in zip(faces, law, strict=True)])
    return counted(np.concatenate(right))


def places_of_a_grid() -> Asked:
    """Grid points written to a file and read back have the grid's own bits."""
    found = []
    for mesh, spacing in ((town(), 0.11), (terrain(), 0.02), (touching(), 0.125)):
        octree, study = Octree.from_mesh(mesh), Study("sky", {})
        grid_points = on_grid(octree, spacing).points
        with TemporaryDirectory(prefix="grid-") as folder:
            path = Path(folder) / "points.npy"
            np.save(path, np.concatenate([grid_points.points, grid_points.normals], axis=1))
            read = of_file(octree, path).points
        found.append(study.evaluate(octree, read) == study.evaluate(octree, grid_points))
    return counted(np.concatenate(found))


def edges_from_both_sides() -> Asked:
    """Points on a tetrahedron's edges see its centre, each other, and what lies in front of either of their faces."""
    rng = np.random.default_rng(_SEED)
    mesh = tetrahedron()
    corners, faces = mesh.vertices, mesh.faces
    octree, middle = Octree(corners, faces), corners.mean(axis=0)
    normals = octree.mesh.face_normals()
    right = []
    for i, j in np.argwhere(np.triu(np.ones((4, 4)), 1)):
        share = np.concatenate([[0.0, 1.0], rng.random(30)])[:, None]
        points = (1.0 - share) * corners[i] + share * corners[j]
        others = rng.dirichlet(np.ones(4), len(points)) @ corners
        right += [
            octree.visible(points, middle),
            octree.visible(middle, points),
            octree.visible(points, others),
            octree.visible(points, points[::-1]),
            octree.visible(points, np.roll(corners, 1, axis=0)[i]),
        ]
        away = middle + 3.0 * rng.normal(size=(len(points), 3))
        outside = ~octree.contains(away)
        held = (faces[:, :, None] == [i, j]).any(axis=1)
        # At a corner there are three faces, along the edge two.
        at = np.where(share == 0.0, held[:, 0], np.where(share == 1.0, held[:, 1], held.all(axis=1)))
        before = at & (np.einsum("fx,nx->nf", normals, away) > np.einsum("fx,fx->f", normals, corners[faces[:, 0]]))
        right += [
            (octree.visible(points, away) == before.any(axis=1))[outside],
            (octree.visible(away, points) == before.any(axis=1))[outside],
        ]
    return counted(np.concatenate(right))


def _near(found: Floats, known: Floats) -> NDArray[np.bool_]:
    """Equal, both infinite, or within 4 ulp; a scan multiplies t by a length, both rounded."""
    with np.errstate(invalid="ignore"):
        close = np.abs(found - known) <= 4.0 * np.spacing(np.where(np.isfinite(known), known, 1.0))
    return (found == known) | close


CHECKS = {
    "moved to UTM coordinates": Check(moved_to_utm, ("studies.sky_view_factor", "studies.occlusion")),
    "threads, order and company": Check(threads_order_and_company, ("studies.sky_view_factor",)),
    "light through walls that touch": Check(no_light_through_touching_walls, ("studies.occlusion",)),
    "shade among faces of a plane": Check(
        no_shade_among_faces_of_a_plane, ("studies.sky_view_factor", "studies.ambient_occlusion")
    ),
    "two sides of a thin plate": Check(two_sides_of_a_thin_plate, ("studies.sky_view_factor",)),
    "points inside bodies": Check(
        dark_inside_bodies,
        ("studies.openness", "studies.sky_view_factor", "studies.ambient_occlusion", "studies.occlusion"),
    ),
    "hours of sun in a street": Check(hours_behind_walls, ("studies.sun_hours",)),
    "weights and distances": Check(weights_and_distances_of_directions, ("studies.occlusion",)),
    "light through screens": Check(light_through_screens, ("studies.sun_hours", "studies.occlusion")),
    "faces that an eye sees": Check(faces_that_an_eye_sees, ("studies.visible_faces",)),
    "clouds and depths": Check(clouds_and_depths, ("studies.scan", "studies.depth_map")),
    "clouds from a roof": Check(clouds_from_a_roof, ("studies.scan",)),
    "places of a grid": Check(places_of_a_grid, ()),
    "edges from both sides": Check(edges_from_both_sides, ("Octree.visible",)),
}


def check(name: str) -> dict[str, Any]:
    """A row: the number of answers, and of those that are not as they must be."""
    return row_of(name, CHECKS[name])
