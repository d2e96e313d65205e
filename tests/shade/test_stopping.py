"""Work that branches without end: it is cut where it must be, says so, stops at once, and has the same bits anyhow."""

import os
import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderer import (
    BruteForce,
    CutWarning,
    Image,
    PerspectiveCamera,
    Phong,
    PointLight,
    RenderSettings,
    Scene,
    SceneObject,
    load_scene,
    prepare,
    render,
)
from renderer.cli.main import main
from renderer.mesh.shapes import icosphere
from renderer.picture import camera_rays
from renderer.picture import prepare as prepared_scene
from renderer.trace.spawn import BOUNDED

pytestmark = pytest.mark.judges(
    "CutWarning", "PreparedScene.picture", "RenderSettings", "render", "scene.render.max_rays"
)


# Four half-mirrors one in another: a ray that meets one leaves two.
TEXT = """
[camera]
eye = [0, 0, 5]
target = [0, 0, 0]
[materials.half]
diffuse = 0.1
reflectance = 0.5
transmittance = 0.5
ior = 1.0
[[lights]]
type = "point"
position = [0, 0, 0]
intensity = 9
[render]
max_depth = 64
"""
OBJECT = '[[objects]]\nmesh = "ball.ply"\nmaterial = "half"\nscale = {}\n'


def half_mirrors(max_depth: int = 64) -> Scene:
    half = Phong(diffuse=0.1, reflectance=0.5, transmittance=0.5, ior=1.0)
    balls = tuple(SceneObject(mesh=icosphere(2), material="half", scale=(r, r, r)) for r in (1.0, 1.5, 2.0, 2.5))
    return Scene(
        camera=PerspectiveCamera(eye=(0, 0, 5), target=(0, 0, 0)),
        materials={"half": half}, objects=balls, lights=(PointLight(position=(0, 0, 0), intensity=(9, 9, 9)),),
        render=RenderSettings(max_depth=max_depth, max_rays=200),
    )  # fmt: skip


def file_of(folder: Path) -> Path:
    from renderer.mesh.load import save_ply

    save_ply(icosphere(2), folder / "ball.ply")
    path = folder / "mirrors.toml"
    path.write_text(TEXT + "".join(OBJECT.format(r) for r in (1.0, 1.5, 2.0, 2.5)))
    return path


def rendered(scene: Any, **settings: Any) -> Image:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CutWarning)
        return render(scene, **{"resolution": (50, 40), **settings})


def same(a: Image, b: Image) -> bool:
    return a.cut == b.cut and all(
        getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in ("radiance", "rays", "depth", "face")
    )


def test_a_pixel_takes_its_rays_and_those_under_way() -> None:
    for budget in (1, 50, 200, 1000):
        image = rendered(half_mirrors(), resolution=(25, 20), max_rays=budget, samples=4)
        # One ray waits a level at the most, and each brings a shadow ray.
        assert image.rays.max() <= 4 * (budget + 2 * 65)
        assert image.cut > 200


