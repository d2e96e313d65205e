"""A picture as a run: bands of its rows, kept on disk until all are rendered."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.counts import count_argument
from renderer.checkpoints.parts import Parts, Plan, digest_of
from renderer.picture.image import PLANES, Image
from renderer.picture.pack import without_faces
from renderer.picture.prepare import PreparedScene
from renderer.picture.render import View
from renderer.scene.needs import Features
from renderer.scene.scene import Scene
from renderer.system.files import check_writable

# Camera rays of a band: with some bounces a second of work on one thread, which is what a kill loses at most.
RAYS = 1 << 18
# The values of a pixel by the name of their plane.
_VALUES = {"radiance": ("<f4", 3), "depth": ("<f8", 1), "normal": ("<f4", 3), "face": ("<i4", 1), "rays": ("<i4", 1)}
# The column of the number of pixels that ``max_rays`` cut: a band's, in its first row.
_CUT = "cut"


@dataclass(frozen=True, eq=False)
class Picture:
    """The view of a scene that is rendered; the scene is named by its digest, see ``digest_of_scene``."""

    view: View
    scene: str

    def rows(self, prepared: PreparedScene, begin: int, end: int, threads: int) -> NDArray[np.uint8]:
        """Some rows (n, bytes of a row), which have the same bits whatever other rows are rendered, and where."""
        view = self.view
        image = prepared.picture(
            view.camera, view.chosen, view.offset, threads, None, view.planes, (begin, end), view.media
        )
        rows = np.zeros(end - begin, self.row())
        for name in self.planes():
            rows[name] = getattr(image, name)
        rows[_CUT][0] = image.cut
        return rows.view(np.uint8).reshape(len(rows), -1)

    def planes(self) -> list[str]:
        """The names of the planes that are kept, in the order of ``Image``."""
        return [name for name in PLANES if name == "radiance" or name in self.view.planes]

    def row(self) -> np.dtype[Any]:
        """A row of pixels as a record: a field for each plane, and one for what was cut."""
        width = self.view.chosen.resolution[0]
        fields: list[Any] = []
        for name in self.planes():
            dtype, values = _VALUES[name]
            fields.append((name, dtype, (width, values) if values > 1 else (width,)))
        return np.dtype([*fields, (_CUT, "<i8")])

    def plan(self, band: int) -> Plan:
        """The picture in bands of so many rows, with all that its bits depend on."""
        view = self.view
        made_of = {
            "kind": "picture", "scene": self.scene, "camera": view.camera.model_dump(),
            "settings": view.chosen.model_dump(), "offset": list(view.offset), "media": view.media,
            "planes": self.planes(), "version": sys.modules["renderer"].__version__,
        }  # fmt: skip
        return Plan(view.chosen.resolution[1], band, self.row().itemsize, "|u1", made_of)


class PictureRun:
    """The folder of a picture under way."""

    def __init__(self, folder: Path, picture: Picture, band: int | None = None) -> None:
        """Begin it, or go on where an earlier run was killed; ``band`` rows are a part, by default ``band_of``.

        Raises ``ValueError`` where the folder is of another picture, ``OSError`` where it cannot be written.
        """
        self.picture = picture
        rows = band_of(picture.view) if band is None else checked_band(band)
        check_writable(folder.with_name(f"{folder.name}.try"))
        self.parts = Parts(folder, picture.plan(rows))

    def image(self, seconds: float = 0.0) -> Image:
        """The picture, when all parts are there; ``seconds`` are its ``render_seconds``. Raises ``OSError`` otherwise.

        No ``CutWarning`` is given; ``Image.cut`` has the number.
        """
        width, height = self.picture.view.chosen.resolution
        kept, cut, planes = self.picture.planes(), 0, {}
        for name in PLANES:
            dtype, values = _VALUES[name]
            shape = (height, width) if name in kept else (0, 0)
            planes[name] = np.empty((*shape, values) if values > 1 else shape, dtype)
        for part in range(self.parts.plan.parts):
            begin, end = self.parts.plan.span(part)
            rows = self.parts.read(part).view(self.picture.row()).reshape(-1)
            for name in kept:
                planes[name][begin:end] = rows[name]
            cut += int(rows[_CUT].sum())
        return Image(**planes, build_seconds=0.0, render_seconds=seconds, cut=cut)

    def remove(self) -> None:
        """Remove the folder."""
        self.parts.remove()


def band_of(view: View) -> int:
    """The rows of a band: as many as ``RAYS`` camera rays make, at least 8, in eights as tiles are traced.

    It depends on the picture alone, so that a run goes on with any number of workers.
    """
    width, height = view.chosen.resolution
    rows = RAYS // (width * view.chosen.samples) // 8 * 8
    return min(max(8, rows), height)


def checked_band(band: object) -> int:
    """``band``, a number of rows. Raises ``ValueError`` for what is none."""
    return count_argument("band", band, 1, alternative=" or None")


def digest_of_scene(scene: Scene, needs: Features) -> str:
    """A digest of all that pictures of a scene show, whatever their cameras and settings are."""
    # The media are those around the scene's own camera, which is the view's.
    shown = [np.asarray(array) for name, array in without_faces(scene, needs)._asdict().items() if name != "media"]
    sources = list({id(instance.source): instance.source for instance in scene.instances}.values())
    numbers = {id(source): number for number, source in enumerate(sources)}
    none = np.empty((0, 3))
    meshes = [a for s in sources for a in (s.vertices, s.faces, none if s.normals is None else s.normals)]
    stands = [(numbers[id(i.source)], i.smooth, i.crease, *i.matrix.ravel()) for i in scene.instances]
    return digest_of(*meshes, np.array(stands), *shown)
