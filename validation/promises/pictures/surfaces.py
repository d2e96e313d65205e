"""Surfaces with maps, colours of vertices, masks and emission, by closed forms."""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.texture import Texture
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.scene import RenderSettings
from validation.promises.pictures.glowing import BLACK
from validation.promises.pictures.textured import (
    CORNERS,
    across,
    close,
    even,
    linear,
    pixels,
    screen,
    seen,
    sheet,
)
from validation.promises.row import row

Bools = NDArray[np.bool_]
_BY = "closed form"
_SIZE = 8
_SUN = DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(0.5, 1.0, 0.25))
_CUTOFF = 0.5
# The last is there, at the cutoff; the one before it is the largest below.
_ALPHAS = np.array([0.0, 1.0, 0.25, 0.75, float(np.nextafter(np.float32(_CUTOFF), np.float32(0.0))), _CUTOFF])


def check_surfaces(rng: Generator) -> list[dict[str, Any]]:
    """Sheets seen from above, one or two, some in front of a glowing one."""
    return [
        row("each map multiplies the colour of its name", _BY, _mapped(rng)),
        row("ambient light has the map of diffuse light unless it has its own", _BY, _ambient(rng)),
        row("colours of vertices multiply ambient and diffuse light and emission", _BY, _tinted(rng)),
        row("a map of normals turns them along u and v, mirrored or not, by its strength", _BY, _normals(rng)),
        row("rays pass a mask where its alpha is below the cutoff", _BY, _masked()),
        row("light shines through the holes of masks and no more", _BY, _shadows()),
        row("a surface that is partly there lets the rest through unbent", _BY, _blended(rng)),
        row("a surface that is partly there shades by its share where shadows are clear", _BY, _shaded()),
        row("emission is seen in mirrors, and lights nothing else", _BY, _emitted()),
        row("a material receives light where a lamp changes its look", "a picture without lamps", _received()),
    ]


def _mapped(rng: Generator) -> Bools:
    """One term of the sum at a time, a texel in each pixel."""
    image, kept = rng.random((_SIZE, _SIZE, 3), np.float32), []
    texture, color, light = Texture(image, filter="nearest"), np.array([0.75, 0.5, 0.25]), np.array([0.5, 1.0, 0.25])
    cases: tuple[tuple[str, dict[str, Any]], ...] = (
        ("ambient", {"ambient": tuple(light)}), ("diffuse", {"lights": (_SUN,)}), ("specular", {"lights": (_SUN,)}),
        ("reflectance", {"background": tuple(light)}), ("transmittance", {"background": tuple(light)}),
        ("emission", {}),
    )  # fmt: skip
    for name, given in cases:
        plain = {} if name == "diffuse" else {"diffuse": BLACK}
        # A colour that is not given beside its map is 1.
        for own, share in (({name: tuple(color)}, color), ({}, np.ones(3))):
            look = Phong.model_validate({**plain, **own, f"{name}_map": texture, "ior": 1.0})
            found = seen((sheet(), look), size=_SIZE, **given)
            kept.append(close(found, image * share * (light if given else 1.0)))
    return np.concatenate(kept)


def _ambient(rng: Generator) -> Bools:
    a, b = (rng.random((_SIZE, _SIZE, 3), np.float32) for _ in range(2))
    one, other = (Texture(image, filter="nearest") for image in (a, b))
    cases: tuple[tuple[dict[str, Any], Any], ...] = (
        ({}, 0.5 * a), ({"ambient": 0.75}, np.full(3, 0.75)), ({"ambient": 0.75, "ambient_map": other}, 0.75 * b),
    )  # fmt: skip
    found = [seen((sheet(), Phong(diffuse=0.5, diffuse_map=one, **own)), size=_SIZE, ambient=1.0) for own, _ in cases]
    return np.concatenate([close(each, expected) for each, (_, expected) in zip(found, cases, strict=True)])


