"""One colour for each face, as sRGB codes: Phong at its centroid, without shadows and bounces."""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.materials.columns import AMBIENT
from renderer.materials.registry import reflected_light
from renderer.numerics.simd import load, maximum, minimum, pointer
from renderer.numerics.vec3 import add, cross, dot, normalized, row3, scale, sub, three, times
from renderer.shade.lights import see_light
from renderer.shade.surface import material_of, scene_pointers

# Equal parts of [0, 1], so narrow that a code is found within a step or two: steps of sRGB are 3e-4 apart and more.
PLACES = 4096


@inlined
def _encoded(x, steps, first):
    """The sRGB code of x, found from the code at the start of its part of [0, 1]; see ``face_phong.CodeTable``."""
    x = minimum(maximum(x, 0.0), 1.0)
    code = load(first, np.int64(x * PLACES))
    while load(steps, code) <= x:
        code += 1
    return code


@kernel
def shade_faces(arrays, eye, colors, steps, first, begin, end):
    """Colour the faces from ``begin`` to ``end``; ``steps`` and ``first`` are those of ``face_phong.CodeTable``."""
    seen, steps, first = scene_pointers(arrays), pointer(steps), pointer(first)
    for face in range(begin, end):
        p0, p1, p2 = seen.ways.corners(seen, seen.ways.at(seen, face))
        p, n = scale(add(add(p0, p1), p2), 1.0 / 3.0), normalized(cross(sub(p1, p0), sub(p2, p0)))
        d, m = normalized(sub(p, eye)), material_of(seen, face)
        n = scale(n, -1.0) if dot(d, n) > 0.0 else n
        color = times(three(seen.materials, m + AMBIENT), row3(seen.colors, 0))
        for light in range(seen.light_count):
            lamp = see_light(seen.lights, light, p, n, 0.0)
            if lamp.faces:
                color = add(color, times(reflected_light(seen.materials, m, n, d, lamp.towards), lamp.arriving))
        for k in range(3):
            colors[face, k] = _encoded(color[k], steps, first)