def test_what_needs_fewer_rays_is_not_cut() -> None:
    """The same picture, and no warning: warnings are errors here."""
    whole = render(half_mirrors(5), resolution=(50, 40), max_rays=10**9)
    assert whole.cut == 0
    needed = int(whole.rays.max())
    assert same(render(half_mirrors(5), resolution=(50, 40), max_rays=needed), whole)
    assert rendered(half_mirrors(5), max_rays=needed // 3).cut > 0


def test_pixels_that_are_not_cut_are_as_without_a_budget() -> None:
    whole, cut = rendered(half_mirrors(7), max_rays=10**9), rendered(half_mirrors(7), max_rays=100)
    spared = whole.rays < 100
    assert spared.sum() > 100
    np.testing.assert_array_equal(cut.radiance[spared], whole.radiance[spared])


@pytest.mark.parametrize("samples", [1, 4])
def test_the_cut_depends_on_no_thread_tile_or_pause(monkeypatch: pytest.MonkeyPatch, samples: int) -> None:
    options = {"max_rays": 60, "samples": samples}
    expected, ready = rendered(half_mirrors(), threads=1, **options), prepare(half_mirrors())
    assert expected.cut > 1000
    assert same(rendered(half_mirrors(), threads=3, **options), expected)
    monkeypatch.setattr(prepared_scene, "_bundles_in_a_row", lambda tree: 1)
    monkeypatch.setattr(camera_rays, "TILE", 16)
    assert same(rendered(ready, threads=2, **options), expected)


def test_finished_may_stop_a_tile_under_way() -> None:
    """A tile of this takes minutes; ``finished`` hears 0 meanwhile."""
    heard: list[int] = []

    def finished(tiles: int) -> None:
        heard.append(tiles)
        if len(heard) == 3:
            raise TimeoutError

    prepared, chosen = prepare(half_mirrors()), RenderSettings(resolution=(16, 16), max_depth=64, max_rays=2**61)
    with pytest.raises(TimeoutError):
        prepared.picture(prepared.scene.camera, chosen, BOUNDED, 2, finished)
    assert heard == [0, 0, 0]


SCRIPTS = {
    "a picture": "render(scene, resolution=(512, 512), max_rays=2**61)",
    "a picture by brute force": "render(scene, resolution=(512, 512), max_rays=2**61, accelerator='brute')",
    "brute force": "BruteForce.from_mesh(icosphere(7)).closest_hit(rays, -rays)",
}


@contextmanager
def ended_in_time(running: subprocess.Popen[str]) -> Iterator[None]:
    """A process is killed, and so its output ends, where it takes more than a minute or is not as expected."""
    timer = threading.Timer(60, running.kill)
    timer.start()
    try:
        yield
    except BaseException:
        running.kill()
        raise
    finally:
        timer.cancel()


def test_control_c_stops_a_script_in_the_midst_of_it() -> None:
    """Without a stop within tiles and chunks each of these goes on for minutes, and its time is over."""
    script = f"""
import sys, warnings, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.path.insert(0, {str(Path(__file__).parent)!r})
import numpy as np
from test_stopping import half_mirrors
from renderer import BruteForce, render
from renderer.mesh.shapes import icosphere
warnings.simplefilter("ignore")
scene, rays = half_mirrors(), np.random.default_rng(1).normal(size=(10**6, 3)) * 3
for accelerator in ("octree", "brute"):
    render(scene, resolution=(4, 4), max_rays=1, accelerator=accelerator)
BruteForce.from_mesh(icosphere(1)).closest_hit(rays[:20000], -rays[:20000])
for line in {list(SCRIPTS.values())!r}:
    try:
        print("begins", flush=True)
        exec(line)
    except KeyboardInterrupt:
        print("stopped", flush=True)
"""
    with subprocess.Popen([sys.executable, "-P", "-c", script], stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        for what in SCRIPTS:
            with ended_in_time(running):
                assert running.stdout.readline() == "begins\n"
                running.send_signal(signal.SIGINT)
                assert running.stdout.readline() == "stopped\n", what


INTERRUPTED = """
import signal
import numpy as np
from renderer import Octree
from renderer.mesh.shapes import icosphere
octree, rays = Octree(icosphere(6), threads=1), np.random.default_rng(1).normal(size=(10**6, 3)) * 3
octree.closest_hit(rays[:100], -rays[:100])
signal.signal(signal.SIGALRM, signal.default_int_handler)
stopped = 0
for _ in range(20):
    signal.setitimer(signal.ITIMER_REAL, 0.02)
    try:
        while True:
            octree.closest_hit(rays, 0.3 - rays)
    except KeyboardInterrupt:
        stopped += 1
print(stopped)
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs an interval timer")
def test_a_script_survives_control_c_whenever_it_comes_while_rays_are_traced() -> None:
    """Also as a kernel returns, where Numba crashes if it has to call Python then, as for a named tuple."""
    done = subprocess.run([sys.executable, "-P", "-c", INTERRUPTED], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (0, "20\n"), done.stderr[-500:]


def test_the_command_line_says_what_was_cut_and_takes_a_budget(tmp_path: Path, capsys: Any) -> None:
    path, out = file_of(tmp_path), tmp_path / "out.png"
    arguments = ["render", str(path), "-o", str(out), "--resolution", "20x16", "--quiet"]
    assert main([*arguments, "--max-rays", "100"]) == 0
    said = capsys.readouterr().err
    assert "pixels miss rays: a sample reached max_rays = 100." in said
    assert len(said.splitlines()) == 1
    assert load_scene(path).render.max_rays == 16384
    assert out.exists()


# The command, which says when it has been in its tiles for a while.
COMMAND = """
import runpy
from renderer.picture import prepare
calls, kernel = [], prepare.render_tile
def heard(*arguments):
    calls.append(len(calls))
    if calls[-1] == 20:
        print("renders", flush=True)
    return kernel(*arguments)
prepare.render_tile = heard
runpy.run_module("renderer", run_name="__main__", alter_sys=True)
"""


def test_control_c_ends_a_command_whose_first_tile_never_ends(tmp_path: Path) -> None:
    words = ["render", str(file_of(tmp_path)), "-o", str(tmp_path / "a.png"), "--max-rays", str(2**61)]
    running = subprocess.Popen(
        [sys.executable, "-P", "-c", COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler), env={**os.environ},
    )  # fmt: skip
    with running, ended_in_time(running):
        assert running.stdout is not None
        assert running.stdout.readline() == "renders\n"
        running.send_signal(signal.SIGINT)
        said = running.communicate(timeout=60)[1]
    assert running.returncode == 130
    assert said == "octree-render: interrupted\n"
    assert not (tmp_path / "a.png").exists()


def test_brute_force_in_small_chunks_has_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    from renderer.trace import closest as query

    brute, rays = BruteForce.from_mesh(icosphere(3), threads=2), np.random.default_rng(1).normal(size=(3000, 3)) * 2
    expected = brute.closest_hit(rays, -rays)
    monkeypatch.setattr(query, "_BLOCK_TESTS", 1000)
    found = brute.closest_hit(rays, -rays)
    for name in ("t", "face", "u", "v"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_the_viewers_first_picture_comes_soon_and_any_can_be_cancelled() -> None:
    """On a scene whose whole picture takes hours."""
    from renderer.viewer.passes import Pass, picture
    from renderer.viewer.protocol import CameraMessage, ViewSettings
    from renderer.viewer.shown import prepare_shown

    shown = prepare_shown(half_mirrors().altered(render=RenderSettings(max_depth=64, max_rays=2**61)))
    m = [1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]
    view = CameraMessage(
        type="view", seq=1, mode="octree", m=m, fovy=0.8, w=64, h=48, settings=ViewSettings(max_depth=64)
    )
    first = picture(shown, view, Pass(0, False, (32, 24), 1))
    assert 256 <= first.rays.max() <= 256 + 2 * 65

    def cancelled(tiles: int) -> None:
        raise TimeoutError

    with pytest.raises(TimeoutError):
        picture(shown, view, Pass(1, True, (64, 48), 1), cancelled)