def _tinted(rng: Generator) -> Bools:
    """As linear numbers and as sRGB; a map of the same colour multiplies too."""
    shine, kept = (0.5, 1.0, 0.25), []
    cases: tuple[tuple[dict[str, Any], dict[str, Any]], ...] = (
        ({"diffuse": 0.5, "ambient": BLACK}, {"lights": (_SUN,)}),
        ({"diffuse": BLACK, "ambient": 0.5}, {"ambient": shine}),
        ({"diffuse": BLACK, "emission": 0.5, "emission_map": even(shine)}, {}),
    )
    for space in ("linear", "srgb"):
        colors = rng.random((4, 3), np.float32)
        tints = across(linear(colors) if space == "srgb" else colors.astype(np.float64), *pixels(_SIZE))
        for look, given in cases:
            material = Phong.model_validate({**look, "vertex_colors": space})
            found = seen((sheet(colors=colors), material), size=_SIZE, **given)
            kept.append(close(found, 0.5 * np.array(shine) * tints))
    return np.concatenate(kept)


def _normals(rng: Generator) -> Bools:
    """Coordinates along x and y, mirrored along either, exchanged and turned: by the gradients of u and v."""
    kept = []
    for rows in ([[1, 0], [0, 1]], [[-1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, -1], [1, 0]]):
        matrix = np.array(rows, np.float64)
        for strength in (1.0, 0.5, -1.5):
            codes = rng.integers(64, 192, 3).astype(np.uint8)
            codes[2] = 240
            x, y, z = 2.0 * codes / 255.0 - 1.0
            in_plane = strength * (x * matrix[0] + y * matrix[1])
            normal = np.array([*in_plane, z]) / np.linalg.norm([*in_plane, z])
            texture = Texture(codes[None, None], strength=strength)
            for towards in ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, -0.6, 0.8)):
                # From above the picture's x is the world's, its y is -z.
                sun = DirectionalLight(direction=(-towards[0], -towards[2], towards[1]), irradiance=(1.0, 1.0, 1.0))
                found = seen((sheet(CORNERS @ matrix.T), Phong(diffuse=1.0, normal_map=texture)), size=2, lights=(sun,))
                kept.append(close(found, np.full(3, max(0.0, normal @ towards))))
    return np.concatenate(kept)


def _mask(**given: Any) -> Phong:
    """Columns of all alphas, the red of which says otherwise."""
    image = np.ones((1, len(_ALPHAS), 4), np.float32)
    image[0, :, 0], image[0, :, 3] = 1.0 - _ALPHAS, _ALPHAS
    return Phong(cutoff=_CUTOFF, opacity_map=Texture(image, filter="nearest"), **given)


def _masked() -> Bools:
    """Up to three masks over a glowing sheet, and over nothing; and an opacity that halves the alpha of the mask."""
    kept, there = [], _ALPHAS >= _CUTOFF
    size, behind, own = len(_ALPHAS), (1.0, 0.25, 0.0), np.array([0.0, 0.5, 1.0])
    for layers in (1, 3):
        masks = [(sheet(height=1.0 + k), _mask(diffuse=BLACK, emission=tuple(own))) for k in range(layers)]
        for found in (
            seen(*masks, (sheet(), screen(even(behind))), size=size), seen(*masks, size=size, background=behind),
        ):  # fmt: skip
            kept.append(close(found, np.where(there[:, None], own, behind)))
    half = sheet(), _mask(diffuse=BLACK, emission=tuple(own), opacity=0.5)
    there = _ALPHAS / 2.0 >= _CUTOFF
    kept.append(close(seen(half, size=size, background=behind), np.where(there[:, None], own, behind)))
    return np.concatenate(kept)


