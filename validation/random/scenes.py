"""A scene drawn at random: meshes of all kinds in any place, all materials, lights, cameras and settings."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tomlkit
from numpy.random import Generator

from renderer.mesh.load import save_ply
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from validation.random.meshes import draw_mesh

Table = dict[str, Any]

# Pictures of 3,072 pixels: a scene takes a second, and one in a thousand pixels shows.
_RESOLUTION = [64, 48]
_KINDS = ("dielectric", "mirror", "phong", "phong", "clear")


class Drawn(NamedTuple):
    """A scene as its file has it, and the meshes of its objects by the names of their files."""

    table: Table
    meshes: dict[str, Mesh]

    def write(self, folder: Path) -> Path:
        """Write the scene and its meshes; returns the scene's file."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, mesh in self.meshes.items():
            save_ply(mesh, folder / name)
        path = folder / "scene.toml"
        path.write_text(tomlkit.dumps(self.table), encoding="utf-8")
        return path


def draw_scene(rng: Generator) -> Drawn:
    """Draw a scene; equal generators give equal scenes."""
    meshes = {f"mesh{k}.ply": draw_mesh(rng) for k in range(int(rng.integers(1, 5)))}
    kinds = {f"m{k}": str(rng.choice(_KINDS)) for k in range(len(meshes))}
    table: Table = {
        "ambient": _rounded(rng.uniform(0.0, 0.3)) if rng.random() < 0.7 else 0.0,
        "background": _color(rng),
        "render": {
            "resolution": _RESOLUTION,
            "max_depth": int(rng.integers(0, 7)),
            "shadows": bool(rng.random() < 0.9),
        },
        "camera": _camera(rng),
        "materials": {name: _material(rng, kind) for name, kind in kinds.items()},
        "lights": [_light(rng) for _ in range(int(rng.integers(0, 4)))],
        "objects": [_object(rng, name, mesh, f"m{k}", kinds[f"m{k}"]) for k, (name, mesh) in enumerate(meshes.items())],
    }
    if rng.random() < 0.15:
        _add_touching(rng, table, meshes)
    if rng.random() < 0.7:
        table["materials"] |= {"light": {"diffuse": 0.6}, "dark": {"diffuse": 0.15, "reflectance": 0.2}}
        table["floor"] = _floor(rng)
    if rng.random() < 0.2:
        del table["background"]
        table["sky"] = _sky(rng)
    return Drawn(table, meshes)


def _add_touching(rng: Generator, table: Table, meshes: dict[str, Mesh]) -> None:
    """Two boxes side by side, of materials of the scene: a face of one is within a face of the other."""
    meshes["box.ply"] = box()
    scale, place = rng.uniform(0.3, 0.9, 3), rng.uniform([-1.0, 0.0, -1.0], [0.5, 0.4, 0.5])
    beside = scale * np.array([rng.uniform(0.3, 1.0), rng.uniform(0.3, 1.0), rng.uniform(0.3, 1.0)])
    axis = int(rng.integers(3))
    for size, at in ((scale, place), (beside, place + np.eye(3)[axis] * scale)):
        material = str(rng.choice(list(table["materials"])))
        table["objects"].append(
            {"mesh": "box.ply", "material": material, "scale": size.tolist(), "translate": at.tolist()}
        )


def _camera(rng: Generator) -> Table:
    """Most look from outside; one in ten is in the middle of the scene, in glass perhaps."""
    distance = rng.uniform(0.0, 1.0) if rng.random() < 0.1 else rng.uniform(3.0, 7.0)
    around, up = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-0.2, 1.2)
    eye = distance * np.array([np.cos(around) * np.cos(up), np.sin(up), np.sin(around) * np.cos(up)])
    camera = {"eye": _numbers(eye + np.array([0.0, 0.6, 0.0])), "target": _numbers(rng.uniform(-0.4, 0.8, 3))}
    if rng.random() < 0.25:
        return camera | {"type": "orthographic", "height": _rounded(rng.uniform(1.5, 6.0))}
    return camera | {"fov": _rounded(rng.uniform(20.0, 80.0))}


