"""The seeded defects: what each one is, where it goes in, and which group of checks runs against it."""

from dataclasses import dataclass
from typing import Literal

from validation.defects.inject import Replacement

Group = Literal["hits", "queries", "studies", "pictures"]


@dataclass(frozen=True)
class Defect:
    """One defect. ``kernel`` tells that kernels are compiled anew for it, which takes most of its time."""

    name: str
    group: Group
    replacement: Replacement
    kernel: bool


def _kernel(group: Group, name: str, place: str, rule: str, broken: str) -> Defect:
    return Defect(name, group, Replacement(place, rule, broken), kernel=True)


def _python(group: Group, name: str, place: str, rule: str, broken: str) -> Defect:
    return Defect(name, group, Replacement(place, rule, broken), kernel=False)


def _before(rule: str, statements: str) -> tuple[str, str]:
    """The statement ``rule``, and the same with others before it."""
    return rule, f"{statements}\n{rule}"


_LIGHT_ROWS = "return rows[~dark | (dark & extra)]"
_IMAGE = "return Image(*film, build_seconds=self.build_seconds, render_seconds=clock.seconds(), cut=int(cut.sum()))"

HITS = (
    _kernel("hits", "a triangle missing from the tree", "_fill",
            "vertices[faces[face, corner], axis] if face >= 0 else np.nan",
            "vertices[faces[face, corner], axis] if face >= 0 and face != 5 else np.nan"),
    _kernel("hits", "one triangle in 512 missing beyond the 65,536th", "_fill",
            "vertices[faces[face, corner], axis] if face >= 0 else np.nan",
            "vertices[faces[face, corner], axis] if face >= 0 and (face <= 0xFFFF or face % 512 > 0) else np.nan"),
    _kernel("hits", "packets exit with their first hit", "trace_packet",
            "limit = _most(floats, LIMIT)",
            "limit = least(select(load8(floats, LIMIT) < load8(floats, LIMIT + 8), load8(floats, LIMIT), "
            "load8(floats, LIMIT + 8)))"),
    _kernel("hits", "single rays exit at half their best hit", "resume",
            "get(rays.floats, LIMIT + r)", "get(rays.floats, LIMIT + r) * np.float32(0.5)"),
    _kernel("hits", "no box padding", "FAR_PADDING",
            "1.0 + 8.0 * 2.0**-23", "1.0"),
    _kernel("hits", "boxes rounded to nearest", "round_up",
            "select(widen(y) < x, magnitude(y) * _STEP + _TINY, np.float32(0.0))", "np.float32(0.0)"),
    _kernel("hits", "origins far beyond what boxes tell", "round_both",
            "magnitude(y) * _STEP + _TINY", "magnitude(y) * np.float32(-(2.0**-12))"),
    _kernel("hits", "eight rays end where the first of them does", "eight_rays_at",
            "rays.max_step", "np.int64(0)"),
    _kernel("hits", "one ray in range vouches for eight", "_are_good",
            "movemask(good & (larger(larger(x, y), w) >= SHORTEST)) == 0xFF", "movemask(good) != 0"),
    _kernel("hits", "a packet's beam too narrow", "_WIDER",
            "np.float32(2.0**-18)", "np.float32(-2.0**-8)"),
    _kernel("hits", "streams lose a leaf's last block", "leave_leaf",
            "~child & (MAX_LEAF_BLOCKS - 1) != 0", "~child & (MAX_LEAF_BLOCKS - 1) > 1"),
    _kernel("hits", "the highest face wins in streams", "take_hits",
            "ti == t and fi < face", "ti == t and fi > face"),
    _kernel("hits", "the highest face wins in packets", "nearest_in_blocks",
            "ti == t and fi < face", "ti == t and (face == NO_FACE or fi > face)"),
    _kernel("hits", "float32 shear in the triangle test", "make_shear",
            "dx / dz", "widen(narrow(dx / dz))"),
    _python("hits", "vertices of the triangle test in float32", "fill_blocks",
            "np.float64 if inexact else np.float32", "np.float32"),
    _kernel("hits", "an edge counts for neither side", "see_triangles",
            "least >= zero", "least > zero"),
    _kernel("hits", "faces are culled from behind", "see_triangles",
            "(least >= zero) | (most <= zero)", "least >= zero"),
    _kernel("hits", "hits in doubt are not settled", "_finish",
            "get(integers, DOUBTFUL + r) != 0", "False"),
    _kernel("hits", "hits in doubt may lie before their boxes", "settled",
            "t = first / largest", "pass"),
    _kernel("hits", "faces of no area are never hit", "_meet_line",
            "return t, second, 0.0", "return np.nan, second, 0.0"),
    _kernel("hits", "a determinant that is noise is believed", "settled",
            "if blurred:\n"
            "    t, u, v, w = _meet_face(tree, at, ray, first / largest, np.float64(last) / largest)\n"
            "    w = -1.0 if _slope(tree, at, ray) * shear.direction_z > 0.0 else 1.0\n"
            "    u, v = u * w, v * w\n"
            "elif height != _FAR and height != 0:\n"
            "    slope = _slope(tree, at, ray)\n"
            "    t = height * abs(_exact_t(tree, at, ray)) * (1.0 if slope > 0 else -1.0)",
            "pass"),
    _kernel("hits", "streams drop a doubt whose t is noise", "_are_due",
            "blurred | (doubt & ahead & within)", "doubt & ahead & within"),
    _kernel("hits", "determinants that blow roundings up are not in doubt", "SLANT",
            "SLANT = 2.0**-16", "SLANT = 2.0**-40"),
    _kernel("hits", "edges as rounded are believed", "_may_be_on_edge",
            "(e0 == zero) & ((x2 & y1) | (y2 & x1))", "(e0 != e0) & x1"),
    _kernel("hits", "hits of scaled meshes keep the tree's t", "write_hit",
            "t / scale + 0.0", "t + 0.0"),
    _kernel("hits", "hits are in doubt too late", "DOUBT",
            "DOUBT = 2.0**-27", "DOUBT = 2.0**-40"),
    _kernel("hits", "stale boxes of inner nodes after a refit", "refit_tree",
            "_fit_nodes(nodes, links)", "pass"),
    _python("hits", "stale triangles after a refit", "refit_tree",
            "fill_blocks(vertices, faces, tree.faces, threads)", "tree.blocks"),
    _kernel("hits", "any hit forgets what is near", "write_hit",
            "put(found.hit, i, hit)", "put(found.hit, i, hit and t > 1.0)"),
    _kernel("hits", "a packet of any hits drops what waits beyond eight octants", "trace_packet",
            "limit = _most(floats, LIMIT)",
            "limit = _most(floats, LIMIT)\n"
            "top = min(top, 8) if any_hit else top"),
    _kernel("hits", "single rays skip a leaf's last block", "search_singly",
            "first, count = blocks_of(child)",
            "first, count = blocks_of(child)\n"
            "count = count - 1 if count > 1 else count"),
    _kernel("hits", "single rays are an ulp too far", "trace_few",
            "best, _ = search_carefully(tree, source, i, stack, pointer(holders), False)",
            "(t, face, u, v, w), _ = search_carefully(tree, source, i, stack, pointer(holders), False)\n"
            "best = t * (1.0 + 2.0**-52), face, u, v, w"),
    _python("hits", "bad rays are let through", "query._run",
            "if bad:\n"
            "    reject(rays, min(bad), tree.scale)",
            "if False:\n"
            "    reject(rays, min(bad), tree.scale)"),
    _python("hits", "places of hits off by 1e-9 of a corner", "hits.points_on",
            "return points", "return points + 1e-9 * vertices[corners[:, 0]]"),
    _python("hits", "normals of hits turned inwards on half the faces", "hits._normals",
            "return face_normals(mesh.vertices[mesh.faces[face]])",
            "return face_normals(mesh.vertices[mesh.faces[face]]) * np.where(face % 2 == 0, -1.0, 1.0)[:, None]"),
    _kernel("hits", "u and v exchanged in packets", "nearest_in_leaf",
            "put_best(rays, r, (t, face, u, v, w))", "put_best(rays, r, (t, face, v, u, w))"),
    _kernel("hits", "single rays accept hits up to 1.0001 t_max", "search_singly",
            "best = (t_max, np.int32(NO_FACE), 0.0, 0.0, 1.0)",
            "best = (t_max * 1.0001, np.int32(NO_FACE), 0.0, 0.0, 1.0)"),
    _kernel("hits", "the last ray of every full chunk is a miss", "write_hit",
            "hit = face != NO_FACE", "hit = face != NO_FACE and i % 8192 != 8191"),
    _kernel("hits", "a refit leaves each leaf's upper z", "refit._fit_leaf",
            "nodes[at + 16 * axis], nodes[at + 16 * axis + 8] = low, high",
            "nodes[at + 16 * axis] = low\n"
            "if axis < 2:\n"
            "    nodes[at + 16 * axis + 8] = high"),
    _python("hits", "a refit counts in the units of the old size", "_Accelerator.refit",
            "refit_tree(tree, scaled, moved.faces, scale, self.threads)",
            "refit_tree(tree, scaled, moved.faces, tree.scale, self.threads)"),
    _python("hits", "bounds of t lose the dimensions of the rays", "Hits.shaped",
            "Hits(t, self.face.reshape(shape), u, v, self._mesh, t_error, side)",
            "Hits(t, self.face.reshape(shape), u, v, self._mesh, self.t_error, side)"),
    _python("hits", "a loaded tree forgets its repairs", "Octree.load",
            "octree.repairs = stored.repairs", "octree.repairs = None"),
    _python("hits", "normals of OBJ files of which some corners have one", "obj._mesh",
            "(normal >= 0).all()", "(normal >= 0).any()"),
)  # fmt: skip

