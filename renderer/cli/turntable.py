"""``--frames`` of ``octree-render render``: one turn of the camera as an animation."""

import argparse
import sys
import time
import warnings
from collections.abc import Iterator
from typing import Any

from renderer.errors import expect
from renderer.system.terminal import progress_bar, say

_FRAMES = "one turn of the camera around its target in N pictures, as a .gif, .webp or .mp4 of 4 s"
_MOST = 3600


def add_frames(command: argparse.ArgumentParser) -> None:
    """Add the option to a command."""
    command.add_argument("--frames", type=_count, metavar="N", help=_FRAMES)


def _count(text: str) -> int:
    """The number of frames."""
    if not (text.isdecimal() and 2 <= int(text) <= _MOST):
        raise argparse.ArgumentTypeError(f"expected an integer from 2 to {_MOST}, got {text!r}")
    return int(text)


def render_turntable(scene: Any, asked: dict[str, Any], options: argparse.Namespace) -> None:
    """Write the turntable of a scene; ``asked`` are arguments of ``render``."""
    from renderer.picture.animation import check_animation_path, write_animation
    from renderer.picture.image import CutWarning
    from renderer.precompile import compile_in_two
    from renderer.scene.needs import needs_of
    from renderer.scene.scene import checked_settings
    from renderer.system.files import write_atomically

    format, count = check_animation_path(options.output), options.frames
    given = {"resolution": asked["resolution"]}
    width, height = checked_settings(scene.render, given, scene.camera).resolution
    even = format != "mp4" or width % 2 == height % 2 == 0
    expect(even, "--resolution", "even numbers for an .mp4 file", f"{width} x {height}")
    began, cuts = time.perf_counter(), list[tuple[int, str]]()
    compile_in_two(needs_of(scene).textures)
    warnings.simplefilter("ignore", CutWarning)  # reported on one line
    with progress_bar(count, "frame", not options.quiet) as update:
        frames = _frames(scene, asked, options, update, cuts)
        write_atomically(options.output, lambda file: write_animation(file, frames, count, format))
    if max(cuts)[0]:
        print(f"octree-render: in a frame {max(cuts)[1]}", file=sys.stderr)
    if not options.quiet:
        say(f"{options.output}: {count} frames of {width} x {height} in {time.perf_counter() - began:.2f} s")


def _frames(
    scene: Any, asked: dict[str, Any], options: argparse.Namespace, update: Any, cuts: list[tuple[int, str]]
) -> Iterator[Any]:
    """The pixels of all frames, each rendered when it is its turn, and all of one tree.

    ``cuts`` gets the number of cut pixels of each, and what is said of them.
    """
    from renderer.picture.render import prepare, render
    from renderer.picture.turntable import turned_cameras

    tree = {name: asked[name] for name in ("accelerator", "split")}
    settings = {name: value for name, value in asked.items() if name not in tree} | {"planes": ()}
    ready = prepare(scene, **tree, threads=options.threads)
    for camera in turned_cameras(scene, options.frames):
        image = render(ready, camera=camera, threads=options.threads, **settings)
        cuts.append((image.cut, image.cut_message(options.max_rays or scene.render.max_rays)))
        if update is not None:
            update(1)
        yield image.toned(options.tone, exposure=options.exposure).srgb
