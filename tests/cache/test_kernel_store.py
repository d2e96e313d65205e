"""Compiled kernels on disk: an edit below a kernel compiles it anew; no state of the disk stops or misleads a run."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import llvmlite.binding as llvm
import pytest
from cases import cases
from kernel_package import COMPILED, LOADED, MIDDLE, RUN, UPPER, bottom_of, run, start, write_package

from renderer.jit.cache import _user_cache, _versions, runnable_levels
from renderer.jit.levels import AHEAD_VARIABLE, FEATURES, LEVELS, lacking

TELL = """
import logging, sys
logging.basicConfig(level=logging.INFO, stream=sys.stdout, format="%(message)s")
"""


@pytest.fixture
def package(tmp_path):
    return write_package(tmp_path)


@pytest.fixture
def kernels(package):
    """The folder of kernels of the small package, which are compiled there."""
    assert run(package) == COMPILED
    return package / "__pycache__"


def stored(folder):
    return sorted(folder.glob("*.kernel"))


def test_an_edit_below_a_kernel_shows_and_an_edit_beside_it_keeps_the_cache(package):
    assert run(package) == COMPILED
    assert run(package) == LOADED
    (package / "below" / "deep" / "aside.py").write_text("STEP = 11\n")
    assert run(package) == LOADED
    bottom_of(package).write_text("STEP = 20\n")
    assert run(package) == ["27", "0", "1"]
    (package / "middle.py").write_text(MIDDLE.replace("2 * x", "5 * x"))
    assert run(package) == ["36", "0", "1"]
    (package / "upper.py").write_text(UPPER.replace("+ 1", "+ 2"))
    assert run(package) == ["37", "0", "1"]
    assert run(package) == ["37", "1", "0"]


@pytest.mark.parametrize("pretend", ["import llvmlite\nllvmlite.__version__ = '99.0'\n", "import numba\n"
                         "numba.__version__ = '0.68.99'\n"])  # fmt: skip
def test_another_compiler_version_shows(package, pretend):
    assert run(package) == COMPILED
    assert run(package, pretend + RUN) == COMPILED
    assert run(package, pretend + RUN) == LOADED
    # And does not take what it made from the first one, which may be used in turn.
    assert run(package) == LOADED


def test_another_processor_shows(package):
    assert run(package) == COMPILED
    generic = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    assert run(package, **generic) == COMPILED
    assert run(package, **generic) == LOADED
    assert run(package) == LOADED


def test_a_kernel_of_another_package_is_kept_too_and_follows_ours(package):
    # By an import that the digest need not follow: it covers all of ours.
    ours = "from renderer.middle import (\n    doubled,\n)"
    mine = UPPER.replace(ours, "import renderer.middle as m\ndoubled = m.doubled")
    assert mine != UPPER
    (package.parent / "mine.py").write_text(mine)
    script = RUN.replace("renderer.upper", "mine")
    assert run(package, script) == COMPILED
    assert run(package, script) == LOADED
    bottom_of(package).write_text("STEP = 20\n")
    assert run(package, script) == ["27", "0", "1"]


def test_code_of_older_sources_is_removed_and_never_used(package, kernels):
    old = {path.name: path.read_bytes() for path in stored(kernels)}
    bottom_of(package).write_text("STEP = 20\n")
    assert run(package) == ["27", "0", "1"]
    new = stored(kernels)
    assert len(new) == 1 and new[0].name not in old
    # As a process of older sources may write it meanwhile; even under the new name.
    new[0].write_bytes(next(iter(old.values())))
    assert run(package) == ["27", "0", "1"]
    assert run(package) == ["27", "1", "0"]


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: b"",
        lambda content: content[:10],
        lambda content: content[: len(content) // 2],
        lambda content: content[:-1],
        lambda content: content[:2000] + bytes([content[2000] ^ 1]) + content[2001:],
        lambda content: b"x" + content,
    ],
    ids=["empty", "head only", "half", "one byte short", "a bit flipped", "another header"],
)
def test_a_damaged_file_is_said_once_and_made_anew(package, kernels, damage):
    (path,) = stored(kernels)
    path.write_bytes(damage(path.read_bytes()))
    done = start(package)
    assert done.stdout.split() == COMPILED
    assert done.stderr.count("a compiled kernel is damaged and is compiled anew") == 1
    assert run(package) == LOADED


def test_a_stored_kernel_is_read_without_the_modules_of_its_pieces(package):
    # Numba's module imports SciPy. A forked process has it already.
    middle = MIDDLE.replace("return 2 * x", "return (2 * x if x < np.finfo(np.float64).max else 0)")
    (package / "middle.py").write_text(f"import numpy as np\n{middle}")
    script, alone = f"{RUN}import sys; print('numba.np.arraymath' in sys.modules)", {"NUMBA_DISABLE_JIT": "0"}
    assert run(package, script, **alone) == [*COMPILED, "True"]
    assert run(package, script, **alone) == [*LOADED, "False"]


def test_a_stored_kernel_prints_what_a_kernel_that_it_calls_prints(package):
    (package / "middle.py").write_text(MIDDLE.replace("    return", "    print(x)\n    return"))
    assert run(package) == ["3", *COMPILED]
    assert run(package) == ["3", *LOADED]


def test_a_stored_kernel_that_cannot_be_rebuilt_is_made_anew(package, kernels):
    broken = "from numba.core.compiler import CompileResult\ndef no(*a): raise AttributeError('gone')\n"
    done = start(package, f"{broken}sound = CompileResult._rebuild\nCompileResult._rebuild = no\n{RUN}")
    assert done.stdout.split() == COMPILED and "damaged" in done.stderr and "gone" in done.stderr


def test_a_folder_that_cannot_be_written_falls_back_to_the_users_own(package, tmp_path):
    (package / "__pycache__").write_text("a file in the way, because root may write anywhere")
    users = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    assert run(package, **users) == COMPILED
    assert run(package, **users) == LOADED
    assert stored(next((tmp_path / "cache" / "octree-renderer").iterdir()))
    bottom_of(package).write_text("STEP = 20\n")
    assert run(package, **users) == ["27", "0", "1"]
    (tmp_path / "blocked").touch()
    nowhere = {"XDG_CACHE_HOME": str(tmp_path / "blocked")}
    for _ in range(2):
        assert " ".join(run(package, TELL + RUN, **nowhere)) == (
            "renderer: compiling kernels, which can take a minute (for this process only: no cache folder can be "
            "written) compiling answer (for this process only: no cache folder can be written) 27 0 1"
        )


# The folder is there and may be read; whatever writes to it fails as on a read-only file system.
READ_ONLY = """
import errno, os, tempfile
def refuse(*a, **k): raise OSError(errno.EROFS, "Read-only file system")
tempfile.TemporaryFile = os.mkdir = refuse
"""


@pytest.mark.parametrize("own", ["in the tree", "NUMBA_CACHE_DIR"])
def test_what_cannot_be_written_is_still_read(package, tmp_path, own):
    """A read-only install, as a container has it, with a home of its own and without one."""
    chosen = {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")} if own == "NUMBA_CACHE_DIR" else {}
    assert run(package, **chosen) == COMPILED
    for home in ({"XDG_CACHE_HOME": str(tmp_path / "fresh")}, {"XDG_CACHE_HOME": "", "HOME": "/dev/null/none"}):
        assert run(package, READ_ONLY + RUN, **chosen, **home) == LOADED


def test_without_a_home_kernels_are_compiled(package, tmp_path):
    (package / "__pycache__").touch()
    script = "import os\nos.environ.pop('HOME', None)\nimport pathlib\n"
    script += "def no(*a): raise RuntimeError('Could not determine home directory.')\npathlib.Path.home = no\n"
    assert run(package, script + RUN, XDG_CACHE_HOME="") == COMPILED


def test_a_full_disk_stops_nothing_and_is_said_once(package):
    full = """
