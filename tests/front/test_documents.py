"""What README and docs say to type works as it stands."""

import re
import shlex
from pathlib import Path

import pytest

from renderer.cli import _parser

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "reports" / "README.md"]
PYTHON = re.compile(r"```python\n(.*?)```", re.DOTALL)
COMMAND = re.compile(r"^    (?:\S*/)?octree-render (.*?)(?:\s+#.*)?$", re.MULTILINE)


def snippets():
    return [(page, block) for page in PAGES for block in PYTHON.findall(page.read_text())]


@pytest.mark.parametrize(("page", "block"), snippets(), ids=lambda value: getattr(value, "name", ""))
def test_python_in_a_page_runs_as_it_stands(page, block, tmp_path, monkeypatch):
    """In a checkout, of which nothing is changed: pictures go elsewhere."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    names: dict[str, object] = {}
    exec(compile(block, str(page), "exec"), names)
    if page.name == "README.md" and "closest_hit" in block:
        assert names["hits"].hit.tolist() == [True, False] and (tmp_path / "glass.png").stat().st_size > 10_000


def test_the_readme_has_python_to_run():
    assert any(page.name == "README.md" for page, _ in snippets())


@pytest.mark.parametrize(("page", "line"), [(p, c) for p in PAGES for c in COMMAND.findall(p.read_text())], ids=str)
def test_commands_in_a_page_are_ones_that_there_are(page, line):
    arguments = shlex.split(line)
    options = _parser().parse_args(arguments)
    assert not hasattr(options, "scene") or (ROOT / options.scene).is_file()


def test_no_page_promises_a_package_on_an_index():
    for page in PAGES:
        assert "pip install octree-renderer" not in page.read_text()
        assert "'octree-renderer[" not in page.read_text()
