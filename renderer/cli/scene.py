"""The scene of a command: its argument, and ``--write-scene``."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from renderer.errors import expect

SPLIT_RULE = "the rule that cuts cells of the octree (default: %(default)s)"
_SCENE = "a scene file (.toml), or a mesh file (.ply, .obj, .stl, .glb, .gltf), which gets a camera, a sky and a floor"
_SEVERAL = _SCENE + "; several mesh files, and those of folders, are objects of one scene"
_UP = "the axis of mesh files that points up (default: y); a scene file has the key up"
_WRITE_SCENE = "with mesh files: write their scene to a new .toml file, which you can change"


def add_scene(command: argparse.ArgumentParser, *, shown: bool = True, several: bool = False) -> None:
    """Add the argument to a command, where it takes ``several`` as a list, and the options for mesh files where a scene
    is ``shown``.
    """
    if several:
        command.add_argument("scene", type=Path, nargs="+", help=_SEVERAL)
    else:
        command.add_argument("scene", type=Path, help=_SCENE)
    if shown:
        command.add_argument("--up", choices=("x", "y", "z"), help=_UP)
        command.add_argument("--write-scene", type=Path, metavar="FILE", help=_WRITE_SCENE)


def files_read(files: Sequence[Path], scene: Any) -> list[Path]:
    """The files that a scene of ``files`` is read from: those, and its meshes and images."""
    from renderer.materials.base import appearance_of

    read = [*files, *(thing.mesh for thing in scene.objects if isinstance(thing.mesh, Path))]
    looks = [appearance_of(material) for material in scene.materials.values()]
    images = [texture.image.source for look in looks for texture in look.textures.values()]
    return read + [image for image in images if isinstance(image, Path)]


def say_up(scenes: Sequence[Path], up: str | None) -> None:
    """Say on standard error which axis is taken for up, where neither the user nor the files say it."""
    from renderer.mesh.load import Y_UP, mesh_suffix

    silent = [scene for scene in scenes if mesh_suffix(scene) not in (None, *Y_UP)]
    if up is None and silent:
        who = f"{silent[0]} does" if len(silent) == 1 else "the mesh files do"
        print(f"octree-render: {who} not say which axis points up: y was taken; --up x|y|z changes it", file=sys.stderr)


def write_scene_of(scenes: Sequence[Path], options: argparse.Namespace) -> None:
    """Write the scene of mesh files, if ``--write-scene`` names a file."""
    from renderer.mesh.load import MESH_SUFFIXES, mesh_suffix
    from renderer.scene.scene import write_scene

    if options.write_scene is not None:
        is_mesh = mesh_suffix(scenes[0]) is not None
        expect(is_mesh, "--write-scene", f"a mesh file ({', '.join(MESH_SUFFIXES)})", str(scenes[0]))
        # It may have been changed since it was written.
        new = not os.path.lexists(options.write_scene)
        expect(new, "--write-scene", "a new file", f"{options.write_scene}, which is there already")
        write_scene(scenes, options.write_scene, options.up)