import errno, renderer.jit.cache as store
def refuse(path, write): raise OSError(errno.ENOSPC, "No space left on device")
store.write_atomically = refuse
from renderer.middle import doubled
assert doubled(3) == 16
"""
    done = start(package, full + RUN + "print(store.lost())\n")
    assert done.stdout.split() == [*COMPILED, "2"]
    said = [line for line in done.stderr.splitlines() if "cannot be kept" in line]
    assert len(said) == 1 and said[0].endswith("No space left on device") and "__pycache__" in said[0]


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ("", 1),
        ("import logging\nlogging.getLogger('renderer').setLevel('ERROR')\n", 0),
        ("import os\nos.environ['OCTREE_RENDERER_QUIET'] = '1'\n", 0),
        ("import os\nos.environ['OCTREE_RENDERER_QUIET'] = '0'\n", 1),
    ],
    ids=["as it comes", "logging", "environment", "environment 0"],
)
def test_the_first_compiling_is_said_on_one_line_that_can_be_turned_off(package, how, told):
    done = start(package, how + "from renderer.middle import doubled\nassert doubled(3) == 16\n" + RUN)
    assert done.stdout.split() == COMPILED
    assert len(done.stderr.splitlines()) == done.stderr.count("renderer: compiling kernels") == told


# Says when it links, which lasts until a line comes, and when it waits for another process.
SAY = """
import sys, time
from renderer.jit import libraries, turns
sound, sleep = libraries.EntryLibrary.finalize, time.sleep
def finalize(library):
    print("links", flush=True)
    sys.stdin.readline()
    sound(library)
