"""Write the PLY models of our own making: ``python scenes/make_models.py [folder]``.

Seeded and deterministic: each run writes the same bytes. Every part is closed and its faces wind
counter-clockwise seen from outside; vertices are shared between faces, so that interpolated normals are
smooth. y is up, and all but the unit sphere stand on y = 0.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.mesh.load import save_ply
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, lattice_faces

Array = NDArray[np.float64]

SEED = 20

# sin and cos differ in the last bit between processors. Coordinates on this grid, far coarser than that and
# far finer than anything seen, are the same on all of them, and float32 holds each exactly below 16.
GRID = 2.0**-20


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, mesh in models().items():
        save_ply(mesh, folder / f"{name}.ply")


def models() -> dict[str, Mesh]:
    """All models by name, their vertices exact in float32."""
    return {
        "teapot": on_grid(teapot()),
        "torus_knot": on_grid(torus_knot()),
        "displaced_sphere": on_grid(displaced_sphere()),
        "sphere": in_float32(icosphere(5)),
        "stairs": stairs(),
        "block": box((0, 0, 0), (1, 1, 1)),
        **{name: in_float32(mesh) for name, mesh in cornell_box().items()},
    }


# --- teapot: about 2 wide, spout towards +x -----------------------------------------------------------------

# Profiles (distance from the axis, height), each row a cubic Bezier curve, from the lower pole to the upper.
BODY_PROFILE = [
    [(0.00, 0.030), (0.12, 0.030), (0.24, 0.030), (0.30, 0.022)],  # hollow of the foot
    [(0.30, 0.022), (0.32, 0.000), (0.37, 0.000), (0.385, 0.014)],  # foot ring
    [(0.385, 0.014), (0.40, 0.035), (0.40, 0.055), (0.43, 0.080)],
    [(0.43, 0.080), (0.56, 0.160), (0.645, 0.270), (0.645, 0.400)],  # belly
    [(0.645, 0.400), (0.645, 0.560), (0.53, 0.690), (0.405, 0.765)],  # shoulder
    [(0.405, 0.765), (0.38, 0.780), (0.385, 0.815), (0.365, 0.820)],  # rim
    [(0.365, 0.820), (0.34, 0.825), (0.335, 0.800), (0.33, 0.780)],
    [(0.33, 0.780), (0.22, 0.775), (0.10, 0.775), (0.00, 0.775)],  # closed below the lid
]
LID_PROFILE = [
    [(0.00, 0.785), (0.10, 0.785), (0.22, 0.785), (0.318, 0.790)],
    [(0.318, 0.790), (0.325, 0.800), (0.325, 0.815), (0.325, 0.830)],
    [(0.325, 0.830), (0.35, 0.828), (0.362, 0.836), (0.355, 0.848)],  # brim, over the rim
    [(0.355, 0.848), (0.27, 0.900), (0.17, 0.915), (0.085, 0.935)],  # dome
    [(0.085, 0.935), (0.045, 0.945), (0.042, 0.965), (0.052, 0.985)],  # neck
]
KNOB_PROFILE = [
    [(0.00, 0.960), (0.02, 0.960), (0.03, 0.965), (0.04, 0.972)],
    [(0.04, 0.972), (0.09, 0.985), (0.11, 1.010), (0.11, 1.040)],
    [(0.11, 1.040), (0.11, 1.085), (0.06, 1.105), (0.00, 1.105)],
]
# Centre lines (x, y), each row one cubic Bezier curve; both begin and end inside the body.
SPOUT_PATH = [
    [(0.40, 0.300), (0.62, 0.290), (0.74, 0.360), (0.80, 0.500)],
    [(0.80, 0.500), (0.86, 0.640), (0.88, 0.740), (1.00, 0.830)],
]
HANDLE_PATH = [
    [(-0.42, 0.680), (-0.60, 0.760), (-0.80, 0.790), (-0.90, 0.700)],
    [(-0.90, 0.700), (-1.03, 0.580), (-0.93, 0.330), (-0.55, 0.230)],
]


def teapot() -> Mesh:
    lid = np.concatenate([bezier(LID_PROFILE, 6), [(0.0, 0.99)]])
    parts = [
        lathe(bezier(BODY_PROFILE, 7), 60),
        lathe(lid, 60),
        lathe(bezier(KNOB_PROFILE, 6), 32),
        spout(),
        handle(),
    ]
    whole = Mesh.concatenate(parts, name="teapot")
    return Mesh(whole.vertices - [0, whole.bounds[0][1], 0], whole.faces, name="teapot")


def spout() -> Mesh:
    """A tube that narrows, and at its mouth turns back into itself, so that it looks hollow."""
    s = np.linspace(0, 1, 37)
    outer = 0.072 + 0.135 * (1 - s) ** 1.6 + 0.012 * s**6
    lip = outer[-1]
    # From the outside over a half-round lip to the inside.
    turn = np.linspace(0, np.pi, 7)[1:-1]
    inside = np.linspace(1, 0.6, 12)
    along = np.concatenate([s, 1 + 0.010 * np.sin(turn), inside])
    radii = np.concatenate([outer, lip - 0.009 + 0.009 * np.cos(turn), np.interp(inside, s, outer) - 0.018])
    return tube(*path_at(SPOUT_PATH, along), np.stack([radii, radii], axis=1), 28)


def handle() -> Mesh:
    """A tube, wider than thick, thickest at its ends."""
    s = np.linspace(0, 1, 49)
    thickness = 0.042 + 0.022 * (2 * s - 1) ** 4
    return tube(*path_at(HANDLE_PATH, s), np.stack([thickness, 1.35 * thickness], axis=1), 20)


# --- the other models ---------------------------------------------------------------------------------------


def torus_knot() -> Mesh:
    """The trefoil that winds twice around the axis and three times through the hole, about 2 across."""
    t = np.arange(400) * (2 * np.pi / 400)
    ring = 2 + np.cos(3 * t)
    centre = np.stack([ring * np.cos(2 * t), ring * np.sin(2 * t), np.sin(3 * t)], axis=1)
    dring = -3 * np.sin(3 * t)
    tangent = np.stack(
        [
            dring * np.cos(2 * t) - 2 * ring * np.sin(2 * t),
            dring * np.sin(2 * t) + 2 * ring * np.cos(2 * t),
            3 * np.cos(3 * t),
        ],
        axis=1,
    )
    # Away from the torus's core and along its surface: a frame that closes after one turn.
    core = np.stack([2 * np.cos(2 * t), 2 * np.sin(2 * t), np.zeros_like(t)], axis=1)
    binormal = unit(np.cross(tangent, centre - core))
    normal = unit(np.cross(binormal, tangent))
    angle = np.arange(50)[None, :, None] * (2 * np.pi / 50)
    points = centre[:, None] + 0.42 * (np.cos(angle) * normal[:, None] + np.sin(angle) * binormal[:, None])
    points = points.reshape(-1, 3)
    points *= 2 / np.ptp(points, axis=0).max()
    return standing(Mesh(points, lattice_faces(400, 50, wrap_rows=True, wrap_columns=True), name="torus_knot"))


def displaced_sphere() -> Mesh:
    """A sphere with seeded hills: a sum of plane sine waves, shorter ones lower."""
    rng = np.random.default_rng(SEED)
    sphere = icosphere(6)
    height = np.zeros(len(sphere.vertices))
    for _ in range(40):
        wave = unit(rng.normal(size=3)) * rng.uniform(2.5, 18)
        phase = rng.uniform(0, 2 * np.pi)
        height += np.sin((sphere.vertices * wave).sum(axis=1) + phase) / (wave**2).sum() ** 0.4
    points = sphere.vertices * (1 + 0.035 * height)[:, None]
    points *= 1.6 / np.ptp(points, axis=0).max()
    return standing(Mesh(points, sphere.faces, name="displaced_sphere"))


def stairs(steps: int = 5, rise: float = 0.5, width: float = 4.0) -> Mesh:
    """Steps as deep as high, going up towards -z, centred on the y axis; coordinates are exact in binary."""
    front = steps * rise / 2
    profile = [(-front, 0.0), (front, 0.0)]
    for step in range(steps):
        profile += [(front - step * rise, (step + 1) * rise), (front - (step + 1) * rise, (step + 1) * rise)]
    count = len(profile)
    vertices = [(x, y, z) for x in (width / 2, -width / 2) for z, y in profile]
    edge = np.arange(count)
    rim = lattice_faces(2, count, wrap_columns=True)
    # The lower back corner sees the whole profile, so a fan from it fills either side.
    fan = np.stack([np.zeros(count - 2, int), edge[2:], edge[1:-1]], axis=1)
    faces = np.concatenate([rim, fan, count + fan[:, ::-1]])
    return Mesh(np.array(vertices), faces.astype(np.int32), name="stairs")


# --- Cornell box: https://www.graphics.cornell.edu/online/box/data.html, in millimetres ----------------------

# Corners of quadrilaterals, counter-clockwise seen from where they are lit.
CORNELL_FLOOR = [(552.8, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 559.2), (549.6, 0.0, 559.2)]
CORNELL_CEILING = [(556.0, 548.8, 0.0), (556.0, 548.8, 559.2), (0.0, 548.8, 559.2), (0.0, 548.8, 0.0)]
CORNELL_BACK = [(549.6, 0.0, 559.2), (0.0, 0.0, 559.2), (0.0, 548.8, 559.2), (556.0, 548.8, 559.2)]
CORNELL_RIGHT = [(0.0, 0.0, 559.2), (0.0, 0.0, 0.0), (0.0, 548.8, 0.0), (0.0, 548.8, 559.2)]
CORNELL_LEFT = [(552.8, 0.0, 0.0), (549.6, 0.0, 559.2), (556.0, 548.8, 559.2), (556.0, 548.8, 0.0)]
CORNELL_LAMP = [(343.0, 548.8, 227.0), (343.0, 548.8, 332.0), (213.0, 548.8, 332.0), (213.0, 548.8, 227.0)]
# The upper faces of the blocks.
CORNELL_SHORT = [(130.0, 165.0, 65.0), (82.0, 165.0, 225.0), (240.0, 165.0, 272.0), (290.0, 165.0, 114.0)]
CORNELL_TALL = [(423.0, 330.0, 247.0), (265.0, 330.0, 296.0), (314.0, 330.0, 456.0), (472.0, 330.0, 406.0)]


def cornell_box() -> dict[str, Mesh]:
    """The Cornell box by its colours; the lamp fills a hole of the ceiling."""
    ring = [
        [CORNELL_CEILING[k], CORNELL_CEILING[(k + 1) % 4], CORNELL_LAMP[(k + 1) % 4], CORNELL_LAMP[k]] for k in range(4)
    ]
    blocks = [quad for upper in (CORNELL_SHORT, CORNELL_TALL) for quad in [upper, *block_sides(upper)]]
    return {
        "cornell_white": quads([CORNELL_FLOOR, CORNELL_BACK, *ring, *blocks], "cornell_white"),
        "cornell_red": quads([CORNELL_LEFT], "cornell_red"),
        "cornell_green": quads([CORNELL_RIGHT], "cornell_green"),
        "cornell_lamp": quads([CORNELL_LAMP], "cornell_lamp"),
    }


def block_sides(upper: list[tuple[float, float, float]]) -> list[list[tuple[float, float, float]]]:
    """The upright sides of a block that stands on the floor."""
    foot = [(x, 0.0, z) for x, _, z in upper]
    return [[foot[k], foot[(k + 1) % 4], upper[(k + 1) % 4], upper[k]] for k in range(4)]


def quads(corners: ArrayLike, name: str) -> Mesh:
    """Quadrilaterals, each as two faces; corners at one place are one vertex."""
    vertices, corner = np.unique(np.reshape(corners, (-1, 3)), axis=0, return_inverse=True)
    first, second, third, fourth = corner.reshape(-1, 4).T
    faces = np.stack([np.stack([first, second, third], 1), np.stack([first, third, fourth], 1)], 1).reshape(-1, 3)
    return Mesh(vertices, faces.astype(np.int32), name=name)


# --- surfaces from curves -----------------------------------------------------------------------------------


def bezier(curves: ArrayLike, samples: int) -> Array:
    """Points along cubic Bezier curves that join end to end, ``samples`` a curve, ends included: (n, 2)."""
    count = len(np.asarray(curves))
    return path_at(curves, np.linspace(0, 1, count * samples + 1))[0]


def path_at(curves: ArrayLike, s: Array) -> tuple[Array, Array]:
    """Points and unit tangents at s: 0 where the first curve starts, 1 where the last ends, then straight."""
    control = np.asarray(curves, dtype=np.float64)
    piece = np.clip((s * len(control)).astype(int), 0, len(control) - 1)
    within = np.minimum(s * len(control) - piece, 1.0)
    beyond = np.maximum(s - 1.0, 0.0)
    t = within[:, None]
    a, b, c, d = (control[piece, k] for k in range(4))
    point = (1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t**2 * c + t**3 * d
    tangent = unit((1 - t) ** 2 * (b - a) + 2 * (1 - t) * t * (c - b) + t**2 * (d - c))
    return point + beyond[:, None] * tangent, tangent


def lathe(profile: Array, segments: int) -> Mesh:
    """The profile (radius, height), from pole to pole with the outside at its right, turned about y."""
    angle = np.arange(segments) * (2 * np.pi / segments)
    radius, height = (profile[1:-1, k][:, None] for k in range(2))
    rings = np.stack(
        [radius * np.cos(angle), np.broadcast_to(height, (len(radius), segments)), -radius * np.sin(angle)],
        axis=-1,
    )
    poles = np.array([[0, profile[0, 1], 0], [0, profile[-1, 1], 0]])
    return capped(rings, poles)


def tube(centres: Array, tangents: Array, radii: Array, segments: int) -> Mesh:
    """Elliptic rings about a curve in the plane z = 0.

    centres, tangents : (n, 2). radii : (n, 2), in the plane and along z.
    """
    angle = np.arange(segments) * (2 * np.pi / segments)
    normals = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    across = radii[:, :1] * np.cos(angle)
    flat = centres[:, None] + across[:, :, None] * normals[:, None]
    rings = np.concatenate([flat, (radii[:, 1:] * np.sin(angle))[:, :, None]], axis=-1)
    poles = np.concatenate([centres[[0, -1]], np.zeros((2, 1))], axis=1)
    return capped(rings, poles)


def capped(rings: Array, poles: Array) -> Mesh:
    """A closed surface over (rings, segments, 3) points, a fan from either pole closing its end.

    Seen from outside, with the rings going up, segments run to the right.
    """
    count, segments, _ = rings.shape
    around = np.arange(segments)
    after = (around + 1) % segments
    low, high = count * segments, count * segments + 1
    top = (count - 1) * segments
    faces = [
        lattice_faces(count, segments, wrap_columns=True),
        np.stack([np.full(segments, low), after, around], axis=1),
        np.stack([np.full(segments, high), top + around, top + after], axis=1),
    ]
    return Mesh(np.concatenate([rings.reshape(-1, 3), poles]), np.concatenate(faces).astype(np.int32))


# --- finish -------------------------------------------------------------------------------------------------


def unit(vectors: Array) -> Array:
    lengths: Array = np.sqrt((vectors**2).sum(axis=-1, keepdims=True))
    return vectors / lengths


def standing(mesh: Mesh) -> Mesh:
    """Centred on the y axis, its lowest point at y = 0."""
    lower, upper = mesh.bounds
    middle = (lower + upper) / 2
    return Mesh(mesh.vertices - [middle[0], lower[1], middle[2]], mesh.faces, name=mesh.name)


def on_grid(mesh: Mesh) -> Mesh:
    # Adding 0 turns -0, whose sign depends on rounding, into 0.
    return Mesh(np.round(mesh.vertices / GRID) * GRID + 0.0, mesh.faces, name=mesh.name)


def in_float32(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices.astype(np.float32), mesh.faces, name=mesh.name)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "models")