def _material(rng: Generator, kind: str) -> Table:
    if kind == "dielectric":
        return {"type": kind, "ior": _rounded(rng.uniform(1.0, 2.5)), "transmittance": _color(rng, 0.6)}
    if kind == "mirror":
        return {"type": kind, "reflectance": _color(rng, 0.5)}
    material: Table = {"diffuse": _color(rng), "specular": _rounded(rng.uniform(0.0, 0.6))}
    material["shininess"] = _rounded(10.0 ** rng.uniform(0.0, 3.0))
    if rng.random() < 0.4:
        material["reflectance"] = _color(rng, 0.0, 0.4)
    if rng.random() < 0.3:
        material["ambient"] = _color(rng)
    if kind == "clear":
        material |= {"transmittance": _color(rng, 0.1, 0.7), "ior": _rounded(rng.uniform(1.0, 1.8))}
    return material


def _light(rng: Generator) -> Table:
    if rng.random() < 0.5:
        direction = [*rng.uniform(-1.0, 1.0, 2), -rng.uniform(0.3, 1.0)]
        x, z, y = direction
        return {"type": "directional", "direction": _numbers([x, y, z]), "irradiance": _color(rng, 0.1)}
    return {
        "type": "point",
        "position": _numbers(rng.uniform([-4.0, 0.5, -4.0], [4.0, 5.0, 4.0])),
        "intensity": _numbers(rng.uniform(2.0, 20.0) * np.array(_color(rng, 0.5))),
    }


def _sky(rng: Generator) -> Table:
    """Few lights, as each takes Mitsuba as long as any other."""
    colors = {name: _color(rng) for name in ("zenith", "horizon", "ground")}
    sky: Table = {**colors, "lights": int(rng.integers(0, 4))}
    if rng.random() < 0.5:
        sky |= {"sun": _numbers(rng.uniform([-1.0, -1.0, -1.0], [1.0, -0.4, 1.0])), "sun_irradiance": _color(rng)}
        sky |= {"sun_angle": _rounded(rng.uniform(0.0, 20.0)), "sun_lights": int(rng.integers(1, 4))}
    return sky


def _object(rng: Generator, name: str, mesh: Mesh, material: str, kind: str) -> Table:
    """A mesh of size about 1 in the middle of the scene, turned, stretched and mirrored; bodies may overlap."""
    size = float(np.linalg.norm(mesh.extent))
    scale = rng.uniform(0.7, 2.0) / size * np.where(rng.random(3) < 0.3, rng.uniform(0.5, 1.5, 3), 1.0)
    if rng.random() < 0.1:
        scale[int(rng.integers(3))] *= -1.0
    # A middle far from the origin would move the object out of sight.
    middle = 0.5 * (mesh.bounds[0] + mesh.bounds[1])
    place = rng.uniform([-1.2, 0.3, -1.2], [1.2, 1.2, 1.2])
    turned = {"rotate": _numbers(rng.uniform(-180.0, 180.0, 3))} if rng.random() < 0.5 else {}
    translate = place if turned else place - scale * middle
    smooth = rng.random() < (0.3 if kind == "dielectric" else 0.5)
    return {
        "mesh": name,
        "material": material,
        "normals": "smooth" if smooth else "flat",
        "scale": _numbers(scale),
        "translate": _numbers(translate),
    } | turned


def _floor(rng: Generator) -> Table:
    return {
        "min": _numbers(-rng.uniform(1.5, 5.0, 2)),
        "max": _numbers(rng.uniform(1.5, 5.0, 2)),
        "squares": [int(rng.integers(1, 9)), int(rng.integers(1, 9))],
        "materials": ["light", "dark"] if rng.random() < 0.7 else ["dark"],
    }


def _color(rng: Generator, low: float = 0.0, high: float = 1.0) -> list[float]:
    return _numbers(rng.uniform(low, high, 3))


def _numbers(values: Any) -> list[float]:
    return [_rounded(value) for value in values]


def _rounded(value: float) -> float:
    """Four digits, so that a scene can be read."""
    return float(f"{float(value):.4g}")
