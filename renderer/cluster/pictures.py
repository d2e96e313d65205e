"""Pictures on a cluster: a task for each band of rows, which are kept on this machine's disk as they come."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence, Sized
from contextlib import closing, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from renderer.arguments.split import SPLIT, Split
from renderer.checkpoints.folder import remove_parts
from renderer.checkpoints.pictures import Picture, PictureRun, checked_band, digest_of_scene
from renderer.cluster.tasks import Results, Task, results
from renderer.cluster.workers import SentScene, render_rows
from renderer.errors import expect
from renderer.picture.image import PLANES, check_picture_path
from renderer.picture.prepare import MediaRule
from renderer.picture.render import check_tree, checked_view
from renderer.scene.camera import Camera
from renderer.scene.needs import needs_of
from renderer.scene.scene import Scene, kind_of
from renderer.system.files import are_apart, as_path, write_atomically
from renderer.system.terminal import progress_bar


def render_on(
    client: Any,
    scene: Scene,
    folder: str | Path,
    *,
    camera: Camera | None = None,
    band: int | None = None,
    progress: bool = False,
    **options: Any,
) -> PictureRun:
    """A picture that is rendered on a cluster in bands of rows, with the bits of ``renderer.render``.

    Parameters
    ----------
    client : distributed.Client
        See `connected`.
    scene : Scene
        It is sent to each worker once.
    folder : str or Path
        For finished bands: a new folder, or that of a run that was killed, whose bands are kept.
    camera : PerspectiveCamera or OrthographicCamera, optional
        By default that of the scene.
    band : int, optional
        Rows of a band. It changes no bit. By default it is chosen.
    progress : bool, default False
        Show a bar on standard error if that is a terminal.
    **options
        ``accelerator``, ``split``, ``offset``, ``media``, ``planes`` and the settings, as for ``renderer.render``.

    Returns
    -------
    PictureRun
        ``image()`` is the picture. ``remove()`` removes the folder; call it when the picture is saved.

    Raises
    ------
    ValueError
        If an argument is not as above, or if `folder` is that of another picture.
    OSError
        If the scheduler is gone, or has had no worker for 10 seconds. The same call then goes on where this one
        stopped.

    Notes
    -----
    If a worker dies, others render its bands.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from renderer import Mesh, PerspectiveCamera, Phong, Scene, SceneObject
    >>> from renderer.cluster import connected, render_on
    >>> triangle = SceneObject(mesh=Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), material="grey")
    >>> camera = PerspectiveCamera(eye=(0.3, 0.3, 2), target=(0.3, 0.3, 0))
    >>> scene = Scene(camera=camera, materials={"grey": Phong()}, objects=[triangle], ambient=1)
    >>> with connected(workers=1) as client, TemporaryDirectory() as folder:
    ...     render_on(client, scene, folder, resolution=(3, 3)).image().face[1].tolist()
    [-1, 0, -1]
    """
    sent, picture = _Sender(options).picture(scene, camera)
    run = PictureRun(as_path("folder", folder), picture, band)

    def compute(missing: list[int]) -> Results:
        tasks = (Task(part, sent, (picture, *run.parts.plan.span(part))) for part in missing)
        return results(client, render_rows, tasks)

    run.parts.complete(compute, "row", progress)
    return run


def frames_on(
    client: Any,
    scenes: Iterable[Scene],
    outputs: Sequence[str | Path],
    folder: str | Path,
    *,
    band: int | None = None,
    progress: bool = False,
    **options: Any,
) -> None:
    """Render the frames of an animation on a cluster, each to its own file.

    Parameters
    ----------
    client : distributed.Client
        See `connected`.
    scenes : iterable of Scene
        One for each output, read when it is its turn. Scenes that differ only in the camera, such as those of
        ``scene.altered(camera=...)``, are sent once.
    outputs : sequence of str or Path
        .png, .exr or .npy files, as ``Image.save`` writes them.
    folder : str or Path
        For finished bands. It also says which frames are done, so the same call goes on where a killed one stopped.
        It is removed when all frames are done.
    band, progress, **options
        As for `render_on`.

    Raises
    ------
    ValueError
        If an argument is not as above, or if `folder` is that of other frames.
    OSError
        If the scheduler is gone, or has had no worker for 10 seconds. The same call then goes on where this one
        stopped.

    Notes
    -----
    Workers render several frames at once, so none waits for the last band of a frame.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from renderer import load_scene
    >>> from renderer.cluster import connected, frames_on
    >>> scene = load_scene("scenes/stairs.toml")
    >>> scenes = [scene, scene.altered(lights=())]
    >>> with connected(workers=1) as client, TemporaryDirectory() as folder:
    ...     frames_on(client, scenes, [f"{folder}/1.png", f"{folder}/2.png"], f"{folder}/parts", resolution=(8, 8))
    ...     sorted(path.name for path in Path(folder).iterdir())
    ['1.png', '2.png']
    """
    frames = _Frames(as_path("folder", folder), outputs, band, options)
    if isinstance(scenes, Sized):
        frames.expect_scenes(len(scenes))
    with (
        progress_bar(len(frames.outputs), "frame", progress) as update,
        closing(results(client, render_rows, frames.tasks(scenes))) as found,
    ):
        shown = 0
        for (number, part), rows in found:
            frames.write(number, part, rows)
            if update is not None:
                update(frames.done - shown)
                shown = frames.done
    frames.remove()


class _Sender:
    """The scenes as workers are sent them, for pictures with the same options."""

    def __init__(self, options: dict[str, Any]) -> None:
        settings = dict(options)
        self._accelerator: str = settings.pop("accelerator", "auto")
        self._split: Split = settings.pop("split", SPLIT)
        check_tree(self._accelerator, self._split)
        self._offset, self._planes = settings.pop("offset", "bounded"), settings.pop("planes", PLANES)
        self._media: MediaRule = settings.pop("media", "stack")
        self._settings = settings
        self._latest: SentScene | None = None

    def picture(self, scene: Scene, camera: Camera | None = None) -> tuple[SentScene, Picture]:
        """The scene as it is sent, the one before where it differs in the camera alone, and the picture of it."""
        expect(isinstance(scene, Scene), "scene", "a Scene", kind_of(scene))
        view = checked_view(scene, camera, self._offset, self._planes, self._settings, self._media)
        needs = needs_of(scene, view.chosen.max_depth)
        latest = self._latest
        if latest is None or latest.needs != needs or not _same_but_for_camera(scene, latest.scene):
            # The copy has its meshes, which a worker on another machine may find no file of.
            sent = scene.altered()
            digest = digest_of_scene(sent, needs)
            latest = self._latest = SentScene(digest, sent, needs, self._accelerator, self._split)
        return latest, Picture(view, latest.digest)


def _same_but_for_camera(scene: Scene, other: Scene) -> bool:
    shown = ("materials", "lights", "ambient", "background", "sky")
    return scene.instances is other.instances and all(getattr(scene, n) == getattr(other, n) for n in shown)


class _Frames:
    """The frames of an animation: those under way, and what is written of those that are done."""

    def __init__(self, folder: Path, outputs: Sequence[str | Path], band: int | None, options: dict[str, Any]) -> None:
        self.outputs = [as_path("outputs", output) for output in outputs]
        expect(are_apart(self.outputs), "outputs", "a file for each frame", "one of them twice")
        for output in self.outputs:
            check_picture_path(output)
        self._folder, self._band = folder, None if band is None else checked_band(band)
        self._sender = _Sender(options)
        self._under_way: dict[int, tuple[PictureRun, set[int]]] = {}
        self.done = 0

    def expect_scenes(self, count: int) -> None:
        """Raise ``ValueError`` unless there are as many outputs."""
        expect(count == len(self.outputs), "scenes", f"{len(self.outputs)}, as outputs are", str(count))

    def tasks(self, scenes: Iterable[Scene]) -> Iterator[Task]:
        """The tasks of all frames that are not done, one after the other."""
        count = 0
        for number, scene in enumerate(scenes):
            count += 1
            expect(count <= len(self.outputs), "scenes", f"{len(self.outputs)}, as outputs are", "more")
            sent, picture = self._sender.picture(scene)
            self._folder.mkdir(parents=True, exist_ok=True)
            if self._is_done(number, picture):
                remove_parts(self._parts(number))  # a run may have been killed before
                self.done += 1
                continue
            run = PictureRun(self._parts(number), picture, self._band)
            missing = run.parts.missing()
            self._under_way[number] = run, set(missing)
            if not missing:
                self._end(number)
            for part in missing:
                yield Task((number, part), sent, (picture, *run.parts.plan.span(part)))
        self.expect_scenes(count)

    def write(self, number: int, part: int, rows: Any) -> None:
        """Keep a part, and save its frame if it was the last one."""
        run, missing = self._under_way[number]
        run.parts.write(part, rows)
        missing.discard(part)
        if not missing:
            self._end(number)

    def remove(self) -> None:
        """Remove the folder, which has no more than what was said to be done."""
        for number in range(len(self.outputs)):
            self._said(number).unlink(missing_ok=True)
        with suppress(FileNotFoundError):  # of no frames
            self._folder.rmdir()

    def _end(self, number: int) -> None:
        run, _ = self._under_way.pop(number)
        output = self.outputs[number]
        run.image().save(output)
        said = {"plan": asdict(run.picture.plan(1)), "sha256": _digest(output)}
        text = json.dumps(said)
        write_atomically(self._said(number), lambda file: file.write(text.encode()))
        run.remove()
        self.done += 1

    def _is_done(self, number: int, picture: Picture) -> bool:
        """Whether its file is the one that an earlier run wrote of this very picture."""
        try:
            said = json.loads(self._said(number).read_text(encoding="utf-8"))
            same = said["plan"] == json.loads(json.dumps(asdict(picture.plan(1))))
            return bool(same and said["sha256"] == _digest(self.outputs[number]))
        except (OSError, ValueError, KeyError, TypeError):
            return False

    def _parts(self, number: int) -> Path:
        return self._folder / f"{number:06d}.parts"

    def _said(self, number: int) -> Path:
        return self._folder / f"{number:06d}.done"


def _digest(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
