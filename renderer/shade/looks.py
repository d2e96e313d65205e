"""A material's row at a point, from its textures and from colours of vertices.

Other pictures have kernels without any of this, chosen when they are compiled.
"""

import math
from typing import Any, NamedTuple

from renderer.jit.decorators import inlined, kernel
from renderer.materials.columns import AMBIENT, DIFFUSE, MATERIAL_COLUMNS, TRANSMITTANCE
from renderer.numerics.simd import doubles_between, extract, load, maximum, splat4, store
from renderer.numerics.vec3 import (
    add,
    barycentric,
    cross,
    dot,
    largest_component,
    length,
    normalized,
    put3,
    scale,
    sub,
    three,
    times,
)
from renderer.shade.records import (
    COLORS,
    CUTOFF,
    EMISSION,
    MAP_COLUMNS,
    MAPPED,
    NORMAL_MAP,
    OPACITY,
    OPACITY_MAP,
    STRENGTH,
    TEXTURE_COLUMNS,
    TINTED,
)
from renderer.shade.texture import Patch, texture_at

# A material's row at a point, with the emission behind it.
OWN_COLUMNS = MATERIAL_COLUMNS + 3
OWN_COLORS = (*COLORS, MATERIAL_COLUMNS)
_TINTED = (AMBIENT, DIFFUSE, MATERIAL_COLUMNS)
# The least cosine of a ray to a face's normal: at a smaller one an ellipse is as long as at this.
_GRAZING = 2.0**-10
# Of a smaller sine rounding may leave no direction.
_STRAIGHT = 2.0**-20


class LookWays(NamedTuple):
    """The kernels by which materials are read.

    row       row(scene, spot, look, d, width, own): the start of the row that holds for a ``Spot``, seen by a ray of
              direction d and that ``width``, from ``scene.materials`` on; ``own`` has room for OWN_COLUMNS
    normal    normal(scene, spot, look, d, width): the shading normal
    glow      glow(scene, row): the ambient light that a row reflects, and what it emits
    is_there  is_there(scene, spot): whether no mask leaves out the surface
    has_holes has_holes(scene): whether there is any mask
    """

    row: Any
    normal: Any
    glow: Any
    is_there: Any
    has_holes: Any


@inlined
def _plain_row(scene, spot, look, d, width, own):
    return look.material


@inlined
def _plain_normal(scene, spot, look, d, width):
    return look.n_s


@inlined
def ambient_light(scene, row):
    """The ambient light that a row reflects."""
    return times(three(scene.materials, row + AMBIENT), three(scene.colors, 0))


@inlined
def _always(scene, spot):
    return True


@inlined
def _never(scene):
    return False


PLAIN = LookWays(_plain_row, _plain_normal, ambient_light, _always, _never)


@inlined
def _maps_of(material):
    return material // MATERIAL_COLUMNS * MAP_COLUMNS


@inlined
def _here(scene, at, u, v):
    """The ``Patch`` of a point alone."""
    u0, v0, u1, v1, u2, v2 = scene.ways.texcoords(scene, at)
    w = 1.0 - u - v
    return Patch(w * u0 + u * u1 + v * u2, w * v0 + u * v1 + v * v2, 0.0, 0.0, 0.0, 0.0)


@kernel
def _patch_at(scene, at, u, v, d, width, facet):
    """The ``Patch`` at barycentrics u, v of a face that a ray of direction d and that ``width`` sees."""
    u0, v0, u1, v1, u2, v2 = scene.ways.texcoords(scene, at)
    here = _here(scene, at, u, v)
    if not (width > 0.0 and facet.double_area > 0.0):
        return here
    p0, p1, p2 = scene.ways.corners(scene, at)
    n, e, f = facet.normal, sub(p1, p0), sub(p2, p0)
    # How the barycentrics grow over the face, times the doubled area, and so the coordinates.
    grows_u, grows_v, each = cross(f, n), cross(n, e), width / facet.double_area
    du, dv, eu, ev = (u1 - u0) * each, (v1 - v0) * each, (u2 - u0) * each, (v2 - v0) * each
    grad_u, grad_v = add(scale(grows_u, du), scale(grows_v, eu)), add(scale(grows_u, dv), scale(grows_v, ev))
    facing = dot(d, n)
    sine = math.sqrt(maximum(1.0 - facing * facing, 0.0))
    # Seen straight on, the ellipse is a circle, and any direction is along it.
    if sine < _STRAIGHT:
        d, sine, facing = e, math.sqrt(dot(e, e)), 1.0
    along, across = sub(d, scale(n, dot(d, n))), cross(n, d)
    longer, shorter = 1.0 / (sine * maximum(abs(facing), _GRAZING)), 1.0 / sine
    return Patch(
        here.u, here.v, dot(along, grad_u) * longer, dot(along, grad_v) * longer,
        dot(across, grad_u) * shorter, dot(across, grad_v) * shorter,
    )  # fmt: skip


@inlined
def _rgb(lanes):
    return extract(lanes, 0), extract(lanes, 1), extract(lanes, 2)


