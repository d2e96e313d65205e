"""Mutants that change no answer, each with the proof in a sentence; and survivors that are left, with the reason."""

# A mutant's key, see ``sites.Mutant.key``: why nobody can tell it from the sound renderer.
EQUIVALENT: dict[str, str] = {
    "renderer.tree.sah.bin_room #0: 3 -> 4": "scratch for a fourth axis is never written nor read",
    "renderer.all_hits.gather._ends #0: _compare_corners(tree, a, b) <= 0 -> not (_compare_corners(tree, a, b) <= 0)":
        "ends ordered downwards bring the same hits together as ends ordered upwards, and nothing else asks for them",
    "renderer.octree._scaled #0: _SMALLEST <= largest <= _LARGEST -> (_SMALLEST) <= (largest) < (_LARGEST)":
        "a mesh whose largest coordinate is exactly 2^60 is scaled by a power of two, which changes no answer",
    "renderer.octree._scaled #0: _SMALLEST <= largest <= _LARGEST -> (_SMALLEST) < (largest) <= (_LARGEST)":
        "a mesh whose largest coordinate is exactly 2^-60 is scaled by a power of two, which changes no answer",
    "renderer.inside.crossings #0: -53 -> (53)":
        "every sign is found in exact arithmetic then: more work, the same answers",
    "renderer.distance.nearest._search_blocks #0: listed == LISTED -> (listed) != (LISTED)":
        "each face is looked at as soon as it is listed: the same answers in more calls",
    "renderer.trace.steps._count_chunk #0: work > _WORK -> not (work > _WORK)":
        "a call that ends earlier is called again: the same counts",
    "renderer.trace.packet._most #0: a > b -> (a) >= (b)": "of two equal numbers either may be taken",
    "renderer.trace.packet._middle_entry #0: load8(nodes, base + near) - "
    "splat8(get(floats, NEAR_ORIGIN + axis * WIDTH + middle)) -> (load8(nodes, base + near)) + "
    "(splat8(get(floats, NEAR_ORIGIN + axis * WIDTH + middle)))":
        "octants are taken in another order: more work, the same answers",
    "renderer.trace.resolve._meet_line #0: dot_pairs(cross_pairs(face.first, face.along), across) -> "
    "dot_pairs(across, cross_pairs(face.first, face.along))": "a scalar product of pairs has the same bits either way",
    "renderer.distance.rational #0: 48 -> 49":
        "a subtraction and two sums change a bound by at most 4 * 2^-53 of it, and 2^-49 is still more",
    "renderer.trace.packet.test_leaf #0: put(rays.floats, LIMIT + r, np.float32(-np.inf)) -> pass":
        "a ray that has its hit is tested on in vain: more work, the same answers",
    "renderer.distance.block_distance #1: -48 -> (48)":
        "the bound from above is so loose that it leaves out no face: more work, the same answers",
    "renderer.tree.midpoint.octant_room #1: 8 -> 9": "scratch for a ninth octant is never written nor read",
    **{
        f"renderer.trace.packet.enter_beam #{n}: a {sign} b -> (a) {sign}= (b)":
            "of two equal numbers either may be taken"
        for n in (0, 1) for sign in "<>"
    },
    "renderer.shade.surface.lets_through #0: largest_component(three(materials, m + TRANSMITTANCE)) > 0.0 -> "
    "(largest_component(three(materials, m + TRANSMITTANCE))) >= (0.0)":
        "a ray of weight 0 does not go on, so the one refracted by a surface that lets no light through is not spawned",
    "validation.oracle.exact._BoxTree.__init__ #0: range(depth) -> range(depth - 1)":
        "the faces of the last level stay unsorted: wider boxes and more candidates, the same answers",
    "validation.oracle.star #0: 1 -> 2": "points are judged one by one, however many are taken together",
    "validation.references.mitsuba.path #0: 1000 -> 1001": "no path has as many edges, so none ends by chance",
    "validation.oracle.rounding.RayView._encloses #0: (px * qy - py * qx > 0) == (qy > py) -> "
    "(px * qy - py * qx > 0) != (qy > py)":
        "a closed outline crosses a line an even number of times, so it passes a point on either side equally odd",
    "validation.oracle.exact._possible #0: values > bounds -> (values) >= (bounds)":
        "a bound is larger than any error, so a value as large as its bound has its sign too",
    "validation.oracle.distance.squared_distance #0: _from_side(point, p, q) -> _from_side(point, q, p)":
        "a side is the same from either end, and nothing is rounded",
    "renderer.inside.crossings._cross_exactly #0: s0 != 0 or s1 != 0 or s2 != 0 -> "
    "(s0 != 0) and (s1 != 0) and (s2 != 0)":
        "a point in the plane of a face, within its outline as seen along an axis along which it has an area, is on it",
    "renderer.numerics.predicates.volume_sign #2: 0 -> 1":
        "any power of two turns no sign, and what leaves the range then is answered in rational arithmetic",
    "renderer.inside.crossings._moved_sign #0: a[1] > b[1] -> (a[1]) >= (b[1])": "there the two are not equal",
    "renderer.inside.crossings._moved_sign #0: b[0] > a[0] -> (b[0]) >= (a[0])": "there the two are not equal",
    "renderer.all_hits.gather._compare_corners #0: range(0, 12, 4) -> range(0, 12 - 1, 4)": "the rows are 0, 4 and 8",
    "renderer.inside.winding._search_in_order #0: 3 -> 4": "an array of no triangles is not looked into",
    "renderer.distance.rational._candidates #0: np.maximum(away.min(axis=1), -away.max(axis=1)) -> "
    "np.maximum(-away.max(axis=1), away.min(axis=1))": "the larger of two numbers is the larger in either order",
    "renderer.trace.traverse._trace_on #0: rounds > _WORK -> (rounds) >= (_WORK)":
        "a call that ends earlier is called again: the same answers",
    "renderer.trace.traverse.new_scratch #0: 1 -> 2": "memory behind the last stack is never written nor read",
    "renderer.jit.compiler.probe #0: True -> False": "a kernel answers alike whether what it calls is inlined",
    "renderer.trace.stream.resume #0: _prefetch_child(tree, child) -> pass": "a prefetch changes no answer",
    "renderer.shade.whitted._meet_surfaces #0: times(row3(bundle.weights, i), row3(scene.colors, 1)) -> "
    "times(row3(scene.colors, 1), row3(bundle.weights, i))": "a product is the same in either order",
    "renderer.distance.block_distance #0: -48 -> (48)":
        "the bound from below is so loose that it leaves out no face: more work, the same answers",
    "renderer.trace.error_bounds._plane_error #0: least > 0.0 -> (least) >= (0.0)":
        "a number above 0 divided by 0 is infinite, as the bound without a quotient is",
    "renderer.numerics.predicates.volume_sign #0: balance(a[0], b[0], c[0], p[0]) -> balance(b[0], a[0], c[0], p[0])":
        "the least and the largest of four numbers are the same in any order",
    "renderer.inside.careful_angle._normal #1: 1 -> 2":
        "any power of two turns no sign, and what leaves the range then is answered in rational arithmetic",
    "renderer.inside.careful_angle.careful_angle #0: _angle_at((b, c, a, p), y, z, x, parts) -> "
    "_angle_at((b, c, a, p), y, x, z, parts)": "the product of two cotangents is the same in either order",
    "renderer.trace.packet.trace_packet #0: any_hit -> not (any_hit)":
        "octants are taken in another order: more work, the same answers",
    "renderer.trace.packet #0: -18 -> (18)":
        "the beam is so wide that every octant is asked of each ray: more work, the same answers",
    "renderer.octree._scaled #1: 0.0 -> 1.0":
        "zeros times any power of two are zeros, and 1 is within the range that follows",
    "renderer.trimesh_ray.intersector._asked #0: raise -> pass":
        "the same rays are asked about again, and refused with the same words",
    "renderer.trace.packet._middle_entry #0: WIDTH // 2 -> (WIDTH) * (2)":
        "octants are taken in another order: more work, the same answers",
    "renderer.shade.tile._block_of #0: smaller(x + SIDE, x1) -> smaller(x1, x + SIDE)":
        "the smaller of two numbers is the same in either order",
    "renderer.tree.midpoint._sort_octants #1: range(8) -> range(8 - 1)":
        "on no axis are all centres above the middle of their range, so the last octant never has all",
    "renderer.mesh.ply._read_rows #0: counts == lengths[0, k] -> (counts) != (lengths[0, k])":
        "the first row has the length of the first row, so every file is read row by row: more work, the same columns",
    "renderer.viewer.shown.prepare_shown #0: touch_viewing(prepared) -> pass":
        "the first question compiles its kernels itself: later, the same answers",
    "renderer.inside.crossings #0: 930 -> 931": "2^-931 is still more than what is lost, which is 2^-943 at most",
    "renderer.trimesh_ray.distinct._repeated #0: 9 -> 10":
        "a digest only names faces that may be equal, which are then compared by their corners",
    "renderer.inside.winding_search._keeps #0: abs(scaled) >= 1.0 -> (abs(scaled)) > (1.0)":
        "a coordinate that a power of two brings to 1 is held exactly",
    "renderer.tree.emit.emit_nodes #0: share > 1 -> (share) >= (1)":
        "of a part that has one place or none the number is not used again",
    "renderer.trace.steps._count #1: 0.0 -> 1.0": "the barycentrics of no hit are not read",
    "renderer.numerics.predicates.lies_within #0: informed or s0 != 0 or s1 != 0 or (s2 != 0) -> "
    "(informed) and (s0 != 0) and (s1 != 0) and (s2 != 0)":
        "a point within the outline of a face along every axis is within its box too, which is asked then",
    "renderer.trace.closest._run.trace #0: bad[0] < begin -> (bad[0]) <= (begin)":
        "the only chunk that begins at a bad ray is the one in which that was found",
    "renderer.mesh.polygons._cut_notched #0: 1 -> 2": "polygons are cut in other portions: the same triangles",
    "renderer.tree.sah._best_plane #0: range(bins - 1, 0, -1) -> range(bins - 1, 0 - 1, -1)":
        "what lies beyond the first bin's lower side is not read",
    "renderer.numerics.expansions #0: -900 -> (900)":
        "every volume is out of range then, and is answered in rational arithmetic: more work, the same answers",
    "renderer.all_hits.gather.gather_chunk #4: 1 -> 2": "any row below 0 says that no ray is out of range",
}  # fmt: skip

