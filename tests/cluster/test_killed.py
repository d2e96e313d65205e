"""Runs whose workers, scheduler or own process are killed end with the bytes of one that nobody disturbed."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from watched import Watched

from renderer import Octree, Scene, load_scene, render
from renderer.checkpoints.study import Study
from renderer.cli.main import main
from renderer.cluster import connected, render_on, run_on
from renderer.mesh.load import save_ply
from renderer.studies.points import on_faces
from validation.benchmark.measures.meshes import named

pytestmark = pytest.mark.judges(
    "cluster.connected", "cluster.render_on", "cluster.run_on", "octree-render render --cluster",
    "octree-render study --cluster",
)  # fmt: skip


GLASS: dict[str, Any] = {"resolution": (80, 60), "samples": 16}
# Longer than any wait here; it ends a test that would hang.
PATIENCE = 60.0
# The command with small parts. Once there are so many, each part that is written takes until it is killed.
COMMAND = """
import sys, time
from renderer.cluster.studies import run_on
from renderer.checkpoints import parts, pictures
if __name__ == "__main__":
    most, own = int(sys.argv[1]), parts.Parts.write
    run_on.__kwdefaults__["size"], pictures.RAYS = 64, 80 * 16 * 8
    def write(self, *part):
        own(self, *part)
        while len(list(self.folder.glob("*.part"))) >= most: time.sleep(0.05)
    parts.Parts.write = write
    from renderer.cli.main import main
    sys.argv[1:2] = []
    sys.exit(main())
"""

# The command with small parts, whose workers are killed once, when the second part is there.
KILLING = """
import multiprocessing, sys
from renderer.checkpoints import parts, pictures
if __name__ == "__main__":
    pictures.RAYS, own, killed = 80 * 16 * 8, parts.Parts.write, []
    def write(self, *part):
        own(self, *part)
        if not killed and len(list(self.folder.glob("*.part"))) >= 2:
            killed.extend(multiprocessing.active_children())
            for worker in killed: worker.kill()
            print("killed", len(killed))
    parts.Parts.write = write
    from renderer.cli.main import main
    sys.exit(main())
