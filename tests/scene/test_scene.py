"""Scenes: what a file may say, the one line that says what is wrong with it, and the triangles that it means."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from renderer.errors import MeshError, SceneError
from renderer.materials.columns import MATERIAL_COLUMNS
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.load import save_ply
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere
from renderer.picture.pack import pack
from renderer.picture.render import render
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight, light_row
from renderer.scene.scene import Floor, RenderSettings, Scene, SceneObject, load_scene

pytestmark = pytest.mark.judges(
    "Floor", "Mesh.transformed", "RenderSettings", "Scene", "Scene.instances", "SceneError",
    "SceneObject", "SceneObject.matrix", "load_scene", "scene.camera", "scene.camera.orthographic.type",
    "scene.camera.perspective.type", "scene.floor", "scene.floor.materials", "scene.floor.max", "scene.floor.min",
    "scene.floor.squares", "scene.lights", "scene.lights.directional.type", "scene.lights.point.type",
    "scene.materials", "scene.materials.dielectric.type", "scene.materials.mirror.type", "scene.materials.phong.type",
    "scene.objects", "scene.objects.material", "scene.objects.mesh", "scene.objects.rotate", "scene.objects.scale",
    "scene.objects.translate",
)  # fmt: skip


CAMERA = "[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n"
MATERIAL = "[materials.clay]\ndiffuse = 0.5\n"
FULL = """\
ambient = 0.1
background = [0.1, 0.2, 0.3]

[render]
resolution = [8, 6]
samples = 4
filter = "tent"
max_depth = 3
min_weight = 0.001
max_rays = 99
terminator = "soft"
glass_shadows = "clear"
shadows = false

[camera]
type = "perspective"
eye = [0, 1, 5]
target = [0, 0, 0]
up = [0, 1, 0]
fov = 40

[materials.clay]
diffuse = [0.7, 0.35, 0.22]
ambient = 0.5
specular = 0.2
shininess = 20
reflectance = 0.1
transmittance = 0.2
ior = 1.3

[materials.glass]
type = "dielectric"
ior = 1.5

[materials.mirror]
type = "mirror"
reflectance = 0.9

[[lights]]
type = "directional"
direction = [0, -1, 0]
irradiance = 0.5

[[lights]]
type = "point"
position = [1, 2, 3]
intensity = [6, 5, 4]

[[objects]]
mesh = "models/box.ply"
material = "glass"
normals = "smooth"
scale = 0.5
rotate = [0, 30, 0]
translate = [1, 0, 0]

[[objects]]
mesh = "models/box.ply"
material = "mirror"
scale = [1, 2, 3]

[floor]
min = [-4, -4]
max = [4.0, 4.0]
squares = [2, 3]
materials = ["clay", "glass"]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: Any) -> Path:
    where = tmp_path_factory.mktemp("scenes")
    (where / "models").mkdir()
    save_ply(box(), where / "models" / "box.ply")
    (where / "models" / "broken.ply").write_bytes(b"ply\nnonsense")
    return where


def load(folder: Path, text: str) -> Scene:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return load_scene(path)


def error_of(folder: Path, text: str) -> str:
    """The SceneError's message without the file that it must name, after checking that it is one line."""
    with pytest.raises(SceneError) as caught:
        load(folder, text)
    message = str(caught.value)
    assert message.startswith(f"{folder / 'scene.toml'}: ")
    assert len(message.splitlines()) == 1
    return message.removeprefix(f"{folder / 'scene.toml'}: ")


def test_a_file_that_uses_every_key(folder: Path) -> None:
    scene = load(folder, FULL)
    assert scene.ambient == (0.1, 0.1, 0.1) and scene.background == (0.1, 0.2, 0.3)
    settings = {
        "resolution": (8, 6),
        "samples": 4,
        "filter": "tent",
        "max_depth": 3,
        "min_weight": 0.001,
        "max_rays": 99,
    }
    settings |= {"shadows": False, "glass_shadows": "clear", "terminator": "soft"}
    assert scene.render.model_dump() == settings
    assert scene.camera == PerspectiveCamera(eye=(0, 1, 5), target=(0, 0, 0), fov=40)
    assert list(scene.materials) == ["clay", "glass", "mirror"]
    assert scene.materials["clay"] == Phong(
        diffuse=(0.7, 0.35, 0.22), ambient=0.5, specular=0.2, shininess=20, reflectance=0.1, transmittance=0.2, ior=1.3
    )
    assert scene.materials["mirror"] == Mirror(type="mirror", reflectance=0.9)
    assert scene.materials["glass"] == Dielectric(type="dielectric", ior=1.5)
    assert scene.lights == (
        DirectionalLight(direction=(0, -1, 0), irradiance=0.5),
        PointLight(position=(1, 2, 3), intensity=(6, 5, 4)),
    )
    assert [(i.material, i.smooth) for i in scene.instances] == [
        ("glass", True), ("mirror", False), ("clay", False), ("glass", False)]  # fmt: skip


