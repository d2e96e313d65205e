"""The command ``octree-validate``: the validation suite that was installed beside this package, and no other.

The suite is a package called ``validation``, and a folder of the user's may have the same name. This command finds the
suite by its place, whatever the current folder or the path holds, and reports an error where the name is taken.
"""

import sys
from importlib import import_module
from pathlib import Path

from renderer.errors import extra_hint
from renderer.system.child import load_package

_SUITE = Path(__file__).resolve().parents[2] / "validation"


def main() -> int:
    """Run ``octree-validate``; returns the suite's exit code, or 2 where it is not there."""
    fault = _fault()
    if fault:
        print(f"octree-validate: {fault}", file=sys.stderr)
        return 2
    if "validation" not in sys.modules:
        load_package("validation", _SUITE)
    code: int = import_module("validation.__main__").main()
    return code


def _fault() -> str:
    """The reason why the suite cannot be loaded, or an empty string."""
    if not (_SUITE / "suite.py").is_file():
        hint = extra_hint("validate")
        return f"expected the validation suite in {_SUITE}, got another package of that name or none; {hint}"
    loaded = sys.modules.get("validation")
    found = Path(getattr(loaded, "__file__", None) or ".").resolve().parent
    if loaded is not None and found != _SUITE:
        return f"expected the validation suite of {_SUITE}, got a package validation from {found}, imported before"
    return ""


if __name__ == "__main__":
    sys.exit(main())
