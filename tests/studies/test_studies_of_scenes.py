"""Studies take a scene where they take an octree, and have the bits of those on its merged mesh."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import Octree, PerspectiveCamera, RayScene
from renderer.mesh.shapes import box, torus
from renderer.studies import (
    ambient_occlusion,
    depth_map,
    face_points,
    grid_points,
    occlusion,
    openness,
    sky_view_factor,
    sun_hours,
    tregenza,
    visible_faces,
)
from renderer.trimesh_ray import RayMeshIntersector
from renderer.trimesh_ray.distances import closest_point

pytestmark = pytest.mark.judges("studies.occlusion", "studies.sky_view_factor", "trimesh_ray.RayMeshIntersector")

RING = torus(around=16, across=8)
CAMERA = PerspectiveCamera(eye=(4.0, -6.0, 5.0), target=(1.0, 1.0, 0.5), up=(0.0, 0.0, 1.0))
SUNS = [[1.0, 0.5, 1.0], [0.0, -1.0, 2.0], [-1.0, 0.2, 0.3]]
ANSWERS: dict[str, Callable[[Any, Any], Any]] = {
    "ambient_occlusion": lambda on, at: ambient_occlusion(on, at.points, at.normals, leaving=at.faces),
    "closest_point": lambda on, at: closest_point(on, at.points + 0.1),
    "depth_map": lambda on, at: depth_map(on, CAMERA, 60, 40),
    "grid_points": lambda on, at: tuple(grid_points(on, 0.3)),
    "light through faces": lambda on, at: sky_view_factor(
        on, at.points, at.normals, transmittance=np.linspace(0.0, 1.0, 12 * 3 + len(RING.faces))
    ),
    "occlusion": lambda on, at: occlusion(on, at.points, at.normals, tregenza().directions, packed=True),
    "openness": lambda on, at: openness(on, at.points, samples=50),
    "rays of trimesh": lambda on, at: RayMeshIntersector(on).intersects_id(at.points + 9.0, at.normals - 9.0),
    "sky_view_factor": lambda on, at: sky_view_factor(on, at.points, at.normals, leaving=at.faces),
    "sun_hours": lambda on, at: sun_hours(on, at.points, at.normals, SUNS, up="z"),
    "visible_faces": lambda on, at: visible_faces(on, CAMERA.eye, cuts=2),
}


def court() -> RayScene:
    """Boxes, of which one is hidden, and a ring above them."""
    scene, places = RayScene(threads=2), ((1.0, 0.0, 0.0, 0.0), (0.8, 0.6, 2.0, 1.0), (1.0, 0.0, 4.0, 4.0))
    scene.add(box((-3, -3, -1), (5, 5, 0)))
    boxes = scene.add(box(), [[[c, -s, 0, x], [s, c, 0, y], [0, 0, 2, 0]] for c, s, x, y in places])
    scene.show(boxes, np.array([True, True, False]))
    scene.add(RING, [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 3]])
    return scene


def arrays(answer: Any) -> tuple[Any, ...]:
    return answer if isinstance(answer, tuple) else (answer,)


@cases("name", ANSWERS)
def test_a_study_of_a_scene_has_the_bits_of_its_merged_mesh(name: str) -> None:
    """Also after something has moved."""
    scene, found = court(), []
    for height in (3.0, 2.0):
        scene.move(2, [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, height]])
        octree = Octree(scene.merged)
        places = face_points(octree.mesh)
        assert len(octree.mesh.faces) == 12 * 3 + len(RING.faces)
        whole = octree.mesh if name in ("closest_point", "rays of trimesh") else octree
        ours, theirs = arrays(ANSWERS[name](scene, places)), arrays(ANSWERS[name](whole, places))
        for own, other in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(own, other, strict=True)
        found.append(ours[0])
    assert not np.array_equal(*found)


def test_a_depth_map_makes_no_merged_mesh() -> None:
    scene = court()
    assert np.isfinite(depth_map(scene, CAMERA, 30, 20)).any()
    assert "merged" not in vars(scene._built)
