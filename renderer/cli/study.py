"""``octree-render study``: arguments in, a study's result as an array, a coloured mesh, or a picture."""

import argparse
from pathlib import Path
from typing import Any, Literal

from renderer.cli.cluster import add_cluster, on_cluster
from renderer.cli.render import resolution
from renderer.errors import expect
from renderer.system.terminal import say

FORMATS = (".npy", ".ply", ".png")
# This tree takes half as long again to build, and a million rays over a million faces make up for it.
SPLIT: Literal["sah"] = "sah"
_KINDS = {"sky": "sky view factor", "sun": "hours of sun", "ao": "ambient occlusion"}
# Options that one kind alone has, which are its function's.
_OWN = {"sky": ("patches", "definition"), "sun": ("suns",), "ao": ("samples",)}
_POINTS = ".npy, (n, 3), or (n, 6) with normals; on the surface or not"
_GRID = "points as seen from above (z up), so far apart, on what they see first"


def add_study(commands: Any) -> None:
    """Add the command to a parser's ``commands``."""
    study = commands.add_parser(
        "study",
        help="what points of a mesh see: the sky, the sun, their surroundings",
        description="Compute what points of a mesh see. Parts are kept beside the output until all are done: the same "
        "command again goes on where one was killed, and ends with the same bits.",
    )
    study.add_argument("kind", choices=_KINDS, help="; ".join(f"{k}: {said}" for k, said in _KINDS.items()))
    study.add_argument("mesh", type=Path, help="a mesh file (.ply, .obj, .stl, .glb), z up")
    where = study.add_mutually_exclusive_group()
    where.add_argument("--faces", action="store_true", help="the middle of each face, the default")
    where.add_argument("--vertices", action="store_true", help="the same, as means of each vertex's faces")
    where.add_argument("--grid", type=float, metavar="SPACING", help=_GRID)
    where.add_argument("--points", type=Path, metavar="FILE", help=_POINTS)
    study.add_argument(
        "-o", "--output", type=Path, required=True, action="append", metavar="FILE",
        help=".npy, .ply or, of faces, .png; may be given more than once",
    )  # fmt: skip
    study.add_argument("--patches", type=int, metavar="N", help="sky: any number of directions; default: 145")
    study.add_argument("--definition", choices=("cosine", "geometric"), help="sky: what is weighed; default: cosine")
    study.add_argument("--suns", type=Path, metavar="FILE", help="sun: a text of rows x y z hours, to the sun")
    study.add_argument("--samples", type=int, metavar="N", help="ao: directions a point; default: 256")
    study.add_argument("--distance", type=float, default=float("inf"), metavar="D", help="how far the mesh hides")
    study.add_argument("--camera", type=Path, metavar="SCENE", help="of a .png: a scene file whose camera it takes")
    study.add_argument("--resolution", type=resolution, default=(960, 720), metavar="WxH", help="of a .png")
    add_cluster(study)
    study.add_argument("--threads", type=int, metavar="N", help="default: all processors")
    study.add_argument("--quiet", action="store_true", help="no progress bar, no summary and no word of compiling")
    study.set_defaults(command=_study)


def _study(options: argparse.Namespace) -> None:
    # Imported here so that --help and --version need no compiler.
    import time

    from renderer.checkpoints.study import Study
    from renderer.mesh.load import load_mesh
    from renderer.octree import Octree

    _check_options(options)
    _check_output(options)
    made = _options_of(options)
    camera = _camera(options)
    octree = Octree.from_mesh(load_mesh(options.mesh), split=SPLIT, threads=options.threads)
    chosen = _chosen(octree, options)
    began = time.perf_counter()
    parts = _run(octree, Study(options.kind, made), chosen.points, options)
    seconds = time.perf_counter() - began
    for output in options.output:
        if output.suffix.lower() == ".npy" and chosen.of_faces is None and chosen.of_vertices is None:
            parts.join(output)
        else:
            _write(output, options, octree.mesh, chosen, parts.joined(), camera)
    if not options.quiet:
        say(_said(options, parts, seconds))
    # Only now, so that a file that cannot be written costs no study.
    parts.remove()


def _said(options: argparse.Namespace, parts: Any, seconds: float) -> str:
    """The line about the result, with the number of points that see nothing, so that this is not silent."""
    outputs = ", ".join(map(str, options.output))
    blind = 0 if options.kind == "sun" else parts.count(0.0)
    told = f"; {blind:,} see nothing: they face down, are hidden all around or lie inside a body" if blind else ""
    return f"{outputs}: {_KINDS[options.kind]} of {parts.plan.rows:,} points in {seconds:.2f} s{told}"


