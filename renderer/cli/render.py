"""``octree-render render``: a scene file in, a picture out."""

import argparse
import math
import os
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any, get_args

from renderer.arguments.split import SPLIT, Split
from renderer.cli.cluster import add_cluster, render_on_cluster
from renderer.cli.scene import SPLIT_RULE, add_scene, files_read, say_up, write_scene_of
from renderer.cli.turntable import add_frames, render_turntable
from renderer.errors import expect
from renderer.system.terminal import say

_CHANGE = (
    "replace the camera, the lights, materials, the ambient light, the background or sky, or keys of render, such as "
    "'render.shadows = false', or leave objects out, such as 'hide = [\"objects.0\", \"floor\"]'; may be given again"
)
# The options that are keys of a scene's settings.
_SETTINGS = ("resolution", "samples", "filter", "max_depth", "min_weight", "max_rays")
_FILTERS = ("box", "tent", "gaussian", "mitchell")
_EXPOSURE = "make the picture 2^STOPS times as bright; default: 0"
_TONE = "the tone curve of a .png or an animation; default: srgb, which clips what is brighter than white"
_WINDOW = "render only this part: the columns from LEFT to below RIGHT and the rows from TOP to below BOTTOM"
_TRANSPARENT = "for a .png: leave the background out, with alpha in its place"
_ACCELERATOR = "default: auto, the octree unless there are very few faces; brute tests all faces"


def add_render(commands: Any) -> None:
    """Add the command to a parser's ``commands``."""
    render = commands.add_parser("render", help="render a scene file or meshes to a picture")
    add_scene(render, several=True)
    formats = ".png, or .exr or .npy for linear radiance; with --frames .gif, .webp or .mp4"
    render.add_argument("-o", "--output", type=Path, default=Path("out.png"), help=formats)
    render.add_argument(
        "--resolution", type=resolution, metavar="WxH", help="pixels, such as 640x360; one number is both"
    )
    render.add_argument("--window", type=int, nargs=4, metavar=("LEFT", "TOP", "RIGHT", "BOTTOM"), help=_WINDOW)
    render.add_argument("--max-depth", type=int, metavar="N", help="bounces, 0 to 64")
    render.add_argument("--samples", type=int, metavar="N", help="samples per pixel: 1, 4, 9, ...")
    render.add_argument("--filter", choices=_FILTERS, help="how samples become pixels (default: box)")
    render.add_argument("--min-weight", type=float, metavar="W", help="end rays whose weight is less")
    render.add_argument("--max-rays", type=int, metavar="N", help="the most rays per sample of a pixel")
    render.add_argument("--exposure", type=stops, default=0.0, metavar="STOPS", help=_EXPOSURE)
    render.add_argument("--tone", choices=("srgb", "reinhard", "aces"), default="srgb", help=_TONE)
    render.add_argument("--transparent", action="store_true", help=_TRANSPARENT)
    add_frames(render)
    render.add_argument("--change", action="append", default=[], metavar="TOML", help=_CHANGE)
    render.add_argument("--accelerator", choices=("auto", "octree", "brute"), default="auto", help=_ACCELERATOR)
    render.add_argument("--split", choices=get_args(Split), default=SPLIT, help=SPLIT_RULE)
    render.add_argument("--threads", type=int, metavar="N", help="default: all processors")
    add_cluster(render)
    render.add_argument("--quiet", action="store_true", help="no progress bar, no summary, no notices")
    render.set_defaults(command=_render)