def with_key(table: str, line: str) -> str:
    """FULL with a line added to the top of a table (or of the file), in place of the key's line if it has one."""
    key = line.split("=")[0].strip()
    head, found, tail = FULL.partition(f"{table}\n") if table else ("", "", FULL)
    own, gap, rest = tail.partition("\n\n")
    own = re.sub(rf"(?m)^{re.escape(key)} = .*\n?", "", own)
    return f"{head}{found}{line}\n{own}{gap}{rest}"


# One of each kind of fault and of place; what each field refuses is in test_fields.py.
FAULTS = [
    # table, line, the key's path, what the message must say besides
    ("", "speed = 3", "speed", ["unknown key", "3"]),
    ("[render]", "speed = 3", "render.speed", ["unknown key", "3"]),
    ("[camera]", "height = 3", "camera.height", ["unknown key", "3"]),
    ("[camera]", "taget = 3", "camera.taget", ["one of eye, target, up", "'target'?"]),
    ("[materials.glass]", "diffuse = 3", "materials.glass.diffuse", ["unknown key", "3"]),
    ("[[lights]]", "speed = 3", "lights.0.speed", ["unknown key", "3"]),
    ("[[objects]]", "speed = 3", "objects.0.speed", ["unknown key", "3"]),
    ("[floor]", "speed = 3", "floor.speed", ["unknown key", "3"]),
    ("", "ambient = -0.5", "ambient", ["greater than or equal to 0", "-0.5"]),
    ("", "ambient = nan", "ambient", ["finite", "nan"]),
    ("", "ambient = true", "ambient", ["a number or a list", "True"]),
    ("", 'ambient = "red"', "ambient", ["a number or a list", "'red'"]),
    ("[render]", 'resolution = "8x8"', "render.resolution", ["a number or a list", "'8x8'"]),
    ("[render]", "resolution = [8, 1000000]", "render.resolution.1", ["16384", "1000000"]),
    ("[render]", "samples = 3", "render", ["samples", "square number", "got 3"]),
    ("[camera]", 'type = "plenoptic"', "camera", ["plenoptic", "perspective", "orthographic"]),
    ("[camera]", "type = [3]", "camera", ["3"]),
    ("[camera]", "eye = [0, 0]", "camera.eye", ["[0, 0]"]),
    ("[camera]", "target = [0, 1, 5]", "camera", ["target != eye"]),
    ("[camera]", "up = [0, 1, 5]", "camera", ["up not parallel"]),
    ("[camera]", 'fov = "45"', "camera.fov", []),
    ("[camera]", "fov = 1979-05-27", "camera.fov", ["1979"]),
    ("[materials.clay]", 'type = "gold"', "materials.clay", ["gold", "phong", "mirror", "dielectric"]),
    ("[materials.clay]", "diffuse = [0.1, 0.2, -0.3]", "materials.clay.diffuse.2", ["-0.3"]),
    ("[[lights]]", 'type = "spot"', "lights.0", ["spot", "directional", "point"]),
    ("[[lights]]", "direction = [0, 0, 0]", "lights.0.direction", ["non-zero"]),
    ("[[objects]]", 'mesh = "models/none.ply"', "objects", ["none.ply", "No such file"]),
    ("[[objects]]", 'mesh = "models"', "objects", ["models", "suffix"]),
    ("[[objects]]", 'mesh = "models/broken.ply"', "objects", ["broken.ply"]),
    ("[[objects]]", 'mesh = "models/bo\\u0000x.ply"', "objects", ["null byte"]),
    ("[[objects]]", 'material = "gold"', "objects.0.material", ["clay", "glass", "mirror", "'gold'"]),
    ("[[objects]]", 'normals = "soft"', "objects.0.normals", ["flat", "smooth", "soft"]),
    ("[floor]", "min = [4, -4]", "floor", ["min < max"]),
    ("[floor]", 'materials = ["clay", "glass", "clay"]', "floor.materials", ["at most 2"]),
    ("[floor]", 'materials = ["gold"]', "floor.materials", ["clay", "'gold'"]),
]


