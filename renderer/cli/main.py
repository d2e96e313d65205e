"""The command line: arguments in, calls to the library, one line and exit code 2 for anything wrong."""

import argparse
import logging
import os
import platform
import sys
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from renderer import __version__
from renderer.cli.cluster import add_cluster, render_on_cluster
from renderer.cli.study import add_study
from renderer.errors import expect
from renderer.jit.levels import AHEAD_VARIABLE, LEVELS, lacking
from renderer.system.interrupt import interruptible
from renderer.system.terminal import flush_output, give_up_output, on_terminal, one_line, say, spell_everything


@interruptible("octree-render: interrupted")
def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``octree-render``; returns the exit code: 0, 2 for bad input, 130 after Ctrl-C."""
    options = make_parser().parse_args(arguments)
    try:
        if getattr(options, "level", None):
            _choose_processor(options.level, options.output)
        if arguments is None:
            spell_everything()
            _hide_scipy_from_numba()
        with compile_notices(getattr(options, "quiet", False)):
            options.command(options)
        flush_output()
    except BrokenPipeError:
        # The reader of standard output, such as ``| head``, has closed it. The picture is written.
        give_up_output()
    except (ValueError, OSError, ImportError, MemoryError) as error:
        kind = "not enough memory" if isinstance(error, MemoryError) else ""
        print(": ".join(filter(None, ("octree-render", kind, one_line(error)))), file=sys.stderr)
        return 2
    return 0


def _hide_scipy_from_numba() -> None:
    """Spare the command's own process SciPy, which Numba imports and no kernel calls.

    It takes time, and where memory is scarce its OpenBLAS waits for memory without end, deaf to signals.
    """
    if "scipy" not in sys.modules:
        sys.modules["scipy"] = None  # type: ignore[assignment]  # so the import statement finds none
        # The second is imported with kernels that are loaded from disk.
        import numba
        import numba.np.arraymath  # noqa: F401

        del sys.modules["scipy"]


@contextmanager
def compile_notices(silent: bool) -> Iterator[None]:
    """Say on standard error that kernels are compiled, so that the first run is not taken for a usual one."""
    log, notices = logging.getLogger("renderer.jit"), _Notices()
    level, propagate = log.level, log.propagate
    log.addHandler(notices)
    log.propagate = False
    log.setLevel(logging.ERROR if silent else logging.WARNING)
    try:
        yield
    finally:
        log.removeHandler(notices)
        log.propagate = propagate
        log.setLevel(level)


class _Notices(logging.Handler):
    """Log lines on standard error, above a progress bar that may stand there."""

    def emit(self, record: logging.LogRecord) -> None:
        from tqdm import tqdm

        tqdm.write(f"octree-render: {record.getMessage().removeprefix('renderer: ')}", file=sys.stderr)


_SCENE = "a scene file (.toml), or a mesh file (.ply, .obj, .stl, .glb): camera, light and floor are then chosen to fit"
_CHANGE = (
    "camera, lights, materials or keys of render in place of the file's, such as 'render.shadows = false', or objects "
    'to leave out, such as \'hide = ["objects.0", "floor"]\'; may be given again'
)
_WRITE_SCENE = "of a mesh file: write the scene chosen for it, to be changed at will"


def _scene_to_write(options: argparse.Namespace) -> None:
    """Write the scene of a mesh file where that is asked for."""
    from renderer.mesh.load import MESH_SUFFIXES
    from renderer.scene.scene import write_scene

    if options.write_scene is not None:
        is_mesh = options.scene.suffix.lower() in MESH_SUFFIXES
        expect(is_mesh, "--write-scene", f"a mesh file ({', '.join(MESH_SUFFIXES)})", str(options.scene))
        # It may have been changed since it was written.
        new = not os.path.lexists(options.write_scene)
        expect(new, "--write-scene", "a new file", f"{options.write_scene}, which is there already")
        write_scene(options.scene, options.write_scene)


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="octree-render", description="Octree ray tracer for triangle meshes.")
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="command")
    render = commands.add_parser("render", help="render a scene file to a picture")
    render.add_argument("scene", type=Path, help=_SCENE)
    render.add_argument("--write-scene", type=Path, metavar="FILE", help=_WRITE_SCENE)
    formats = ".png, or .exr or .npy for linear radiance"
    render.add_argument("-o", "--output", type=Path, default=Path("out.png"), help=formats)
    render.add_argument("--resolution", type=_resolution, metavar="WxH", help="pixels, such as 512x512")
    render.add_argument("--max-depth", type=int, metavar="N", help="bounces, 0 to 64")
    render.add_argument("--samples", type=int, metavar="N", help="samples a pixel: 1, 4, 9, ...")
    render.add_argument("--min-weight", type=float, metavar="W", help="end rays that weigh less")
    render.add_argument("--max-rays", type=int, metavar="N", help="rays of a sample of a pixel after which it is cut")
    render.add_argument("--change", action="append", default=[], metavar="TOML", help=_CHANGE)
    render.add_argument("--accelerator", choices=("auto", "octree", "brute"), default="auto")
    render.add_argument("--split", choices=("midpoint", "sah"), default="midpoint", help="how the octree is cut")
    render.add_argument("--threads", type=int, metavar="N", help="default: all processors")
    add_cluster(render)
    render.add_argument("--quiet", action="store_true", help="no progress bar, no summary and no word of compiling")
    render.set_defaults(command=_render)
    info = commands.add_parser("info", help="say what a scene holds and what its octree looks like")
    info.add_argument("scene", type=Path, help=_SCENE)
    info.add_argument("--split", choices=("midpoint", "sah"), default="midpoint")
    info.set_defaults(command=_info)
    view = commands.add_parser("view", help="show a scene in the browser, live")
    view.add_argument("scene", type=Path, help=_SCENE)
    view.add_argument("--write-scene", type=Path, metavar="FILE", help=_WRITE_SCENE)
    view.add_argument("--host", default="127.0.0.1", help="where to listen; beyond this machine it takes a token")
    view.add_argument("--port", type=int, default=0, help="default: 0, any free one")
    view.add_argument("--no-browser", action="store_true", help="print the address and open nothing")
    view.set_defaults(command=_view)
    add_study(commands, _resolution)
    _add_compile(commands)
    return parser


def _add_compile(commands: Any) -> None:
    ahead = commands.add_parser(
        "compile",
        help="compile kernels now, for CI, container images and folders that travel",
        description="Compile kernels now, so that no later run of these versions has to.",
        epilog=f"A folder made with -o is found by {AHEAD_VARIABLE}=FOLDER, and never written by a run.",
    )
    what = ahead.add_mutually_exclusive_group()
    for name, does in (
        ("queries", "what an Octree and a BruteForce call"),
        ("pictures", "the same, and what renders pictures"),
        ("all", "the same, and what the viewer calls; the default"),
    ):
        what.add_argument(f"--{name}", dest="what", action="store_const", const=name, help=does)
    ahead.add_argument("--level", choices=LEVELS, help="for any processor of a level, not this machine's; needs -o")
    ahead.add_argument("-o", "--output", type=Path, metavar="FOLDER", help="keep them there and not in the usual cache")
    ahead.add_argument("--quiet", action="store_true", help="no progress bar and no word at the end")
    ahead.set_defaults(command=_compile, what="all")


def _resolution(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT such as 512x512, got {text!r}")
    return int(width), int(height)


def _render(options: argparse.Namespace) -> None:
    # Imported here so that --help and --version need no compiler.
    from renderer.picture.image import PLANES, CutWarning, check_picture_path
    from renderer.picture.render import render
    from renderer.precompile import compile_in_two
    from renderer.scene.change import changed
    from renderer.scene.scene import load_scene

    check_picture_path(options.output)
    scene = load_scene(options.scene)
    _check_output_is_no_input(options, scene)  # nor one of an object that a change hides
    for text in options.change:
        try:
            scene = changed(scene, text)
        except ValueError as error:
            raise ValueError(f"--change: {error}") from None
    _scene_to_write(options)
    asked: dict[str, Any] = {
        "resolution": options.resolution,
        "samples": options.samples,
        "max_depth": options.max_depth,
        "min_weight": options.min_weight,
        "max_rays": options.max_rays,
        "accelerator": options.accelerator,
        "split": options.split,
        "planes": PLANES if options.output.suffix.lower() == ".exr" else ("rays",),
    }
    if options.cluster is None:
        compile_in_two()
        warnings.simplefilter("ignore", CutWarning)  # reported below, on one line
        image = render(scene, **asked, threads=options.threads, progress=not options.quiet)
        _save(image, options.output)
    else:
        run, image = render_on_cluster(scene, asked, options)
        image.save(options.output)
        # Only now, so that a file that cannot be written costs no picture.
        run.remove()
    if image.cut:
        print(f"octree-render: {image.cut_message(options.max_rays or scene.render.max_rays)}", file=sys.stderr)
    if not options.quiet:
        height, width = image.rays.shape
        rays = int(image.rays.sum())
        # On a cluster a run may have found parts of an earlier one, and workers built their trees meanwhile.
        speed = (
            f"({rays / image.render_seconds / 1e6:.1f} million a second), scene ready in {image.build_seconds:.2f} s"
            if options.cluster is None
            else "on the cluster"
        )
        say(f"{options.output}: {width} x {height}, {rays} rays in {image.render_seconds:.2f} s {speed}")


def _check_output_is_no_input(options: argparse.Namespace, scene: Any) -> None:
    """Refuse to write the picture over a file that it is made of, whatever links lead there."""
    from renderer.system.files import are_apart

    read = [options.scene, *(thing.mesh for thing in scene.objects if isinstance(thing.mesh, Path))]
    written = [options.write_scene] if options.write_scene else []
    apart, output = are_apart([options.output], [*read, *written]), os.path.realpath(options.output)
    expect(apart, "--output", "another file than the scene's own", f"{output} by a link")


def _save(image: Any, path: Path) -> None:
    """Save a picture; where that fails after all its work, keep it elsewhere and raise an error that says where."""
    try:
        image.save(path)
    except (OSError, MemoryError) as error:
        # Its radiance is written as it is, where there is no memory to encode it.
        name = path.name if isinstance(error, OSError) else f"{path.stem}.npy"
        folder = tempfile.mkdtemp(prefix="octree-render-")
        kept = Path(folder) / name
        try:
            image.save(kept)
        except OSError:
            os.rmdir(folder)
            raise error from None
        reason = str(error) if isinstance(error, OSError) else "there is not enough memory to encode the picture"
        raise OSError(f"{reason}; the picture is kept as {kept}") from error


def _compile(options: argparse.Namespace) -> None:
    from tqdm import tqdm

    from renderer.jit.cache import lost, stored_in
    from renderer.jit.notice import compile_seconds
    from renderer.precompile import PARTS, compile_ahead, compile_into

    if options.output is not None:
        compile_into(options.output)
    visible = not options.quiet and on_terminal()
    with tqdm(total=len(PARTS[options.what]), unit="part", leave=False, disable=not visible) as bar:

        def began(name: str) -> None:
            bar.set_description(name)
            bar.update()

        compile_ahead(options.what, began)
    if lost():
        raise OSError(f"{lost()} kernels were compiled but could not be kept: {options.output or 'no cache folder'}")
    if not options.quiet:
        where = f"; {stored_in(options.output)} kernels in {options.output}" if options.output else ""
        say(f"compiled in {compile_seconds():.1f} s{where}")


def _choose_processor(level: str, output: Path | None) -> None:
    """Let Numba, which reads the environment when it is imported, compile for a level."""
    expect(output is not None, "--output", "a folder, as kernels for a level are not this machine's", "none")
    own = platform.machine().lower()
    expect((own in ("aarch64", "arm64")) == (level == "aarch64"), "--level", f"one of this processor's, {own}", level)
    lacks = ", ".join(lacking(level))
    # Each kernel is compiled by a call.
    expect(not lacks, "--level", "one that this machine runs too", f"{level}, of which it lacks {lacks}")
    expect("numba" not in sys.modules, "--level", "a process that has not imported Numba yet", "one that has")
    os.environ["NUMBA_CPU_NAME"] = LEVELS[level]
    os.environ["NUMBA_CPU_FEATURES"] = ""


def _view(options: argparse.Namespace) -> None:
    from renderer.viewer.view import view

    _scene_to_write(options)
    served = view(options.scene, host=options.host, port=options.port, browser=False)
    # Ctrl-C is the usual way to end it, so no failure, from the moment on that the address stands there.
    with served as viewing, suppress(KeyboardInterrupt):
        say(f"{options.scene} is shown at {viewing.url} until Ctrl-C", flush=True)
        if not options.no_browser:
            viewing.open_browser()
        viewing.wait()


def _info(options: argparse.Namespace) -> None:
    from renderer.octree import Octree
    from renderer.picture.pack import pack
    from renderer.scene.needs import examine, needs_of
    from renderer.scene.scene import load_scene

    scene = load_scene(options.scene)
    expect(bool(scene.instances), "scene", "at least one object or a floor", "none")
    say(f"{options.scene}: {len(scene.instances)} meshes, {len(scene.lights)} lights, {scene.camera.type} camera")
    for instance in scene.instances:
        material = scene.materials[instance.material]
        normals = "smooth" if instance.smooth else "flat"
        say(
            f"  {instance.mesh.name or 'mesh':<20} {len(instance.mesh.faces):>9} faces  {normals:<7} "
            f"{instance.material} ({material.type})"
        )
    if needs_of(scene).octree:
        stats = Octree.from_mesh(pack(scene)[0], split=options.split).stats
        say(
            f"octree ({options.split}): {stats.nodes} nodes, {stats.leaves} leaves, depth {stats.depth}, "
            f"{stats.references} references in {stats.blocks} blocks ({stats.fill:.0%} full), "
            f"{stats.bytes / 1e6:.1f} MB"
        )
    for feature, value, reason in examine(scene):
        say(f"  {feature.replace('_', ' '):<16} {'needed' if value else 'left out'}: {reason}")


if __name__ == "__main__":
    sys.exit(main())
