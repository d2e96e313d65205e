"""The files of a study: those that can be written, the camera and size of a picture, and what each suffix has."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from renderer.errors import expect

FORMATS = (".npy", ".ply", ".png")
KINDS = {"sky": "sky view factor", "sun": "hours of sun", "ao": "ambient occlusion"}
# The size of a picture with its legend.
_USUAL = 960, 720


class Layout(NamedTuple):
    """The camera of a picture, if one is given, its width and height in pixels, and the rows of the legend below."""

    camera: Any
    size: tuple[int, int]
    legend_rows: int


def check_outputs(outputs: Sequence[Path], read: Sequence[str | Path]) -> None:
    """Refuse outputs that cannot be written, and those that are one file or an input."""
    from renderer.system.files import are_apart, check_writable

    for output in outputs:
        expect(are_apart([output], read), "--output", "a file that is not an input", str(output))
    expect(are_apart(outputs), "--output", "each file once", ", ".join(map(str, outputs)))
    for output in outputs:
        expect(output.parent.is_dir(), "--output", "a path in an existing folder", str(output))
        check_writable(output)


def layout_of(options: argparse.Namespace) -> Layout:
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


def write(
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
        picture = drawing.draw(image, mesh, seen, KINDS[options.kind], layout.legend_rows, UP_AXES[up])
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