def say(seconds):
    print("waits", flush=True)
    sleep(seconds)
libraries.EntryLibrary.finalize, time.sleep = finalize, say
"""


def _says(package, script=""):
    own = {**os.environ, "NUMBA_CACHE_DIR": "", "PYTHONPATH": str(package.parent)}
    command = [sys.executable, "-B", "-P", "-c", SAY + script + RUN]
    return subprocess.Popen(command, env=own, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


@pytest.mark.skipif(sys.platform == "win32", reason="there nobody waits")
@pytest.mark.parametrize("how", ["ends", "is killed", "stands still"])
def test_who_needs_a_kernel_that_another_process_compiles_waits_for_it(package, how):
    with _says(package) as first:
        assert first.stdout.readline() == "links\n"
        with _says(package, "turns._LONGEST = 0.1\n" if how == "stands still" else "") as second:
            assert second.stdout.readline() == "waits\n"
            if how == "is killed":
                first.kill()
            elif how == "ends":
                assert first.communicate("\n", timeout=300)[0].split() == COMPILED
            out, _ = second.communicate("\n", timeout=300)
            assert out.split()[-3] == "17" and ("links" in out) == (how != "ends")
        if how == "stands still":
            assert first.communicate("\n", timeout=300)[0].split() == COMPILED
    assert run(package) == LOADED


@cases(
    ("lacks", "triple", "levels"),
    [
        ((), "x86_64-unknown-linux-gnu", ("x86-64-v4", "x86-64-v3", "x86-64-v2")),
        (("avx512dq",), "x86_64-pc-windows-msvc", ("x86-64-v3", "x86-64-v2")),
        (("avx512f", "bmi2"), "x86_64-apple-darwin", ("x86-64-v2",)),
        (("ssse3",), "x86_64-unknown-linux-gnu", ()),
        ((), "aarch64-unknown-linux-gnu", ("aarch64",)),
        ((), "arm64-apple-darwin", ("aarch64",)),
    ],
)
def test_a_machine_runs_the_levels_whose_features_it_has(monkeypatch, lacks, triple, levels):
    features = {feature: feature not in lacks for needs in FEATURES.values() for feature in needs}
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: features)
    monkeypatch.setattr(llvm, "get_process_triple", lambda: triple)
    assert runnable_levels.__wrapped__() == levels


@cases(
    ("has", "level", "lacks"),
    [
        ("x86-64-v2", "x86-64-v2", []),
        ("x86-64-v2", "x86-64-v3", ["avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"]),
        ("x86-64-v3", "x86-64-v4", ["avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"]),
        ("x86-64-v4", "aarch64", ["neon"]),
    ],
)
def test_a_level_lacks_what_the_psabi_has_in_it_beyond_the_machine(monkeypatch, has, level, lacks):
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: dict.fromkeys(FEATURES[has], True))
    assert lacking(level) == lacks


@pytest.fixture(scope="module")
def ahead(tmp_path_factory):
    """The kernels of the package for a level that this machine runs, compiled once where another copy of it is."""
    level, place = runnable_levels()[-1], tmp_path_factory.mktemp("ahead")
    processor = {"NUMBA_CPU_NAME": LEVELS[level], "NUMBA_CPU_FEATURES": ""}
    assert run(write_package(place), NUMBA_CACHE_DIR=str(place / "made"), **processor) == COMPILED
    (folder,) = (place / "made").iterdir()
    return folder


class TestAhead:
    """Folders of kernels that were compiled for a level of processors, and are only read."""

    @pytest.fixture
    def folder(self, ahead, tmp_path):
        """A folder of its own with them, which no other folder has."""
        return shutil.copytree(ahead, tmp_path / "made" / ahead.name)

    def test_they_are_found_where_the_environment_names_them(self, package, folder, tmp_path):
        assert run(package, OCTREE_RENDERER_KERNELS=f"{tmp_path / 'none'}{os.pathsep}{folder}") == LOADED
        assert run(package) == COMPILED

    @pytest.mark.parametrize("place", ["none", "empty"])
    def test_a_folder_without_any_is_named_once(self, package, folder, tmp_path, place):
        (tmp_path / "empty").mkdir()
        look = "from renderer.jit.cache import ahead_folders as look\nfor _ in range(2): look()\n"
        named = {AHEAD_VARIABLE: f"{folder}{os.pathsep}{tmp_path / place}"}
        (said,) = start(package, look, **named).stderr.splitlines()
        assert AHEAD_VARIABLE in said and str(tmp_path / place) in said and str(folder) not in said

    def test_a_package_may_carry_them(self, package, folder):
        folder.rename(package / "compiled")
        assert run(package) == LOADED

    @pytest.mark.judges("octree-render compile")
    def test_they_are_not_used_for_other_sources(self, package, folder):
        before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.iterdir()}
        bottom_of(package).write_text("STEP = 20\n")
        assert run(package, OCTREE_RENDERER_KERNELS=str(folder)) == ["27", "0", "1"]
        # What a run compiles goes elsewhere.
        assert {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in folder.iterdir()} == before

    def test_they_are_not_used_by_a_machine_that_lacks_the_level(self, package, folder):
        pretend = "import renderer.jit.cache as store\nstore.runnable_levels = tuple\n"
        assert run(package, pretend + RUN, OCTREE_RENDERER_KERNELS=str(folder)) == COMPILED


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_pipe_in_the_place_of_a_kernel_is_not_waited_for(package):
    assert run(package) == COMPILED
    (path,) = (package / "__pycache__").glob("*.kernel")
    path.unlink()
    os.mkfifo(path)
    assert run(package) == COMPILED


@pytest.mark.parametrize(
    ("system", "folder"), [("linux", ".cache"), ("darwin", "Library/Caches"), ("win32", "AppData/Local")]
)
def test_the_user_s_own_folder_is_where_each_system_has_it(monkeypatch, tmp_path, system, folder):
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    assert _user_cache() == tmp_path / folder


def test_kernels_of_one_python_are_not_those_of_another():
    assert sys.implementation.cache_tag and sys.implementation.cache_tag in _versions()
