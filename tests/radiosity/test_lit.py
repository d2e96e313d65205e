"""Scenes lit by radiosity: closed forms, the direct light of ``render``, what stays, and what is left out."""

import warnings
from typing import Any

import numpy as np
import pytest
from cases import cases
from numpy.typing import NDArray

from renderer import (
    Dielectric,
    DirectionalLight,
    Mesh,
    Mirror,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    PointLight,
    RenderSettings,
    Scene,
    SceneObject,
    SceneWarning,
    Sky,
    Texture,
    render,
    shapes,
)
from renderer.radiosity import lit_scene

pytestmark = pytest.mark.judges("radiosity.lit_scene")

ABOVE = OrthographicCamera(eye=(0, 3, 0), target=(0, 0, 0), up=(0, 0, -1), height=1.9)
# From z up to y up.
TURN = [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]
GROUND = Mesh([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], [[0, 1, 2], [0, 2, 3]])


def turned(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces[:, ::-1], mesh.normals, mesh.colors, mesh.texcoords, mesh.name)


def scene_of(things: dict[str, Mesh], materials: dict[str, Any], **more: Any) -> Scene:
    objects = [SceneObject(mesh=mesh, material=name) for name, mesh in things.items()]
    return Scene(**{"camera": ABOVE, "materials": materials, "objects": objects, **more})


def seen(scene: Scene, **options: Any) -> NDArray[np.float32]:
    return render(scene, **{"resolution": 24, **options}).radiance


def test_a_furnace_is_equally_bright_everywhere() -> None:
    rho = np.array([0.2, 0.5, 0.9])
    eye = PerspectiveCamera(eye=(0.1, 0.2, 0.3), target=(0, 0, -1), fov=120)
    walls = {"walls": turned(shapes.icosphere(1))}
    scene = scene_of(walls, {"walls": Phong(diffuse=rho, emission=1 - rho)}, camera=eye)
    assert np.abs(seen(lit_scene(scene, 1.5)) - 1).max() < 1e-5


@cases(
    "light",
    [
        {"lights": [DirectionalLight(direction=(1, -2, 0.5), irradiance=(1, 2, 3))]},
        {"lights": [DirectionalLight(direction=(1, -2, 0.5)), DirectionalLight(direction=(0, -1, 0), irradiance=0.3)]},
        {"lights": [DirectionalLight(direction=(0, 1, 0))]},
        {"lights": [PointLight(position=(0.3, -2, 0))]},
        {"sky": Sky(lights=24, sun=(0.2, -1, 0))},
        {"sky": Sky(lights=0)},
    ],
)
def test_open_ground_has_the_light_that_render_gives_it(light: dict[str, Any]) -> None:
    scene = scene_of({"clay": GROUND}, {"clay": Phong(diffuse=(0.2, 0.4, 0.6))}, **light)
    assert np.allclose(seen(lit_scene(scene, 0.5)), seen(scene), rtol=1e-6, atol=1e-7)


def test_a_point_light_falls_off_as_in_render() -> None:
    light = PointLight(position=(0.3, 0.9, -0.2), intensity=(1, 2, 3))
    scene = scene_of({"clay": GROUND}, {"clay": Phong(diffuse=0.5)}, lights=[light])
    sound = seen(scene)
    # Of second order in the edge inside; at the border colours are those of the patches within.
    inside = np.s_[3:-3, 3:-3]
    assert np.abs(seen(lit_scene(scene, 0.08)) / sound - 1)[inside].max() < 0.01


def test_shadows_are_where_render_has_them() -> None:
    plate = Mesh(0.4 * GROUND.vertices + [0, 0.5, 0], GROUND.faces)
    light = DirectionalLight(direction=(0.6, -1, 0.2), irradiance=2)
    # So dark that nothing lights anything else.
    materials = {"clay": Phong(diffuse=1e-6), "plate": Phong(diffuse=1e-6)}
    scene = scene_of({"clay": GROUND, "plate": plate}, materials, lights=[light])
    below = OrthographicCamera(eye=(0.3, 0.4, 0), target=(0.3, 0, 0), up=(0, 0, -1), height=1.4)
    ours, sound = (1e6 * seen(s, camera=below, resolution=56)[..., 0] for s in (lit_scene(scene, 0.1), scene))
    shade = np.lib.stride_tricks.sliding_window_view(sound, (11, 11))
    same = np.abs(shade - shade[..., 5:6, 5:6]).max(axis=(2, 3)) < 1e-6  # five pixels are longer than an edge
    assert 0.1 < (sound[5:-5, 5:-5][same] == 0).mean() < 0.9
    assert np.abs(ours - sound)[5:-5, 5:-5][same].max() < 1e-3


