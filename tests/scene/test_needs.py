"""What a scene needs, that the rest costs nothing, and that switching it on changes no bit of the picture."""

import importlib
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import Image, Mesh, Needs, Scene, load_scene, needs_of, render
from renderer.cli.main import main
from renderer.materials.columns import KIND, PHONG
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.shapes import box, grid, icosphere
from renderer.picture.pack import pack
from renderer.picture.prepare import build_octree, kernel_settings_of, tree_for
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight, light_row
from renderer.scene.needs import FEW_FACES, examine
from renderer.scene.scene import Floor, RenderSettings, SceneObject
from renderer.shade.surface import MAX_MEDIA

pytestmark = pytest.mark.judges(
    "Dielectric.passes_light", "Image", "Mirror.passes_light", "Needs", "Phong.passes_light", "Phong.receives_light",
    "needs_of", "render",
)  # fmt: skip


MODULE = importlib.import_module("renderer.picture.prepare")
SCENES = Path(__file__).parents[2] / "scenes"
SUN = DirectionalLight(direction=(-1, -2, -1))
DARK = PointLight(position=(0, 5, 0), intensity=0.0)
GLASS = Dielectric(type="dielectric")
UNLIT = Phong(diffuse=0.0, ambient=0.5)
FLOOR = Floor(min=(-3, -3), max=(3, 3), materials=("m",))
SIZE = (24, 18)


def ball(level: int) -> Mesh:
    """An icosphere that float32 holds exactly."""
    return Mesh(icosphere(level).vertices.astype(np.float32), icosphere(level).faces)


def scene(
    material: Any, mesh: Mesh | None = None, *, normals: Any = "flat", eye: Any = (2, 3, 5), **more: Any
) -> Scene:
    """One mesh of ``material`` at the origin, and a white material that nothing is made of."""
    return Scene(
        **{
            "camera": PerspectiveCamera(eye=eye, target=(0, 0.1, 0)),
            "materials": {"m": material, "unused": Phong(specular=1.0, reflectance=1.0, transmittance=1.0)},
            "objects": (SceneObject(mesh=mesh or ball(0), material="m", normals=normals),),
            "lights": (SUN,),
            "ambient": 0.5,
            "background": 0.3,
            **more,
        }
    )


def picture(what: Scene, **options: Any) -> Image:
    return render(what, resolution=SIZE, threads=1, **options)