@inlined
def _opacity(scene, maps, patch):
    opacity, texture = load(scene.maps, maps + OPACITY), load(scene.maps, maps + OPACITY_MAP)
    # rule: alpha-of-opacity-map
    return (
        opacity * extract(texture_at(scene.textures, scene.texels, int(texture), patch), 3)
        if texture >= 0.0
        else opacity
    )


@kernel
def _own_row(scene, spot, look, d, width, own):
    at, maps = scene.ways.at(scene, spot.face), _maps_of(look.material)
    for k in range(MATERIAL_COLUMNS):
        store(own, k, load(scene.materials, look.material + k))
    put3(own, MATERIAL_COLUMNS, three(scene.maps, maps + EMISSION))
    opacity = load(scene.maps, maps + OPACITY)
    if load(scene.maps, maps + MAPPED) != 0.0:
        patch = _patch_at(scene, at, spot.u, spot.v, d, width, look.facet)
        _put_mapped(scene, maps, patch, own)
        opacity = _opacity(scene, maps, patch)
    # rule: colours-of-vertices
    if load(scene.maps, maps + TINTED) != 0.0:
        a, b, c = scene.ways.tints(scene, at)
        for k in _TINTED:
            put3(own, k, times(three(own, k), barycentric(a, b, c, spot.u, spot.v)))
    if opacity < 1.0 and load(scene.maps, maps + CUTOFF) == 0.0:
        for k in OWN_COLORS:
            # rule: share-of-blend
            put3(own, k, scale(three(own, k), opacity))
        # rule: rest-of-blend
        rest = 1.0 - opacity
        put3(own, TRANSMITTANCE, add(three(own, TRANSMITTANCE), (rest, rest, rest)))
    return doubles_between(scene.materials, own)


@inlined
def _put_mapped(scene, maps, patch, own):
    """Multiply the colours of a row by their textures."""
    last, values = -1.0, splat4(1.0)
    for k in range(len(OWN_COLORS)):
        texture = load(scene.maps, maps + k)
        if texture >= 0.0:
            # Ambient and diffuse light mostly share theirs.
            if texture != last:
                last, values = texture, texture_at(scene.textures, scene.texels, int(texture), patch)
            # rule: colour-by-map
            put3(own, OWN_COLORS[k], times(three(own, OWN_COLORS[k]), _rgb(values)))


@kernel
def _mapped_normal(scene, spot, look, d, width):
    """The shading normal that a texture of normals gives, on the side of the surface from which the ray comes."""
    maps = _maps_of(look.material)
    texture = load(scene.maps, maps + NORMAL_MAP)
    if texture < 0.0:
        return look.n_s
    at, number, n = scene.ways.at(scene, spot.face), int(texture), look.n_s
    along, other = _tangents(scene, at, n)
    if largest_component(along) == 0.0:
        return n
    r, g, b = _rgb(
        texture_at(scene.textures, scene.texels, number, _patch_at(scene, at, spot.u, spot.v, d, width, look.facet))
    )
    # rule: strength-of-normals
    strength = load(scene.textures, number * TEXTURE_COLUMNS + STRENGTH)
    # rule: normal-of-texel
    x, y, z = strength * (2.0 * r - 1.0), strength * (2.0 * g - 1.0), 2.0 * b - 1.0
    return normalized(add(add(scale(along, x), scale(other, y)), scale(n, z)))


@kernel
def _tangents(scene, at, n):
    """The unit vectors across a normal along which u and v grow on a face; zero where texture coordinates do not."""
    u0, v0, u1, v1, u2, v2 = scene.ways.texcoords(scene, at)
    p0, p1, p2 = scene.ways.corners(scene, at)
    e, f = sub(p1, p0), sub(p2, p0)
    turn = (u1 - u0) * (v2 - v0) - (u2 - u0) * (v1 - v0)
    # rule: tangent-along-u
    along = scale(sub(scale(e, v2 - v0), scale(f, v1 - v0)), 1.0 if turn > 0.0 else -1.0)
    along = sub(along, scale(n, dot(n, along)))
    if turn == 0.0 or length(along) == 0.0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    along = normalized(along)
    # Where the image is mirrored on the face, v grows to the other side of u.
    # rule: mirrored-tangents
    return along, scale(cross(n, along), 1.0 if turn > 0.0 else -1.0)


@inlined
def _own_glow(scene, row):
    # rule: emission
    return add(ambient_light(scene, row), three(scene.materials, row + MATERIAL_COLUMNS))


@kernel
def _is_there(scene, spot):
    at = scene.ways.at(scene, spot.face)
    maps = _maps_of(load(scene.material, scene.ways.row(scene, at)))
    cutoff = load(scene.maps, maps + CUTOFF)
    # rule: mask-at-cutoff
    return cutoff == 0.0 or _opacity(scene, maps, _here(scene, at, spot.u, spot.v)) >= cutoff


@inlined
def _has_holes(scene):
    return scene.holes


TEXTURED = LookWays(_own_row, _mapped_normal, _own_glow, _is_there, _has_holes)
