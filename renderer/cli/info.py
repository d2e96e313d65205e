"""``octree-render info``: what a scene holds, and what its pictures need."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any, get_args

from renderer.arguments.split import SPLIT, Split
from renderer.cli.scene import SPLIT_RULE, add_scene
from renderer.errors import expect
from renderer.system.terminal import say

if TYPE_CHECKING:
    from renderer.mesh.material import MeshMaterial


def add_info(commands: Any) -> None:
    """Add the command to a parser's ``commands``."""
    info = commands.add_parser("info", help="list what a scene holds, and its octree")
    add_scene(info, shown=False)
    info.add_argument("--split", choices=get_args(Split), default=SPLIT, help=SPLIT_RULE)
    info.set_defaults(command=_info)


def _info(options: argparse.Namespace) -> None:
    from renderer.octree import Octree
    from renderer.picture.pack import pack
    from renderer.scene.needs import examine, features_of
    from renderer.scene.scene import load_scene

    scene = load_scene(options.scene)
    expect(bool(scene.instances), "scene", "at least one object or a floor", "none")
    say(f"{options.scene}: {len(scene.instances)} meshes, {len(scene.lights)} lights, {scene.camera.type} camera")
    for instance in scene.instances:
        material = scene.materials[instance.material]
        normals = "smooth" if instance.smooth else "flat"
        say(
            f"  {instance.source.name or 'mesh':<20} {instance.faces:>9} faces  {normals:<7} "
            f"{instance.material} ({material.type})"
        )
        for own in instance.source.materials:
            say(f"    {_described(own)}")
    findings = examine(scene)
    if features_of(findings).octree:
        stats = Octree.from_mesh(pack(scene)[0], split=options.split).stats
        say(
            f"octree ({options.split}): {stats.nodes} nodes, {stats.leaves} leaves, depth {stats.depth}, "
            f"{stats.references} references in {stats.blocks} blocks ({stats.fill:.0%} full), "
            f"{stats.bytes / 1e6:.1f} MB"
        )
    for feature, value, reason in findings:
        say(f"  {feature.replace('_', ' '):<16} {'needed' if value else 'left out'}: {reason}")


def _described(material: MeshMaterial) -> str:
    """A material of a mesh file and its textures, in a line."""
    images = ", ".join(
        f"{field.removesuffix('_texture')} {texture.image.size[0]} x {texture.image.size[1]}"
        for field, texture in material.textures.items()
    )
    color = " ".join(f"{share:.3g}" for share in material.base_color)
    return f"{material.name or 'material'}: colour {color}, alpha {material.alpha_mode}; textures: {images or 'none'}"