def assert_same_picture(a: Image, b: Image) -> None:
    for name in ("radiance", "depth", "normal", "face"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name


NOTHING = Needs(False, False, False, False, False, 0, False, False, False)
LIT = replace(NOTHING, shadows=True, lights=1)
FINE = icosphere(0)


@cases(
    ("what", "expected"),
    [
        (scene(UNLIT), NOTHING),
        (scene(UNLIT, objects=()), NOTHING),
        (scene(Phong()), LIT),
        (scene(Phong(), lights=()), NOTHING),
        (scene(Phong(specular=0.1), lights=(DARK,)), NOTHING),
        (scene(Phong(), lights=(DARK, SUN, SUN)), replace(LIT, lights=2)),
        (scene(Phong(diffuse=0.0, specular=(0, 0, 0.1))), replace(LIT, specular=True)),
        (scene(Phong(reflectance=(0, 0.1, 0))), replace(LIT, reflection=True)),
        (scene(Phong(transmittance=0.1)), replace(LIT, refraction=True)),
        (scene(Mirror(type="mirror")), replace(NOTHING, reflection=True)),
        (scene(Mirror(type="mirror", reflectance=0.0)), NOTHING),
        (scene(GLASS), replace(NOTHING, reflection=True, refraction=True)),
        (scene(GLASS, render=RenderSettings(max_depth=0)), NOTHING),
        (scene(Dielectric(type="dielectric", transmittance=0.0)), replace(NOTHING, reflection=True)),
        (scene(UNLIT, normals="smooth"), replace(NOTHING, smooth_normals=True)),
        (scene(UNLIT, FINE), replace(NOTHING, float64_vertices=True)),
        (scene(UNLIT, ball(1)), replace(NOTHING, octree=True)),
    ],
)
def test_needs(what: Scene, expected: Needs) -> None:
    assert needs_of(what) == expected


def test_an_octree_is_needed_above_few_faces() -> None:
    for count, needed in ((FEW_FACES, False), (FEW_FACES + 1, True)):
        faces = np.resize(ball(1).faces, (count, 3))
        assert needs_of(scene(UNLIT, Mesh(ball(1).vertices, faces))).octree == needed


def test_an_object_without_faces_needs_nothing() -> None:
    empty = Mesh(FINE.vertices, np.empty((0, 3), np.int32))
    assert needs_of(scene(GLASS, empty, normals="smooth")) == NOTHING
    assert picture(scene(GLASS, empty, normals="smooth")).rays.tolist() == np.ones(SIZE[::-1]).tolist()


def test_bounces_are_needed_as_far_as_max_depth_asks() -> None:
    assert needs_of(scene(GLASS), max_depth=0) == NOTHING
    assert needs_of(scene(GLASS, render=RenderSettings(max_depth=0)), max_depth=2).refraction


def test_findings_name_the_fields_and_the_material() -> None:
    findings = examine(scene(GLASS))
    assert [f.feature for f in findings] == [f.name for f in fields(Needs)]
    reasons = {f.feature: f.reason for f in findings}
    assert reasons["refraction"] == "material 'm' lets light through"
    assert reasons["specular"] == "no material has highlights"
    assert {f.feature: f.reason for f in examine(scene(GLASS), 0)}["reflection"] == "max_depth is 0"
    assert {f.feature: f.reason for f in examine(scene(Phong(), lights=(DARK,)))}["shadows"] == "no light shines"


EVERYTHING = [
    scene(UNLIT, icosphere(2)),
    scene(Phong(), lights=(DARK, SUN, DARK), floor=FLOOR),
    scene(Phong(specular=0.5, reflectance=0.2)),
    scene(Mirror(type="mirror", reflectance=0.7), icosphere(2), floor=FLOOR),
    scene(GLASS, icosphere(2), normals="smooth"),
    scene(Dielectric(type="dielectric", transmittance=0.0), icosphere(1)),
    # The eye is in the glass, which a picture without bounces does not look at.
    scene(GLASS, icosphere(2), eye=(0.1, 0.2, 0.3), render=RenderSettings(max_depth=0)),
]


@cases("what", EVERYTHING)
def test_more_than_needed_changes_no_bit(what: Scene) -> None:
    needs, expected = needs_of(what), picture(what)
    lights = len(what.lights)
    features = [name for name, value in asdict(needs).items() if not value and name != "lights"]
    for chosen in [*([name] for name in features), features]:
        more = replace(needs, lights=lights, **dict.fromkeys(chosen, True))
        assert_same_picture(picture(what, needs=more), expected)


def test_less_than_needed_is_an_error() -> None:
    what = scene(Phong(specular=0.1, reflectance=0.1), icosphere(1), normals="smooth", lights=(SUN, DARK))
    for feature in ("reflection", "shadows", "specular", "smooth_normals", "octree"):
        with pytest.raises(ValueError, match=rf"needs\.{feature}: expected True \(.+\), got False"):
            picture(what, needs=replace(needs_of(what), **{feature: False}))
    for lights in (0, 3, -1, True, 1.0):
        with pytest.raises(ValueError, match=r"needs\.lights: expected an integer from 1 to 2"):
            picture(what, needs=replace(needs_of(what), lights=lights))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"needs\.octree: expected True or False, got 1"):
        picture(what, needs=replace(needs_of(what), octree=1))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="needs: expected a Needs or None, got dict"):
        picture(what, needs={})  # type: ignore[arg-type]
    # What the scene needs with bounces, a picture without them need not have.
    picture(what, needs=replace(needs_of(what), reflection=False), max_depth=0)


def test_what_is_not_needed_costs_no_rays() -> None:
    assert (picture(scene(UNLIT)).rays == 1).all()
    assert (picture(scene(Phong(), lights=(DARK, DARK))).rays == 1).all()
    forced = picture(scene(UNLIT), needs=replace(needs_of(scene(UNLIT)), shadows=True, lights=1))
    assert (forced.rays[forced.face >= 0] == 2).any()
    # A shadow ray to each light that shines, where the surface faces it.
    lit = picture(scene(Phong(), lights=(SUN, DARK)))
    assert set(lit.rays[lit.face >= 0]) == {1, 2} and (lit.rays[lit.face < 0] == 1).all()
    # In a scene with shadows the dark material still traces none.
    floor = Floor(min=(-3, -3), max=(3, 3), materials=("unused",))
    mixed = picture(scene(UNLIT, floor=floor), max_depth=0)
    assert (mixed.rays[(mixed.face >= 0) & (mixed.face < 20)] == 1).all() and (mixed.rays[mixed.face >= 20] == 2).all()


@pytest.mark.parametrize("diffuse", [0.0, 0.5])
def test_highlights_are_there_with_and_without_a_diffuse_colour(diffuse: float) -> None:
    glossy, dull = (picture(scene(Phong(diffuse=diffuse, specular=k, shininess=1.0)), max_depth=0) for k in (0.5, 0.0))
    more = glossy.radiance - dull.radiance
    assert (more >= 0.0).all() and more.max() > 0.1


