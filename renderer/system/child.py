"""Child Python processes that import packages from the same places as this one.

``python -c`` and ``python -m`` put the current folder first on the path: a file ``renderer.py`` or ``numpy.py`` beside
a downloaded scene would be executed. A child runs this file by its path, without that folder, and loads the same
packages as its parent.
"""

import os
import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

_OUR_PACKAGES = ("renderer", "validation")


def command(target: str, *arguments: str) -> list[str]:
    """The command of a process that calls ``target``, such as "renderer.cli.main:main", with string arguments."""
    return [sys.executable, "-P", str(Path(__file__).resolve()), target, *arguments]


def environment(**more: str) -> dict[str, str]:
    """This process's environment for a child, without relative import paths."""
    own = {**os.environ, **more}
    if "PYTHONPATH" in own:
        absolute = [entry for entry in own["PYTHONPATH"].split(os.pathsep) if os.path.isabs(entry)]
        own["PYTHONPATH"] = os.pathsep.join(absolute)
    return own


def _call(target: str, *arguments: str) -> object:
    """In the child: load our packages from the folder of this file's package, and call the target."""
    home = Path(__file__).resolve().parents[2]
    for name in _OUR_PACKAGES:
        if name not in sys.modules and (home / name).is_dir():
            load_package(name, home / name)
    module, _, function = target.partition(":")
    return getattr(import_module(module), function)(*arguments)


def load_package(name: str, folder: Path) -> None:
    """Import the package in ``folder`` as ``name``, whatever the import path has under that name."""
    spec = spec_from_file_location(name, folder / "__init__.py", submodule_search_locations=[str(folder)])
    assert spec is not None and spec.loader is not None  # the file is there
    module = module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)


if __name__ == "__main__":
    _call(*sys.argv[1:])
