"""Each field of a scene that a page draws or shows by itself is in what it fetches."""

import json
from pathlib import Path
from typing import Any

import tomlkit
from cases import cases
from varied import VARIATIONS, Variation, written

from renderer import load_mesh
from renderer.viewer.payload import description, mesh_payload
from renderer.viewer.shown import UNSEEN, open_file

# Scenes with a camera of the page.
SHOWN = [v for v in VARIATIONS if v.table["camera"]["type"] in ("perspective", "orthographic")]
# What the server alone goes by.
UNTOLD = (
    *("filter", "min_weight", "max_rays", "glass_shadows", "terminator"),
    *(name for name in UNSEEN if name not in ("emission", "emission_map", "vertex_colors")),
)


def fetched(folder: Path, table: Any) -> tuple[str, bytes]:
    """What a page knows of the scene of a file, beside its tree and what a picture needs."""
    shown = open_file(written(folder, table))
    told = {key: value for key, value in description(shown).items() if key not in ("id", "octree", "needs")}
    return json.dumps(told), b"".join(mesh_payload(shown.prepared).pieces)


def test_a_page_is_told_of_another_value(folder: Path) -> None:
    of_tables: dict[str, Any] = {}
    for other in SHOWN:
        told = repr(other.table)
        if told not in of_tables:
            of_tables[told] = fetched(folder, other.table)
        same = fetched(folder, other.varied()) == of_tables[told]
        assert same == (other.keys[-1] in UNTOLD), other.keys


@cases("other", [v for v in VARIATIONS if v.keys[0] in ("objects", "floor")])
def test_each_object_has_the_faces_of_its_mesh_and_the_floor_two_for_each_square(
    folder: Path, other: Variation
) -> None:
    table = other.varied()
    (folder / "b.toml").write_text(tomlkit.dumps(table))
    shown = open_file(folder / "b.toml")
    across, along = table["floor"]["squares"]
    expected = [len(load_mesh(folder / entry["mesh"]).faces) for entry in table["objects"]] + [2 * across * along]
    assert [told["faces"] for told in description(shown)["objects"]] == expected
    assert sum(expected) == len(shown.prepared.mesh.faces)