def test_a_background_lights_by_what_is_seen_of_it() -> None:
    open_box = turned(shapes.box((-1, 0, -1), (1, 2, 1)))
    well = Mesh(open_box.vertices, open_box.faces[open_box.face_normals()[:, 1] > -0.5])
    # Walls so dark that the floor has the sky's light alone, over its whole area that of the opposite square.
    scene = scene_of({"clay": well}, {"clay": Phong(diffuse=1e-6)}, background=(1, 2, 4))
    below = OrthographicCamera(eye=(0, 1, 0), target=(0, 0, 0), up=(0, 0, -1), height=2)
    floor = 1e6 * seen(lit_scene(scene, 0.25, rtol=0.02), camera=below).mean(axis=(0, 1))
    # Howell C-11, for a cube; means over pixels are not those over patches.
    assert np.allclose(floor, 0.19982 * np.array([1, 2, 4]), rtol=0.02)


def test_backs_of_faces_get_no_light() -> None:
    scene = scene_of({"clay": turned(GROUND)}, {"clay": Phong()}, lights=[DirectionalLight(direction=(0, -1, 0))])
    assert seen(lit_scene(scene)).max() == 0


def test_colours_bleed_from_a_wall_onto_the_ground() -> None:
    wall = Mesh([[-1, 0, -1], [1, 0, -1], [1, 2, -1], [-1, 2, -1]], [[0, 1, 2], [0, 2, 3]])
    materials = {"white": Phong(diffuse=0.8), "red": Phong(diffuse=(0.8, 0, 0))}
    scene = scene_of({"white": GROUND, "red": wall}, materials, lights=[DirectionalLight(direction=(0, -1, -0.5))])
    rows = seen(lit_scene(scene, 0.2)).mean(axis=1)
    redness = rows[:, 0] - rows[:, 2]
    assert redness[1] > 5 * redness[-1] > 0 and np.allclose(rows[:, 1], rows[:, 2])


def test_textures_stay_in_the_picture() -> None:
    ground = Mesh(GROUND.vertices, GROUND.faces, texcoords=[[0, 1], [0, 0], [1, 0], [1, 1]])
    look = Phong(diffuse=0.5, diffuse_map=Texture.checker((0.8, 0.4, 0.2), 0.1, squares=(4, 4)))
    scene = scene_of({"tiles": ground}, {"tiles": look}, lights=[DirectionalLight(direction=(0, -1, 0))])
    with pytest.warns(SceneWarning, match="materials.tiles: diffuse_map, whose mean counts"):
        lit = lit_scene(scene, 0.3)
    assert np.allclose(seen(lit), seen(scene), rtol=1e-6)


@cases("space", ["srgb", "linear"])
def test_colours_of_vertices_count(space: str) -> None:
    ground = Mesh(GROUND.vertices, GROUND.faces, colors=np.tile([0.2, 0.4, 0.6], (4, 1)))
    look = Phong(diffuse=0.5, vertex_colors=space)
    scene = scene_of({"clay": ground}, {"clay": look}, lights=[DirectionalLight(direction=(0, -1, 0))])
    assert np.allclose(seen(lit_scene(scene, 0.5)), seen(scene), rtol=1e-6)


def test_mirrors_and_glass_show_the_lit_surfaces() -> None:
    mirror = Mesh([[-1, 0.6, -1], [1, 0.6, -1], [1, 0.6, 1], [-1, 0.6, 1]], [[0, 1, 2], [0, 2, 3]])
    things = {"clay": GROUND, "mirror": mirror}
    materials = {"clay": Phong(diffuse=1e-6, emission=(0.1, 0.2, 0.3)), "mirror": Mirror(reflectance=0.5)}
    upwards = OrthographicCamera(eye=(0, 0.5, 0), target=(0, 1, 0), up=(0, 0, -1), height=1)
    with pytest.warns(SceneWarning, match="what the mirror throws on other surfaces"):
        lit = lit_scene(scene_of(things, materials, camera=upwards), 0.5)
    assert np.allclose(seen(lit), [0.05, 0.1, 0.15], rtol=1e-5)
    assert lit.materials["mirror"] is materials["mirror"]


def test_emission_lights_the_ground_and_mirrors_hide_it() -> None:
    lamp = Mesh(0.5 * GROUND.vertices + [0, 1, 0], GROUND.faces[:, ::-1])
    hood = Mesh(1.2 * GROUND.vertices + [0, 0.5, 0], GROUND.faces)
    materials = {"clay": Phong(diffuse=0.5), "lamp": Phong(diffuse=0, emission=4), "hood": Mirror()}
    below = OrthographicCamera(eye=(0, 0.4, 0), target=(0, 0, 0), up=(0, 0, -1), height=0.2)
    lit = scene_of({"clay": GROUND, "lamp": lamp}, materials, camera=below)
    assert seen(lit_scene(lit, 0.25)).min() > 0.2
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        hidden = lit_scene(scene_of({"clay": GROUND, "lamp": lamp, "hood": hood}, materials, camera=below), 0.25)
    # What passes beside the hood reaches the middle of the ground at no angle.
    assert seen(hidden).max() < 0.02


