"""How Sphinx draws the site: ``make docs``. Its pages are this folder's, the README and those beside it.

Nothing is fetched. Sources are read from the root of the repository, so that links between pages are those that a code
host follows, too.
"""

import os
import re
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]  # docstrings.py, and the tree itself whatever is installed
os.environ.setdefault("OCTREE_RENDERER_QUIET", "1")

from docstrings import as_rst  # noqa: E402

import renderer  # noqa: E402

project = "octree-renderer"
author = copyright = "The octree-renderer authors"
release = version = renderer.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "sphinx_gallery.gen_gallery"]
root_doc = "docs/index"
include_patterns = [
    "docs/**.md",
    "docs/**.rst",
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "reports/README.md",
]
exclude_patterns = ["docs/gallery/**", ".venv", ".git", "build"]
highlight_language = "none"  # blocks without a language are commands and diagrams

html_theme = "furo"
html_title = "octree-renderer"
html_extra_path = ["start"]  # the address without a page leads to the start page
html_copy_source = False
html_theme_options = {"sidebar_hide_name": False}

# Anchors as code hosts make them.
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100
numpydoc_show_class_members = False

sphinx_gallery_conf = {
    "examples_dirs": "docs/gallery",
    "gallery_dirs": "docs/examples",
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "notebook_images": False,
    "show_signature": False,
    "min_reported_time": 1e9,
}


def short_types(app, what, name, thing, options, signature, returns):
    """Signatures say ArrayLike where annotations were resolved to the union that NumPy makes of it."""
    union = r"_Buffer \| _SupportsArray\[.*?_NestedSequence\[complex \| bytes \| str\]"
    return re.sub(union, "ArrayLike", signature or ""), returns


def setup(app):
    """Let autodoc read this project's docstrings."""
    app.connect("autodoc-process-signature", short_types)
    app.connect("autodoc-process-docstring", lambda app, what, name, thing, options, lines: as_rst(lines), priority=100)
