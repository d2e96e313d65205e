"""``render`` and ``prepare``: a scene and settings in, checked, and a picture out."""

import warnings
from collections.abc import Collection, Mapping, Sequence
from numbers import Real
from typing import Any, Literal, NamedTuple, Unpack

from renderer.arguments.arrays import real_argument
from renderer.arguments.split import SPLIT, Split
from renderer.errors import expect
from renderer.picture.camera_rays import tile_side
from renderer.picture.image import PLANES, CutWarning, Image
from renderer.picture.prepare import MediaRule, PreparedScene, prepare_scene, tiles
from renderer.scene.camera import Camera
from renderer.scene.cameras.base import BaseCamera
from renderer.scene.needs import Features, checked_needs
from renderer.scene.scene import GivenSettings, RenderSettings, Scene, checked_settings, kind_of
from renderer.system.terminal import progress_bar
from renderer.system.threads import checked_threads
from renderer.trace.spawn import BOUNDED, MITSUBA_EPSILON, OffsetRule
from renderer.tree.build import SPLITS


def render(
    scene: Scene | PreparedScene,
    *,
    camera: Camera | None = None,
    accelerator: Literal["auto", "octree", "brute"] = "auto",
    split: Split = SPLIT,
    needs: Features | None = None,
    offset: Literal["bounded", "mitsuba"] | float = "bounded",
    media: MediaRule = "stack",
    planes: Collection[str] = PLANES,
    window: Sequence[int] | None = None,
    threads: int | None = None,
    progress: bool = False,
    **settings: Unpack[GivenSettings],
) -> Image:
    """Render a picture of a scene.

    Parameters
    ----------
    scene : Scene or PreparedScene
        The scene. What ``prepare`` returns for one saves its preparation: the tree, and all else that does not depend
        on the camera or the settings.
    camera : PerspectiveCamera, OrthographicCamera or another of the cameras, optional
        Another camera than the scene's.
    accelerator : {"auto", "octree", "brute"}, default "auto"
        The octree, or a test of every ray against every face. "auto" takes the octree unless there are very few faces.
        This argument, ``split`` and ``needs`` are for a ``Scene`` that is not prepared.
    split : {"midpoint", "sah"}, default "sah"
        The rule by which cells of the octree are cut.
    needs : Needs, optional
        The features to prepare: at least those of ``needs_of(scene)``, which is the default. More of them cost time
        and memory and change no bit of radiance, depth, normal or face.
    offset : {"bounded", "mitsuba"} or float, default "bounded"
        How far spawned rays start from a surface: by the bound of the rounding error, or by the rule of Mitsuba, with
        its own epsilon or the one given, below 0.1.
    media : {"stack", "normal"}, default "stack"
        Which media lie on both sides of glass. "stack": a ray keeps a list of the bodies that it is in, the innermost
        counts, and faces that coincide are crossed together. "normal": the body is behind each of its faces and air is
        in front, as in Mitsuba. They differ where glass is open, overlaps or touches.
    planes : collection of str, default all
        The arrays of the ``Image`` to keep beside ``radiance``, of "depth", "normal", "face" and "rays". They take 28
        of 40 bytes a pixel.
    window : (int, int, int, int), optional
        Left, top, right and bottom of the part of the picture to render, in pixels; right and bottom are the first
        column and row that are left out. Its pixels have the bits that they have in the whole picture.
    threads : int, optional
        The number of threads, by default that of the processors.
    progress : bool, default False
        Whether to show a progress bar on standard error, if that is a terminal.
    **settings
        Settings in place of those of the scene: ``resolution``, ``samples``, ``filter``, ``max_depth``, ``min_weight``,
        ``max_rays`` and ``shadows``; see ``RenderSettings``.

    Returns
    -------
    Image
        The same bits for any number of threads.

    Raises
    ------
    ValueError
        For a bad argument, which the message names.

    Warns
    -----
    CutWarning
        Where pixels miss rays because of ``max_rays``.

    Notes
    -----
    Ctrl-C stops it at once.

    Examples
    --------
    >>> from renderer import Mesh, PerspectiveCamera, Phong, Scene, SceneObject, render
    >>> triangle = SceneObject(mesh=Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), material="grey")
    >>> camera = PerspectiveCamera(eye=(0.3, 0.3, 2), target=(0.3, 0.3, 0))
    >>> scene = Scene(camera=camera, materials={"grey": Phong()}, objects=[triangle], ambient=1)
    >>> render(scene, resolution=3).face[1].tolist()
    [-1, 0, -1]
    >>> render(scene, resolution=3, window=(1, 1, 3, 2)).face.tolist()
    [[0, -1]]
    """
    threads = checked_threads(threads)
    expect(isinstance(scene, Scene | PreparedScene), "scene", "a Scene or a PreparedScene", kind_of(scene))
    source = scene.scene if isinstance(scene, PreparedScene) else scene
    view = checked_view(source, camera, offset, planes, settings, media)
    columns, rows = _window(window, *view.chosen.resolution)
    if isinstance(scene, PreparedScene):
        _expect_usual(accelerator, split, needs)
        prepared = scene
    else:
        prepared = _prepared(scene, view.chosen.max_depth, accelerator, split, needs, threads)
    side = tile_side(view.camera, view.chosen.resolution, view.chosen.samples)
    with progress_bar(tiles(columns[1] - columns[0], rows[1] - rows[0], side), "tile", progress) as update:
        image = prepared.picture(
            view.camera, view.chosen, view.offset, threads, update, view.planes, rows, view.media, columns
        )
    if image.cut:
        warnings.warn(image.cut_message(view.chosen.max_rays), CutWarning, stacklevel=2)
    return image