# Survivors that break no promise though they may change an answer: they are judged, count as not noticed, and are left.
LEFT: dict[str, str] = {
    "renderer.pyvista_accessor.OctreeAccessor.tree #0: np.asarray(self._dataset.faces).reshape(-1, 4) -> "
    "np.asarray(self._dataset.faces).reshape(4, -1)":
        "PyVista is not among the locked packages, so its tests, each of which notices this, are skipped",
    "renderer.pyvista_accessor.OctreeAccessor.tree #0: self._dataset.is_all_triangles or self._dataset.n_cells == 0 -> "
    "(self._dataset.is_all_triangles) and (self._dataset.n_cells == 0)":
        "PyVista is not among the locked packages, so its tests, each of which notices this, are skipped",
    "renderer.jit.cache.KernelStore._digest #0: digest is None or is_ours(self._source) -> "
    "(digest is None) and (is_ours(self._source))":
        "the keys of kept kernels have more in them than they need: a start takes longer, the kernels are the same",
    "renderer.viewer.app.make_app #0: False -> True":
        "only a server that is told to listen at a name that begins with www. would redirect requests without that",
    "renderer.distance.face_distance._precedes #0: a[1] < b[1] or (a[1] == b[1] and a[2] < b[2]) -> "
    "(a[1] < b[1]) and (a[1] == b[1] and a[2] < b[2])":
        "from either end an edge's distance is within 2^-98 and is rounded as if from one end",
    "renderer.trace.resolve._meet_plane #0: t += minus(numerator, product(determinant, (t, 0.0)))[0] / determinant[0] "
    "-> pass": "t of a hit in doubt is within 2 ulp rather than 1, where 4 ulp are promised",
    "renderer.distance.face_distance #0: -40 -> (40)":
        "every area is computed with all digits: a distance comes within 0.5 ulp then, where 0.51 is promised",
    "renderer.distance.face_distance._precedes #0: a[1] == b[1] and a[2] < b[2] -> (a[1] == b[1]) or (a[2] < b[2])":
        "from either end an edge's distance is within 2^-98 and is rounded as if from one end; 64,000 points beside "
        "edges found none that differs",
    "renderer.trimesh_ray.within #0: -0.6210395307 -> (0.6210395307)":
        "the second pair of rays stands for a random one: any direction keeps what is promised of it",
    "renderer.jit.compiler._link_all #0: isinstance(library, _PieceLibrary) -> "
    "not (isinstance(library, _PieceLibrary))":
        "the same functions are linked from another module of theirs: slower to compile, the same answers",
    "renderer.jit.digest.source_digest #0: found.stat().st_mtime > loaded.AT -> "
    "(found.stat().st_mtime) >= (loaded.AT)":
        "a file written in the very instant in which the package was loaded may count as either",
}  # fmt: skip
