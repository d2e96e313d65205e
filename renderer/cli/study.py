"""``octree-render study``: arguments in, a study's result as an array, a coloured mesh, or a picture."""

import argparse
from pathlib import Path
from typing import Any, NamedTuple

from renderer.cli.cluster import add_cluster, on_cluster
from renderer.cli.meshes import Files, is_array, kept_of, load_files, say_up, transmittance_of, up_of, values_of_files
from renderer.cli.render import resolution
from renderer.errors import expect
from renderer.system.terminal import say

FORMATS = (".npy", ".ply", ".png")
_KINDS = {"sky": "sky view factor", "sun": "hours of sun", "ao": "ambient occlusion"}
# Options that one kind alone has, which are its function's.
_OWN = {"sky": ("patches", "definition"), "sun": ("suns",), "ao": ("samples",)}
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
_TRANSMITTANCE = (
    "the share of light that faces let through: of the mesh files of a name or pattern, such as 'tree*.obj=0.3'; or an "
    ".npy file with a value for each face; may be given again"
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
# The size of a picture with its legend.
_USUAL = 960, 720


class Layout(NamedTuple):
    """The camera of a picture, if one is given, its width and height in pixels, and the rows of the legend below."""

    camera: Any
    size: tuple[int, int]
    legend_rows: int


def add_study(commands: Any) -> None:
    """Add the command to a parser's ``commands``."""
    study = commands.add_parser(
        "study",
        help="what points of a mesh see: the sky, the sun, their surroundings",
        description="Compute what points of a mesh see. If a long run is killed, the same command goes on where it "
        "stopped and ends with the same bits: parts that are done are kept beside the output.",
    )
    study.add_argument("kind", choices=_KINDS, help="; ".join(f"{k}: {said}" for k, said in _KINDS.items()))
    study.add_argument("mesh", type=Path, nargs="+", help=_MESH)
    study.add_argument("--up", choices=("x", "y", "z"), help=_UP)
    study.add_argument("--hide", action="append", default=[], metavar="NAME", help=_HIDE)
    _add_places(study)
    study.add_argument(
        "-o", "--output", type=Path, required=True, action="append", metavar="FILE",
        help=".npy: values; .ply: a mesh or points with values and colours; .png: a picture, not of points; may be "
        "given again",
    )  # fmt: skip
    study.add_argument("--patches", type=int, metavar="N", help="sky: the number of directions; default: 145")
    study.add_argument("--definition", choices=("cosine", "geometric"), help="sky: what is weighed; default: cosine")
    study.add_argument("--suns", type=Path, metavar="FILE", help=_SUNS)
    study.add_argument("--samples", type=int, metavar="N", help="ao: directions of each point; default: 256")
    study.add_argument("--max-distance", type=float, default=float("inf"), metavar="D", help=_DISTANCE)
    study.add_argument("--transmittance", action="append", default=[], metavar="NAME=VALUE", help=_TRANSMITTANCE)
    # The former name of --max-distance.
    study.add_argument("--distance", dest="max_distance", type=float, default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    study.add_argument("--camera", type=Path, metavar="SCENE", help="for a .png: a scene file with the camera")
    study.add_argument("--resolution", type=resolution, metavar="WxH", help=_RESOLUTION)
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

    from renderer.checkpoints.study import Study
    from renderer.mesh.load import mesh_paths
    from renderer.octree import Octree

    _check_options(options)
    options.mesh = mesh_paths(options.mesh)
    _check_output(options)
    paths = kept_of(options.mesh, options.hide)
    up, line = up_of(paths, options.up)
    made = _options_of(options, up)
    _say_up(line, options, made)
    layout = _layout(options)
    files = load_files(paths)
    if options.transmittance:
        made["transmittance"] = transmittance_of(files, options.transmittance)
    octree = Octree.from_mesh(files.mesh, threads=options.threads)
    chosen = _chosen(octree, options, up)
    began = time.perf_counter()
    parts = _run(octree, Study(options.kind, made), chosen.points, options)
    seconds = time.perf_counter() - began
    for output in options.output:
        if output.suffix.lower() == ".npy" and chosen.of_faces is None and chosen.of_vertices is None:
            parts.join(output)
        else:
            _write(output, options, octree.mesh, chosen, parts.joined(), layout, up)
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
    say(f"{outputs}: {_KINDS[options.kind]} of {parts.plan.rows:,} points in {seconds:.2f} s{nothing}")
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
    from renderer.system.files import are_apart, check_writable

    on_mesh = options.grid is None and options.points is None
    arrays = (Path(word) for word in options.transmittance if is_array(word))
    given = (*options.mesh, options.points, options.suns, options.camera, *arrays)
    read = [file for file in given if file is not None]
    for output in options.output:
        suffix = output.suffix.lower()
        expect(suffix in FORMATS, "--output", f"one of {', '.join(FORMATS)}", str(output))
        expect(are_apart([output], read), "--output", "a file that is not an input", str(output))
        expect(suffix != ".png" or on_mesh, "--output", ".npy or .ply, as a picture needs faces", str(output))
    named = ", ".join(map(str, options.output))
    expect(are_apart(options.output), "--output", "each file once", named)
    seen = options.camera is None or any(output.suffix.lower() == ".png" for output in options.output)
    expect(seen, "--camera", "an output that ends in .png", named)
    for output in options.output:
        check_writable(output)


def _check_options(options: argparse.Namespace) -> None:
    """Refuse other options that do not fit together before the work begins."""
    for kind, names in _OWN.items():
        for name in names:
            given = options.kind != kind and getattr(options, name) is not None
            expect(not given, f"--{name}", f"none but for the kind {kind}", f"one for the kind {options.kind}")
    expect(options.kind != "sun" or options.suns is not None, "--suns", "a file for the kind sun", "none")
    for name in ("height", "bounds"):
        expect(options.grid is not None or getattr(options, name) is None, f"--{name}", "none without --grid", "one")


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


def _layout(options: argparse.Namespace) -> Layout:
    """The layout of a picture. Refuses one that cannot be drawn before the work begins."""
    from renderer.diagnostics.mesh_values import FINER, legend_rows, map_size
    from renderer.scene.scene import MOST_PIXELS, load_scene

    camera = None if options.camera is None else load_scene(options.camera).camera
    film = None if camera is None else camera.film_size
    width, height = options.resolution or film or _USUAL
    widest = MOST_PIXELS // FINER
    right = min(width, height) >= 1 and max(width, height) <= widest
    expect(right, "--resolution", f"1x1 to {widest}x{widest}", f"{width}x{height}")
    if camera is None or film is None:
        return Layout(camera, map_size((width, height)), legend_rows(height))
    camera.rays((0, 0), (width, height))  # refuses another shape than the film's
    return Layout(camera, (width, height), legend_rows(height))


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


def _write(
    output: Path, options: argparse.Namespace, mesh: Any, chosen: Any, answers: Any, layout: Layout, up: str
) -> None:
    """Write the results of points that need a place: those of a mesh, and those in a .ply."""
    from renderer.arguments.up import UP_AXES
    from renderer.diagnostics import mesh_values as drawing

    suffix = output.suffix.lower()
    if chosen.of_faces is None and chosen.of_vertices is None:
        drawing.write_ply(output, chosen.points.points, None, answers, of_faces=False)
        return
    of_faces = chosen.of_faces is not None
    values = chosen.of_faces(answers) if of_faces else chosen.of_vertices(answers)
    if suffix == ".npy":
        drawing.write_npy(output, values)
    elif suffix == ".ply":
        drawing.write_ply(output, mesh.vertices, mesh.faces, values, of_faces)
    else:
        seen = values if of_faces else values[mesh.faces].mean(axis=1)
        image = _picture(mesh, layout, options, up)
        picture = drawing.draw(image, mesh, seen, _KINDS[options.kind], layout.legend_rows, UP_AXES[up])
        drawing.write_png(output, picture)


def _picture(mesh: Any, layout: Layout, options: argparse.Namespace, up: str) -> Any:
    """The faces and normals that a camera sees; by default it looks down from the south-west."""
    from renderer.diagnostics.mesh_values import FINER
    from renderer.materials.phong import Phong
    from renderer.picture.render import render
    from renderer.scene.overview import from_above
    from renderer.scene.scene import Scene, SceneObject

    thing = SceneObject(mesh=mesh, material="grey", normals="flat")
    width, height = layout.size
    eye = from_above(mesh, layout.size, up) if layout.camera is None else layout.camera
    scene = Scene(camera=eye, materials={"grey": Phong()}, objects=[thing], ambient=1)
    return render(scene, resolution=(FINER * width, FINER * height), samples=1, max_depth=0, planes=("face", "normal"),
                  threads=options.threads, progress=not options.quiet)  # fmt: skip