@cases(("table", "line", "where", "says"), FAULTS)
def test_each_fault_is_one_line_with_its_place(
    folder: Path, table: str, line: str, where: str, says: list[str]
) -> None:
    message = error_of(folder, with_key(table, line))
    assert re.match(re.escape(where) + r"(\.\d)?: ", message), message
    for words in says:
        assert words in message, message


@cases(
    ("text", "says"),
    [
        ("", ["camera: ", "expected a value, got none"]),
        (CAMERA, ["materials: ", "expected a value, got none"]),
        (MATERIAL, ["camera: ", "expected a value, got none"]),
        ("[materials]\n[camera]\n", ["camera.eye: ", "expected a value, got none"]),
        ("camera = 3\n[materials]\n", ["camera: ", "3"]),
        ("materials = 3\n" + CAMERA, ["materials: ", "3"]),
        ("lights = 3\n" + CAMERA + MATERIAL, ["lights: ", "3"]),
        ("objects = 3\n" + CAMERA + MATERIAL, ["objects: ", "3"]),
        ("objects = [3]\n" + CAMERA + MATERIAL, ["objects.0: ", "3"]),
        ("lights = [3]\n" + CAMERA + MATERIAL, ["lights.0: ", "3"]),
        (CAMERA + MATERIAL + "[lights]\n", ["lights: "]),
        (CAMERA + MATERIAL + "[objects]\n", ["objects: "]),
        (CAMERA + MATERIAL + "[[lights]]\n", ["lights.0: ", "type"]),
        (CAMERA + MATERIAL + "[[objects]]\n", ["objects.0.mesh: ", "expected a value, got none"]),
        (CAMERA + MATERIAL + "[floor]\n", ["floor.min: ", "expected a value, got none", "2 more", "floor.max"]),
        (CAMERA + "materials = {clay = 3}", ["camera.materials: ", "unknown key"]),
        (CAMERA + "[materials]\nclay = 3", ["materials.clay: ", "3"]),
        (CAMERA + MATERIAL + 'type = "mirror"', ["materials.clay.diffuse: ", "unknown key", "0.5"]),
        ("x = [", ["TOML", "syntax"]),
        ("x = 1\nx = 2", ["TOML", "overwrite"]),
        ("x = " + "[" * 5000, ["TOML"]),
    ],
)
def test_faults_of_whole_tables(folder: Path, text: str, says: list[str]) -> None:
    message = error_of(folder, text)
    for words in says:
        assert words in message, message


@cases("name", ["perspective", "phong", "mirror", "dielectric", "point", "function-before", "is-instance"])
def test_a_material_may_bear_the_name_of_a_type(folder: Path, name: str) -> None:
    """The key's path names the user's own keys, whatever they are called."""
    message = error_of(folder, CAMERA + f"[materials.{name}]\nspeed = 3\n")
    assert message.startswith(f"materials.{name}.speed: unknown key")


@cases("digits", [400, 4000, 4400, 6000])
def test_huge_integers(folder: Path, digits: int) -> None:
    """Python reads no decimal number of more than 4300 digits, and writes none."""
    for number in ("1" * digits, "0x" + "f" * digits):
        error_of(folder, CAMERA + f"fov = {number}\n" + MATERIAL)
        error_of(folder, CAMERA + f"speed = {number}\n" + MATERIAL)
        error_of(folder, CAMERA.replace("[0, 0, 5]", f"[0, 0, {number}]") + MATERIAL)


@pytest.mark.parametrize("text", ['"a\\nb" = 3\n', '[materials."a\\nb"]\nspeed = 3\n'])
def test_keys_with_line_breaks_stay_on_one_line(folder: Path, text: str) -> None:
    error_of(folder, text + CAMERA if text.startswith('"') else CAMERA + text)


def test_file_names_with_line_breaks_stay_on_one_line(folder: Path) -> None:
    error_of(folder, with_key("[[objects]]", 'mesh = "models/a\\nb.ply"'))


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=re.escape(f"{tmp_path / 'none.toml'}: cannot be read: No such file")):
        load_scene(tmp_path / "none.toml")
    latin = tmp_path / "latin.toml"
    latin.write_bytes(b'x = "\xe9"')
    with pytest.raises(SceneError, match=re.escape(f"{latin}: expected TOML")):
        load_scene(str(latin))
    with pytest.raises(SceneError, match="cannot be read: embedded null byte"):
        load_scene("a\0b.toml")


