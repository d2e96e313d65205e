"""Textures, masks, maps of normals and colours of vertices, against closed forms and SciPy's interpolation."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from renderer import (
    Dielectric,
    DirectionalLight,
    Image,
    Mesh,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    PointLight,
    Scene,
    SceneError,
    SceneObject,
    Texture,
    needs_of,
    prepare,
    render,
    shapes,
    srgb,
)
from renderer.diagnostics.ray_path import ray_path
from renderer.mesh.texture import Filter, Wrap

SIZE = 64
# Across a unit square of the plane z = 0, seen from above, x to the right and y up.
ABOVE = OrthographicCamera(eye=(0.5, 0.5, 1), target=(0.5, 0.5, 0), up=(0, 1, 0), height=1)
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
FACES = [[0, 1, 2], [0, 2, 3]]
# x and y in the middle of each pixel.
X, Y = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, 1 - (np.arange(SIZE) + 0.5) / SIZE)
NOISE = np.random.default_rng(1).random((5, 7, 3), np.float32)


def square(texcoords: Any = CORNERS[:, :2], height: float = 0.0, **given: Any) -> Mesh:
    return Mesh(CORNERS + np.array([0, 0, height]), FACES, texcoords=texcoords, **given)


def scene_of(*objects: tuple[Mesh, Any], camera: Any = ABOVE, **given: Any) -> Scene:
    materials = {f"m{i}": material for i, (_, material) in enumerate(objects)}
    placed = [SceneObject(mesh=mesh, material=f"m{i}") for i, (mesh, _) in enumerate(objects)]
    return Scene(camera=camera, materials=materials, objects=placed, **given)


def seen(*objects: tuple[Mesh, Any], size: int = SIZE, **given: Any) -> NDArray[np.float32]:
    return render(scene_of(*objects, **given), resolution=size).radiance


def glowing(texture: Any, **given: Any) -> Phong:
    """What shows a texture as it is."""
    return Phong(diffuse=0, emission_map=texture, **given)


def value(color: Any, channels: int = 3) -> Texture:
    """A texture of one value."""
    return Texture(np.broadcast_to(np.float32(color), (1, 1, channels)).copy())


def read(image: NDArray[Any], x: Any, y: Any, order: int, wrap: tuple[Wrap, Wrap]) -> NDArray[Any]:
    """The image at coordinates, by SciPy: each axis is extended first, as SciPy has one mode for both."""
    modes: dict[Wrap, Any] = {"repeat": "wrap", "mirror": "symmetric", "clamp": "edge"}
    for axis, mode in ((1, modes[wrap[0]]), (0, modes[wrap[1]])):
        widths = [(0, 0)] * 3
        widths[axis] = (4 * image.shape[axis],) * 2
        image = np.pad(image, widths, mode=mode)
    high, wide = image.shape[0] / 9, image.shape[1] / 9
    at = [(4 + 1 - y) * high - 0.5, (4 + x) * wide - 0.5]
    return np.stack([map_coordinates(image[..., k].astype(float), at, order=order) for k in range(3)], axis=-1)


@pytest.mark.judges("Texture")
@pytest.mark.parametrize("wrap", [("repeat", "mirror"), ("mirror", "clamp"), ("clamp", "repeat")])
@pytest.mark.parametrize("filter", ["nearest", "linear"])
def test_a_texture_is_read_as_another_program_reads_it(filter: Filter, wrap: tuple[Wrap, Wrap]) -> None:
    rows = np.array([[3.1416, 0.7071, -1.3], [-0.8727, 2.7183, 0.2]])
    found = seen((square(), glowing(Texture(NOISE, rows, wrap, filter))))
    u, v = (row[0] * X + row[1] * Y + row[2] for row in rows)
    expected = read(NOISE, u, v, int(filter == "linear"), wrap)
    np.testing.assert_allclose(found, expected, atol=3e-6)


def test_texture_coordinates_are_interpolated_on_each_face() -> None:
    texcoords = np.array([[0.1, 0.2], [1.3, 0.1], [0.8, 0.9], [-0.4, 1.2]])
    found = seen((square(texcoords), glowing(Texture(NOISE, filter="linear"))))
    a, b, c, d = texcoords
    below = (Y < X)[..., None]
    x, y = X[..., None], Y[..., None]
    at = np.where(below, a + (b - a) * x + (c - b) * y, a + (d - a) * y + (c - d) * x)
    np.testing.assert_allclose(found, read(NOISE, at[..., 0], at[..., 1], 1, ("repeat", "repeat")), atol=3e-6)


def test_codes_of_an_image_are_those_of_a_picture_that_shows_it() -> None:
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16, 1)
    found = srgb(seen((square(), glowing(Texture(codes, filter="nearest"))), size=16))
    np.testing.assert_array_equal(found, np.repeat(codes, 3, axis=2))


def test_sixteen_bits_are_srgb_and_floats_are_linear() -> None:
    for image, expected in ((np.uint16([[[32768]]]), 0.2140486), (np.float32([[[0.5]]]), 0.5)):
        assert seen((square(), glowing(Texture(image))), size=1) == pytest.approx(expected, rel=1e-5)


@pytest.mark.judges("Texture.checker")
def test_a_checker_has_its_first_colour_in_the_lower_left() -> None:
    found = seen((square(), glowing(Texture.checker((0.25, 0.5, 1), 0, squares=(8, 4)))))
    first = (np.floor(X * 8) + np.floor(Y * 4)) % 2 == 0
    np.testing.assert_array_equal(found, np.where(first[..., None], np.float32([0.25, 0.5, 1]), 0))


def test_each_color_is_multiplied_by_its_map() -> None:
    tints = np.array([0.5, 0.25, 0.75])
    usual: dict[str, Any] = {"diffuse": 0.8, "specular": 0.6, "reflectance": 0.5, "transmittance": 0.7, "emission": 2.0}
    light: dict[str, Any] = {"lights": [DirectionalLight(direction=(0, 0, -1))], "ambient": 0.3, "background": 0.4}
    for name in usual:
        mapped = Phong(**usual, **{f"{name}_map": value(tints)})
        plain = Phong(**usual | {name: usual[name] * tints})
        found, expected = (seen((square(), material), size=1, **light) for material in (mapped, plain))
        np.testing.assert_allclose(found, expected, rtol=1e-6)
        assert not np.allclose(found, seen((square(), Phong(**usual)), size=1, **light), rtol=1e-3)


@pytest.mark.parametrize(("u", "expected"), [(3e9, 1), (-3e9, 0), (1e300, 1)])
def test_clamped_coordinates_far_away_have_the_edge_on_their_side(u: float, expected: int) -> None:
    texture = Texture(np.float32([[[0], [1]]]), wrap=("clamp", "clamp"))
    assert seen((square(np.full((4, 2), u)), glowing(texture)), size=1).tolist() == [[[expected] * 3]]


def test_grey_bytes_of_two_axes_are_an_image() -> None:
    assert seen((square(), glowing(np.full((2, 2), 255, np.uint8))), size=1).tolist() == [[[1, 1, 1]]]


def test_maps_are_seen_as_they_are_where_their_colour_is_not_given() -> None:
    found = Phong(specular_map=value(0.5), opacity_map=value(1.0))
    assert (found.specular, found.diffuse) == ((1.0, 1.0, 1.0), (0.8, 0.8, 0.8))


def test_emission_is_seen_in_mirrors_and_lights_nothing_else() -> None:
    lamp = square(height=0.5), Phong(diffuse=0, emission=(1, 2, 4))
    for floor, expected in ((Phong(reflectance=0.5, diffuse=0), (0.5, 1, 2)), (Phong(diffuse=1), (0, 0, 0))):
        below = OrthographicCamera(eye=(0.5, 0.5, 0.25), target=(0.5, 0.5, 0), up=(0, 1, 0), height=1)
        assert seen((square(), floor), lamp, camera=below, size=1).tolist() == [[list(expected)]]


# Minification


def test_mip_maps_of_an_even_image_keep_its_colour() -> None:
    even = Texture(np.full((9, 5, 3), 0.3, np.float32), transform=((900, 70, 0), (-30, 400, 0)))
    np.testing.assert_allclose(seen((square(), glowing(even))), 0.3, rtol=1e-6)


@pytest.mark.parametrize("size", [(5, 1), (31, 7), (6, 63)])
def test_the_last_mip_map_is_the_mean_of_an_image_of_any_size(size: tuple[int, int]) -> None:
    image = np.random.default_rng(size[0]).random((size[1], size[0], 3), np.float32)
    found = seen((square(), glowing(Texture(image, transform=((900, 0, 0.3), (0, 900, 0.1))))), size=2)
    np.testing.assert_allclose(found, np.broadcast_to(image.mean(axis=(0, 1)), (2, 2, 3)), rtol=1e-5)


def floor_of(filter: Filter) -> Image:
    """A floor of fine squares to the horizon, from a low eye."""
    codes = np.kron([[0.9, 0.1], [0.1, 0.9]], np.ones((16, 16)))[..., None].astype(np.float32)
    corners = np.array([[-30, 0, 0], [30, 0, 0], [30, 0, -60], [-30, 0, -60]], float)
    floor = Mesh(corners, FACES, texcoords=corners[:, [0, 2]])
    camera = PerspectiveCamera(eye=(0.3, 1, 1), target=(0, 0.7, -1), fov=50)
    scene = scene_of((floor, glowing(Texture(codes, filter=filter))), camera=camera, background=0.5)
    return render(scene, resolution=96, samples=256 if filter == "linear" else 1)


def test_a_floor_at_one_sample_is_near_the_mean_of_many_by_mip_maps_alone() -> None:
    truth, far = floor_of("linear").radiance, slice(36, 60)
    shown = {filter: floor_of(filter).radiance for filter in ("mipmap", "nearest")}
    errors = {filter: np.sqrt(np.mean((found - truth)[far] ** 2)) for filter, found in shown.items()}
    # Squares of 0.1 and 0.9 alone are 0.4 beside their mean; what is left is the blur of the isotropic filter.
    assert errors["mipmap"] < 0.05 and errors["nearest"] > 0.2


# Maps of normals


def lit(texcoords: Any, texture: Texture, direction: Any) -> Any:
    light = DirectionalLight(direction=direction)
    return seen((square(texcoords), Phong(diffuse=1, normal_map=texture)), size=1, lights=[light])[0, 0, 0]


@pytest.mark.parametrize("strength", [1.0, 0.5])
def test_a_map_of_normals_turns_them_along_u_and_v(strength: float) -> None:
    n = np.array([0.36, -0.48, 0.8])
    texture = Texture((n + 1)[None, None].astype(np.float32) / 2, strength=strength)
    turned = n * [strength, strength, 1]
    turned /= np.linalg.norm(turned)
    uv = CORNERS[:, :2]
    # The axes of the world along which u and v grow on the square.
    for along, other, texcoords in (
        ((1, 0), (0, 1), uv),
        ((-1, 0), (0, 1), 1 - uv * [1, -1]),
        ((0, 1), (1, 0), uv[:, ::-1]),
    ):
        world = np.array([*(turned[0] * np.array(along) + turned[1] * np.array(other)), turned[2]])
        for to_light in ((0, 0, 1), (0.6, 0, 0.8), (0, -0.6, 0.8)):
            expected = max(world @ to_light, 0)
            assert lit(texcoords, texture, -np.array(to_light)) == pytest.approx(expected, abs=2e-6)


def test_a_map_of_normals_needs_texture_coordinates_that_grow() -> None:
    tilted = value((1.0, 0.5, 0.6))
    assert lit(np.zeros((4, 2)), tilted, (0, 0, -1)) == 1.0


# Masks


HALF = np.array([[[1, 1, 1, 1], [1, 1, 1, 0]]], np.float32)
# There where x is below a half.
HOLED = Phong(diffuse=0, emission=(0, 1, 0), cutoff=0.5, opacity_map=Texture(HALF, filter="nearest"))


@pytest.mark.parametrize("layers", [1, 3, 300])
def test_rays_pass_through_holes_to_what_is_behind(layers: int) -> None:
    masks = [(square(height=0.6 / layers * (k + 1)), HOLED) for k in range(layers)]
    image = render(scene_of(*masks, (square(), glowing(value((1, 0, 0))))), resolution=4)
    assert (
        image.radiance[:, :2].tolist() == [[[0, 1, 0]] * 2] * 4
        and image.radiance[:, 2:].tolist() == [[[1, 0, 0]] * 2] * 4
    )
    np.testing.assert_allclose(image.depth, [[0.4] * 2 + [1.0] * 2] * 4)
    assert set(image.face[:, :2].ravel()) <= {2 * layers - 2, 2 * layers - 1}
    assert set(image.face[:, 2:].ravel()) == {2 * layers, 2 * layers + 1}
    alone = render(scene_of(*masks, background=0.25), resolution=4)
    assert (
        (alone.radiance[:, 2:] == 0.25).all() and (alone.face[:, 2:] == -1).all() and np.isinf(alone.depth[:, 2:]).all()
    )


@pytest.mark.parametrize(
    "light", [DirectionalLight(direction=(0, 0, -1)), PointLight(position=(0.5, 0.5, 4.0), intensity=16)]
)
def test_light_shines_through_holes(light: Any) -> None:
    camera = OrthographicCamera(eye=(0.5, 0.5, 0.25), target=(0.5, 0.5, 0), up=(0, 1, 0), height=1)
    floor = square(), Phong(diffuse=1)
    masks = [(square(height=h), HOLED) for h in (0.5, 0.75)]
    found, bare = (
        render(scene_of(floor, *over, camera=camera, lights=[light]), resolution=8).radiance for over in (masks, ())
    )
    assert not found[:, :4].any()
    np.testing.assert_array_equal(found[:, 4:], bare[:, 4:])
    # A light between the layers and the floor is not theirs to hide.
    near = PointLight(position=(0.2, 0.5, 0.4), intensity=1.0)
    found, bare = (
        render(scene_of(floor, *over, camera=camera, lights=[near]), resolution=8).radiance for over in (masks, ())
    )
    np.testing.assert_array_equal(found, bare)


def test_a_share_of_light_goes_on_where_a_surface_is_partly_there() -> None:
    over = Phong(diffuse=0, emission=(1, 0, 0), opacity=0.5, opacity_map=value((1, 1, 1, 0.5), 4), ior=1.5)
    assert over.passes_light
    behind = square(), glowing(value((0, 1, 0)))
    slanted = OrthographicCamera(eye=(0.5, 0.5, 1), target=(0.4, 0.5, 0), up=(0, 1, 0), height=0.2)
    for camera in (ABOVE, slanted):
        found = seen((square(height=0.5), over), behind, size=2, camera=camera)
        np.testing.assert_allclose(found, np.broadcast_to([0.25, 0.75, 0], (2, 2, 3)), rtol=1e-6)


def test_masks_take_nothing_from_glass_and_mirrors_beside_them() -> None:
    ball = shapes.icosphere(2), Dielectric()
    for shadows in (True, False):
        with_mask = scene_of(ball, (square(height=-2), HOLED), background=0.5)
        found = render(with_mask, resolution=16, shadows=shadows).radiance
        assert np.isfinite(found).all()


# Colours of vertices


@pytest.mark.parametrize("space", ["linear", "srgb"])
def test_colors_of_vertices_multiply_and_are_interpolated(space: Any) -> None:
    colors = np.array([[0, 0.2, 1], [1, 0.2, 0.5], [0.5, 0.2, 1], [0.3, 0.2, 0]])
    found = seen((square(colors=colors), Phong(diffuse=0, emission=0.5, vertex_colors=space)))
    a, b, c, d = (
        colors if space == "linear" else np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
    )
    x, y, below = X[..., None], Y[..., None], (Y < X)[..., None]
    expected = np.where(below, a + (b - a) * x + (c - b) * y, a + (d - a) * y + (c - d) * x) / 2
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_ambient_light_has_the_colour_of_diffuse_light_unless_it_has_its_own() -> None:
    mesh = square(colors=np.full((4, 3), 0.5))
    look: dict[str, Any] = {"diffuse_map": value((0.5, 1, 1)), "vertex_colors": "linear"}
    owns: list[Any] = [{}, {"ambient": 0.75}, {"ambient_map": value((0.75, 1, 0))}]
    for own, expected in zip(owns, ([0.25, 0.5, 0.5], [0.375] * 3, [0.375, 0.5, 0]), strict=True):
        assert seen((mesh, Phong(**look, **own)), size=1, ambient=1).tolist() == [[expected]]


# All of it


def all_of_it() -> Scene:
    """Each kind of texture, bounces, smooth normals and masks."""
    ball = shapes.icosphere(3)
    around = np.column_stack([np.arctan2(ball.vertices[:, 1], ball.vertices[:, 0]), ball.vertices[:, 2]])
    mesh = Mesh(ball.vertices, ball.faces, ball.vertices, (ball.vertices + 1) / 2, around)
    rgba = np.random.default_rng(2).integers(0, 256, (8, 8, 4), np.uint8)
    materials = [
        Phong(diffuse_map=rgba, normal_map=Texture(rgba, filter="linear"), reflectance=0.3, vertex_colors="srgb"),
        Phong(diffuse_map=rgba, opacity_map=rgba, cutoff=0.5, specular=0.5),
        Phong(diffuse_map=rgba, opacity_map=rgba, transmittance=0.4),
        Phong(transmittance_map=rgba, reflectance_map=rgba, specular_map=rgba),
    ]
    objects = [
        SceneObject(mesh=mesh, material=str(k), normals="smooth", translate=(1.5 * k, 0, -k))
        for k in range(len(materials))
    ]
    camera = PerspectiveCamera(eye=(2, 1, 6), target=(2, 0, 0), fov=60)
    named = {str(k): material for k, material in enumerate(materials)}
    lights = [DirectionalLight(direction=(-1, -2, -1)), PointLight(position=(0, 3, 4), intensity=9)]
    return Scene(camera=camera, materials=named, objects=objects, lights=lights, ambient=0.1, background=0.2)


def test_any_number_of_threads_and_brute_force_give_the_same_bits() -> None:
    scene = all_of_it()
    one = render(scene, resolution=(50, 40), threads=1)
    assert np.isfinite(one.radiance).all() and one.radiance.std() > 0.05
    for other in (
        render(scene, resolution=(50, 40), threads=3),
        render(scene, resolution=(50, 40), accelerator="brute"),
    ):
        for name in ("radiance", "depth", "normal", "face", "rays"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    window = render(scene, resolution=(50, 40), window=(7, 5, 27, 15))
    np.testing.assert_array_equal(window.radiance, one.radiance[5:15, 7:27])


def test_a_scene_without_textures_has_the_same_bits_by_the_kernels_that_read_them() -> None:
    plain = [Phong(specular=0.3, reflectance=0.2), Dielectric(), Phong(transmittance=0.3, ior=1.1)]
    scene = all_of_it()
    scene = scene.altered(
        materials={**scene.materials, **{str(k): m for k, m in enumerate(plain)}, "3": Phong(diffuse=0)}
    )
    needs = needs_of(scene)
    assert not needs.textures
    usual, other = (
        render(scene, resolution=24, needs=n) for n in (needs, type(needs)(**vars(needs) | {"textures": True}))
    )
    for name in ("radiance", "depth", "normal", "face", "rays"):
        np.testing.assert_array_equal(getattr(usual, name), getattr(other, name))


# What is missing


def test_a_mesh_without_what_its_material_reads_is_refused() -> None:
    bare = Mesh(CORNERS, FACES)
    with pytest.raises(ValueError, match="material 'm0': expected texture coordinates for its diffuse_map, got none"):
        seen((bare, Phong(diffuse_map=value(1.0))))
    with pytest.raises(ValueError, match="material 'm0': expected colours of vertices for its vertex_colors, got none"):
        seen((bare, Phong(vertex_colors="srgb")))


@pytest.mark.parametrize(
    "bad", ["no.png", b"no image", np.zeros((2, 2, 5)), np.zeros((2, 2, 3)) * np.nan, np.zeros((0, 2, 3))]
)
def test_what_is_no_image_is_refused(bad: Any) -> None:
    with pytest.raises(ValueError):
        seen((square(), glowing(bad)))


def test_values_of_fields_that_are_no_textures_are_refused() -> None:
    for bad in (3, {"image": "a.png", "filter": "cubic"}, {"image": "a.png", "warp": 1}, {"pixels": 1}):
        with pytest.raises(SceneError, match="diffuse_map"):
            Phong(diffuse_map=bad)


def test_the_path_of_a_ray_adds_up_to_its_pixel() -> None:
    scene = all_of_it().altered(render={"resolution": (12, 12)})
    image, ready = render(scene), prepare(scene)
    origins, directions = scene.camera.primary_rays(12)
    for row, column in np.argwhere(image.face >= 0)[::3].tolist():
        path = ray_path(ready, origins[row, column], directions[row, column], scene.render.max_depth)
        sums = np.sum([segment.radiance for segment in path], axis=0)
        np.testing.assert_allclose(sums, image.radiance[row, column], rtol=1e-5, atol=1e-6)
        assert len(path) == image.rays[row, column]


def test_both_faces_of_a_square_blur_a_stretched_texture_alike() -> None:
    stripes = np.random.default_rng(5).random((64, 64, 1), np.float32)
    texture = glowing(Texture(stripes, transform=((8, 0, 0), (0, 2, 0))))
    one, other = (
        seen((Mesh(CORNERS, faces, texcoords=CORNERS[:, :2]), texture), size=32)
        for faces in (FACES, [[1, 2, 3], [1, 3, 0]])
    )
    np.testing.assert_allclose(one, other, atol=2e-3)
