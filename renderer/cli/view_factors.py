"""``octree-render study viewfactors``: the surfaces of mesh files in, a file of their view factors out."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

from renderer.cli.cluster import on_cluster
from renderer.cli.meshes import Files, kept_of, load_files
from renderer.cli.study_files import check_outputs
from renderer.cli.transmittance import is_array, transmittance_of
from renderer.errors import expect
from renderer.system.terminal import say

_GROUPS = (
    "what a surface is: each face (the default); each object of a mesh file, or each file if there are several; or all "
    "faces of a material"
)
_SIDES = "the sides on which faces send and receive; default: front"
_RTOL = (
    "add rays until the share of what a surface sends that may arrive elsewhere, the root of the sum of its squared "
    "errors, is at most R; default: 0.02"
)
# The options that are arguments of ``studies.view_factors``.
OWN = ("sides", "rtol", "max_rays")


class Surfaces(NamedTuple):
    """The surface that each face belongs to, (F,), and the names of the surfaces; None for both: each face is one."""

    groups: Any = None
    names: tuple[str, ...] | None = None


def add_view_factors(study: argparse.ArgumentParser) -> None:
    """Add the options that view factors alone have."""
    own = study.add_argument_group("view factors")
    own.add_argument("--groups", choices=("faces", "objects", "materials"), help=_GROUPS)
    own.add_argument("--sides", choices=("front", "both"), help=_SIDES)
    own.add_argument("--rtol", type=float, metavar="R", help=_RTOL)
    own.add_argument("--max-rays", type=int, metavar="N", help="most rays of a surface; default: 65536")


def study_view_factors(options: argparse.Namespace) -> None:
    """Compute view factors and write them. If it is killed, the same command goes on where it stopped."""
    import time
    from dataclasses import replace

    from renderer.checkpoints.folder import naming_parts, remove_parts
    from renderer.checkpoints.study import folder_of
    from renderer.mesh.load import mesh_paths
    from renderer.octree import Octree
    from renderer.studies.factors.sparse import scipy_sparse

    scipy_sparse()
    options.mesh = mesh_paths(options.mesh)
    files = load_files(kept_of(options.mesh, options.hide))
    surfaces = _surfaces(files, options.groups)
    _check_output(options, len(files.mesh.faces) if surfaces.names is None else len(surfaces.names))
    made = {name: value for name in OWN if (value := getattr(options, name)) is not None}
    made["transmittance"] = transmittance_of(files, options.transmittance)
    octree = Octree.from_mesh(files.mesh, threads=options.threads)
    folder, began = folder_of(options.output[0]), time.perf_counter()
    with naming_parts(folder):
        found = replace(_run(octree, folder, surfaces.groups, made, options), names=surfaces.names)
        seconds = time.perf_counter() - began
        for output in options.output:
            found.save(output)
    _say_backs(found)
    if not options.quiet:
        outputs, rays = ", ".join(map(str, options.output)), int(found.rays.sum())
        worst, sky = found.errors.data.max(initial=0.0), (found.areas * found.sky).sum() / found.areas.sum()
        say(f"{outputs}: view factors of {len(found.areas):,} surfaces in {seconds:.2f} s, by {rays:,} rays; largest "
            f"standard error {worst:.2g}; {100.0 * sky:.3g} % of what they send meets nothing")  # fmt: skip
    # Last, so that no work is lost if a file cannot be written.
    remove_parts(folder)


def _run(octree: Any, folder: Any, groups: Any, made: dict[str, Any], options: argparse.Namespace) -> Any:
    """The view factors, computed here or on a cluster."""
    from renderer.checkpoints.view_factors import run_view_factors

    progress = not options.quiet
    warnings.filterwarnings("ignore", ".*see backs of faces")  # said below, with the option
    if options.cluster is None:
        return run_view_factors(octree, folder, groups, progress=progress, **made)
    from renderer.cluster import view_factors_on

    with on_cluster(options) as client:
        return view_factors_on(client, octree, folder, groups, progress=progress, **made)


def _say_backs(found: Any) -> None:
    from renderer.studies.factors.assemble import backs_message
    from renderer.studies.factors.saved import names_of

    message = backs_message(found.backs, names_of(found), "use --sides both")
    if message:
        print(f"octree-render: {message}", file=sys.stderr)


def _check_output(options: argparse.Namespace, surfaces: int) -> None:
    """Refuse outputs that cannot be written before the work begins."""
    from renderer.studies.factors.saved import check_factors_path

    for output in options.output:
        check_factors_path("--output", output, surfaces)
    check_outputs(options.output, [*options.mesh, *filter(is_array, options.transmittance)])


def _surfaces(files: Files, groups: str | None) -> Surfaces:
    import numpy as np

    from renderer.mesh.parts import part_numbers

    mesh = files.mesh
    if groups == "objects":
        return _used(part_numbers(mesh.parts, np.arange(len(mesh.faces))), [part.name for part in mesh.parts], "object")
    if groups == "materials":
        where = ", ".join(map(str, files.paths))
        expect(mesh.face_materials is not None, "--groups", "a mesh file with materials", f"none in {where}")
        return _used(mesh.face_materials, [material.name for material in mesh.materials], "material")
    return Surfaces()


def _used(numbers: Any, names: Sequence[str], word: str) -> Surfaces:
    """The surfaces that faces have by the numbers of names; -1 is a surface of its own."""
    import numpy as np

    used, groups = np.unique(numbers, return_inverse=True)
    distinct = [*_distinct(names, word), f"no {word}"]
    return Surfaces(groups, tuple(distinct[number] for number in used))


def _distinct(names: Sequence[str], word: str) -> list[str]:
    """Names that are all different: what has none gets its number, and what comes again a number after its name."""
    found: dict[str, None] = {}
    for number, given in enumerate(names):
        name = given or f"{word} {number}"
        tries = (f"{name} {again}" for again in range(2, len(names) + 2))
        found[name if name not in found else next(other for other in tries if other not in found)] = None
    return list(found)