def test_mesh_paths_are_relative_to_the_scene_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    load(folder, FULL)
    monkeypatch.chdir(folder.parent)
    assert len(load_scene(Path(folder.name) / "scene.toml").instances[0].mesh.faces) == 12
    monkeypatch.chdir(folder / "models")
    assert len(load_scene("../scene.toml").instances) == 4
    absolute = FULL.replace("models/box.ply", str(folder / "models" / "box.ply"))
    (folder.parent / "other.toml").write_text(absolute)
    assert len(load_scene(folder.parent / "other.toml").instances) == 4


# Values that a number, vector, string or table of the file may be replaced with.
STRANGE: list[str] = [
    "1e308", "-1e308", "1e-320", "1e160", "1e-200", "0", "-0.0", "-1", "1", "2.5", "nan", "inf", "-inf", "true",
    '""', '"\\u0000"', '"a\\nb"', "{}", "[[]]", "{a=1}", "1979-05-27", "07:32:00", "99999999999999999999",
    "[1e308,1e308,1e308]", "[1e-200,0,0]", "[0,0,0]", "[1,2]", "[true,1,1]", '["clay"]', '"clay"',
    '"models/box.ply"', '"models"', '"mirror"', '"dielectric"', '"point"', "[]",
]  # fmt: skip
STRANGE += ["9" * 4400, "0x" + "f" * 4400]
LINES = FULL.splitlines()


@st.composite
def mutated(draw: Any) -> str:
    lines = list(LINES)
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(lines) - 1))
        kind = draw(st.sampled_from(["value", "value", "value", "drop", "twice", "swap", "text", "key"]))
        key, equals, value = lines[at].partition(" = ")
        if kind == "value" and equals:
            lines[at] = f"{key} = {draw(st.sampled_from(STRANGE))}"
        elif kind == "key" and equals:
            name = draw(st.sampled_from(["x", "type", "mesh", "fov", "height", '"a b"']))
            lines[at] = f"{name} = {value}"
        elif kind == "drop":
            lines[at] = ""
        elif kind == "twice":
            lines.insert(at, lines[at])
        elif kind == "swap":
            other = draw(st.integers(0, len(lines) - 1))
            lines[at], lines[other] = lines[other], lines[at]
        else:
            cut = draw(st.integers(0, len(lines[at])))
            lines[at] = lines[at][:cut] + draw(st.text(max_size=4)) + lines[at][cut:]
    return "\n".join(lines)


@pytest.mark.filterwarnings("ignore::renderer.SceneWarning")
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=mutated())
@example(FULL.replace("translate = [1, 0, 0]", "translate = [1e308, 0, 0]").replace("scale = 0.5", "scale = 1e308"))
@example(FULL.replace("translate = [1, 0, 0]", "translate = [1e300, 0, 0]"))
@example(FULL.replace("max = [4.0, 4.0]", "max = [1e300, 4.0]"))
@example(
    FULL.replace("eye = [0, 1, 5]", "eye = [1e308, 1, 5]").replace("target = [0, 0, 0]", "target = [-1e308, 0, 0]")
)
@example(FULL.replace("max_depth = 3", "max_depth = " + "9" * 4400))
@example(FULL.replace('type = "mirror"', 'type = "a\\nb"'))
def test_any_file_is_a_scene_or_one_line(folder: Path, text: str) -> None:
    """No other exception and no warning; a scene that comes out is one that can be packed for the kernels."""
    path = folder / "fuzz.toml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        scene = load_scene(path)
    except (SceneError, MeshError) as error:
        assert str(error).startswith(f"{path}: ") and len(str(error).splitlines()) == 1
        return
    _, world = pack(scene)
    for array in (world.vertices, world.normals, world.materials, world.lights, world.colors):
        assert np.isfinite(array).all()
    for rows in (scene.camera.rows(3, 2), np.array(scene.camera.frame())):
        assert np.isfinite(rows).all()
    towards = world.lights[world.lights[:, 0] == 0, 1:4] if len(scene.lights) else np.zeros((0, 3))
    np.testing.assert_allclose(np.linalg.norm(towards, axis=1), 1.0, rtol=1e-12)