def test_dark_lights_come_when_asked_for() -> None:
    what = scene(Phong(), lights=(DARK, SUN, DARK))
    needs = needs_of(what)
    rows = np.array([light_row(light) for light in what.lights])
    for lights, kept in ((1, [1]), (2, [0, 1]), (3, [0, 1, 2])):
        np.testing.assert_array_equal(pack(what, replace(needs, lights=lights))[1].lights, rows[kept])
    assert picture(what, needs=replace(needs, lights=3)).rays.max() == 4 and picture(what).rays.max() == 2


def test_what_is_not_needed_takes_no_memory() -> None:
    what = scene(UNLIT, lights=(SUN,), eye=(0.1, 0.2, 0.3))
    _, world = pack(what)
    assert (len(world.normals), len(world.smooth), len(world.lights), len(world.media)) == (0, 0, 0, 0)
    all_on = Needs(True, True, True, True, True, 1, True, True, False)
    _, world = pack(what, all_on)
    vertices, faces = len(icosphere(0).vertices), len(icosphere(0).faces)
    assert (len(world.normals), len(world.smooth), len(world.lights)) == (vertices, faces, 1)
    assert not world.smooth.any() and (world.materials[:, KIND] == PHONG).all()
    few, most = (kernel_settings_of(n, RenderSettings(max_depth=5), 0.0) for n in (needs_of(what), all_on))
    assert (few.max_depth, few.media) == (0, 0) and (most.max_depth, most.media) == (5, MAX_MEDIA)
    # The eye is in the glass, but a picture without bounces looks through none of it.
    inside = scene(GLASS, icosphere(2), eye=(0.1, 0.2, 0.3))
    assert (len(pack(inside)[1].media), len(pack(inside, needs_of(inside, 0))[1].media)) == (1, 0)
    mirror = kernel_settings_of(replace(NOTHING, reflection=True), RenderSettings(max_depth=5), 0.0)
    assert (mirror.max_depth, mirror.media) == (5, 0)


def test_vertices_take_half_where_float32_holds_them() -> None:
    for what, size in ((scene(UNLIT), 4), (scene(UNLIT, FINE), 8)):
        mesh, _ = pack(what)
        own, widened = needs_of(what), replace(needs_of(what), float64_vertices=True)
        octree = build_octree(mesh, "auto", "midpoint", own)
        assert tree_for(octree, own).blocks.itemsize == size
        wide = tree_for(octree, widened).blocks
        assert wide.dtype == np.float64
        brute = build_octree(mesh, "brute", "midpoint", own)
        np.testing.assert_array_equal(wide, tree_for(brute, own).blocks)


@pytest.mark.parametrize(("mesh", "tree"), [(box(), False), (grid(4, 4), True)], ids=["few", "many"])
def test_the_tree_is_built_where_it_pays_or_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, mesh: Mesh, tree: bool
) -> None:
    built: list[str] = []

    def count(name: str) -> None:
        class Counting(getattr(MODULE, name)):  # type: ignore[misc]
            @classmethod
            def from_mesh(cls, *arguments: Any, **options: Any) -> Any:
                built.append(name)
                return super().from_mesh(*arguments, **options)

        monkeypatch.setattr(MODULE, name, Counting)

    count("Octree")
    count("BruteForce")
    what = scene(Phong(), mesh)
    needs = needs_of(what)
    pictures = [picture(what), picture(what, accelerator="octree"), picture(what, accelerator="brute")]
    pictures.append(picture(what, needs=replace(needs, octree=True)))
    assert built == ["Octree" if tree else "BruteForce", "Octree", "BruteForce", "Octree"]
    for other in pictures[1:]:
        assert_same_picture(pictures[0], other)


def test_info_says_what_is_needed_and_why(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["info", str(SCENES / "stairs.toml")]) == 0
    lines = capsys.readouterr().out.splitlines()[-9:]
    assert [line[2:18].strip().replace(" ", "_") for line in lines] == [f.name for f in fields(Needs)]
    assert lines[0].endswith(" left out: no material reflects") and lines[5].endswith(" needed: 25 of 25 lights shine")
    needs = needs_of(load_scene(SCENES / "stairs.toml"))
    assert [" needed: " in line for line in lines] == [bool(value) for value in asdict(needs).values()]


def test_info_of_few_faces_builds_no_tree(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    text = "camera = {eye = [0, 1, 3], target = [0, 0, 0]}\nmaterials = {m = {}}\n"
    (tmp_path / "floor.toml").write_text(text + 'floor = {min = [-1, -1], max = [1, 1], materials = ["m"]}\n')
    assert main(["info", str(tmp_path / "floor.toml")]) == 0
    out = capsys.readouterr().out
    assert "nodes" not in out and f"left out: 2 faces, and a tree pays above {FEW_FACES}" in out