def prepare(
    scene: Scene,
    *,
    accelerator: Literal["auto", "octree", "brute"] = "auto",
    split: Split = SPLIT,
    needs: Features | None = None,
    threads: int | None = None,
) -> PreparedScene:
    """Prepare a scene once for many pictures, such as those of an animation or of several cameras.

    Parameters
    ----------
    scene : Scene
        The scene.
    accelerator, split, needs, threads
        As of ``render``.

    Returns
    -------
    PreparedScene
        It renders at any ``max_depth``. Its pictures have the same bits as those of the scene itself.

    Raises
    ------
    ValueError
        For a bad argument, which the message names.

    Examples
    --------
    >>> from renderer import Mesh, PerspectiveCamera, Phong, Scene, SceneObject, prepare, render
    >>> triangle = SceneObject(mesh=Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), material="grey")
    >>> camera = PerspectiveCamera(eye=(0.3, 0.3, 2), target=(0.3, 0.3, 0))
    >>> ready = prepare(Scene(camera=camera, materials={"grey": Phong()}, objects=[triangle]))
    >>> beside = PerspectiveCamera(eye=(9, 0, 2), target=(9, 0, 0))
    >>> [int(render(ready, camera=eye, resolution=1).face[0, 0]) for eye in (camera, beside)]
    [0, -1]
    """
    expect(isinstance(scene, Scene), "scene", "a Scene", kind_of(scene))
    # The needs are the same for any number of bounces above 0.
    depth = max(1, scene.render.max_depth)
    return _prepared(scene, depth, accelerator, split, needs, checked_threads(threads))


class View(NamedTuple):
    """A checked view: camera, settings, the rules of offsets and media, and the planes to keep."""

    camera: Camera
    chosen: RenderSettings
    offset: OffsetRule
    planes: tuple[str, ...]
    media: MediaRule


def checked_view(
    source: Scene,
    camera: Camera | None,
    offset: str | float,
    planes: Collection[str],
    settings: Mapping[str, Any],
    media: MediaRule = "stack",
) -> View:
    """The checked view of the arguments of ``render``. Raises ``ValueError`` naming the argument."""
    eye = source.camera if camera is None else camera
    expect(isinstance(eye, BaseCamera), "camera", "a camera", type(camera).__name__)
    chosen = checked_settings(source.render, settings, eye)
    try:
        kept: tuple[Any, ...] = (planes,) if isinstance(planes, str) else tuple(planes)
    except TypeError:  # also of what claims to be iterable and is not
        kept = (None,)
    known = not isinstance(planes, str) and all(isinstance(p, str) and p in PLANES for p in kept)
    expect(known, "planes", f"some of {', '.join(PLANES)}", repr(planes))
    named = isinstance(media, str) and media in ("stack", "normal")
    expect(named, "media", "'stack' or 'normal'", repr(media))
    return View(eye, chosen, _offset(offset), kept, media)


def check_tree(accelerator: object, split: object) -> None:
    """Raise ``ValueError`` unless these are what ``render`` takes."""
    named = isinstance(accelerator, str) and accelerator in ("auto", "octree", "brute")
    expect(named, "accelerator", "'auto', 'octree' or 'brute'", repr(accelerator))
    expect(isinstance(split, str) and split in SPLITS, "split", f"one of {sorted(SPLITS)}", repr(split))


def _prepared(
    scene: Scene,
    max_depth: int,
    accelerator: str,
    split: Split,
    needs: Features | None,
    threads: int,
) -> PreparedScene:
    check_tree(accelerator, split)
    return prepare_scene(scene, checked_needs(needs, scene, max_depth), accelerator, split, threads)


def _expect_usual(accelerator: object, split: object, needs: object) -> None:
    """Refuse arguments that a prepared scene cannot change."""
    for name, value, usual in (("accelerator", accelerator, "auto"), ("split", split, SPLIT)):
        expect(isinstance(value, str) and value == usual, name, f"{usual!r}, as the scene is prepared", repr(value))
    expect(needs is None, "needs", "None, as the scene is prepared", repr(needs))


def _window(window: Sequence[int] | None, width: int, height: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """The columns and rows of a window, first and end each; by default all."""
    if window is None:
        return (0, width), (0, height)
    given = real_argument("window", window)
    shaped = given.shape == (4,) and given.dtype.kind in "iu"
    left, top, right, bottom = given.tolist() if shaped else (0, 0, 0, 0)
    expected = f"left < right, top < bottom, four integers within {width} x {height} pixels"
    expect(0 <= left < right <= width and 0 <= top < bottom <= height, "window", expected, repr(window))
    return (left, right), (top, bottom)


def _offset(offset: str | float) -> OffsetRule:
    if isinstance(offset, str):
        expect(offset in ("bounded", "mitsuba"), "offset", "'bounded', 'mitsuba' or a number", repr(offset))
        return BOUNDED if offset == "bounded" else OffsetRule(False, MITSUBA_EPSILON)
    expect(isinstance(offset, Real) and 0.0 <= offset < 0.1, "offset", "a number from 0 to below 0.1", offset)
    return OffsetRule(False, float(offset))