@cases("size", [1e-300, 1e-200, 1e-160, 1.0, 1e160, 1e300])
def test_directional_lights_of_any_length_shine_alike(size: float) -> None:
    row = light_row(DirectionalLight(direction=(0, -size, 0), irradiance=2.0))
    assert row.tolist() == [0, 0, 1, 0, 2, 2, 2]


class TestFromPython:
    def test_meshes_in_memory(self) -> None:
        mesh = icosphere(1)
        scene = Scene(
            camera=PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0)),
            materials={"a": Phong(), "b": Mirror(type="mirror")},
            objects=(SceneObject(mesh=mesh, material="b"), SceneObject(mesh=box(), material="a", translate=(1, 2, 3))),
        )
        first, second = scene.instances
        assert first.mesh is mesh and first.material == "b"
        assert second.mesh.bounds[0].tolist() == [1, 2, 3] and second.material == "a"
        assert scene.instances is scene.instances

    def test_plain_tables(self, folder: Path) -> None:
        scene = Scene(
            camera={"eye": (0, 0, 5), "target": (0, 0, 0)},
            materials={"a": {"type": "mirror"}},
            lights=[{"type": "point", "position": (0, 1, 0)}],
            objects=[{"mesh": folder / "models" / "box.ply", "material": "a"}],
        )
        assert isinstance(scene.camera, PerspectiveCamera) and isinstance(scene.materials["a"], Mirror)
        assert isinstance(scene.lights[0], PointLight) and len(scene.instances[0].mesh.faces) == 12

    def test_faults_are_value_errors_that_name_the_key(self) -> None:
        camera = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        with pytest.raises(ValueError, match="speed"):
            Scene(camera=camera, materials={}, speed=3)
        with pytest.raises(ValueError, match=r"objects\.0\.material.*'a'"):
            Scene(camera=camera, materials={}, objects=(SceneObject(mesh=box(), material="a"),))

    def test_numbers_and_arrays_of_numpy_are_those_of_python(self) -> None:
        eye, angle = np.array([0, 0, 5]), np.float32(40.5)
        camera = PerspectiveCamera(eye=eye, target=(np.float64(0.0), np.int8(1), 0), fov=angle)
        assert camera == PerspectiveCamera(eye=(0, 0, 5), target=(0, 1, 0), fov=40.5)
        assert [type(camera.fov), *map(type, camera.eye)] == [float] * 4
        # These pydantic would refuse, which takes the ones above.
        assert RenderSettings(samples=np.int64(4)) == RenderSettings(samples=4)
        assert Phong(diffuse=np.float32(0.5)) == Phong(diffuse=(0.5, 0.5, 0.5))

    def test_scenes_are_frozen(self) -> None:
        scene = Scene(camera=PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0)), materials={})
        with pytest.raises(ValueError, match="frozen"):
            scene.ambient = (1, 1, 1)


def turned(degrees: Any, points: np.ndarray) -> np.ndarray:
    """Points rotated about x, then y, then z, counter-clockwise seen from the axis' tip; by complex numbers."""
    points = points.astype(np.float64).copy()
    for axis, angle in enumerate(degrees):
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        z = (points[:, i] + 1j * points[:, j]) * np.exp(1j * np.radians(angle))
        points[:, i], points[:, j] = z.real, z.imag
    return points