QUERIES = (
    _kernel("queries", "points on an edge are not moved off it", "_cross_exactly",
            "s0 if s0 != 0 else _moved_sign(b, c)", "s0"),
    _kernel("queries", "signs of areas are believed however small", "crossings._AREA_ERROR",
            "_AREA_ERROR = (3.0 + 16.0 * _ROUNDOFF) * _ROUNDOFF", "_AREA_ERROR = 0.0"),
    _kernel("queries", "signs of volumes are believed however small", "crossings._VOLUME_ERROR",
            "_VOLUME_ERROR = (7.0 + 56.0 * _ROUNDOFF) * _ROUNDOFF", "_VOLUME_ERROR = 0.0"),
    _kernel("queries", "points on upright faces are not seen", "_cross_exactly",
            "lies_within(a, b, c, p, parts)", "0"),
    _kernel("queries", "expansions forget what products round off", "_add_pair",
            "_add(parts, _add(parts, count, pair[1]), pair[0])", "_add(parts, count, pair[0])"),
    _kernel("queries", "exact signs forget what products round off", "products_sign",
            "one[1] - other[1]", "0.0"),
    _kernel("queries", "hits at one edge are contacts of their own", "_merge",
            "_compare_places(tree, found, get(order, k - 1), get(order, k)) == 0", "False"),
    _kernel("queries", "a corner is taken for one of its edges", "_ends",
            "edges & (edges - 1) != 0", "False"),
    _kernel("queries", "of hits at one t the highest face comes first", "gather._precedes",
            "ti == tj and face < other", "ti == tj and face > other"),
    _kernel("queries", "max_hits keeps one more", "gather_chunk",
            "smaller(_ordered(tree, ray_at(source, i)[0], found, count, merge, keep), most)",
            "smaller(_ordered(tree, ray_at(source, i)[0], found, count, merge, keep), most + 1)"),
    _kernel("queries", "blocks of which a ray sees the first face alone are left out", "find_blocks",
            "get(lanes.bits, r) != 0", "get(lanes.bits, r) > 1"),
    _kernel("queries", "the nearest point is never a corner", "_distance_to_ordered",
            "behind <= 0.0", "behind != behind"),
    _kernel("queries", "points beside an edge are taken as over the face", "distance_to_face",
            "wa > on_a and wb > on_b and wc > on_c", "wa > on_a and wb > on_b"),
    _kernel("queries", "points near a plane lose their digits", "face_distance._height",
            "abs(height[0]) < _CANCELLED * _largest(normal)", "height[0] != height[0]"),
    _kernel("queries", "points near an edge lose their digits", "_distance_to_ordered",
            "_largest(area) < _CANCELLED * _largest(pa)", "behind != behind"),
    _kernel("queries", "of faces equally near any may come", "_settle",
            "d < distance or (d == distance and f < face)", "d <= distance"),
    _kernel("queries", "boxes are taken as a hundredth farther", "_bound_four",
            "splat4(_LESS)", "splat4(1.02)"),
    _kernel("queries", "a face's least distance bounds the search", "bound_distances",
            "select(within, high, splat4(np.inf))", "select(within, low * splat4(0.999), splat4(np.inf))"),
    _kernel("queries", "a distance is reached only short of it", "find_nearest",
            "face != NO_FACE and distance <= limit", "face != NO_FACE and distance < limit"),
    _kernel("queries", "distances of scaled meshes keep the tree's units", "find_nearest",
            "tree.scale * get(p, 0)", "get(p, 0)"),
    _kernel("queries", "distances whose products vanish are believed", "find_nearest",
            "get(parts, UNTOLD) == 0.0", "True"),
    _python("queries", "distances are negative outside", "signed.signed_distance",
            "inside & (distance > 0.0)", "~inside & (distance > 0.0)"),
    _python("queries", "an end hides itself", "_between",
            "np.maximum(reach - room, 0.0)", "reach"),
    _python("queries", "a way is seen to its middle", "_between",
            "np.maximum(reach - room, 0.0)", "reach * 0.5"),
    _python("queries", "points on the surface are inside without it", "contains.contains",
            "inside & ~on", "inside | on"),
    _python("queries", "parity is taken as winding", "contains.contains",
            "(counted & 1) == 1", "counted != 0"),
    _python("queries", "the drop-in lists each face at an edge", "RayMeshIntersector._hits",
            "it.octree.all_hits(origins, directions, max_hits=max_hits)",
            "it.octree.all_hits(origins, directions, max_hits=max_hits, contacts=False)"),
    _python("queries", "a limited distance loses its sign", "signed.signed_distance",
            "inside & (distance > 0.0)", "inside & (distance > 0.0) & (distance < np.inf)"),
    _python("queries", "views leave room by where they begin alone", "visible._between",
            "np.maximum(np.abs(start.points), np.abs(stop.points))", "np.abs(start.points)"),
    _python("queries", "-0.0 is another place than 0.0", "edges.sides",
            "np.ascontiguousarray(vertices + 0.0)", "np.ascontiguousarray(vertices)"),
)  # fmt: skip

