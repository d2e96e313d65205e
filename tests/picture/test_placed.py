"""Pictures of scenes in which meshes stand many times, beside those of the merged mesh."""

import copy
import pickle

import numpy as np
import pytest

from renderer import Dielectric, Mesh, Mirror, PerspectiveCamera, Phong, PointLight, Scene, SceneObject, prepare, render
from renderer.mesh.shapes import box, icosphere
from renderer.picture import placed
from renderer.picture.image import PLANES
from renderer.rayscene.built import BuiltScene
from tests.cases import cases

pytestmark = pytest.mark.judges("PreparedScene.mesh", "PreparedScene.octree", "SceneObject", "prepare", "render")

BALL = icosphere(2)
# Its normals are not those of its faces.
SMOOTH = Mesh(BALL.vertices * [1, 1, 2], BALL.faces, np.add(BALL.vertices, [0.3, 0, 0]))
MATERIALS = {
    "grey": Phong(diffuse=(0.7, 0.3, 0.1), specular=0.3),
    "glass": Dielectric(),
    "tinted": Phong(transmittance=(0.2, 0.8, 0.4), ior=1.2),
    "mirror": Mirror(reflectance=0.8),
}
IMAGE = np.random.default_rng(3).integers(0, 256, (6, 5, 4), np.uint8)
TEXTURED = {
    "grey": Phong(diffuse_map=IMAGE, normal_map=IMAGE),
    "glass": Phong(vertex_colors="srgb", opacity_map=IMAGE, cutoff=0.4),
    "tinted": Phong(transmittance_map=IMAGE, vertex_colors="linear"), "mirror": Mirror(),
}  # fmt: skip


def scene_of(objects):
    return Scene(
        camera=PerspectiveCamera(eye=(0, 1, 9), target=(0, 0, 0)), materials=MATERIALS, objects=objects,
        lights=[PointLight(position=(2, 5, 4), intensity=40), PointLight(position=(-3, 1, 0), intensity=20)],
        ambient=0.1, background=(0.2, 0.3, 0.5),
    )  # fmt: skip


def scattered(seed):
    """Meshes with and without normals, turned, mirrored, sheared by their scales, and some as they are."""
    rng = np.random.default_rng(seed)
    still = [SceneObject(mesh=mesh, material="glass", normals="smooth") for mesh in (BALL, SMOOTH)]
    return still + [
        SceneObject(
            mesh=[BALL, SMOOTH, SMOOTH][rng.integers(3)], material=list(MATERIALS)[rng.integers(4)],
            normals=["flat", "smooth"][rng.integers(2)], crease=30.0,
            scale=rng.uniform(0.2, 0.8, 3) * rng.choice([-1, 1], 3), rotate=rng.uniform(0, 360, 3),
            translate=rng.uniform(-3, 3, 3),
        )
        for _ in range(30)
    ]  # fmt: skip


def textured(seed):
    """The meshes of ``scattered``, with texture coordinates and colours of vertices."""
    dressed = {
        id(mesh): Mesh(mesh.vertices, mesh.faces, mesh.normals, abs(mesh.vertices) / 2, mesh.vertices[:, :2] * 2)
        for mesh in (BALL, SMOOTH)
    }
    return [o.model_copy(update={"mesh": dressed[id(o.mesh)]}) for o in scattered(seed)]


def stacked(_):
    """Boxes of glass that touch, so that rays cross two faces at once, with a glass of water around the eye's place."""
    cells = [(x, y, z) for x in range(2) for y in range(2) for z in range(3)]
    glass = ["glass", "tinted", "grey"]
    return [SceneObject(mesh=box(), material="tinted", scale=20, translate=(-10, -10, -10))] + [
        SceneObject(mesh=box(), material=glass[sum(cell) % 3], translate=cell) for k, cell in enumerate(cells)
    ]


def crowded(seed):
    """Boxes of all materials that touch and overlap, some of them mirrored, so that opaque faces coincide too."""
    # At 10 and 11 opaque faces coincide of which a copy of the mesh elsewhere touches glass.
    rng = np.random.default_rng(9 + seed)
    return [
        SceneObject(
            mesh=box(), material=list(MATERIALS)[rng.integers(4)], scale=rng.integers(1, 4, 3) * rng.choice([-1, 1], 3),
            translate=rng.integers(-2, 2, 3),
        )
        for _ in range(9)
    ]  # fmt: skip