def _run(octree: Any, study: Any, points: Any, options: argparse.Namespace) -> Any:
    """All parts of the study, computed here or on a cluster."""
    from renderer.checkpoints.study import folder_of, run

    folder, progress = folder_of(options.output[0]), not options.quiet
    if options.cluster is None:
        return run(octree, study, points, folder, progress=progress)
    from renderer.cluster import run_on

    with on_cluster(options) as client:
        return run_on(client, octree, study, points, folder, split=SPLIT, progress=progress)


def _check_output(options: argparse.Namespace) -> None:
    """Refuse outputs that cannot be written, before any work."""
    from renderer.system.files import are_apart, check_writable

    on_mesh = options.grid is None and options.points is None
    read = [file for file in (options.mesh, options.points, options.suns, options.camera) if file is not None]
    for output in options.output:
        suffix = output.suffix.lower()
        expect(suffix in FORMATS, "--output", f"one of {', '.join(FORMATS)}", str(output))
        expect(are_apart([output], read), "--output", "another file than those that are read", str(output))
        expect(suffix != ".png" or on_mesh, "--output", ".npy or .ply for points that are not a mesh's", str(output))
    named = ", ".join(map(str, options.output))
    expect(are_apart(options.output), "--output", "each file once", named)
    seen = options.camera is None or any(output.suffix.lower() == ".png" for output in options.output)
    expect(seen, "--camera", "a .png to be seen by it", named)
    for output in options.output:
        check_writable(output)


def _check_options(options: argparse.Namespace) -> None:
    """Refuse other options that do not fit together, before any work."""
    from renderer.diagnostics.mesh_values import FINER
    from renderer.scene.scene import MOST_PIXELS

    for kind, names in _OWN.items():
        for name in names:
            given = options.kind != kind and getattr(options, name) is not None
            expect(not given, f"--{name}", f"none, as it is the kind {kind}'s", f"one for {options.kind}")
    expect(options.kind != "sun" or options.suns is not None, "--suns", "a file for the kind sun", "none")
    widest = MOST_PIXELS // FINER
    right = min(options.resolution) >= 1 and max(options.resolution) <= widest
    expect(right, "--resolution", f"1x1 to {widest}x{widest}", "{}x{}".format(*options.resolution))


def _options_of(options: argparse.Namespace) -> dict[str, Any]:
    """The keyword arguments of the study."""
    from renderer.studies.points import suns_of

    of: dict[str, Any] = {"distance": options.distance}
    if options.kind == "sun":
        return of | dict(zip(("sun_directions", "weights"), suns_of(options.suns), strict=True))
    return of | {name: value for name in _OWN[options.kind] if (value := getattr(options, name)) is not None}


def _camera(options: argparse.Namespace) -> Any:
    from renderer.scene.scene import load_scene

    return None if options.camera is None else load_scene(options.camera).camera


def _chosen(octree: Any, options: argparse.Namespace) -> Any:
    from renderer.studies import points as chosen

    if options.points is not None:
        return chosen.of_file(octree, options.points)
    if options.grid is not None:
        return chosen.on_grid(octree, options.grid)
    return chosen.on_vertices(octree) if options.vertices else chosen.on_faces(octree)


def _write(output: Path, options: argparse.Namespace, mesh: Any, chosen: Any, answers: Any, camera: Any) -> None:
    """Write a result that is more than the answers of the points."""
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
        picture = drawing.draw(_picture(mesh, camera, options), mesh, seen, _KINDS[options.kind])
        drawing.write_png(output, picture)


def _picture(mesh: Any, camera: Any, options: argparse.Namespace) -> Any:
    """The faces and normals that a camera sees; without one, from the south-west and above."""
    from renderer.diagnostics.mesh_values import FINER
    from renderer.picture.render import render
    from renderer.scene.material import Phong
    from renderer.scene.overview import from_above
    from renderer.scene.scene import Scene, SceneObject

    thing = SceneObject(mesh=mesh, material="grey", normals="flat")
    eye = from_above(mesh, options.resolution) if camera is None else camera
    scene = Scene(camera=eye, materials={"grey": Phong()}, objects=[thing], ambient=1)
    width, height = options.resolution
    return render(scene, resolution=(FINER * width, FINER * height), samples=1, max_depth=0, planes=("face", "normal"),
                  threads=options.threads, progress=not options.quiet)  # fmt: skip