@cases(
    ("look", "words"),
    [
        (Phong(specular=0.5), "materials.clay: its highlights"),
        (Phong(reflectance=0.5), "materials.clay: what it mirrors on other surfaces"),
        (Phong(transmittance=0.5), "materials.clay: what it lets through"),
        (Phong(opacity=0.5), "materials.clay: what it lets through"),
        (Mirror(), "materials.clay: what the mirror throws"),
        (Dielectric(ior=1.5), "materials.clay: what the dielectric throws"),
    ],
)
def test_what_is_left_out_is_named(look: Any, words: str) -> None:
    with pytest.warns(SceneWarning, match=f"radiosity leaves out {words}"):
        lit_scene(scene_of({"clay": GROUND}, {"clay": look}), 1)


def test_ambient_light_and_absent_shadows_are_named() -> None:
    scene = scene_of({"clay": GROUND}, {"clay": Phong()}, ambient=0.5, render={"shadows": False})
    with pytest.warns(SceneWarning) as caught:
        lit = lit_scene(scene, 1)
    assert [str(w.message).split(":")[0] for w in caught] == [
        "radiosity leaves out ambient", "radiosity leaves out render.shadows",
    ]  # fmt: skip
    assert seen(lit).max() == 0


def test_walls_that_are_turned_away_are_named() -> None:
    room = scene_of({"clay": turned(shapes.box())}, {"clay": Phong()})
    lit_scene(room, 0.5)
    inner = shapes.box((0.1, 0.1, 0.1), (0.9, 0.9, 0.9))
    lined = scene_of({"clay": turned(shapes.box()), "lining": turned(inner)}, {"clay": Phong(), "lining": Phong()})
    with pytest.warns(SceneWarning, match="ends on backs of faces"):
        lit_scene(lined, 0.5)


@cases(
    ("arguments", "words"),
    [
        ({"edge": 0}, "edge: expected"),
        ({"edge": np.inf}, "edge: expected"),
        ({"edge": 1e-9}, "edge: expected"),
        ({"rtol": 0}, "rtol: expected"),
        ({"max_rays": 1}, "max_rays: expected"),
        ({"crease": 181}, "crease: expected"),
        ({"threads": 0}, "threads: expected"),
        ({"scene": GROUND}, "scene: expected a renderer.Scene, got Mesh"),
        ({"scene": scene_of({}, {})}, "scene: expected a scene with faces, got none"),
    ],
)
def test_bad_arguments(arguments: dict[str, Any], words: str) -> None:
    given = {"scene": scene_of({"clay": GROUND}, {"clay": Phong()}), "edge": 0.5, **arguments}
    with pytest.raises(ValueError, match=words):
        lit_scene(**given)


def test_a_material_that_returns_all_light_is_named() -> None:
    with pytest.raises(ValueError, match=r"materials.snow.diffuse: expected numbers less than 1 .*1\.0"):
        lit_scene(scene_of({"snow": GROUND}, {"snow": Phong(diffuse=(0.5, 1, 0))}))


def test_camera_settings_and_sky_stay() -> None:
    sky, settings = Sky(lights=8, sun=(0, -1, 0)), RenderSettings(samples=4, resolution=(5, 7))
    scene = scene_of({"clay": GROUND}, {"clay": Phong()}, sky=sky, render=settings, up="y")
    lit = lit_scene(scene, 1)
    assert lit.camera == scene.camera and lit.render == settings and lit.up == "y"
    assert lit.sky is not None and lit.sky.zenith == sky.zenith and lit.all_lights == ()


def test_faces_without_area_are_left_out() -> None:
    faces = np.concatenate([GROUND.faces, [[0, 0, 1]]])
    scene = scene_of({"clay": Mesh(GROUND.vertices, faces)}, {"clay": Phong()}, background=1)
    lit = lit_scene(scene, 9)
    assert len(lit.instances[0].mesh.faces) == 2 and np.allclose(seen(lit), 0.8)


def test_floors_are_objects_of_their_materials() -> None:
    floor = {"min": (-1, -1), "max": (1, 1), "materials": ["light", "dark"], "squares": (2, 2)}
    scene = scene_of({}, {"light": Phong(diffuse=0.8), "dark": Phong(diffuse=0.2)}, floor=floor, background=1)
    lit = lit_scene(scene, 9)
    assert [thing.material for thing in lit.objects] == ["light", "dark"] and lit.floor is None
    assert set(np.unique(seen(lit).round(4))) == {np.float32(0.8), np.float32(0.2)}


def test_bits_do_not_depend_on_threads() -> None:
    ball = Mesh(0.3 * shapes.icosphere(1).vertices + [0, 0.4, 0], shapes.icosphere(1).faces)
    scene = scene_of(
        {"clay": GROUND, "ball": ball}, {"clay": Phong(), "ball": Phong()},
        lights=[PointLight(position=(0.5, 2, 0))], background=0.2,
    )  # fmt: skip
    one, three = (lit_scene(scene, 0.3, threads=threads) for threads in (1, 3))
    for a, b in zip(one.instances, three.instances, strict=True):
        assert np.array_equal(a.mesh.colors, b.mesh.colors)
    assert one.materials == three.materials
