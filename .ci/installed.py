#!/usr/bin/env python3
"""Try built files: each wheel or sdist is installed into a new virtual environment and asked for hits and a picture.

    python .ci/installed.py dist/octree_renderer-0.1.0-py3-none-any.whl ...

Everything runs in a temporary folder, so that nothing of a checkout is found. A minute a file, most of it for pip.
"""

import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

SMOKE = """
import numpy as np
import renderer
from renderer import Octree
from renderer.mesh.shapes import box
from renderer.studies import face_points, sky_view_factor
assert renderer.__file__.startswith(folder), renderer.__file__
octree = Octree.from_mesh(box())
hits = octree.closest_hit([0.5, 0.25, 9.0], [0.0, 0.0, -1.0])
assert hits.t == 8.0, hits.t
assert octree.contains([0.5, 0.5, 0.5]) and not octree.contains([0.5, 0.5, 1.5])
points, normals, faces = face_points(octree.mesh)
assert sky_view_factor(octree, points, normals, leaving=faces).max() == 1.0
print("smoke:", renderer.__version__, "on", sys.version.split()[0], sys.platform)
"""
STL = (
    "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n"
)


def main(files: list[str]) -> None:
    for file in map(Path, files):
        with tempfile.TemporaryDirectory(prefix="installed-") as name:
            attempt(file.resolve(strict=True), Path(name).resolve())


def attempt(file: Path, folder: Path) -> None:
    venv.create(folder / "venv", with_pip=True)
    programs = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
    run(folder, [programs / "python", "-m", "pip", "install", "--quiet", file])
    run(folder, [programs / "python", "-c", f"import sys\nfolder = {str(folder)!r}\n{SMOKE}"])
    (folder / "one.stl").write_text(STL)
    run(folder, [programs / "octree-render", "render", "one.stl", "-o", "one.png", "--resolution", "32x24"])
    assert (folder / "one.png").stat().st_size > 100


def run(folder: Path, command: list[str | Path]) -> None:
    print("+", *(str(part).partition("\n")[0] for part in command), flush=True)
    subprocess.run(command, cwd=folder, check=True)


if __name__ == "__main__":
    if not sys.argv[1:]:
        sys.exit(__doc__)
    main(sys.argv[1:])
