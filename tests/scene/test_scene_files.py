"""The committed scenes: all load and render, and the stairs are hit where they were built."""

from pathlib import Path

import numpy as np
import pytest
from cases import cases

from renderer.picture.render import render
from renderer.scene.camera import OrthographicCamera, primary_rays
from renderer.scene.scene import load_scene

SCENES = Path(__file__).parents[2] / "scenes"
FILES = sorted(SCENES.glob("*.toml"))


def test_they_are_all_here() -> None:
    assert {"three_models", "glass", "mirrors", "stairs"} <= {path.stem for path in FILES}


@cases("path", FILES)
def test_each_renders(path: Path) -> None:
    scene = load_scene(path)
    image = render(scene, resolution=(32, 32), threads=2)
    assert np.isfinite(image.radiance).all() and (image.radiance >= 0).all()
    hit = image.face >= 0
    assert hit.mean() > 0.3 and image.radiance[hit].std() > 0.05
    assert (np.isfinite(image.depth) == hit).all()
    lengths = np.linalg.norm(image.normal, axis=-1)
    np.testing.assert_allclose(lengths[hit], 1.0, rtol=2.0**-22)  # three float32 roundings
    assert (lengths[~hit] == 0).all()
    # A pixel's rays: one, and for each light one shadow ray at each of at most 2^(depth + 1) - 1 hits.
    assert image.rays.min() >= 1 and (not scene.all_lights or (image.rays[hit] >= 2).mean() > 0.5)
    # Whoever looks sees every object: some pixel of each instance.
    ends = np.cumsum([len(i.mesh.faces) for i in scene.instances])
    seen = set(np.searchsorted(ends, image.face[hit], side="right").tolist())
    assert len(seen) >= min(4, len(ends)), f"only instances {seen} of {len(ends)} are seen"


@cases("path", FILES)
def test_octree_and_brute_force_give_the_same_bits(path: Path) -> None:
    scene = load_scene(path)
    tree, brute = (render(scene, resolution=(8, 8), accelerator=a, threads=2) for a in ("octree", "brute"))
    for name in ("radiance", "depth", "normal", "face", "rays"):
        assert getattr(tree, name).tobytes() == getattr(brute, name).tobytes(), name


def stairs_by_hand(o: np.ndarray, d: np.ndarray) -> tuple[float, np.ndarray]:
    """Nearest of the planes that the five steps, their sides and the floor are made of: (t, normal)."""
    best, normal = np.inf, np.zeros(3)

    def offer(axis: int, level: float, inside: np.ndarray) -> None:
        nonlocal best, normal
        t = (level - o[axis]) / d[axis]
        p = o + t * d
        low, high = inside
        others = [k for k in range(3) if k != axis]
        if 0 < t < best and all(low[k] <= p[k] <= high[k] for k in others):
            best, normal = t, np.eye(3)[axis]

    for step in range(5):
        front, top = 1.25 - 0.5 * step, 0.5 * (step + 1)
        low, high = np.array([-2, top - 0.5, front - 0.5]), np.array([2, top, front])
        offer(1, top, (low, high))
        offer(2, front, (low, high))
        offer(0, 2.0, (np.array([0, 0, front - 0.5]), np.array([0, top, front])))
    offer(1, 0.0, (np.full(3, -4.0), np.full(3, 4.0)))
    return best, normal


def test_stairs_against_their_planes() -> None:
    """The camera looks down from +x, +y, +z: it sees treads (+y), risers (+z), the side x = 2 and the floor."""
    scene = load_scene(SCENES / "stairs.toml")
    assert isinstance(scene.camera, OrthographicCamera)
    size = 61
    image = render(scene, resolution=(size, size), threads=1)
    origins, directions = primary_rays(scene.camera, size, size)
    # All rays look below the horizon.
    horizon = np.array([0.58, 0.6, 0.62], np.float32).tolist()
    kinds = set()
    for i, (o, d) in enumerate(zip(origins, directions, strict=True)):
        t, normal = stairs_by_hand(o, d)
        y, x = divmod(i, size)
        if np.isinf(t):
            assert np.isinf(image.depth[y, x]) and image.radiance[y, x].tolist() == horizon
            continue
        # Coordinates below 16, a dozen roundings, and slopes above 1/2.
        assert image.depth[y, x] == pytest.approx(t, abs=12 * 16 * 2.0**-53 * 2)
        np.testing.assert_allclose(image.normal[y, x], normal, atol=2.0**-23)
        kinds.add((*normal, round((o + t * d)[1], 6) if normal[1] else None))
    # Five treads and the floor by their heights, risers and the side.
    assert kinds == {(0, 1, 0, h) for h in (0, 0.5, 1, 1.5, 2, 2.5)} | {(1, 0, 0, None), (0, 0, 1, None)}
