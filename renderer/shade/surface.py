"""A scene as kernels read it, the surface at a hit, and the light that it reflects."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.materials.registry import reflected_light
from renderer.numerics.kinds import of_kind
from renderer.numerics.simd import load, minimum, pointer
from renderer.numerics.vec3 import add, barycentric, dot, largest_component, normalized, row3, scale, sub
from renderer.shade.faces import MERGED, PLACED, FaceWays
from renderer.shade.looks import PLAIN, TEXTURED, LookWays
from renderer.trace.instances import scene_pointers as instance_pointers
from renderer.trace.spawn import Facet, facet_of, offset_distance

# The most media that a ray remembers to be in. A ninth is not remembered; leaving it then leads back into the eighth.
MAX_MEDIA = 8


class SceneArrays(NamedTuple):
    """The arrays of a scene; the columns of materials and lights are those of ``records``.

    vertices   (V, 3)
    normals    (V, 3), no rows if no face is smooth; (R,) int64 for placed meshes, the addresses of their own
    faces      (F, 3) int32
    placed     empty int64; or uint64, the scene as of ``trace.instances`` in which meshes are placed: then there are no
               vertices and faces, and R is the number of instances in place of F
    material   (R,) int32, for each face the start of its material's row in the flat array ``materials``
    smooth     (R,) bool, no rows if no face is smooth
    materials  (M, MATERIAL_COLUMNS)
    maps       (M, MAP_COLUMNS), no rows in pictures without textures
    textures   (T, TEXTURE_COLUMNS) float64; empty int64 in pictures without textures
    texels     (n,) float32, red, green, blue and alpha of the images of textures, linear
    texcoords  (V, 2), and
    tints      (V, 3), colours of vertices, linear; of placed meshes flat, behind R places where those of each start; no
               rows without textures
    lights     (L, LIGHT_COLUMNS)
    colors     (2, 3), ambient and background
    sky        (4, 3), the unit vector up, and the radiance of zenith, horizon and ground; no rows without a sky
    media      (m,) int64, m <= MAX_MEDIA, the same place for each medium that the eye is in, outermost first
    touching   (R,) uint8, not 0 for faces that may coincide with one that transmits light; no rows if none does
    soft       whether the terminator of smooth faces is soft
    clear      whether light passes surfaces that transmit light
    holes      whether a mask leaves out any surface
    pixel      the width of camera rays where they start, and
    spread     by how much rays are wider after a distance of 1
    """

    vertices: NDArray[np.float64]
    normals: NDArray[Any]
    faces: NDArray[np.int32]
    placed: NDArray[Any]
    material: NDArray[np.int32]
    smooth: NDArray[np.bool_]
    materials: NDArray[np.float64]
    maps: NDArray[np.float64]
    textures: NDArray[Any]
    texels: NDArray[np.float32]
    texcoords: NDArray[Any]
    tints: NDArray[Any]
    lights: NDArray[np.float64]
    colors: NDArray[np.float64]
    sky: NDArray[np.float64]
    media: NDArray[np.int64]
    touching: NDArray[np.uint8]
    soft: bool
    clear: bool
    holes: bool = False
    pixel: float = 0.0
    spread: float = 0.0


class ScenePointers(NamedTuple):
    """A ``SceneArrays`` as pointers, with the ``FaceWays`` and ``LookWays``, the numbers of lights and of media around
    the eye, and whether any face is smooth, any touches another and there is a sky.
    """

    vertices: Any
    normals: Any
    faces: Any
    placed: Any
    ways: FaceWays
    material: Any
    smooth: Any
    materials: Any
    maps: Any
    textures: Any
    texels: Any
    texcoords: Any
    tints: Any
    looks: LookWays
    lights: Any
    colors: Any
    sky: Any
    media: Any
    touching: Any
    light_count: int
    media_count: int
    has_smooth: bool
    has_touching: bool
    has_sky: bool
    soft: bool
    clear: bool
    holes: bool
    pixel: float
    spread: float


@inlined
def _plain(textures):
    return PLAIN


@inlined
def _textured(textures):
    return TEXTURED


@inlined
def _merged(descriptor):
    return 0, MERGED


@inlined
def _placed(descriptor):
    return instance_pointers(descriptor), PLACED


@inlined
def scene_pointers(scene):
    """Pointers into a scene, which the caller must keep alive."""
    placed, ways = of_kind(scene.placed, _merged, _placed)(scene.placed)
    return ScenePointers(
        pointer(scene.vertices),
        pointer(scene.normals),
        pointer(scene.faces),
        placed,
        ways,
        pointer(scene.material),
        pointer(scene.smooth),
        pointer(scene.materials),
        pointer(scene.maps),
        pointer(scene.textures),
        pointer(scene.texels),
        pointer(scene.texcoords),
        pointer(scene.tints),
        of_kind(scene.textures, _plain, _textured)(scene.textures),
        pointer(scene.lights),
        pointer(scene.colors),
        pointer(scene.sky),
        pointer(scene.media),
        pointer(scene.touching),
        len(scene.lights),
        len(scene.media),
        len(scene.smooth) > 0,
        len(scene.touching) > 0,
        len(scene.sky) > 0,
        scene.soft,
        scene.clear,
        scene.holes,
        scene.pixel,
        scene.spread,
    )


class Look(NamedTuple):
    """The surface at a hit: the point p, the ``Facet``, the shading normal, and the start of the material's row."""

    p: tuple
    facet: Facet
    n_s: tuple
    material: int


class Surface(NamedTuple):
    """A hit surface, for rays that leave it: the point p of a ``Look``, the ``offset_distance`` of p, the geometric and
    the shading normal, the material, and the slack of rays from there.
    """

    p: tuple
    error: float
    n_g: tuple
    n_s: tuple
    material: int
    slack: float


