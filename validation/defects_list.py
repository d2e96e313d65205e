"""The seeded defects: what each one is, where it goes in, and which group of checks runs against it."""

from dataclasses import dataclass
from typing import Literal

from validation.defects_seam import Replacement

Group = Literal["hits", "pictures"]


@dataclass(frozen=True)
class Defect:
    """One defect. ``kernel`` tells that kernels are compiled anew for it, which takes most of its time."""

    name: str
    group: Group
    replacement: Replacement
    kernel: bool


def _kernel(group: Group, name: str, module: str, rule: str, broken: str) -> Defect:
    return Defect(name, group, Replacement(module, rule, broken), kernel=True)


def _python(group: Group, name: str, module: str, rule: str, broken: str) -> Defect:
    return Defect(name, group, Replacement(module, rule, broken), kernel=False)


_LIGHT_ROWS = "return rows[~dark | (dark & extra)]"
_MATERIAL_ROWS = "own, kinds = needs_of(scene), rows[:, KIND]"
_COLORS = "np.array([scene.ambient, scene.background])"
_IMAGE = "return Image(*film,"
_SETTINGS = "Settings(bounces, chosen.min_weight,"
_SAMPLES = "rows, samples = camera.rows(width, height), sample_offsets(chosen.samples)"
_CORNER = "corner = forward - right * (pixel * width / 2.0)"

HITS = (
    _kernel("hits", "a triangle missing from the tree", "blocks", "vertex = first if face < 0 else",
            "vertex = first if face < 0 or face == 5 else"),
    _kernel("hits", "one triangle in 512 missing beyond the 65,536th", "blocks", "vertex = first if face < 0 else",
            "vertex = first if face < 0 or (face > 0xFFFF and face % 512 == 0) else"),
    _kernel("hits", "packets exit with their first hit", "packet", "                limit = _most(floats, LIMIT)",
            "                limit = least(select(load8(floats, LIMIT) < load8(floats, LIMIT + 8), "
            "load8(floats, LIMIT), load8(floats, LIMIT + 8)))"),
    _kernel("hits", "single rays exit at half their best hit", "stream", "limit = get(rays.floats, LIMIT + r)",
            "limit = get(rays.floats, LIMIT + r) * np.float32(0.5)"),
    _kernel("hits", "no box padding", "intersect", "FAR_PADDING = np.float32(1.0 + 8.0 * 2.0**-23)",
            "FAR_PADDING = np.float32(1.0)"),
    _kernel("hits", "boxes rounded to nearest", "intersect",
            "np.float32(abs(y) * _STEP + _TINY) if np.float64(y) < x else np.float32(0.0)", "np.float32(0.0)"),
    _kernel("hits", "a packet's beam too narrow", "packet", "_WIDER = np.float32(2.0**-18)",
            "_WIDER = np.float32(-(2.0**-8))"),
    _kernel("hits", "streams lose a leaf's last block", "stream", "if ~child & (MAX_LEAF_BLOCKS - 1) != 0:",
            "if ~child & (MAX_LEAF_BLOCKS - 1) > 1:"),
    _kernel("hits", "the highest face wins in streams", "stream", "if ti < t or (ti == t and fi < face):",
            "if ti < t or (ti == t and fi > face):"),
    _kernel("hits", "the highest face wins in packets", "leaf",
            "if ti >= t_min and (ti < t or (ti == t and fi < face)):",
            "if ti >= t_min and (ti < t or (ti == t and (face == NO_FACE or fi > face))):"),
    _kernel("hits", "float32 shear in the triangle test", "intersect", "        dx / dz,\n",
            "        np.float64(np.float32(dx / dz)),\n"),
    _python("hits", "vertices of the triangle test in float32", "blocks", "np.float64 if inexact else np.float32",
            "np.float32"),
    _kernel("hits", "an edge counts for neither side", "intersect", "not_negative = (e0 >= zero)",
            "not_negative = (e0 > zero)"),
    _kernel("hits", "faces are culled from behind", "intersect", "seen = (not_negative | not_positive)",
            "seen = (not_negative & not_negative)"),
    _kernel("hits", "hits in doubt are not settled", "traverse", "    if doubtful:\n", "    if False:\n"),
    _kernel("hits", "hits in doubt may lie before their boxes", "intersect",
            "return t if t0 <= box_limit(t, largest) else np.float64(t0) / largest", "return t"),
    _kernel("hits", "hits are in doubt too late", "intersect", "_DOUBT = 2.0**-27", "_DOUBT = 2.0**-40"),
    _kernel("hits", "stale boxes of inner nodes after a refit", "refit", "    _fit_nodes(nodes, links)\n", ""),
    _python("hits", "stale triangles after a refit", "refit", "fill_blocks(vertices, faces, tree.faces, threads)",
            "tree.blocks"),
    _kernel("hits", "any hit forgets what is near", "traverse", "put(found.hit, i, hit)",
            "put(found.hit, i, hit and t > 1.0)"),
    _kernel("hits", "a packet of any hits drops what waits beyond eight octants", "packet",
            "                limit = _most(floats, LIMIT)", "                limit = _most(floats, LIMIT)\n"
            "                top = min(top, 8) if any_hit else top"),
    _kernel("hits", "single rays skip a leaf's last block", "traverse",
            "best = nearest_carefully(tree, code >> LEAF_BITS, (code & (MAX_LEAF_BLOCKS - 1)) + 1, ray, shear, best)",
            "best = nearest_carefully(tree, code >> LEAF_BITS, "
            "np.int64((code & (MAX_LEAF_BLOCKS - 1)) == 0) + (code & (MAX_LEAF_BLOCKS - 1)), ray, shear, best)"),
    _kernel("hits", "single rays are an ulp too far", "batch", "out[0, i] = t / tree.scale + 0.0 if hit",
            "out[0, i] = t / tree.scale * (1.0 + 2.0**-52) if hit"),
    _python("hits", "bad rays are let through", "query", "    if bad:\n        _reject",
            "    if False:\n        _reject"),
)  # fmt: skip

