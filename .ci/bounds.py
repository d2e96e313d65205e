#!/usr/bin/env python3
"""Try the project with the exact lower bounds of pyproject.toml, or with the newest release of everything.

    python .ci/bounds.py lowest | newest

Installs it with its extras into a new virtual environment in a temporary folder and asks it for hits, a picture, a
served page and a part of the validation suite. Takes some minutes, most of them for pip.
"""

import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EXTRAS = ("validate", "exr", "viewer")
SMOKE = """
import numpy as np
from renderer import Octree, load_mesh, load_scene, render, view
octree = Octree.from_mesh(load_mesh("scenes/models/teapot.ply"))
hits = octree.closest_hit(np.tile([0.0, 1.0, 9.0], (40, 1)), np.tile([0.0, 0.0, -1.0], (40, 1)))
image = render(load_scene("scenes/glass.toml"), resolution=(40, 30))
for kind in ("png", "exr", "npy"):
    image.save(f"{folder}/picture.{kind}")
with view(load_scene("scenes/stairs.toml"), browser=False) as viewing:
    assert viewing.url.startswith("http://127.0.0.1:")
print("smoke:", hits.t[0], image.radiance.mean())
"""


def main(kind: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = project["dependencies"] + [one for name in EXTRAS for one in project["optional-dependencies"][name]]
    if kind == "lowest":
        asked = [re.sub(r">=", "==", one) for one in asked]
    with tempfile.TemporaryDirectory(prefix="bounds-") as folder:
        venv.create(folder, with_pip=True)
        python = [str(Path(folder) / "bin" / "python")]
        run([*python, "-m", "pip", "install", "--quiet", "--quiet", "--upgrade", *asked])
        run([*python, "-m", "pip", "install", "--quiet", "--no-deps", str(ROOT)])
        run([*python, "-m", "pip", "list", "--format", "freeze"])
        run([*python, "-P", "-c", f"folder = {folder!r}\n{SMOKE}"])
        given = ["--scene", "scenes/glass.toml", "--mesh", "scenes/models/teapot.ply"]
        run([f"{folder}/bin/octree-validate", "--quick", *given, "--output", f"{folder}/report"])


def run(command: list[str]) -> None:
    print("+", " ".join(command)[:300], flush=True)
    subprocess.run(command, cwd=ROOT, check=True)


if __name__ == "__main__":
    if sys.argv[1:] not in (["lowest"], ["newest"]):
        sys.exit(__doc__)
    main(sys.argv[1])