def _shadows() -> Bools:
    """Masks above the eye and a floor below it, lit from above the masks and from below them."""
    kept, size, holes = [], len(_ALPHAS), (_ALPHAS < _CUTOFF)[:, None]
    floor = sheet(), Phong(diffuse=1.0)
    near, far = (PointLight(position=(0.5, height, 0.5), intensity=1e4) for height in (1.5, 1e3))
    for layers in (1, 2):
        masks = [(sheet(height=2.0 + k), _mask(diffuse=0.5)) for k in range(layers)]
        # Where the rays from afar pass the masks they are within a hundredth of a pixel of parallel ones.
        for light, lit in ((_SUN, holes), (near, True), (far, holes)):
            bare, found = (seen(floor, *above, size=size, eye=1.0, lights=(light,)) for above in ((), masks))
            kept.append(close(found, np.where(lit, bare, 0.0)))
    return np.concatenate(kept)


def _blended(rng: Generator) -> Bools:
    """A share of opacity, of its map's alpha or of both, over what the same camera sees without that surface."""
    image, behind = rng.random((_SIZE, _SIZE, 4), np.float32), rng.random((_SIZE, _SIZE, 3), np.float32)
    kept, shine, over = [], np.array([1.0, 0.5, 0.25]), Texture(image, filter="nearest")
    below = sheet(), screen(Texture(behind, filter="nearest"))
    near = PerspectiveCamera(eye=(0.5, 2.0, 0.5), target=(0.5, 0.0, 0.5), up=(0.0, 0.0, -1.0), fov=25.0)
    alphas = image[..., 3]
    for opacity, texture, shares in ((0.25, None, np.full_like(alphas, 0.25)), (0.75, over, 0.75 * alphas),
                                     (1.0, over, alphas)):  # fmt: skip
        look = Phong(diffuse=BLACK, emission=shine, opacity=opacity, opacity_map=texture, ior=1.5)
        share = shares[..., None]
        kept.append(close(seen((sheet(height=1.0), look), below, size=_SIZE), share * shine + (1.0 - share) * behind))
        if texture is None:
            bare, found = (seen(*some, below, size=_SIZE, camera=near) for some in ((), ((sheet(height=1.0), look),)))
            kept.append(close(found, opacity * shine + (1.0 - opacity) * bare))
    return np.concatenate(kept)


def _shaded() -> Bools:
    kept = []
    for shadows, share in (("opaque", 0.0), ("clear", 0.75 * 0.5)):
        panes = [(sheet(height=2.0 + k), Phong(opacity=opacity)) for k, opacity in enumerate((0.25, 0.5))]
        settings = RenderSettings.model_validate({"glass_shadows": shadows})
        found = seen((sheet(), Phong(diffuse=1.0)), *panes, size=2, eye=1.0, lights=(_SUN,), render=settings)
        kept.append(close(found, share * np.array([0.5, 1.0, 0.25])))
    return np.concatenate(kept)


def _emitted() -> Bools:
    """Between a lamp above the eye and a floor that mirrors half, or scatters everything."""
    kept, shine = [], np.array([1.0, 2.0, 4.0])
    lamp = sheet(height=2.0), Phong(diffuse=BLACK, emission=tuple(shine))
    for floor, share in ((Phong(diffuse=BLACK, reflectance=0.5), 0.5), (Phong(diffuse=1.0), 0.0)):
        kept.append(close(seen((sheet(), floor), lamp, size=2, eye=1.0), share * shine))
    return np.concatenate(kept)


def _received() -> Bools:
    """Materials that scatter, shine, glow, mirror and refract."""
    materials = Phong(), Phong(diffuse=0.0, specular=0.5), Phong(diffuse=0.0, ambient=1.0), Mirror(), Dielectric()
    found = [[seen((sheet(), each), size=1, ambient=1.0, lights=some) for some in ((), (_SUN,))] for each in materials]
    changed = [not np.array_equal(bare, lit) for bare, lit in found]
    return np.array([each.receives_light == lit for each, lit in zip(materials, changed, strict=True)])
