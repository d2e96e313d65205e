"""``octree-render radiosity``: a scene whose surfaces light each other, as a picture, a scene file or a mesh."""

import argparse
import time
from pathlib import Path
from typing import Any

from renderer.cli.render import resolution, stops
from renderer.cli.scene import add_scene, files_read, say_up
from renderer.errors import expect
from renderer.system.terminal import say

_OUTPUT = (
    ".png, .exr or .npy: a picture; .toml: the lit scene, which render and view show from anywhere, with its meshes "
    "beside it; .ply or .glb: a mesh with colours for other programs; may be given again"
)
_PICTURES = (".png", ".exr", ".npy")
_EDGE = "the longest edge of a patch, in scene units: shadows are no sharper; default: 1/16 of the scene's longest side"
_RTOL = "the share of what a patch sends that may arrive at others than it should; default: 0.05"
_CREASE = "blend colours over edges of at most this angle; default: 30"
_UP = "the axis of mesh files that points up (default: y); a scene file has the key up"


def add_radiosity(commands: Any) -> None:
    """Add the command to a parser's ``commands``."""
    command = commands.add_parser(
        "radiosity",
        help="light a scene by its own surfaces, for pictures from anywhere",
        description="Compute the light that diffuse surfaces send each other (radiosity), and show or save the scene "
        "lit by it. Unlike render, emission and a background light other surfaces.",
    )
    add_scene(command, shown=False, several=True)
    command.add_argument("--up", choices=("x", "y", "z"), help=_UP)
    command.add_argument("-o", "--output", type=Path, required=True, action="append", metavar="FILE", help=_OUTPUT)
    command.add_argument("--edge", type=float, metavar="LENGTH", help=_EDGE)
    command.add_argument("--rtol", type=float, default=0.05, metavar="R", help=_RTOL)
    command.add_argument("--max-rays", type=int, default=1 << 16, metavar="N", help="rays of a patch at most")
    command.add_argument("--crease", type=float, default=30.0, metavar="DEGREES", help=_CREASE)
    command.add_argument("--resolution", type=resolution, metavar="WxH", help="of a picture, in pixels")
    command.add_argument("--samples", type=int, metavar="N", help="of a picture, per pixel: 1, 4, 9, ...")
    command.add_argument(
        "--exposure", type=stops, default=0.0, metavar="STOPS", help="make pictures and meshes 2^STOPS times as bright"
    )
    command.add_argument("--tone", choices=("srgb", "reinhard", "aces"), default="srgb", help="of a .png")
    command.add_argument("--threads", type=int, metavar="N", help="default: all processors")
    command.add_argument("--quiet", action="store_true", help="no progress bar, no summary, no notices")
    command.set_defaults(command=_radiosity)


def _radiosity(options: argparse.Namespace) -> None:
    # Imported here so that --help and --version need no compiler.
    from renderer.radiosity import lit_scene
    from renderer.scene.scene import checked_settings, load_scene, scene_files

    _check_outputs(options)
    files = scene_files(options.scene)
    scene = load_scene(files, up=options.up)
    _check_no_input(options, files, scene)
    checked_settings(scene.render, {"resolution": options.resolution, "samples": options.samples}, scene.camera)
    if not options.quiet:
        say_up(files, options.up)
    began = time.perf_counter()
    chosen = {name: getattr(options, name) for name in ("edge", "rtol", "max_rays", "crease", "threads")}
    lit = lit_scene(scene, **chosen, progress=not options.quiet)
    seconds = time.perf_counter() - began
    for output in options.output:
        _write(lit, output, options)
    if not options.quiet:
        count = sum(instance.faces for instance in lit.instances)
        say(f"{', '.join(map(str, options.output))}: {count:,} patches in {seconds:.2f} s")


def _check_outputs(options: argparse.Namespace) -> None:
    """Refuse an output that cannot be written, before anything is computed."""
    from renderer.picture.exr import check_exr
    from renderer.picture.image import check_output_path
    from renderer.radiosity.files import LIT_FORMATS

    suffixes = [check_output_path(output, (*_PICTURES, *LIT_FORMATS)).suffix.lower() for output in options.output]
    if ".exr" in suffixes:
        check_exr()
    named = ", ".join(map(str, options.output))
    for name in ("resolution", "samples"):
        unused = getattr(options, name) is not None and not {*suffixes} & {*_PICTURES}
        expect(not unused, f"--{name}", "a picture among the outputs", named)
    toned = options.tone == "srgb" or ".png" in suffixes
    expect(toned, "--tone", "a .png file", repr(str(options.output[0])))


def _check_no_input(options: argparse.Namespace, files: list[Path], scene: Any) -> None:
    """Refuse to write over what is read, also through links."""
    from renderer.radiosity.files import lit_files
    from renderer.system.files import are_apart

    written = [path for output in options.output for path in lit_files(output, len(scene.instances))]
    apart = are_apart(written, files_read(files, scene))
    expect(apart, "--output", "other files than the scene's own, each once", ", ".join(map(str, options.output)))


def _write(lit: Any, output: Path, options: argparse.Namespace) -> None:
    """Write one of the outputs."""
    from renderer.picture.render import render
    from renderer.radiosity.files import LIT_FORMATS, save_lit

    if output.suffix.lower() in LIT_FORMATS:
        save_lit(lit, output, exposure=options.exposure)
        return
    chosen = {name: getattr(options, name) for name in ("resolution", "samples", "threads")}
    image = render(lit, **chosen, progress=not options.quiet)
    tone: Any = options.tone if output.suffix.lower() == ".png" else "srgb"
    image.toned(tone, exposure=options.exposure).save(output)
