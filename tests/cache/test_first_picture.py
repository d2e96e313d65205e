"""A first picture: what a second process compiles beside the command's own."""

import re
import shutil
import sys
from contextlib import suppress
from pathlib import Path
from time import perf_counter

import pytest
from planted import console, executed, planted, run

from renderer import precompile
from renderer.shade.tile import render_tile

ROOT = Path(__file__).parents[2]
# Kernels that a first picture compiles beside and in the command's own process; each takes seconds.
COMPILED_AGAIN = ("renderer.shade.tile.", "renderer.tree.subtree.")


@pytest.mark.skipif(precompile.available_threads() < 2, reason="with one processor there is no second process")
def test_a_first_picture_executes_nothing_that_lies_in_the_current_folder(tmp_path):
    """Without kernels of either process, so that a second one compiles beside; it imported renderer.py from here."""
    folder, scene = planted(tmp_path), str(ROOT / "scenes" / "stairs.toml")
    cache, warm = tmp_path / "cache", Path(render_tile.store.cache_path)
    asked = "from renderer.shade.tile import render_tile; print(render_tile.store.cache_path)"
    kernels = Path(run([sys.executable, "-P", "-c", asked], folder, NUMBA_CACHE_DIR=str(cache)).stdout.strip())
    # All others are there, whatever ran before: some of them are compiled for two kinds of arguments.
    precompile.compile_ahead("pictures")
    found = {path.name for path in warm.glob("*.kernel") if not path.name.startswith(COMPILED_AGAIN)}
    for name in found:
        with suppress(FileNotFoundError):  # of older sources, removed by another test meanwhile
            shutil.copy(warm / name, kernels)
    command, began = [console("octree-render"), "render", scene, "-o", "out.png", "--resolution", "8x8"], perf_counter()
    done = run(command, folder, NUMBA_CACHE_DIR=str(cache))
    assert done.returncode == 0, done.stderr
    # 38 s of compiling were once reported as rendering. They are most of a command's time; 64 pixels take milliseconds.
    rendering, building = re.search(r"rays in ([\d.]+) s .* ready in ([\d.]+) s", done.stdout + done.stderr).groups()
    assert float(rendering) + float(building) < (perf_counter() - began) / 2
    assert "ended with exit code" not in done.stderr and executed(folder) == ""
    # Each kernel once, where this process looks for it.
    names = [path.name.split("-")[0] for path in kernels.glob("*.kernel") if path.name not in found]
    assert {name.rpartition(".")[2] for name in names} >= {"render_tile", "build_subtree"}
    assert len(names) == len(set(names))
