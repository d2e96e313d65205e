"""``help(renderer)`` is a page or two, with a word on every public name."""

import pydoc
import re
import subprocess
import sys

import renderer
from renderer import cluster, studies


def test_help_is_short_and_names_all_that_is_public() -> None:
    text = pydoc.plain(pydoc.render_doc(renderer))
    assert 40 < len(text.splitlines()) < 120
    absent = [name for name in renderer.__all__ if not re.search(rf"\b{name}\b", text)]
    assert absent in ([], ["__version__"])
    assert all(f"renderer.{package}" in text for package in ("studies", "radiosity", "cluster", "trimesh_ray"))


def test_all_public_names_are_imported_by_a_star() -> None:
    """pydoc alone is shown no ``__all__``."""
    script = "from renderer import *\nprint(*sorted(name for name in globals() if not name.startswith('_')))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout.split() == sorted(set(renderer.__all__) - {"__version__"})
    assert cluster.__all__ and studies.__all__


def test_help_of_a_scenes_class_begins_with_its_arguments() -> None:
    first = pydoc.plain(pydoc.render_doc(renderer.Phong)).splitlines()[3]
    assert first.startswith(" |  Phong(*, diffuse: 'ArrayLike' = 0.8, ")
    assert [name for name in dir(renderer.Phong()) if name.startswith("model_")] == []
    assert {"diffuse", "passes_light"} <= set(dir(renderer.Phong()))