PICTURES = (
    _python("pictures", "one triangle of a sphere missing", "pack",
            *_before("mesh = Mesh(vertices, faces)",
                     "hole = int(np.argmin(np.linalg.norm(vertices[faces].mean(axis=1) - (-0.68, 1.0, 1.72), "
                     "axis=1)))\n"
                     "if len(faces) > 5000:\n"
                     "    faces[hole] = faces[hole, 0]")),
    _python("pictures", "ior 1.501 for 1.5", "pack._materials",
            *_before("if needs.shadows and (not own.shadows):\n"
                     "    kinds[kinds == UNLIT] = LAMBERT",
                     "from renderer.shade.records import IOR\n"
                     "rows[:, IOR] *= 1.501 / 1.5")),
    _python("pictures", "film shifted by half a pixel", "PreparedScene.picture",
            *_before("film = _film(width, end_row, planes, first_row)",
                     "rows[3] -= 0.5 * rows[4]")),
    _kernel("pictures", "the budget of rays is not kept", "_may_leave",
            "get(work.traced, pixel) >= settings.max_rays", "get(work.traced, pixel) > 2 * settings.max_rays"),
    _python("pictures", "eyes beyond the limit are let through", "_Camera._is_near_enough",
            "max(map(abs, eye)) > FARTHEST", "False"),
    _kernel("pictures", "film shifted by 0.1 pixel", "PerspectiveCamera.rows",
            "pixel * width / 2.0", "pixel * (width + 0.2) / 2.0"),
    _kernel("pictures", "camera rays 0.1 pixel off their pixel's centre", "_shoot",
            "x + place[0]", "x + 0.1 + place[0]"),
    _kernel("pictures", "orthographic film 1 % too wide", "OrthographicCamera.rows",
            *_before("zero = np.zeros(3)",
                     "right = 1.01 * right")),
    _kernel("pictures", "field of view + 0.3 degrees", "PerspectiveCamera.rows",
            "math.radians(self.fov)", "math.radians(self.fov + 0.3)"),
    _python("pictures", "a light missing", "light_rows",
            "rows[~dark | (dark & extra)]", "rows[:-1]"),
    _python("pictures", "point light + 5 %", "light_rows",
            *_before(_LIGHT_ROWS, "rows[-1, 4:] *= 1.05")),
    _python("pictures", "light moved by 0.05", "light_rows",
            *_before(_LIGHT_ROWS, "rows[-1, 1] += 0.05")),
    _python("pictures", "gain 1.10", "PreparedScene.picture",
            *_before(_IMAGE, "film.radiance[...] *= 1.1")),
    _python("pictures", "gain 1.001", "PreparedScene.picture",
            *_before(_IMAGE, "film.radiance[...] *= 1.001")),
    _python("pictures", "red and blue exchanged", "PreparedScene.picture",
            *_before(_IMAGE, "film.radiance[...] = film.radiance[..., ::-1].copy()")),
    _python("pictures", "flat instead of smooth normals", "pack",
            "[i.smooth for i in instances]", "[False for i in instances]"),
    _python("pictures", "depth 5 for 6", "kernel_settings_of",
            "Settings(bounces, chosen.min_weight, offset, media, chosen.shadows, chosen.max_rays)",
            "Settings(min(bounces, 5), chosen.min_weight, offset, media, chosen.shadows, chosen.max_rays)"),
    _python("pictures", "rays end below a weight of 0.05", "kernel_settings_of",
            "chosen.min_weight", "max(0.05, chosen.min_weight)"),
    _python("pictures", "offset 1e-2", "_offset",
            'BOUNDED if offset == "bounded" else OffsetRule(False, MITSUBA_EPSILON)',
            'OffsetRule(False, 0.01) if offset == "bounded" else OffsetRule(False, MITSUBA_EPSILON)'),
    _python("pictures", "sRGB applied twice", "image._encoded",
            "return (encoded * 255.0 + 0.5).astype(np.uint8)",
            "encoded = 1.055 * encoded ** (1.0 / 2.4) - 0.055\n"
            "return (np.maximum(encoded, 0.0) * 255.0 + 0.5).astype(np.uint8)"),
    _python("pictures", "sRGB cut off instead of rounded", "image._encoded",
            "encoded * 255.0 + 0.5", "encoded * 255.0"),
    _python("pictures", "radiance already in sRGB", "PreparedScene.picture",
            *_before(_IMAGE, "film.radiance[...] = np.clip(film.radiance, 0, 1) ** (1 / 2.2)")),
    _python("pictures", "background 2 % darker", "pack",
            "scene.background", "np.multiply(0.98, scene.background)"),
    _python("pictures", "no ambient light", "pack",
            "[scene.ambient, scene.background]", "[(0.0, 0.0, 0.0), scene.background]"),
    _python("pictures", "the lamp a little redder", "light_rows",
            *_before(_LIGHT_ROWS, "rows[1:, 4:] *= 1.0 + 5e-5 * np.array([1.0, 0.0, -1.0])")),
    _python("pictures", "dither left in the tiles from the third on", "PreparedScene.picture",
            *_before(_IMAGE, "film.radiance[:, 2 * TILE:] *= 1.0 + 2e-4 * np.array([0, 1, -1])[np.arange(2 * "
                             "TILE, width) % 3, None]")),
    _python("pictures", "one stuck pixel in 8,192", "PreparedScene.picture",
            *_before(_IMAGE, "film.radiance.reshape(-1, 3)[8192::8192] *= 0.95")),
    _python("pictures", "the last pixel of a tile 1 % brighter", "PreparedScene.picture",
            *_before(_IMAGE, "film.radiance[TILE - 1::TILE, TILE - 1::TILE] *= 1.01")),
    _python("pictures", "a fixed offset 100 times too long", "_offset",
            "OffsetRule(False, float(offset))", "OffsetRule(False, 100.0 * float(offset))"),
    _python("pictures", "depth along the view axis", "PreparedScene.picture",
            *_before(_IMAGE, "from renderer.scene.camera import primary_rays\n"
                             "cosines = primary_rays(camera, width, height)[1] @ camera.frame()[2]\n"
                             "film.depth[...] *= cosines.reshape(height, width)")),
    _python("pictures", "faces numbered from 1", "PreparedScene.picture",
            *_before(_IMAGE, "film.face[film.face > 0] -= 1")),
    _python("pictures", "objects turned the other way", "SceneObject.matrix",
            "_rotation(axis, degrees)", "_rotation(axis, -degrees)"),
    _python("pictures", "objects moved 0.1 % too far", "SceneObject.matrix",
            "self.translate", "np.multiply(1.001, self.translate)"),
    _python("pictures", "vertex normals of equal weights", "Mesh.vertex_normals",
            "normals[axis] * angle", "normals[axis]"),
    _python("pictures", "normals of the film point inwards", "PreparedScene.picture",
            *_before(_IMAGE, "film.normal[...] *= -1")),
    _python("pictures", "a miss shows face 0 in the tiles from the third on", "PreparedScene.picture",
            *_before(_IMAGE, "film.face[(film.face < 0) & (np.arange(width) >= 2 * TILE)] = 0")),
    _kernel("pictures", "n1 and n2 swapped", "_refract",
            "refract(d, n, n1, n2)", "refract(d, n, n2, n1)"),
    _kernel("pictures", "Fresnel of one polarisation", "fresnel",
            "0.5 * (s * s + p * p)", "s * s"),
    _kernel("pictures", "total internal reflection lost", "_refract",
            "1.0 if cos_t < 0.0 else fresnel(-dot(d, n), cos_t, n1, n2)",
            "0.0 if cos_t < 0.0 else fresnel(-dot(d, n), cos_t, n1, n2)"),
    _kernel("pictures", "every medium stands in air", "crossing._innermost_ior",
            "get(scene.materials, get(media, count - 1) + IOR) if count > 0 else 1.0", "1.0"),
    _kernel("pictures", "refraction by the textbook's formula", "refract",
            "if s2 < 0.5:\n"
            "    s = math.sqrt(s2)\n"
            "    cos2 = (1.0 - eta * s) * (1.0 + eta * s)\n"
            "else:\n"
            "    cos2 = (eta * dn) * (eta * dn) + (n2 - n1) / n2 * (1.0 + eta)",
            "if True:\n"
            "    cos2 = 1.0 - eta * eta * (1.0 - dn * dn)\n"
            "elif s2 < 0.5:\n"
            "    s = math.sqrt(s2)\n"
            "    cos2 = (1.0 - eta * s) * (1.0 + eta * s)\n"
            "else:\n"
            "    cos2 = (eta * dn) * (eta * dn) + (n2 - n1) / n2 * (1.0 + eta)"),
    _kernel("pictures", "no shadows", "light_surfaces",
            "not (settings.shadows and get(work.found.hit, k))", "True"),
    _kernel("pictures", "shadow rays pass the light", "lights.aim",
            "SHORT_OF_LIGHT", "2.0"),
    _kernel("pictures", "lights shine through from behind", "see_light",
            "dot(n, to_light) <= error", "dot(n, to_light) <= -np.inf"),
    _kernel("pictures", "light falls off as 1 / r", "see_light",
            "1.0 / dot(to_light, to_light)", "1.0 / np.sqrt(dot(to_light, to_light))"),
    _kernel("pictures", "clamped specular: shininess at most 50", "shading.specular",
            "shininess * math.log1p(-short)", "min(shininess, 50.0) * math.log1p(-short)"),
    _kernel("pictures", "highlights left out below R.V = 0.5", "shading.specular",
            "-dot(r, d) <= 0.0", "-dot(r, d) <= 0.5"),
    _kernel("pictures", "interpolated normals not normalised", "surface_at",
            "normalized(n) if largest_component(n) > 0.0 else n_g", "n if largest_component(n) > 0.0 else n_g"),
    _kernel("pictures", "rays leave a face from its other side", "search._stopped",
            "1 if start.code & ABOVE != 0 else -1", "-1 if start.code & ABOVE != 0 else 1"),
    _kernel("pictures", "rays leave a face by a thousandth of the bound", "spawn._moved",
            "plane.needed - away * plane.height", "1e-3 * plane.needed - away * plane.height"),
    _kernel("pictures", "spawned rays start on their surface", "spawn_origin",
            "scale(n_g, side * error)", "scale(n_g, 0.0 * error)"),
    _kernel("pictures", "the tint of glass lost", "_refract",
            "scale(k_t, 1.0 - f)", "scale((k_t[0], k_t[0], k_t[0]), 1.0 - f)"),
    _python("pictures", "all samples of a pixel at one place", "sample_offsets",
            "return np.stack([x.ravel(), y.ravel()], axis=1)", "return np.full((samples, 2), 0.5)"),
    _python("pictures", "objects turned about y and z before x", "SceneObject.matrix",
            "linear = _rotation(axis, degrees) @ linear",
            "linear = _rotation(axis, degrees) @ linear if axis == 0 else linear @ _rotation(axis, degrees)"),
    _python("pictures", "objects scaled after they are turned", "SceneObject.matrix",
            "result[:3, :3] = linear",
            "result[:3, :3] = np.diag(self.scale) @ linear @ np.diag(1 / np.array(self.scale))"),
    _python("pictures", "the floor begins with its other colour", "_floor_meshes",
            "color = (row + column) % len(floor.materials)", "color = (row + column + 1) % len(floor.materials)"),
    _kernel("pictures", "min_weight judged by the mean of the channels", "whitted._goes_on",
            "largest = largest_component(weight)", "largest = (weight[0] + weight[1] + weight[2]) / 3.0"),
    _kernel("pictures", "leaving a medium forgets its outermost entry", "crossing._leave",
            "range(count - 1, -1, -1)", "range(count)"),
    _python("pictures", "an eye within media is in the outermost", "media_around",
            "sorted(around, reverse=True)", "sorted(around)"),
    _python("pictures", "lights that are not red do not shine", "needs.examine",
            "any(light.row()[4:])", "light.row()[4] > 0.0"),
    _python("pictures", "another camera's eye is in the media of the scene's", "PreparedScene.picture",
            "self.needs.refraction and camera is not self.scene.camera", "False"),
)  # fmt: skip

