"""Savings by leaving out unneeded features: each is forced on, and time, memory and picture are compared."""

from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from renderer import Image, Needs, Scene, load_scene, needs_of, render
from renderer.mesh.shapes import box, icosphere
from renderer.picture.pack import pack
from renderer.picture.prepare import build_octree, kernel_settings_of, tree_for
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight
from renderer.scene.material import Mirror, Phong
from renderer.scene.scene import Floor, SceneObject
from renderer.shade.tile import tile_scratch
from renderer.system.threads import available_threads
from renderer.trace.spawn import BOUNDED

SCENES = Path(__file__).parents[3] / "scenes"
RUNS = 5


def run(quick: bool, step: Callable[[str], None]) -> dict[str, Any]:
    """Force each unneeded feature on, in every scene of ``scenes/`` and in a few made here.

    Returns, ready for JSON, ``rows`` (one a scene and feature: the result of ``compare``) and ``passed``: whether no
    picture changed. Each pair is rendered ``RUNS`` times in turn; ``quick`` makes the pictures small. ``step`` is
    called with the name of each step.
    """
    size = 64 if quick else 512
    rows = []
    for name, scene in scenes():
        for feature, more in additions(scene):
            step(f"ablation: {name} with {feature}")
            rows.append({"scene": name, "feature": feature, **compare(scene, more, size)})
    return {"rows": rows, "passed": all(row["identical"] for row in rows), "runs": RUNS, "size": size}


def scenes() -> Iterator[tuple[str, Scene]]:
    """The scene files by their names, then small scenes that need little."""
    for path in sorted(SCENES.glob("*.toml")):
        yield path.stem, load_scene(path)
    yield "a box", _made(Phong(), SceneObject(mesh=box(), material="m"), floor=False)
    yield "all diffuse", _made(Phong(), SceneObject(mesh=icosphere(5), material="m", normals="smooth"))
    yield "all flat", _made(Mirror(type="mirror"), SceneObject(mesh=icosphere(5), material="m"))
    yield "ambient only", _made(Phong(diffuse=0.0, ambient=0.5), SceneObject(mesh=icosphere(5), material="m"))


def _made(material: Any, thing: SceneObject, floor: bool = True) -> Scene:
    return Scene(
        camera=PerspectiveCamera(eye=(2, 3, 5), target=(0, 0.3, 0), fov=40),
        materials={"m": material},
        objects=(thing,),
        floor=Floor(min=(-3, -3), max=(3, 3), materials=("m",)) if floor else None,
        lights=(DirectionalLight(direction=(-1, -2, -1)),),
        ambient=0.2,
        background=0.3,
    )


def additions(scene: Scene) -> Iterator[tuple[str, Needs]]:
    """Each feature that ``scene`` does not need, and the scene's needs with this feature on."""
    needs = needs_of(scene)
    for feature, value in asdict(needs).items():
        if feature == "lights":
            if value < len(scene.lights) and needs.shadows:
                yield feature, replace(needs, lights=len(scene.lights))
        elif not value:
            # Shadow rays go to lights, so the lights are needed too.
            lights = len(scene.lights) if feature == "shadows" else needs.lights
            yield feature, replace(needs, lights=lights, **{feature: True})


def compare(scene: Scene, more: Needs, size: int) -> dict[str, Any]:
    """The picture with its own needs and with ``more``: median seconds, bytes and rays of both, and their differences.

    ``difference`` is the largest difference of radiance, which must be 0; ``identical`` covers depth, normal and face
    too.
    """
    both = {"without": needs_of(scene), "with": more}
    pictures = {key: _render(scene, needs, size) for key, needs in both.items()}
    seconds: dict[str, list[float]] = {key: [] for key in both}
    for _ in range(RUNS):
        for key, needs in both.items():
            image = _render(scene, needs, size)
            seconds[key].append(image.build_seconds + image.render_seconds)
    a, b = pictures["without"], pictures["with"]
    return {
        "seconds": {key: median(values) for key, values in seconds.items()},
        "bytes": {key: memory(scene, needs) for key, needs in both.items()},
        "rays": {key: int(picture.rays.sum()) for key, picture in pictures.items()},
        "difference": float(np.abs(a.radiance - b.radiance).max()),
        "identical": all(
            getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in ("radiance", "depth", "normal", "face")
        ),
    }


def _render(scene: Scene, needs: Needs, size: int) -> Image:
    return render(scene, resolution=(size, size), needs=needs)


def memory(scene: Scene, needs: Needs) -> int:
    """Bytes of the arrays that a picture reads: the scene's, the tree's and the scratch of every thread."""
    mesh, world = pack(scene, needs)
    tree = tree_for(build_octree(mesh, "auto", "midpoint", needs), needs)
    scratch = tile_scratch(tree.depth, kernel_settings_of(needs, scene.render, BOUNDED))
    rays = scratch.trace
    parts = (rays.floats, rays.doubles, rays.integers, scratch.doubles, scratch.integers, scratch.hits, scratch.total)
    a_thread = sum(array.nbytes for array in parts)
    arrays = [*world, tree.nodes, tree.blocks, tree.faces]
    return sum(array.nbytes for array in arrays) + available_threads() * a_thread