"""


@pytest.fixture(scope="module")
def glass() -> Scene:
    return load_scene("scenes/glass.toml")


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("killed") / "city.ply"
    save_ply(named("city_300"), path)
    return path


def wait_for(there: Callable[[], bool], child: subprocess.Popen[Any] | None = None) -> None:
    """Wait until something is so, while a process lives."""
    end = time.monotonic() + PATIENCE
    while not there():
        assert time.monotonic() < end and (child is None or child.poll() is None)
        time.sleep(0.01)


@contextmanager
def process(*arguments: str, **options: Any) -> Iterator[subprocess.Popen[Any]]:
    child = subprocess.Popen([sys.executable, *arguments], text=True, **options)
    try:
        yield child
    finally:
        child.kill()
        child.communicate()


def test_a_command_that_is_killed_twice_ends_with_the_bytes_of_one_that_was_not(tmp_path: Path) -> None:
    """A picture; a study goes on by the same loop, and does so below under a scheduler that is killed."""
    result, undisturbed = tmp_path / "a.npy", tmp_path / "b.npy"
    command = ["render", "scenes/glass.toml", "--resolution", "80x60", "--samples", "16"]
    (tmp_path / "command.py").write_text(COMMAND)
    told, parts = [*command, "-o", str(result), "--cluster", "local", "--threads", "1", "--quiet"], result.parent
    for most in (2, 4):
        with process(str(tmp_path / "command.py"), str(most), *told, stderr=subprocess.DEVNULL) as child:
            wait_for(lambda least=most: len(list(parts.glob("*.parts/*.part"))) >= least, child)
            child.send_signal(signal.SIGKILL)
        assert not result.exists() and len(list(parts.glob("*.parts/*.part"))) == most
    kept = {path: path.stat().st_ino for path in parts.glob("*.parts/*.part")}
    with process(str(tmp_path / "command.py"), "9999", *told) as child:
        wait_for(lambda: any(path.name not in {p.name for p in kept} for path in parts.glob("*.parts/*.part")), child)
        assert {path: path.stat().st_ino for path in kept} == kept
        assert child.wait(PATIENCE) == 0
    assert main([*command, "-o", str(undisturbed), "--quiet"]) == 0
    assert result.read_bytes() == undisturbed.read_bytes()
    assert {path.name for path in tmp_path.iterdir()} == {"a.npy", "b.npy", "command.py"}


def test_the_only_worker_is_killed_and_nothing_is_said(tmp_path: Path) -> None:
    """What the worker was sent dies with it: it is sent again, and no log of Dask's stands on the terminal."""
    (tmp_path / "command.py").write_text(KILLING)
    command = ["render", "scenes/glass.toml", "--resolution", "80x60", "--samples", "16", "-o"]
    told = [*command, str(tmp_path / "a.npy"), "--cluster", "--threads", "1"]
    with process(str(tmp_path / "command.py"), *told, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
        said, wrong = child.communicate(timeout=PATIENCE)
    assert child.returncode == 0 and wrong == "" and "killed 1" in said
    assert main([*command, str(tmp_path / "b.npy"), "--quiet"]) == 0
    assert (tmp_path / "a.npy").read_bytes() == (tmp_path / "b.npy").read_bytes()


@contextmanager
def scheduler(port: int) -> Iterator[subprocess.Popen[Any]]:
    arguments = ("--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    with process("-m", "distributed.cli.dask_scheduler", *arguments, stderr=subprocess.DEVNULL) as child:
        wait_for(lambda: answers(port), child)
        yield child


def worker(port: int) -> Any:
    arguments = (f"tcp://127.0.0.1:{port}", "--nthreads", "1", "--no-nanny", "--no-dashboard")
    return process("-m", "distributed.cli.dask_worker", *arguments, stderr=subprocess.DEVNULL)


def answers(port: int) -> bool:
    with socket.socket() as asking:
        return asking.connect_ex(("127.0.0.1", port)) == 0


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def test_a_scheduler_that_is_killed_is_told_and_another_goes_on_from_the_manifest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(import_module("renderer.cluster.clients"), "SECONDS", 1.0)
    octree, folder, port = Octree.from_mesh(named("city_300")), tmp_path / "parts", free_port()
    points, study = on_faces(octree).points, Study("sky", {"patches": 1000})
    with ExitStack() as first:
        child = first.enter_context(scheduler(port))
        first.enter_context(worker(port))
        client = first.enter_context(connected(f"tcp://127.0.0.1:{port}"))
        wait_for(lambda: bool(client.nthreads()))

        def kill(name: str) -> None:
            if len(list(folder.glob("*.part"))) >= 2:
                child.kill()

        with pytest.raises(OSError, match=rf"the scheduler at tcp://127.0.0.1:{port} does not answer, for 1.0 seconds"):
            run_on(Watched(client, kill), octree, study, points, folder, size=32)
    kept = {path: path.stat().st_mtime_ns for path in folder.glob("*.part")}
    assert len(kept) >= 2
    with scheduler(port), worker(port), connected(f"tcp://127.0.0.1:{port}") as client:
        wait_for(lambda: bool(client.nthreads()))
        parts = run_on(client, octree, study, points, folder, size=32)
    assert {path: path.stat().st_mtime_ns for path in kept} == kept and parts.plan.parts > len(kept)
    assert parts.joined().tobytes() == study.evaluate(octree, points).tobytes()


def is_there(group: int) -> bool:
    """Whether any process of a group is there."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_ctrl_c_ends_a_command_and_its_workers_with_one_line(city: Path, tmp_path: Path) -> None:
    """Sent to all processes of the group, as a terminal does."""
    (tmp_path / "command.py").write_text(COMMAND)
    told = ["study", "ao", str(city), "--samples", "16", "-o", str(tmp_path / "a.npy"), "--cluster", "--threads", "1"]
    with process(str(tmp_path / "command.py"), "2", *told, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                 start_new_session=True) as child:  # fmt: skip
        wait_for(lambda: len(list(tmp_path.glob("a.npy.parts/*.part"))) >= 2, child)
        os.killpg(child.pid, signal.SIGINT)
        said, wrong = child.communicate(timeout=PATIENCE)
    assert child.returncode == 130 and wrong.startswith("octree-render: interrupted; ") and wrong.count("\n") == 1
    assert str(tmp_path / "a.npy.parts") in wrong
    assert said.startswith("dashboard: http://127.0.0.1:") and said.count("\n") == 1
    wait_for(lambda: not is_there(child.pid))


def test_a_worker_that_comes_late_is_waited_for_and_none_is_an_error(
    glass: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from distributed import Client, LocalCluster

    monkeypatch.setattr(import_module("renderer.cluster.clients"), "SECONDS", 0.3)
    with (
        LocalCluster(n_workers=0, processes=False, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        with pytest.raises(OSError, match=r"the scheduler at \S+ has no worker, for 0\.3 seconds"):
            render_on(client, glass, tmp_path / "parts", **GLASS)
        monkeypatch.setattr(import_module("renderer.cluster.clients"), "SECONDS", PATIENCE)
        threading.Timer(0.5, lambda: cluster.scale(1)).start()
        image = render_on(client, glass, tmp_path / "parts", **GLASS).image()
    assert image.radiance.tobytes() == render(glass, **GLASS).radiance.tobytes()
