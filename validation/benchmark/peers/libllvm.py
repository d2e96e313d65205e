"""Search for a libLLVM that Dr.Jit can use. Older ones abort the process, so each is tried in a separate one."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from glob import glob

VARIABLE = "DRJIT_LIBLLVM_PATH"
# Dr.Jit 1 aborts with libLLVM 15 and 16; 19 is the oldest that was seen to work here.
OLDEST = 19
HOW = f"libLLVM >= {OLDEST}: Debian, Ubuntu: apt-get install libllvm19; macOS: brew install llvm; or set {VARIABLE}"
_PLACES = (
    "/usr/lib/*-linux-gnu/libLLVM*.so*", "/usr/lib/llvm-*/lib/libLLVM*.so*", "/usr/lib64/libLLVM*.so*",
    "/usr/lib64/llvm*/lib/libLLVM*.so*", "/usr/local/lib/libLLVM*.so*", "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
    "/usr/local/opt/llvm*/lib/libLLVM*.dylib",
)  # fmt: skip
_TRIAL = (
    "import mitsuba as mi; mi.set_variant('llvm_ad_rgb'); import drjit as dr; "
    "assert (dr.arange(mi.Float, 8) + 1).numpy().sum() == 36"
)


def usable() -> str | None:
    """Path of a libLLVM with which Mitsuba's ``llvm_ad_rgb`` was seen to work, or None."""
    return next((path for path in candidates() if _works(path)), None)


def candidates() -> Iterator[str]:
    """Only the path in ``DRJIT_LIBLLVM_PATH`` if it is set; else those in the usual places, newest first."""
    if VARIABLE in os.environ:
        yield os.environ[VARIABLE]
        return
    found = {os.path.realpath(path): path for place in _PLACES for path in glob(place)}
    versions = sorted(((version(path), path) for path in found.values()), reverse=True)
    yield from (path for number, path in versions if number >= OLDEST)


def version(path: str) -> int:
    """Major version in a library's name or folder, 0 without one.

    >>> version("/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1"), version("/usr/lib/llvm-14/lib/libLLVM.so")
    (19, 14)
    """
    found = re.search(r"(?:libLLVM(?:-|\.so\.)|llvm[-@]?)(\d+)", os.path.realpath(path)) or re.search(
        r"(?:libLLVM(?:-|\.so\.)|llvm[-@]?)(\d+)", path
    )
    return int(found.group(1)) if found else 0


def _works(path: str) -> bool:
    environment = os.environ | {VARIABLE: path}
    # Loading takes a second; a minute allows for a busy machine.
    command = [sys.executable, "-P", "-c", _TRIAL]
    return subprocess.run(command, env=environment, capture_output=True, timeout=60, check=False).returncode == 0
