"""Where and with what a run was made, so that a reader can make it again."""

import os
import platform
from importlib.metadata import PackageNotFoundError, version

from renderer.parallel import available_threads

PACKAGES = (
    "octree-renderer", "numpy", "numba", "llvmlite", "embreex", "mitsuba", "drjit", "trimesh", "scikit-image",
)  # fmt: skip


def describe() -> dict[str, object]:
    """Versions, processor and threads, ready for JSON."""
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "processor": _processor(),
        "processors": os.cpu_count(),
        "threads": available_threads(),
        "packages": {name: _version(name) for name in PACKAGES},
    }


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
