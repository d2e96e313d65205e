"""``python -m renderer.trimesh_ray [--proximity] script.py ...``: run a script whose trimesh asks the octree."""

import os
import sys
import types

from renderer.trimesh_ray.install import install

_USAGE = "usage: python -m renderer.trimesh_ray [--proximity] script.py [arguments of the script]"
_HELP = f"""{_USAGE}

Run a script with renderer.trimesh_ray installed: its trimesh then uses the octree.

  --proximity  for nearest points and signed distances too"""


def main() -> None:
    """Run the script as ``python script.py ...`` would. Processes that it starts have nothing installed."""
    arguments = sys.argv[1:]
    proximity = arguments[:1] == ["--proximity"]
    given = arguments[proximity:]
    if given[:1] in (["-h"], ["--help"]):
        print(_HELP)
        return
    if not given or not os.path.isfile(given[0]):
        got = given[0] if given else "nothing"
        sys.exit(f"{_USAGE}\npython -m renderer.trimesh_ray: error: script: expected a file, got {got}")
    install(proximity)
    script = os.path.abspath(given[0])
    sys.argv = given
    if not sys.flags.safe_path:
        sys.path[0] = os.path.dirname(os.path.realpath(script))
    with open(script, "rb") as file:
        code = compile(file.read(), script, "exec")
    # It stays __main__ to the end, for threads and functions that run after the script.
    module = sys.modules["__main__"] = types.ModuleType("__main__")
    module.__file__ = script
    module.__dict__["__builtins__"] = __builtins__
    exec(code, module.__dict__)


if __name__ == "__main__":
    main()
