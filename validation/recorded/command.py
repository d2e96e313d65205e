"""``octree-validate --record`` and ``--compare``, which need no reference, only the renderer."""

import json
from pathlib import Path

from renderer.errors import MeshError
from renderer.mesh.load import load_mesh
from renderer.picture.encoding import write_pixels
from renderer.system.files import write_atomically
from validation.recorded.compare import compare
from validation.recorded.picture import draw
from validation.recorded.record import Record, make_record, read_record, write_record


def record(file: Path, mesh: Path) -> int:
    """Record the hits of a mesh in ``file``; returns 0."""
    recorded = make_record(load_mesh(mesh), mesh)
    try:
        write_record(recorded, file)
    except OSError as error:
        raise ValueError(f"--record: expected a file that can be written, got {file}: {error.strerror}") from None
    print(f"validation: recorded the hits of {mesh} in {file}")
    return 0


def compare_with(file: Path, mesh: Path | None, tolerance: float, output: Path | None) -> int:
    """Compare a mesh, by default the recorded path, with ``file``; returns 1 where hits differ.

    Writes ``STEM-compared.png`` and ``STEM-compared.json``, by default beside ``file``.
    """
    recorded = read_record(file)
    try:
        found = compare(recorded, load_mesh(_path(recorded, mesh)), tolerance)
    except MeshError as error:
        hint = "" if mesh else f"; {file} names this mesh, another one goes after it: --compare {file} MESH"
        raise MeshError(f"{error}{hint}") from error
    except ValueError as error:
        raise ValueError(f"{file}: {error}; write it again with --record") from None
    folder = file.parent if output is None else output
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"--output: expected a folder that can be made, got {folder}: {error.strerror}") from None
    picture, numbers = (folder / f"{file.stem}-compared{suffix}" for suffix in (".png", ".json"))
    write_atomically(picture, lambda png: write_pixels(png, draw(recorded, found), optimize=True))
    text = json.dumps(found.as_json() | {"mesh": str(_path(recorded, mesh)), "record": str(file)}, indent=1) + "\n"
    write_atomically(numbers, lambda out: out.write(text.encode()))
    print(f"validation: {found.summary()}; see {picture}")
    return 0 if found.passed else 1


def _path(recorded: Record, mesh: Path | None) -> Path:
    return Path(recorded.mesh) if mesh is None else mesh
