"""The report's picture of a study: the sky view factor of a town's faces, in false colours with a legend."""

from pathlib import Path
from typing import Any

import numpy as np

from renderer.diagnostics import mesh_values as drawing
from renderer.materials.phong import Phong
from renderer.octree import Octree
from renderer.picture.render import render
from renderer.scene.overview import from_above
from renderer.scene.scene import Scene, SceneObject
from renderer.studies import face_points, sky_view_factor
from validation.studies.bodies import town

_SIZE = (640, 420)


def write(path: Path) -> dict[str, Any]:
    """Write it; returns its name and what it shows."""
    mesh = town(6, 120)
    points, normals, faces = face_points(mesh)
    values = np.full(len(mesh.faces), np.nan)
    values[faces] = sky_view_factor(Octree.from_mesh(mesh), points, normals, leaving=faces)
    thing = SceneObject(mesh=mesh, material="grey", normals="flat")
    shown = drawing.map_size(_SIZE)
    scene = Scene(camera=from_above(mesh, shown), materials={"grey": Phong()}, objects=[thing], ambient=1)
    size = (drawing.FINER * shown[0], drawing.FINER * shown[1])
    image = render(scene, resolution=size, samples=1, max_depth=0, planes=("face", "normal"))
    drawing.write_png(path, drawing.draw(image, mesh, values, "sky view factor", drawing.legend_rows(_SIZE[1])))
    return {"name": path.name, "faces": len(mesh.faces), "mean": float(np.nanmean(values))}