@inlined
def _seen(n_s, n_g, d):
    """The shading normal n_s, bent across the ray where the smooth surface turns away from it and the flat face n_g
    does not, as at an outline. Normals of a file may lie on the other side of the face, and stay there.
    """
    away = dot(n_s, d)
    if away * dot(n_g, d) * dot(n_s, n_g) >= 0.0:
        return n_s
    return normalized(sub(n_s, scale(d, away * (1.0 + 2.0**-20))))


@inlined
def look_at(scene, face, u, v, d):
    """The ``Look`` at barycentrics u, v of a face hit by a ray of direction d."""
    at, ways = scene.ways.at(scene, face), scene.ways
    p0, p1, p2 = ways.corners(scene, at)
    row, facet = ways.row(scene, at), facet_of(p0, p1, p2, d)
    n_s = facet.normal
    if scene.has_smooth and load(scene.smooth, row):
        n0, n1, n2 = ways.normals(scene, at)
        n = barycentric(n0, n1, n2, u, v)
        # A file may hold zeros, and opposite normals cancel: a surface without a direction would let light through.
        # rule: unit-shading-normal
        n_s = normalized(n) if largest_component(n) > 0.0 else n_s
        if scene.soft:
            n_s = _seen(n_s, facet.normal, d)
    return Look(barycentric(p0, p1, p2, u, v), facet, n_s, load(scene.material, row))


@inlined
def material_of(scene, face):
    """The start of the row of a face's material."""
    return np.int64(load(scene.material, scene.ways.row(scene, scene.ways.at(scene, face))))


class Raised(NamedTuple):
    """A point of a face, or the one above it on the smooth surface that the face stands for, and whether it is off."""

    point: tuple
    is_off: bool


@inlined
def raised(scene, face, u, v, p, n, n_g, error):
    """The point p at barycentrics u, v of a smooth face, ``Raised`` on the side of the shading normal n: the mean of
    its images in the planes across the normals of the corners, where it is below them. It stays where that is within
    p's ``error`` along the face's normal n_g, as on a flat part: from there a ray would meet the face itself.

    Shadow rays from there are not hidden by the faces next to it, of which the smooth surface has none.
    Hanika, Hacking the Shadow Terminator, in Ray Tracing Gems II, 2021.
    """
    at, ways = scene.ways.at(scene, face), scene.ways
    if not (scene.soft and scene.has_smooth and load(scene.smooth, ways.row(scene, at))):
        return Raised(p, False)
    (p0, p1, p2), (n0, n1, n2) = ways.corners(scene, at), ways.normals(scene, at)
    up = barycentric(_up_to(p0, n0, p, n), _up_to(p1, n1, p, n), _up_to(p2, n2, p, n), u, v)
    return Raised(add(p, up), abs(dot(up, n_g)) > error)


@inlined
def _up_to(corner, normal, p, n):
    """The way from p up to the plane through a corner across its normal, 0 where p is not below it."""
    if largest_component(normal) == 0.0:
        return (0.0, 0.0, 0.0)
    normal = normalized(normal)
    outwards = normal if dot(normal, n) > 0.0 else scale(normal, -1.0)
    # rule: soft-terminator
    height = minimum(dot(sub(p, corner), outwards), 0.0)
    return scale(outwards, -height)


@inlined
def bounds_at(scene, face, u, v, p, facet):
    """The ``offset_distance`` and the slack of rays that leave a face at p."""
    p0, p1, p2 = scene.ways.corners(scene, scene.ways.at(scene, face))
    return offset_distance(p, p0, p1, p2, u, v, facet)


@inlined
def left_from(scene, face, u, v, look):
    """The ``Surface`` of a ``Look`` at barycentrics u, v of a face."""
    error, slack = bounds_at(scene, face, u, v, look.p, look.facet)
    return Surface(look.p, error, look.facet.normal, look.n_s, look.material, slack)


@inlined
def surface_at(scene, face, u, v, d):
    """The ``Surface`` at barycentrics u, v of a face hit by a ray of direction d."""
    return left_from(scene, face, u, v, look_at(scene, face, u, v, d))


@inlined
def missed(scene, d):
    """The radiance of a ray of unit direction d that hits nothing."""
    if not scene.has_sky:
        return row3(scene.colors, 1)
    # rule: sky-gradient
    sine = dot(row3(scene.sky, 0), d)
    if sine <= 0.0:
        return row3(scene.sky, 3)
    return add(scale(row3(scene.sky, 1), sine), scale(row3(scene.sky, 2), 1.0 - sine))


@kernel
def surface_of(arrays, face, u, v, d):
    """``surface_at``, for Python."""
    return surface_at(scene_pointers(arrays), face, u, v, d)


@kernel
def own_look_of(arrays, spot, d, width, own):
    """What a ray of direction d and that ``width`` sees at a ``Spot`` of a picture with textures: writes the row of the
    material there, with the emission behind it, and returns the shading normal. For Python.
    """
    scene = scene_pointers(arrays)
    look = look_at(scene, spot.face, spot.u, spot.v, d)
    scene.looks.row(scene, spot, look, d, width, pointer(own))
    return scene.looks.normal(scene, spot, look, d, width)


@kernel
def is_there_of(arrays, spot):
    """Whether no mask leaves out the surface at a ``Spot``, for Python."""
    scene = scene_pointers(arrays)
    return scene.looks.is_there(scene, spot)


@kernel
def missed_of(arrays, d):
    """``missed``, for Python."""
    return missed(scene_pointers(arrays), d)


@kernel
def reflected_of(arrays, m, n, d, towards):
    """``reflected_light``, for Python."""
    return reflected_light(scene_pointers(arrays).materials, m, n, d, towards)
