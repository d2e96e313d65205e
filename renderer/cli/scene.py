"""The scene of a command: its argument, and ``--write-scene``."""

import argparse
import os
from pathlib import Path

from renderer.errors import expect

_SCENE = "a scene file (.toml), or a mesh file (.ply, .obj, .stl, .glb): camera, light and floor are then chosen to fit"
_WRITE_SCENE = "of a mesh file: write the scene chosen for it, to be changed at will"


def add_scene(command: argparse.ArgumentParser, *, written: bool = True) -> None:
    """Add the argument to a command, and unless ``written`` is False the option."""
    command.add_argument("scene", type=Path, help=_SCENE)
    if written:
        command.add_argument("--write-scene", type=Path, metavar="FILE", help=_WRITE_SCENE)


def write_scene_of(options: argparse.Namespace) -> None:
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
