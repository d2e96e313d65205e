"""``octree-render study``: arguments in, a study's result as an array, a coloured mesh, or a picture.

View factors, the kind without points, are in ``renderer.cli.view_factors``.
"""

import argparse
from pathlib import Path
from typing import Any

from renderer.cli.cluster import add_cluster, on_cluster
from renderer.cli.meshes import Files, kept_of, load_files, say_up, up_of, values_of_files
from renderer.cli.render import resolution
from renderer.cli.study_files import FORMATS, KINDS, check_outputs, layout_of, write
from renderer.cli.transmittance import add_transmittance, is_array, transmittance_of
from renderer.cli.view_factors import add_view_factors, study_view_factors
from renderer.errors import expect
from renderer.system.terminal import say

_VIEW_FACTORS = "viewfactors"
# Options that one kind alone has.
_OWN = {
    "sky": ("patches", "definition"),
    "sun": ("suns",),
    "ao": ("samples",),
    _VIEW_FACTORS: ("groups", "sides", "rtol", "max_rays"),
}
# Options that all kinds have but view factors, and what they are where they are not given.
_OF_POINTS = {
    "up": None, "faces": False, "vertices": False, "grid": None, "points": None, "height": None, "bounds": None,
    "max_distance": float("inf"), "camera": None, "resolution": None,
}  # fmt: skip
_MESH = (
    "mesh files (.ply, .obj, .stl, .glb, .gltf), or folders of them; several are one mesh, and the summary has the "
    "values of each"
)
_UP = (
    "the axis that points up; default: y for glTF, else z. kind sun: with it, or with angles in --suns, suns below the "
    "horizon do not count"
)
_SUNS = (
    "sun: a text of rows x y z hours, to the sun; or a table whose first line has the names azimuth, elevation and, if "
    "given, hours: degrees, clockwise from north, which is +y, or -z where y is up; pvlib's tables are read as they are"
)
_HIDE = "leave out the mesh files of this name or pattern, such as 'tree*.obj'; may be given again"
_VERTICES = "a value for each vertex: the mean of its faces' values, weighted by their areas"
_GRID = "points of a level grid this far apart, dropped from above on the mesh"
_HEIGHT = "with --grid: do not drop the points; all have this height"
_BOUNDS = "with --grid: the least and greatest corner of the region; default: that of the mesh"
_POINTS = "points of an .npy, .csv, .xyz or .ply file, (n, 3), or (n, 6) with normals, which otherwise point up"
_DISTANCE = "how far from a point a hit still counts; default: any distance"
_RESOLUTION = (
    "size of a .png with its legend; default: 960x720. Of a calibrated camera: without it; default: its film's"
)


