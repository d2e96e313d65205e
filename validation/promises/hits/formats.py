"""What mesh files say by convention: indices of OBJ that count back, and colours of PLY as shares of their type."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.load import load_mesh
from validation.promises.row import row

# Lines of few are read one by one, many at once.
_SIZES = (4, 800)
_PLY = {"uchar": 255.0, "ushort": 65535.0, "uint": 4294967295.0, "float": 1.0, "double": 1.0}
_VERTICES = "0 0 0\n1 0 0\n0 1 0\n"


def check_formats(rng: Generator) -> list[dict[str, Any]]:
    """Files by hand, in a folder of their own."""
    with TemporaryDirectory(prefix="promises-") as name:
        folder = Path(name)
        return [
            row("an index below 0 in an OBJ file counts back from its face", "places by hand", _back(folder, rng)),
            row("colours of a PLY file are shares of the largest of their type", "shares by hand", _shares(folder)),
        ]


def _back(folder: Path, rng: Generator) -> NDArray[np.bool_]:
    """Faces between the vertices, which name their corners from the beginning, or back from where the face stands."""
    path, kept = folder / "a.obj", []
    for count in _SIZES:
        for backwards in (0.0, 0.5, 1.0):
            places, lines, expected = rng.integers(-99, 100, (count, 3)), [], []
            for k, place in enumerate(places):
                lines.append("v {} {} {}".format(*place))
                if k >= 3 or k == count - 1:
                    corners = rng.permutation(k + 1)[:3]
                    back = rng.random(3) < backwards
                    lines.append("f {} {} {}".format(*np.where(back, corners - k - 1, corners + 1)))
                    expected.append(places[corners])
            path.write_text("\n".join(lines) + "\n", encoding="ascii")
            kept.append((load_mesh(path).triangles == np.array(expected)).all(axis=(1, 2)))
    return np.concatenate(kept)


def _shares(folder: Path) -> NDArray[np.bool_]:
    path, kept = folder / "a.ply", []
    for kind, largest in _PLY.items():
        values = np.array([[0.0, 1.0, 0.5], [1.0, 0.25, 0.0], [0.75, 0.0, 1.0]]) * largest
        colors = values if kind in ("float", "double") else np.floor(values)
        names = "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
        rows = zip(_VERTICES.splitlines(), colors.tolist(), strict=True)
        spelled = "".join(f"{at} {' '.join(str(c if kind in ('float', 'double') else int(c)) for c in color)}\n"
                          for at, color in rows)  # fmt: skip
        path.write_text(
            f"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{names}"
            f"element face 1\nproperty list uchar int vertex_indices\nend_header\n{spelled}3 0 1 2\n", encoding="ascii",
        )  # fmt: skip
        found = load_mesh(path).colors
        assert found is not None
        kept.append((found[:, :3] == (colors / largest).astype(np.float32)).ravel())
    return np.concatenate(kept)