STUDIES = (
    _kernel(
        "studies",
        "what lies at a point's horizon is open",
        "sweep._aim",
        "height > 0.0 and _start_ray(work, i, d, rays)",
        "height >= 0.0 and _start_ray(work, i, d, rays)",
    ),
    _kernel(
        "studies",
        "the first direction of all is hidden",
        "sweep._aim",
        "height > 0.0 and _start_ray(work, i, d, rays)",
        "height > 0.0 and _start_ray(work, i, d, rays) and k > 0",
    ),
    _kernel(
        "studies",
        "bits stand the other way round in their bytes",
        "sweep._take_down",
        "np.uint8(0x80 >> (k & 7))",
        "np.uint8(1 << (k & 7))",
    ),
    _kernel(
        "studies",
        "rays of studies leave a face on its other side",
        "sweep._start_ray",
        "above = slope >= 0.0",
        "above = slope < 0.0",
    ),
    _kernel(
        "studies",
        "the whole is without what the horizon hides",
        "sweep._aim",
        "put(work.points, _WHOLE + i, get(work.points, _WHOLE + i) + value)",
        "put(work.points, _WHOLE + i, get(work.points, _WHOLE + i) + (value if height > 0.0 else 0.0))",
    ),
    _kernel(
        "studies",
        "a list of leaves lacks its last one",
        "parallel_rays._list_leaves",
        "_end_list(parallel, listed)",
        "listed = max(listed - 1, 0)\n_end_list(parallel, listed)",
    ),
    _kernel(
        "studies",
        "the leaf that hid a ray hides the next one unasked",
        "parallel_rays._try_hiders",
        "hidden = face != NO_FACE",
        "hidden = face != NO_FACE or leaf < 0",
    ),
    _python(
        "studies",
        "patches weigh the same at all heights",
        "sky_view_factor",
        "cosine = definition == 'cosine'",
        "cosine = False",
    ),
    _python(
        "studies",
        "distances in units of the directions",
        "share.limits_of",
        "return float(given) / lengths_of(directions)",
        "return float(given) + 0.0 * lengths_of(directions)",
    ),
    _python(
        "studies",
        "every sun stands for an hour",
        "sun_hours",
        "hours = check_weights('weights', weights, len(suns))",
        "hours = np.ones(len(suns))",
    ),
    _python(
        "studies",
        "a scan's distances in units of its directions",
        "views.scan",
        "away = hits.t[rays] * lengths_of(some[rays])",
        "away = 1.0 * hits.t[rays]",
    ),
    _python(
        "studies",
        "an eye sees faces by their middles, near or hidden",
        "visible_faces",
        "seen[left[reached]] = True",
        "seen[left] = True",
    ),
)
DEFECTS = HITS + QUERIES + STUDIES + PICTURES