def add_study(commands: Any) -> None:
    """Add the command to a parser's ``commands``."""
    study = commands.add_parser(
        "study",
        help="what points of a mesh see: the sky, the sun, their surroundings; and view factors",
        description="Compute what points or surfaces of a mesh see. If a long run is killed, the same command goes on "
        "where it stopped and ends with the same bits: parts that are done are kept beside the output.",
    )
    kinds = KINDS | {_VIEW_FACTORS: "view factors between surfaces, and from them to the sky"}
    study.add_argument("kind", choices=kinds, help="; ".join(f"{k}: {said}" for k, said in kinds.items()))
    study.add_argument("mesh", type=Path, nargs="+", help=_MESH)
    study.add_argument("--up", choices=("x", "y", "z"), help=_UP)
    study.add_argument("--hide", action="append", default=[], metavar="NAME", help=_HIDE)
    _add_places(study)
    study.add_argument(
        "-o", "--output", type=Path, required=True, action="append", metavar="FILE",
        help=".npy: values; .ply: a mesh or points with values and colours; .png: a picture, not of points; view "
        "factors: .npz with all arrays, .csv with a column for each surface; may be given again",
    )  # fmt: skip
    study.add_argument("--patches", type=int, metavar="N", help="sky: the number of directions; default: 145")
    study.add_argument("--definition", choices=("cosine", "geometric"), help="sky: what is weighed; default: cosine")
    study.add_argument("--suns", type=Path, metavar="FILE", help=_SUNS)
    study.add_argument("--samples", type=int, metavar="N", help="ao: directions of each point; default: 256")
    study.add_argument("--max-distance", type=float, default=float("inf"), metavar="D", help=_DISTANCE)
    add_transmittance(study)
    # The former name of --max-distance.
    study.add_argument("--distance", dest="max_distance", type=float, default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    study.add_argument("--camera", type=Path, metavar="SCENE", help="for a .png: a scene file with the camera")
    study.add_argument("--resolution", type=resolution, metavar="WxH", help=_RESOLUTION)
    add_view_factors(study)
    add_cluster(study)
    study.add_argument("--threads", type=int, metavar="N", help="default: all processors")
    study.add_argument("--quiet", action="store_true", help="show no progress, summary or notice")
    study.set_defaults(command=_study)


def _add_places(study: argparse.ArgumentParser) -> None:
    """Add the options that say where points are."""
    where = study.add_mutually_exclusive_group()
    where.add_argument("--faces", action="store_true", help="a value for each face, at its centroid; the default")
    where.add_argument("--vertices", action="store_true", help=_VERTICES)
    where.add_argument("--grid", type=float, metavar="SPACING", help=_GRID)
    where.add_argument("--points", type=Path, metavar="FILE", help=_POINTS)
    study.add_argument("--height", type=float, metavar="H", help=_HEIGHT)
    study.add_argument("--bounds", type=float, nargs=6, metavar=("X0", "Y0", "Z0", "X1", "Y1", "Z1"), help=_BOUNDS)


def _study(options: argparse.Namespace) -> None:
    # Imported here so that --help and --version need no compiler.
    import time

    from renderer.checkpoints.folder import naming_parts
    from renderer.checkpoints.study import Study, folder_of
    from renderer.mesh.load import mesh_paths
    from renderer.octree import Octree

    _check_options(options)
    if options.kind == _VIEW_FACTORS:
        study_view_factors(options)
        return
    options.mesh = mesh_paths(options.mesh)
    _check_output(options)
    paths = kept_of(options.mesh, options.hide)
    up, line = up_of(paths, options.up)
    made = _options_of(options, up)
    layout = layout_of(options)
    files = load_files(paths)
    if options.transmittance:
        made["transmittance"] = transmittance_of(files, options.transmittance)
    octree = Octree.from_mesh(files.mesh, threads=options.threads)
    chosen = _chosen(octree, options, up)
    _say_up(line, options, made)
    began = time.perf_counter()
    with naming_parts(folder_of(options.output[0])):
        parts = _run(octree, Study(options.kind, made), chosen.points, options)
        seconds = time.perf_counter() - began
        for output in options.output:
            if output.suffix.lower() == ".npy" and chosen.of_faces is None and chosen.of_vertices is None:
                parts.join(output)
            else:
                write(output, options, octree.mesh, chosen, parts.joined(), layout, up)
    if not options.quiet:
        _say_result(options, files, chosen, parts, seconds)
    # Last, so that no work is lost if a file cannot be written.
    parts.remove()


def _say_up(line: str, options: argparse.Namespace, made: dict[str, Any]) -> None:
    """Say which axis was taken for the one that points up, if it matters and nobody said."""
    from_above = any(output.suffix.lower() == ".png" for output in options.output) and options.camera is None
    if line and not options.quiet and ("up" in made or options.grid or options.points or from_above):
        say_up(line)


def _say_result(options: argparse.Namespace, files: Files, chosen: Any, parts: Any, seconds: float) -> None:
    """Say what was written, how many points see nothing, and the values of each of several files."""
    outputs = ", ".join(map(str, options.output))
    blind = 0 if options.kind == "sun" else parts.count(0.0)
    nothing = f"; {blind:,} see nothing: they face down, are hidden all around or lie inside a body" if blind else ""
    say(f"{outputs}: {KINDS[options.kind]} of {parts.plan.rows:,} points in {seconds:.2f} s{nothing}")
    if len(files.paths) > 1:
        for line in values_of_files(files, chosen, parts.joined()):
            say(line)


def _run(octree: Any, study: Any, points: Any, options: argparse.Namespace) -> Any:
    """All parts of the study, computed here or on a cluster."""
    from renderer.checkpoints.study import folder_of, run

    folder, progress = folder_of(options.output[0]), not options.quiet
    if options.cluster is None:
        return run(octree, study, points, folder, progress=progress)
    from renderer.cluster import run_on

    with on_cluster(options) as client:
        return run_on(client, octree, study, points, folder, progress=progress)


def _check_output(options: argparse.Namespace) -> None:
    """Refuse outputs that cannot be written before the work begins."""
    arrays = (Path(word) for word in options.transmittance if is_array(word))
    given = (*options.mesh, options.points, options.suns, options.camera, *arrays)
    for output in options.output:
        expect(output.suffix.lower() in FORMATS, "--output", f"one of {', '.join(FORMATS)}", str(output))
    check_outputs(options.output, [file for file in given if file is not None])
    pictures = any(output.suffix.lower() == ".png" for output in options.output)
    on_mesh, named = options.grid is None and options.points is None, ", ".join(map(str, options.output))
    expect(on_mesh or not pictures, "--output", ".npy or .ply, as a picture needs faces", named)
    for name in ("camera", "resolution"):
        _expect(pictures or getattr(options, name) is None, name, "an output that ends in .png", named)


def _check_options(options: argparse.Namespace) -> None:
    """Refuse other options that do not fit together before the work begins."""
    for kind, names in _OWN.items():
        for name in names:
            given = options.kind != kind and getattr(options, name) is not None
            _expect(not given, name, f"none but for the kind {kind}", f"one for the kind {options.kind}")
    for name, usual in _OF_POINTS.items() if options.kind == _VIEW_FACTORS else ():
        _expect(getattr(options, name) == usual, name, f"none for the kind {_VIEW_FACTORS}", "one")
    expect(options.kind != "sun" or options.suns is not None, "--suns", "a file for the kind sun", "none")
    for name in ("height", "bounds"):
        _expect(options.grid is not None or getattr(options, name) is None, name, "none without --grid", "one")


def _expect(condition: bool, option: str, expected: str, got: str) -> None:
    expect(condition, f"--{option.replace('_', '-')}", expected, got)


def _options_of(options: argparse.Namespace, up: Any) -> dict[str, Any]:
    """The keyword arguments of the study, but for those that need the mesh."""
    from renderer.studies.sun_files import suns_of

    of: dict[str, Any] = {"max_distance": options.max_distance}
    if options.kind == "sky":
        of["up"] = up
    if options.kind == "sun":
        suns = suns_of(options.suns, up)
        of |= {"up": up} if options.up is not None or suns.have_horizon else {}
        return of | {"sun_directions": suns.directions, "weights": suns.hours}
    return of | {name: value for name in _OWN[options.kind] if (value := getattr(options, name)) is not None}


def _chosen(octree: Any, options: argparse.Namespace, up: Any) -> Any:
    from renderer.studies import points as chosen

    if options.points is not None:
        return chosen.of_file(octree, options.points, up)
    if options.grid is None:
        return chosen.on_vertices(octree) if options.vertices else chosen.on_faces(octree)
    bounds = None if options.bounds is None else [options.bounds[:3], options.bounds[3:]]
    try:
        return chosen.on_grid(octree, options.grid, bounds=bounds, height=options.height, up=up)
    except ValueError as error:
        raise ValueError(f"--{error}".replace("--spacing", "--grid", 1)) from None
