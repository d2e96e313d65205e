"""Scenes of diffuse surfaces that random paths judge."""

from collections.abc import Callable

from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, grid
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.scene import Scene, SceneObject, load_scene
from validation.scenes import SCENES


def cornell() -> Scene:
    """The Cornell box."""
    return load_scene(SCENES / "cornell_box.toml")


def room() -> Scene:
    """A room whose ceiling shines, with walls of three colours: nothing hides anything."""
    whole = box()
    inside = whole.faces[:, ::-1].reshape(6, 2, 3)
    middles = whole.vertices[inside].mean(axis=(1, 2))
    names = ["ceiling" if y > 0.9 else "red" if x < 0.1 else "green" if x > 0.9 else "white" for x, y, _ in middles]
    materials = {
        "white": Phong(diffuse=0.7), "red": Phong(diffuse=(0.6, 0.1, 0.1)), "green": Phong(diffuse=(0.1, 0.5, 0.2)),
        "ceiling": Phong(diffuse=0.5, emission=(1.0, 0.9, 0.6)),
    }  # fmt: skip
    walls = [
        SceneObject(mesh=Mesh(whole.vertices, faces), material=name) for name, faces in zip(names, inside, strict=True)
    ]
    eye = PerspectiveCamera(eye=(0.5, 0.5, 0.95), target=(0.5, 0.4, 0.0), fov=80.0)
    return Scene(camera=eye, materials=materials, objects=walls)


def yard() -> Scene:
    """A block on the ground, under a uniform sky, the sun and a lamp."""
    ground = grid(4, 4, (4.0, 4.0))
    block = box((-0.4, 0.0, -0.4), (0.4, 0.7, 0.3))
    standing = Mesh(block.vertices, block.faces[block.face_normals()[:, 1] > -0.5])
    materials = {"ground": Phong(diffuse=0.6), "block": Phong(diffuse=(0.7, 0.4, 0.2))}
    things = [SceneObject(mesh=ground, material="ground"), SceneObject(mesh=standing, material="block")]
    lights = (
        DirectionalLight(direction=(0.8, -1.0, 0.3), irradiance=(0.9, 0.8, 0.6)),
        PointLight(position=(0.5, 0.9, 1.5), intensity=(0.5, 0.5, 0.8)),
    )
    eye = PerspectiveCamera(eye=(1.6, 1.7, 2.2), target=(0.0, 0.2, 0.0), fov=40.0)
    return Scene(camera=eye, materials=materials, objects=things, lights=lights, background=(0.15, 0.2, 0.25))


# Each with the longest edge of its patches, and of those of a short run.
LIT: dict[str, tuple[Callable[[], Scene], float, float]] = {
    "the Cornell box by radiosity": (cornell, 40.0, 60.0),
    "a room by radiosity": (room, 0.15, 0.25),
    "a yard by radiosity": (yard, 0.2, 0.3),
}