def resolution(text: str) -> tuple[int, int]:
    """Width and height of the text WxH; one number is both."""
    width, x, height = text.lower().partition("x")
    height = height if x else width
    if not (width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT such as 640x360, or one number, got {text!r}")
    return int(width), int(height)


def stops(text: str) -> float:
    """The number of stops of an exposure."""
    from renderer.picture.exposure import MAX_STOPS

    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= MAX_STOPS:
        raise argparse.ArgumentTypeError(f"expected a number from {-MAX_STOPS:g} to {MAX_STOPS:g}, got {text!r}")
    return value


def _render(options: argparse.Namespace) -> None:
    # Imported here so that --help and --version need no compiler.
    from renderer.picture.animation import check_animation_path
    from renderer.picture.image import PLANES, check_picture_path

    _check_fits(options)
    (check_picture_path if options.frames is None else check_animation_path)(options.output)
    scene = _scene(options)
    asked: dict[str, Any] = {name: getattr(options, name) for name in (*_SETTINGS, "accelerator", "split")}
    asked["planes"] = PLANES if options.output.suffix.lower() == ".exr" else ("rays",)
    if options.frames is not None:
        render_turntable(scene, asked, options)
        return
    if options.cluster is None:
        image, matte = _rendered_here(scene, asked, options)
        _save(_developed(image, options), options, matte and matte.exposed(options.exposure))
    else:
        run, image = render_on_cluster(scene, asked, options)
        _developed(image, options).save(options.output)
        # Only now, so that a file that cannot be written costs no picture.
        run.remove()
    if image.cut:
        print(f"octree-render: {image.cut_message(options.max_rays or scene.render.max_rays)}", file=sys.stderr)
    if not options.quiet:
        say(_summary(image, options))


def _scene(options: argparse.Namespace) -> Any:
    """The scene that is rendered, with the changes of the options."""
    from renderer.scene.change import changed
    from renderer.scene.scene import checked_settings, load_scene, scene_files

    files = scene_files(options.scene)
    scene = load_scene(files, up=options.up)
    _check_output_is_no_input(options, files, scene)  # nor one of an object that a change hides
    for text in options.change:
        try:
            scene = changed(scene, text)
        except ValueError as error:
            raise ValueError(f"--change: {error}") from None
    checked_settings(scene.render, {name: getattr(options, name) for name in _SETTINGS}, scene.camera)
    write_scene_of(files, options)
    if not options.quiet:
        say_up(files, options.up)
    return scene


def _check_fits(options: argparse.Namespace) -> None:
    """Refuse what the kind of output has not: transparency, a window, a tone curve where radiance stays linear."""
    suffix = options.output.suffix.lower()
    linear = options.tone != "srgb" and suffix in (".exr", ".npy")
    expect(not linear, "--tone", "a .png file or an animation", repr(str(options.output)))
    expect(suffix == ".png" or not options.transparent, "--transparent", "a .png file", repr(str(options.output)))
    for name in ("transparent", "window"):
        expect(not getattr(options, name) or options.frames is None, f"--{name}", "a picture", "--frames")
    for name in ("transparent", "window", "frames"):
        alone = options.cluster is None or not getattr(options, name)
        expect(alone, f"--{name}", "a picture of this machine", "--cluster")


def _rendered_here(scene: Any, asked: dict[str, Any], options: argparse.Namespace) -> tuple[Any, Any]:
    """The picture, rendered on this machine, and its matte if it is to be transparent."""
    from renderer.picture.image import CutWarning
    from renderer.picture.render import prepare, render
    from renderer.precompile import compile_in_two
    from renderer.scene.needs import needs_of

    compile_in_two(needs_of(scene).textures)
    warnings.simplefilter("ignore", CutWarning)  # reported on one line
    source, asked = scene, {**asked, "threads": options.threads}
    if options.transparent:
        source = prepare(scene, **{name: asked.pop(name) for name in ("accelerator", "split")}, threads=options.threads)
    image = render(source, **asked, window=options.window, progress=not options.quiet)
    return image, _matte(source, options) if options.transparent else None


def _matte(ready: Any, options: argparse.Namespace) -> Any:
    """The matte of the picture of a prepared scene."""
    from renderer.picture.matte import matte_of
    from renderer.scene.scene import checked_settings
    from renderer.system.threads import checked_threads

    scene = ready.scene
    given = {name: getattr(options, name) for name in ("resolution", "samples", "filter")}
    chosen = checked_settings(scene.render, given, scene.camera)
    left, top, right, bottom = options.window or (0, 0, *chosen.resolution)
    threads, rows, columns = checked_threads(options.threads), (top, bottom), (left, right)
    return matte_of(ready, scene.camera, chosen, threads, band=rows, columns=columns)


def _developed(image: Any, options: argparse.Namespace) -> Any:
    """The picture with the exposure and tone of the options; a transparent one gets its tone without its background."""
    return image.toned("srgb" if options.transparent else options.tone, exposure=options.exposure)


def _summary(image: Any, options: argparse.Namespace) -> str:
    """The summary of a written picture."""
    height, width = image.rays.shape
    rays = int(image.rays.sum())
    # On a cluster a run may have found parts of an earlier one, and workers built their trees meanwhile.
    speed = (
        f"({rays / image.render_seconds / 1e6:.1f} million a second), scene ready in {image.build_seconds:.2f} s"
        if options.cluster is None
        else "on the cluster"
    )
    return f"{options.output}: {width} x {height}, {rays} rays in {image.render_seconds:.2f} s {speed}"


def _check_output_is_no_input(options: argparse.Namespace, files: list[Path], scene: Any) -> None:
    """Refuse to write the picture over one of its inputs, also through links."""
    from renderer.system.files import are_apart

    written = [options.write_scene] if options.write_scene else []
    read = [*files_read(files, scene), *written]
    apart, output = are_apart([options.output], read), os.path.realpath(options.output)
    expect(apart, "--output", "another file than the scene's own", f"{output} by a link")


def _write(image: Any, path: Path, tone: str, matte: Any) -> None:
    from renderer.picture.matte import save_cut_out

    if matte is None or path.suffix.lower() != ".png":
        image.save(path)
    else:
        save_cut_out(path, image.radiance, matte, tone)


def _save(image: Any, options: argparse.Namespace, matte: Any = None) -> None:
    """Save a picture, transparent where it has a matte. If that fails, save it in a temporary folder and raise an error
    with its path.
    """
    path = options.output
    try:
        _write(image, path, options.tone, matte)
    except (OSError, MemoryError) as error:
        # Its radiance is written as it is, where there is no memory to encode it.
        name = path.name if isinstance(error, OSError) else f"{path.stem}.npy"
        folder = tempfile.mkdtemp(prefix="octree-render-")
        kept = Path(folder) / name
        try:
            _write(image, kept, options.tone, matte)
        except OSError:
            os.rmdir(folder)
            raise error from None
        reason = str(error) if isinstance(error, OSError) else "there is not enough memory to encode the picture"
        raise OSError(f"{reason}; the picture is kept as {kept}") from error
