"""Files of pictures: of the kind that the suffix names, and with the depth where the kind has it."""

from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.picture.render import render
from renderer.scene.scene import Scene
from validation.promises.pictures.glowing import from_above, square, thing
from validation.promises.row import row

Bools = NDArray[np.bool_]
_ACROSS, _ALONG = np.array([0.0, 0.0, 8.0]), np.array([8.0, 0.0, 0.0])
_BEGINNINGS = {"png": b"\x89PNG\r\n", "exr": b"\x76\x2f\x31\x01", "npy": b"\x93NUMPY"}


def check_saved() -> list[dict[str, Any]]:
    """A square that covers half of the picture."""
    half = square(np.array([0.0, 0.0, -4.0]), _ACROSS, _ALONG)
    return [
        row("a picture is saved as the kind of file that its suffix names", "file signatures",
            _kinds(half)),
        row("an EXR file has the depth, infinite where nothing is", "OpenEXR", _depth(half)),
    ]  # fmt: skip


def _scene(mesh: Mesh) -> Scene:
    camera = from_above((0.0, 5.0, 0.0), 2.0)
    return Scene(camera=camera, materials={"any": Phong()}, objects=(thing(mesh, "any"),))


def _kinds(mesh: Mesh) -> Bools:
    image, kept = render(_scene(mesh), resolution=(3, 2)), []
    with TemporaryDirectory(prefix="promises-") as folder:
        for name, begin in product(("a.{}", "B.PNG.{}", "c.d.{}"), _BEGINNINGS.items()):
            for suffix in (begin[0], begin[0].upper(), begin[0].title()):
                path = Path(folder) / name.format(suffix)
                image.save(path)
                kept.append(path.read_bytes().startswith(begin[1]))
    return np.array(kept)


def _depth(half: Mesh) -> Bools:
    with TemporaryDirectory(prefix="promises-") as folder:
        path = Path(folder) / "a.exr"
        image = render(_scene(half), resolution=(8, 4))
        image.save(path)
        with OpenEXR.File(str(path)) as file:
            z = np.array(file.channels()["Z"].pixels)
    expected = np.where(np.arange(8) >= 4, 5.0, np.inf)
    kept: Bools = (z == expected).ravel() & (image.depth == expected).ravel()
    return kept
