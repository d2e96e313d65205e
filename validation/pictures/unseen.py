"""Pictures in which some things cannot be seen: no way out of closed mirrors, and no air between bodies that touch.

The sky is bright and all else is dark, so that one pixel that sees what it cannot is seen. What plane glass lets
through has a closed form.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.picture.render import render
from renderer.scene.camera import OrthographicCamera, PerspectiveCamera
from renderer.scene.scene import UNLIMITED_RAYS, Floor, Scene, SceneObject
from validation.gates import Gate
from validation.job import Job
from validation.meshes import mirror_bodies
from validation.pictures.explain.optics import fresnel

Floats = NDArray[np.float64]
Part = tuple[Mesh, Material]

# Radiance is stored as float32: half an ulp is 2^-24 of it, and as much is left for some dozen roundings in float64.
STORED = 2.0**-23
_SKY = 1000.0
_DEPTH = 30
# Of a view of all around a place, and of views so narrow that each ray passes it within 1e-5 and 1e-9 of the body.
_VIEWS = (60.0, 1e-3, 1e-7)
_DARK = Phong(diffuse=0.0, ambient=0.0)
# Nothing is reflected: what these do not let through is lost.
_CLEAR, _WATER = Dielectric(ior=1.5, reflectance=0.0), Dielectric(ior=1.33, reflectance=0.0)
_AIR = Phong(diffuse=0.0, ambient=0.0, transmittance=0.9, ior=1.0)
_EYES = ((2.3, 3.0, 4.1), (-1.7, 5.0, 0.4), (0.0, 4.0, 4.0))
_FLOOR = Floor(min=(-99.0, -99.0), max=(99.0, 99.0), materials=("dark",), squares=(3, 3))
# Heights of the ground: a third has no float64, so that the same plane has many roundings.
_HEIGHTS = (0.0, 1e3 / 3.0)


class Row(NamedTuple):
    """Some pictures: the number of pixels, and of those that see what they cannot, or the largest relative error."""

    subject: str
    pixels: int
    wrong: int | None
    error: float | None


def steps() -> int:
    """Number of calls of ``job.step``."""
    return 3


def check_unseen(job: Job) -> tuple[list[dict[str, Any]], list[Gate]]:
    """Draw all pictures; returns records for JSON and the gates."""
    size = 13 if job.quick else 27
    rows: list[Row] = []
    job.step("pictures: inside of mirrors")
    rows += [_mirrors(name, mesh, size) for name, mesh in mirror_bodies().items()]
    job.step("pictures: glass on the ground")
    for name, scenes in grounds().items():
        found = [unseen(scene, 2 * size, max_depth=8) for scene in scenes]
        rows.append(Row(name, sum(asked for asked, _ in found), sum(wrong for _, wrong in found), None))
    job.step("pictures: glass on glass")
    rows += list(_fresnel(3 if job.quick else 16))
    return [row._asdict() for row in rows], [_gate(row) for row in rows]


def _gate(row: Row) -> Gate:
    subject = f"{row.subject}, {row.pixels:,} pixels"
    if row.error is None:
        value, reason = (
            float(row.wrong or 0),
            "no path leads to the sky: the surface has no holes, and no air lies in between",
        )
        return Gate("images", subject, "pixels that see the hidden sky", value, "at most", 0.0, reason)
    reason = "Fresnel's formula at each plane; 2^-23: stored as float32"
    return Gate("images", subject, "relative error of transmitted light", row.error, "at most", STORED, reason)


def unseen(scene: Scene, size: int, **options: Any) -> tuple[int, int]:
    """The number of pixels of a picture that see a surface, and of these that see light, of which there is none."""
    image = render(scene, resolution=(size, size), samples=1, max_rays=UNLIMITED_RAYS, min_weight=0.0, **options)
    met = image.face >= 0
    return int(met.sum()), int((met & ~(image.radiance == 0.0).all(axis=-1)).sum())


def scene_of(parts: Sequence[Part], camera: Any, **more: Any) -> Scene:
    """Parts in front of a bright sky, without other light; equal materials are one."""
    materials: dict[str, Any] = {str(material): material for _, material in parts}
    objects = tuple(SceneObject(mesh=mesh, material=str(material), normals="flat") for mesh, material in parts)
    more.setdefault("background", _SKY)
    return Scene(camera=camera, materials={**materials, "dark": _DARK}, objects=objects, **more)


# ------------------------------------------------------------------------------------------------- closed mirrors


def _mirrors(name: str, mesh: Mesh, size: int) -> Row:
    asked, wrong = 0, 0
    for scene in from_within(mesh):
        met, seen = unseen(scene, size, max_depth=_DEPTH)
        # A pixel that meets nothing sees the sky at once.
        asked, wrong = asked + size * size, wrong + seen + size * size - met
    return Row(f"{name} of mirrors from within, {_DEPTH} reflections", asked, wrong, None)


def from_within(mesh: Mesh) -> Iterator[Scene]:
    """Views from the middle of a body at its corners, and at the middles of its edges and faces."""
    vertices, corners = np.asarray(mesh.vertices, np.float64), mesh.triangles
    edges = (corners + np.roll(corners, 1, axis=1)).reshape(-1, 3) / 2.0
    eye = vertices.mean(axis=0)
    for target in np.concatenate([vertices, edges, corners.mean(axis=1)]):
        for fov in _VIEWS:
            camera = PerspectiveCamera(eye=eye.tolist(), target=target.tolist(), up=(0.12, 0.75, -0.64), fov=fov)
            yield scene_of([(mesh, Mirror())], camera)


# ---------------------------------------------------------------------------------------------- glass on the ground


def grounds() -> dict[str, list[Scene]]:
    """Glass that stands on dark ground, whose sky no pixel of it sees: rays that enter it go down, or are lost."""
    found: dict[str, list[Scene]] = {}
    for name, material in (("glass", _CLEAR), ("a body of index 1", _AIR)):
        found[f"{name} on a floor"] = [_seen_from(eye, [(_cube(0.0), material)], floor=_FLOOR) for eye in _EYES]
        for what, make in (("on a plane", _on_plane), ("stacked", _stacked), ("nested", _nested)):
            found[f"{name} {what}"] = [
                _seen_from(eye, parts, y)
                for y in _HEIGHTS
                for flipped in (False, True)
                for parts in _both_ways([*make(y, material), (_plane(y, flipped), _DARK)])
                for eye in _EYES
            ]
        found[f"{name} in a corner"] = [_in_corner(parts) for parts in _both_ways(_walls(material))]
    return found


def _both_ways(parts: list[Part]) -> tuple[list[Part], list[Part]]:
    return parts, parts[::-1]


def _seen_from(eye: tuple[float, float, float], parts: Sequence[Part], y: float = 0.0, **more: Any) -> Scene:
    eye, target = (eye[0], eye[1] + y, eye[2]), (0.0, y + 0.4, 0.0)
    return scene_of(parts, PerspectiveCamera(eye=eye, target=target, up=(0.1, 0.7, -0.7), fov=30.0), **more)


def _cube(y: float, size: float = 1.0, height: float = 1.0) -> Mesh:
    return box((-0.5 * size, y, -0.5 * size), (0.5 * size, y + height, 0.5 * size))


def _plane(y: float, flipped: bool) -> Mesh:
    """A large square whose diagonal passes below the cubes, or the other diagonal."""
    square = [[-99.0, y, -99.0], [-99.0, y, 99.0], [99.0, y, 99.0], [99.0, y, -99.0]]
    return Mesh(square, [[0, 1, 3], [1, 2, 3]] if flipped else [[0, 1, 2], [0, 2, 3]])


def _on_plane(y: float, material: Material) -> list[Part]:
    return [(_cube(y), material)]


def _stacked(y: float, material: Material) -> list[Part]:
    """A small one and one of water on it, and beside it a third against its side."""
    beside = box((0.5, y, -0.5), (1.0, y + 0.5, 0.25))
    return [
        (_cube(y, 1.0, 0.5), material),
        (box((-0.5, y + 0.5, -0.5), (0.25, y + 1.0, 0.5)), _WATER),
        (beside, _WATER),
    ]


def _nested(y: float, material: Material) -> list[Part]:
    """A body in another one, of which it touches the floor and two sides."""
    return [(_cube(y), material), (box((-0.5, y, -0.5), (0.0, y + 0.5, 0.25)), _WATER)]


def _walls(material: Material) -> list[Part]:
    walls = (
        box((-2.0, -1.0, -2.0), (2.0, 0.0, 2.0)),
        box((-2.0, 0.0, -2.0), (0.0, 3.0, 2.0)),
        box((0.0, 0.0, -2.0), (2.0, 3.0, 0.0)),
    )
    return [*((wall, _DARK) for wall in walls), (box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), material)]


def _in_corner(parts: Sequence[Part]) -> Scene:
    camera = PerspectiveCamera(eye=(3.1, 2.7, 3.3), target=(0.4, 0.4, 0.4), up=(0.1, 0.7, -0.7), fov=30.0)
    return scene_of(parts, camera)


# --------------------------------------------------------------------------------------------------- glass on glass


def passed(angle: float, *indices: float) -> float:
    """The share that goes through plane interfaces between media of such indices, from an angle in the first, in
    degrees; of unpolarised light at each, as the renderer's contract has it.

    >>> round(passed(0.0, 1.0, 1.5), 12)
    0.96
    """
    share, sine = 1.0, math.sin(math.radians(angle)) * indices[0]
    for n1, n2 in pairwise(indices):
        c1, c2 = math.sqrt(1.0 - (sine / n1) ** 2), math.sqrt(1.0 - (sine / n2) ** 2)
        share *= 1.0 - fresnel(c1, c2, n1, n2)
    return share


_ANGLES = (0.0, 20.0, 50.0, 75.0)
# Indices of slabs from above, each on the next.
_PILES = {
    "two slabs of one glass": (1.5, 1.5),
    "two slabs": (1.33, 1.7),
    "three slabs": (1.5, 1.33, 1.8),
    "five slabs": (1.2, 2.4, 1.2, 1.5, 1.5),
}


def _fresnel(size: int) -> Iterator[Row]:
    """Slabs on each other in all orders, a body in water that touches its bottom, and a mirror below glass."""
    for name, indices in _PILES.items():
        slabs = [(_slab(-k, 1.0 - k), _of(index)) for k, index in enumerate(indices)]
        orders = (slabs, slabs[::-1], slabs[1:] + slabs[:1])
        asked = [(order, passed(angle, 1.0, *indices, 1.0), angle) for order in orders for angle in _ANGLES]
        yield _worst(name, asked, size)
    # The body is later in the scene, so that it holds where both begin.
    water, body = (_slab(0.0, 3.0), _of(1.33)), _of(1.7)
    asked = [([water, (_slab(low, low + 2.0), body)], passed(angle, 1.0, 1.33, 1.7, 1.0), angle)
             for low in (0.0, 1.0) for angle in _ANGLES]  # fmt: skip
    yield _worst("a body in water at its wall", asked, size)
    ground = (_slab(-1.0, 0.0), Mirror(reflectance=0.9))
    glass = (_slab(0.0, 1.0), _of(1.5))
    asked = [(parts, 0.9 * passed(angle, 1.0, 1.5) ** 2, angle)
             for parts in _both_ways([ground, glass]) for angle in _ANGLES]  # fmt: skip
    yield _worst("a mirror below glass", asked, size)
    yield _along_diagonals(16 * size)
    yield _within_planes(2 * size + 1)
    yield _through_edges(8 * size)


def _slab(low: float, high: float) -> Mesh:
    return box((-60.0, low, -60.0), (60.0, high, 60.0))


def _of(index: float) -> Material:
    return Dielectric(ior=index, reflectance=0.0)


def _error(found: Floats, known: float) -> float:
    """The largest relative error."""
    return float(np.abs(found / known - 1.0).max())


def _worst(subject: str, asked: Sequence[tuple[Sequence[Part], float, float]], size: int) -> Row:
    """The largest relative error of pictures with one known radiance each."""
    worst = 0.0
    for parts, known, angle in asked:
        worst = max(worst, _error(through(parts, angle, size), known))
    return Row(subject, len(asked) * size * size, None, worst)


# The middle of two slabs, and their width: there the last bit of a coordinate is 10^-8 of the width.
_FAR, _WIDTH = (1e6, 0.0, 3e6), 0.01


def _along_diagonals(count: int) -> Row:
    """Slabs far from the origin, seen from above along both diagonals of the square in which they touch."""
    x, y, z = _FAR
    low, high = (x - _WIDTH / 2, z - _WIDTH / 2), (x + _WIDTH / 2, z + _WIDTH / 2)
    parts = [(box((low[0], k - 1.0, low[1]), (high[0], float(k), high[1])), _of(1.5)) for k in (0, 1)]
    worst, length = 0.0, 0.98 * math.sqrt(2.0) * _WIDTH
    for across in ((1.0, 0.0, 1.0), (1.0, 0.0, -1.0)):
        camera = OrthographicCamera(eye=(x, y + 9.0, z), target=_FAR, up=across, height=length / count)
        found = _seen(scene_of(parts, camera, background=1.0), (count, 1))
        worst = max(worst, _error(found, passed(0.0, 1.0, 1.5, 1.0)))
    return Row("two slabs of one glass far from the origin, along diagonals", 2 * count, None, worst)


# The axes of columns, and upwards in pictures, so that rays are exactly within the planes, and a rounding off them.
_AXES = ((0.0, 0.0, 0.0), (0.3, -0.7, 1.1), (929.8, 831.9, 209.1), (-241.3, 200.7, 786.6), (437.3, 174.8, 99.9))
_TURNS = ((1.0, 0.0, 3.0), (1.0, 0.0, 1.0), (2.0, 0.0, 1.0), (3.0, 0.0, -1.0))


def _within_planes(size: int) -> Row:
    """Columns of four materials around an axis, alone and on a plate, seen along it: a ray within the planes in which
    they touch passes one of them.
    """
    known, errors = passed(0.0, 1.0, 1.5, 1.0), []
    for axis, end, up in product(_AXES, (9.0, -9.0), _TURNS):
        eye = (axis[0], axis[1] + end, axis[2])
        camera = OrthographicCamera(eye=eye, target=axis, up=up, height=1.0)
        plate, columns = (box_at(axis, (-3.0, -1.0, -3.0), (3.0, 0.0, 3.0)), _of(1.5)), list(columns_at(axis))
        for parts in (columns, [*columns[:2], plate, *columns[2:]]):
            errors.append(_error(_seen(scene_of(parts, camera, background=1.0), (size, size)), known))
    return Row("rays within the planes in which columns touch", len(errors) * size * size, None, max(errors))


def _through_edges(count: int) -> Row:
    """Wide columns seen obliquely: rays enter where two of them touch, or pass within them through the edge of four."""
    columns, errors = list(columns_at((0.0, 0.0, 0.0), 60.0)), []
    half = math.sqrt(0.5)
    ways = (((1.0, 0.0), (count, 1)), ((half, half), (1, count)))
    for parts, angle, turned in product((columns, columns[::-1]), _ANGLES[1:], (9.0, -9.0)):
        aside, known = turned * math.tan(math.radians(angle)), passed(angle, 1.0, 1.5, 1.0)
        for (x, z), resolution in ways:
            camera = OrthographicCamera(
                eye=(x * aside, 10.0, z * aside), target=(0.0, 1.0, 0.0), up=(x, 0.0, z), height=3.0 / resolution[0]
            )
            errors.append(_error(_seen(scene_of(parts, camera, background=1.0), resolution), known))
    return Row("rays through the edges at which columns touch", len(errors) * count, None, max(errors))


def columns_at(axis: tuple[float, float, float], width: float = 1.0) -> Iterator[Part]:
    """Four columns of indices that differ, but by less than anything shows."""
    for k, (x, z) in enumerate(((0.0, 0.0), (-width, 0.0), (-width, -width), (0.0, -width))):
        yield box_at(axis, (x, 0.0, z), (x + width, 1.0, z + width)), _of(1.5 + k * 2.0**-40)


def box_at(axis: tuple[float, float, float], low: tuple[float, ...], high: tuple[float, ...]) -> Mesh:
    return box(np.add(axis, low).tolist(), np.add(axis, high).tolist())


def through(parts: Sequence[Part], angle: float, size: int) -> Floats:
    """The radiance along parallel rays at an angle from above, under a sky of 1."""
    t = math.radians(angle)
    target = np.array([0.3, 0.0, 0.2])
    eye = target + 20.0 * np.array([math.sin(t), math.cos(t), 0.0])
    camera = OrthographicCamera(eye=eye.tolist(), target=target.tolist(), up=(0.0, 0.0, 1.0), height=0.01)
    return _seen(scene_of(parts, camera, background=1.0), (size, size))


def _seen(scene: Scene, resolution: tuple[int, int]) -> Floats:
    image = render(scene, resolution=resolution, samples=1, max_depth=12, max_rays=UNLIMITED_RAYS, min_weight=0.0)
    return np.asarray(image.radiance[..., 0], np.float64)
