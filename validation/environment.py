"""The environment of a run: versions, processor and a digest of the sources, so that a reader can repeat it."""

import hashlib
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from renderer.system.threads import available_threads

PACKAGES = (
    "octree-renderer", "numpy", "numba", "llvmlite", "embreex", "libigl", "mitsuba", "drjit", "trimesh", "rtree",
    "scikit-image", "flip-evaluator", "OpenEXR", "matplotlib",
)  # fmt: skip
_ROOT = Path(__file__).resolve().parent.parent


def describe() -> dict[str, object]:
    """Versions, processor, threads and the digest of the sources, ready for JSON."""
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "processor": _processor(),
        "processors": os.cpu_count(),
        "threads": available_threads(),
        "packages": {name: _version(name) for name in PACKAGES},
        "sources": sources_sha256(),
    }


def sources_sha256() -> str:
    """SHA-256 over names and texts of all sources of ``renderer`` and ``validation``: changes when any of them does."""
    digest = hashlib.sha256()
    for path in sorted([*_ROOT.glob("renderer/**/*.py"), *_ROOT.glob("validation/**/*.py")]):
        text = path.read_bytes()
        digest.update(f"{path.relative_to(_ROOT).as_posix()} {len(text)}\n".encode() + text)
    return digest.hexdigest()


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