PICTURES = (
    _python("pictures", "one triangle of a sphere missing", "world", "    mesh = Mesh(vertices, faces)\n",
            "    hole = int(np.argmin(np.linalg.norm(vertices[faces].mean(axis=1) - (-0.68, 1.0, 1.72), axis=1)))\n"
            "    if len(faces) > 5000:\n        faces[hole] = faces[hole, 0]\n    mesh = Mesh(vertices, faces)\n"),
    _python("pictures", "ior 1.501 for 1.5", "world", _MATERIAL_ROWS,
            _MATERIAL_ROWS + "; from renderer.scene_rows import IOR; rows[:, IOR] *= 1.501 / 1.5"),
    _python("pictures", "film shifted by half a pixel", "prepared_scene", _SAMPLES,
            _SAMPLES + "; rows[3] -= 0.5 * rows[4]"),
    _kernel("pictures", "the budget of rays is not kept", "whitted", "if get(work.traced, pixel) >= settings.max_rays:",
            "if get(work.traced, pixel) > 2 * settings.max_rays:"),
    _python("pictures", "eyes beyond the limit are let through", "camera", "if max(map(abs, eye)) > FARTHEST:",
            "if False:"),
    _kernel("pictures", "film shifted by 0.1 pixel", "camera", _CORNER,
            "corner = forward - right * (pixel * (width + 0.2) / 2.0)"),
    _kernel("pictures", "camera rays 0.1 pixel off their pixel's centre", "tile",
            "px, py = x + get(camera.samples, 2 * sample),", "px, py = x + 0.1 + get(camera.samples, 2 * sample),"),
    _kernel("pictures", "orthographic film 1 % too wide", "camera", "pixel = self.height / height\n",
            "pixel = self.height / height\n        right = 1.01 * right\n"),
    _kernel("pictures", "field of view + 0.3 degrees", "camera", "math.radians(self.fov)",
            "math.radians(self.fov + 0.3)"),
    _python("pictures", "a light missing", "world", _LIGHT_ROWS, "return rows[:-1]"),
    _python("pictures", "point light + 5 %", "world", _LIGHT_ROWS, "rows[-1, 4:] *= 1.05; " + _LIGHT_ROWS),
    _python("pictures", "light moved by 0.05", "world", _LIGHT_ROWS, "rows[-1, 1] += 0.05; " + _LIGHT_ROWS),
    _python("pictures", "gain 1.10", "prepared_scene", _IMAGE, "film.radiance[...] *= 1.10; " + _IMAGE),
    _python("pictures", "gain 1.001", "prepared_scene", _IMAGE, "film.radiance[...] *= 1.001; " + _IMAGE),
    _python("pictures", "red and blue exchanged", "prepared_scene", _IMAGE,
            "film.radiance[...] = film.radiance[..., ::-1].copy(); " + _IMAGE),
    _python("pictures", "flat instead of smooth normals", "world", "np.repeat([i.smooth for i in instances],",
            "np.repeat([False for i in instances],"),
    _python("pictures", "depth 5 for 6", "prepared_scene", _SETTINGS, "Settings(min(bounces, 5), chosen.min_weight,"),
    _python("pictures", "rays end below a weight of 0.05", "prepared_scene", _SETTINGS,
            "Settings(bounces, max(0.05, chosen.min_weight),"),
    _python("pictures", "offset 1e-2", "render", "return BOUNDED if offset", "return 1e-2 if offset"),
    _python("pictures", "sRGB applied twice", "image", "return (encoded * 255.0 + 0.5)",
            "encoded = 1.055 * encoded ** (1.0 / 2.4) - 0.055; return (np.maximum(encoded, 0.0) * 255.0 + 0.5)"),
    _python("pictures", "sRGB cut off instead of rounded", "image", "(encoded * 255.0 + 0.5)", "(encoded * 255.0)"),
    _python("pictures", "radiance already in sRGB", "prepared_scene", _IMAGE,
            "film.radiance[...] = np.clip(film.radiance, 0, 1) ** (1 / 2.2); " + _IMAGE),
    _python("pictures", "background 2 % darker", "world", _COLORS,
            "np.array([scene.ambient, np.multiply(0.98, scene.background)])"),
    _python("pictures", "no ambient light", "world", _COLORS, "np.array([(0.0, 0.0, 0.0), scene.background])"),
    _python("pictures", "the lamp a little redder", "world", _LIGHT_ROWS,
            "rows[1:, 4:] *= 1.0 + 5e-5 * np.array([1.0, 0.0, -1.0]); " + _LIGHT_ROWS),
    _python("pictures", "dither left in the tiles from the third on", "prepared_scene", _IMAGE,
            "film.radiance[:, 2 * TILE :] *= 1.0 + 2e-4 * np.array([0, 1, -1])[np.arange(2 * TILE, width) % 3, None]; "
            + _IMAGE),
    _python("pictures", "one stuck pixel in 8,192", "prepared_scene", _IMAGE,
            "film.radiance.reshape(-1, 3)[8192::8192] *= 0.95; " + _IMAGE),
    _python("pictures", "the last pixel of a tile 1 % brighter", "prepared_scene", _IMAGE,
            "film.radiance[TILE - 1 :: TILE, TILE - 1 :: TILE] *= 1.01; " + _IMAGE),
    _python("pictures", "a fixed offset 100 times too long", "render", "return float(offset)",
            "return 100.0 * float(offset)"),
    _python("pictures", "depth along the view axis", "prepared_scene", _IMAGE,
            "from renderer.camera import primary_rays; cosines = primary_rays(camera, width, height)[1] @ "
            "camera.frame()[2]; film.depth[...] *= cosines.reshape(height, width); " + _IMAGE),
    _python("pictures", "faces numbered from 1", "prepared_scene", _IMAGE, "film.face[film.face > 0] -= 1; " + _IMAGE),
    _python("pictures", "objects turned the other way", "scene", "_rotation(axis, degrees) @ linear",
            "_rotation(axis, -degrees) @ linear"),
    _python("pictures", "objects moved 0.1 % too far", "scene", "result[:3, 3] = self.translate",
            "result[:3, 3] = np.multiply(1.001, self.translate)"),
    _python("pictures", "vertex normals of equal weights", "mesh", "= normals[axis] * angle", "= normals[axis]"),
    _python("pictures", "normals of the film point inwards", "prepared_scene", _IMAGE,
            "film.normal[...] *= -1; " + _IMAGE),
    _python("pictures", "a miss shows face 0 in the tiles from the third on", "prepared_scene", _IMAGE,
            "film.face[(film.face < 0) & (np.arange(width) >= 2 * TILE)] = 0; " + _IMAGE),
    _kernel("pictures", "n1 and n2 swapped", "whitted", "refract(d, n, n1, n2)", "refract(d, n, n2, n1)"),
    _kernel("pictures", "Fresnel of one polarisation", "shading", "return 0.5 * (s * s + p * p)", "return s * s"),
    _kernel("pictures", "total internal reflection lost", "whitted", "f = 1.0 if cos_t < 0.0 else",
            "f = 0.0 if cos_t < 0.0 else"),
    _kernel("pictures", "every medium stands in air", "whitted",
            "return get(world.materials, get(media, count - 1) + IOR) if count > 0 else 1.0", "return 1.0"),
    _kernel("pictures", "refraction by the textbook's formula", "shading", "    if s2 < 0.5:\n",
            "    if True:\n        cos2 = 1.0 - eta * eta * (1.0 - dn * dn)\n    elif s2 < 0.5:\n"),
    _kernel("pictures", "no shadows", "direct", "if not (settings.shadows and get(work.found.hit, k)):", "if True:"),
    _kernel("pictures", "shadow rays pass the light", "direct", "else SHORT_OF_LIGHT", "else 2.0"),
    _kernel("pictures", "lights shine through from behind", "direct", "if dot(n, to_light) <= error:",
            "if dot(n, to_light) <= -np.inf:"),
    _kernel("pictures", "light falls off as 1 / r", "direct", "scale(arriving, 1.0 / squared)",
            "scale(arriving, 1.0 / np.sqrt(squared))"),
    _kernel("pictures", "clamped specular: shininess at most 50", "shading", "math.exp(shininess *",
            "math.exp(min(shininess, 50.0) *"),
    _kernel("pictures", "highlights left out below R.V = 0.5", "shading", "if -dot(r, d) <= 0.0:",
            "if -dot(r, d) <= 0.5:"),
    _kernel("pictures", "interpolated normals not normalised", "sight",
            "n_s = normalized(n) if largest", "n_s = n if largest"),
    _kernel("pictures", "rays leave a face from its other side", "spawn", "step = scale(n_g, side * missing)",
            "step = scale(n_g, -side * missing)"),
    _kernel("pictures", "rays leave a face by a thousandth of the bound", "spawn", "    if missing <= 0.0:",
            "    missing *= 1e-3\n    if missing <= 0.0:"),
    _kernel("pictures", "spawned rays start on their surface", "spawn", "step = scale(n_g, side * error)",
            "step = scale(n_g, 0.0 * error)"),
    _kernel("pictures", "the tint of glass lost", "whitted", "scale(k_r, f), scale(k_t, 1.0 - f)",
            "scale(k_r, f), scale((k_t[0], k_t[0], k_t[0]), 1.0 - f)"),
)  # fmt: skip

DEFECTS = HITS + PICTURES