@pytest.fixture
def always(monkeypatch):
    monkeypatch.setattr(placed, "_LEAST", 1)
    monkeypatch.setattr("renderer.scene.needs.FEW_FACES", 0)


def same_planes(picture, expected):
    for plane in ("radiance", *PLANES[1:]):
        np.testing.assert_array_equal(getattr(picture, plane), getattr(expected, plane), err_msg=plane)


@cases("make", [scattered, textured, stacked, crowded])
@cases("settings", [{}, {"terminator": "soft", "glass_shadows": "clear", "max_depth": 4}])
def test_the_picture_has_the_bits_of_that_of_the_merged_mesh(always, make, settings):
    for seed in range(3):
        objects = make(seed)
        box_ = objects[0].mesh
        objects = [o.model_copy(update={"mesh": box_}) if make in (stacked, crowded) else o for o in objects]
        scene = scene_of(objects).altered(materials=TEXTURED if make is textured else MATERIALS)
        ready = prepare(scene)
        assert isinstance(ready.built, BuiltScene)
        expected = render(scene, accelerator="octree", resolution=60, **settings)
        same_planes(render(ready, resolution=60, **settings), expected)
        assert np.array_equal(ready.mesh.triangles, prepare(scene, accelerator="octree").mesh.triangles)


def test_copies_and_pickles_render_the_same(always):
    ready = prepare(scene_of(scattered(7)))
    expected = render(ready, resolution=40)
    for again in (copy.deepcopy(ready), pickle.loads(pickle.dumps(ready))):
        assert isinstance(again.built, BuiltScene)
        same_planes(render(again, resolution=40), expected)


def test_memory_does_not_grow_with_copies():
    rng = np.random.default_rng(0)
    sizes = []
    for count in (20, 120):
        places = rng.uniform(-3, 3, (count, 3))
        ball = icosphere(5)
        mesh = Mesh(ball.vertices, ball.faces, ball.vertices)
        objects = [
            SceneObject(mesh=mesh, material="glass", normals="smooth", scale=0.1, translate=place) for place in places
        ]
        sizes.append(len(pickle.dumps(prepare(scene_of(objects)))))
    # Of the merged mesh, a copy has two megabytes of vertices and faces alone.
    assert sizes[1] - sizes[0] < 100 * 3000


def test_a_mesh_is_kept_once_where_copies_have_many_faces():
    ball, twin = icosphere(5), icosphere(5)
    for meshes, once in (([ball], False), ([ball, twin], False), ([ball, twin, ball], True), ([ball, ball], True)):
        objects = [SceneObject(mesh=mesh, material="grey", translate=(3 * k, 0, 0)) for k, mesh in enumerate(meshes)]
        for accelerator in ("auto", "octree"):
            ready = prepare(scene_of(objects), accelerator=accelerator)
            assert isinstance(ready.built, BuiltScene) == (once and accelerator == "auto")
    smooth = [SceneObject(mesh=ball, material="grey", normals="smooth", translate=(3 * k, 0, 0)) for k in range(3)]
    assert not isinstance(prepare(scene_of(smooth)).built, BuiltScene)


def test_all_instances_are_marked_that_may_touch(always):
    """Of two boxes of glass and one apart, in any order."""
    cube = box()
    for apart in range(3):
        places = [(9, 0, 0) if k == apart else (int(k != (apart + 1) % 3), 0, 0) for k in range(3)]
        objects = [SceneObject(mesh=cube, material="glass", translate=place) for place in places]
        # Between the three, so that each is an object of its own.
        objects = [one for pair in zip(objects, [SceneObject(mesh=BALL, material="grey", translate=(0, 9 + k, 0))
                                                 for k in range(3)], strict=True) for one in pair][:5]  # fmt: skip
        marks = prepare(scene_of(objects)).arrays.touching
        assert marks.tolist() == [int(k % 2 == 0 and k // 2 != apart) for k in range(5)]


def test_what_cannot_be_placed_is_merged(always):
    flat = [SceneObject(mesh=BALL, material="grey", scale=(1, 1, size)) for size in (0, 0, 1)]
    assert not isinstance(prepare(scene_of(flat)).built, BuiltScene)
    far = [SceneObject(mesh=BALL, material="grey", translate=(x, 0, 0)) for x in (1e19, 2e19)]
    with pytest.raises(ValueError, match="scene: expected a largest coordinate"):
        prepare(scene_of(far))
