"""``python -m renderer.trimesh_ray [--proximity] script.py ...``: run a script whose trimesh asks the octree."""

import argparse
import runpy
import sys
from pathlib import Path

from renderer.trimesh_ray.install import install


def main() -> None:
    """Run the script as ``python script.py ...`` would."""
    parser = argparse.ArgumentParser(prog="python -m renderer.trimesh_ray", description=__doc__)
    parser.add_argument("--proximity", action="store_true", help="nearest points and signed distances too")
    parser.add_argument("script", type=Path)
    parser.add_argument("arguments", nargs=argparse.REMAINDER, help="the script's own")
    options = parser.parse_args()
    if not options.script.is_file():
        parser.error(f"script: expected a file, got {options.script}")
    install(proximity=options.proximity)
    sys.argv = [str(options.script), *options.arguments]
    sys.path[0] = str(options.script.resolve().parent)
    runpy.run_path(str(options.script), run_name="__main__")


if __name__ == "__main__":
    main()