class TestPlacing:
    def place(self, mesh: Mesh, **how: Any) -> Mesh:
        camera = PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0))
        objects = (SceneObject(mesh=mesh, material="a", **how),)
        return Scene(camera=camera, materials={"a": Phong()}, objects=objects).instances[0].mesh

    @cases("move", [0.7, 1000.1, 5e6])
    @cases("dtype", [np.float32, np.float64])
    def test_placed_corners_are_float64_whatever_the_file_holds(self, dtype: Any, move: float) -> None:
        mesh = Mesh(icosphere(2).vertices.astype(dtype), icosphere(2).faces)
        placed = self.place(mesh, scale=0.3, rotate=(10, 20, 30), translate=(0.1, move, -0.2))
        exact = turned((10, 20, 30), mesh.vertices * 0.3) + np.array([0.1, move, -0.2])
        np.testing.assert_allclose(placed.vertices, exact, rtol=0, atol=2.0**-52 * (1.0 + move))

    def test_a_moved_box_is_where_it_was_moved_to(self) -> None:
        """A box of whole numbers, whose corners float32 holds before it is moved and not after."""
        assert box().is_float32
        assert self.place(box(), translate=(0, 0, 0.3)).bounds[1].tolist() == [1.0, 1.0, 1.3]
        crate = SceneObject(mesh=box(), material="a", translate=(0, 0, 0.3))
        eye = PerspectiveCamera(eye=(0.5, 0.5, 10), target=(0.5, 0.5, 0))
        scene = Scene(camera=eye, materials={"a": Phong()}, objects=(crate,))
        assert render(scene, resolution=(1, 1)).depth.tolist() == [[10 - 1.3]]

    def test_normals_go_with_the_surface(self) -> None:
        ball = Mesh(icosphere(3).vertices, icosphere(3).faces, normals=icosphere(3).vertices)
        placed = self.place(ball, scale=(1, 2, 4), rotate=(0, 30, 0))
        assert placed.normals is not None
        # The normal of an ellipsoid at (x, y, z) goes like (x, y/4, z/16) of its placed position.
        expected = turned((0, 30, 0), ball.vertices / [1, 2, 4])
        expected /= np.linalg.norm(expected, axis=1, keepdims=True)
        np.testing.assert_allclose(placed.normals, expected, atol=16 * 2.0**-53)

    def test_world_positions_that_overflow_are_one_error_without_warnings(self, folder: Path) -> None:
        error_of(folder, with_key("[[objects]]", "scale = 1e308").replace("[1, 0, 0]", "[1e308, 1e308, 1e308]"))


class TestFloor:
    def parts(self, **how: Any) -> dict[str, Mesh]:
        floor = Floor(**{"min": (-1, -2), "max": (3, 4), "materials": ("a", "b"), **how})
        scene = Scene(
            camera=PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0)),
            materials={"a": Phong(), "b": Phong()},
            floor=floor,
        )
        return {i.material: i.mesh for i in scene.instances}

    def test_squares_share_their_edges(self) -> None:
        parts = self.parts(min=(-0.1, -0.7), max=(0.3, 0.9), squares=(7, 5))
        assert set(map(tuple, parts["a"].vertices)) == set(map(tuple, parts["b"].vertices))

    def test_squares_stay_where_they_are_at_the_coordinates_of_a_map(self) -> None:
        low, high = (500_000.3, 5_000_000.1), (500_010.3, 5_000_010.1)
        parts = self.parts(min=low, max=high, squares=(10, 10))
        for mesh in parts.values():
            assert [corner.tolist() for corner in mesh.bounds] == [[low[0], 0.0, low[1]], [high[0], 0.0, high[1]]]
            along, across = (np.unique(mesh.vertices[:, axis]) for axis in (0, 2))
            np.testing.assert_allclose(along, low[0] + np.arange(11), rtol=0, atol=1e-9)
            np.testing.assert_allclose(across, low[1] + np.arange(11), rtol=0, atol=1e-8)


def test_packed_rows_follow_the_instances(folder: Path) -> None:
    scene = load(folder, FULL)
    mesh, world = pack(scene)
    names = list(scene.materials)
    rows = world.material // MATERIAL_COLUMNS
    assert [names[i] for i in rows] == ["glass"] * 12 + ["mirror"] * 12 + ["clay"] * 6 + ["glass"] * 6
    assert world.smooth.tolist() == [True] * 12 + [False] * 24
    start = 0
    for instance in scene.instances:
        count = len(instance.mesh.faces)
        assert (mesh.triangles[start : start + count] == instance.mesh.triangles).all()
        start += count
    assert len(mesh.faces) == len(world.faces) == start
    assert world.colors.tolist() == [[0.1] * 3, [0.1, 0.2, 0.3]]


def test_one_mesh_may_stand_in_many_places(folder: Path) -> None:
    entry = '[[objects]]\nmesh = "models/box.ply"\nmaterial = "clay"\n'
    scene = load(folder, CAMERA + MATERIAL + entry * 20)
    assert len(scene.instances) == 20 and len(pack(scene)[0].faces) == 240


@pytest.mark.parametrize("head", ["x", "[[objects]]\nmaterial = 'm'\nmesh", "[materials.m]\ncolor"])
def test_tables_too_deep_to_show_are_named(tmp_path: Path, head: str) -> None:
    """``repr`` of a value so deep ended in a RecursionError."""
    (tmp_path / "deep.toml").write_text(head + ".a" * 5000 + " = 1\n")
    with pytest.raises(SceneError, match=r"deep\.toml: "):
        load_scene(tmp_path / "deep.toml")
