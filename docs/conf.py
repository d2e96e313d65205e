"""Sphinx's settings for the site: ``make docs``. Its pages are this folder's, the README and those beside it.

Nothing is fetched. Scripts of the gallery and notebooks are run. Sources are read from the root of the repository, so
that links between pages are those that a code host follows, too.
"""

import gzip
import os
import re
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]  # the modules here, and the tree itself whatever is installed
os.environ.setdefault("OCTREE_RENDERER_QUIET", "1")

import downloads  # noqa: E402
from api_links import link_api  # noqa: E402
from case_links import link_cases  # noqa: E402
from source_links import link_sources, source_pages  # noqa: E402
from sphinx.util.logging import getLogger  # noqa: E402

import renderer  # noqa: E402
from validation.benchmark.page.record import commit  # noqa: E402

project = "octree-renderer"
author = copyright = "The octree-renderer authors"
release = version = renderer.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "numpydoc", "sphinx_gallery.gen_gallery"]
root_doc = "docs/index"
include_patterns = [
    "docs/**.md",
    "docs/**.rst",
    "docs/notebooks/*.ipynb",
    "CHANGELOG.md",
    "SECURITY.md",
    "reports/README.md",
]
exclude_patterns = ["docs/gallery/**", "docs/examples/sg_execution_times.rst", ".venv", ".git", "build"]
highlight_language = "none"  # blocks without a language are commands and diagrams

html_theme = "furo"
html_title = "octree-renderer"
html_favicon = "../renderer/viewer/page/icon.svg"
html_extra_path = ["start"]  # the address without a page leads to the start page
html_static_path = ["style"]
html_css_files = ["site.css"]
html_copy_source = False
html_theme_options = {"sidebar_hide_name": False}

# Pages of another make lead back.
BACK = b'<p style="margin: 0.5rem 1rem"><a href="../docs/samples.html">octree-renderer: samples</a></p>'

# Anchors as code hosts make them.
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100
numpydoc_show_class_members = False

# An exception in a notebook is an error of the build.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 120

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
    union = r"~?[\w.]*\b_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]"
    short = signature and re.sub(union, "ArrayLike", signature)
    if "_NestedSequence" in (short or ""):
        getLogger(__name__).warning("%s: NumPy has another union for ArrayLike: %s", name, short)
    return short, returns


def put_downloads(app, page, source):
    """The page of downloads has the files that are built now."""
    if page == "docs/downloads":
        files = downloads.build(Path(app.outdir, "downloads"))
        source[0] = (
            source[0]
            .replace("FILES", downloads.listed(files))
            .replace("VERSION", version)
            .replace("COMMIT", commit() or "unknown")
        )


def unpack_samples(app, failed):
    """Reports that are kept compressed are pages of the site."""
    for path in sorted((HERE / "samples").glob("*.html.gz")):
        page = Path(app.outdir, "samples", path.stem)
        page.parent.mkdir(exist_ok=True)
        back = b"" if path.name.startswith("model") else BACK  # which the start page shows within itself
        page.write_bytes(gzip.decompress(path.read_bytes()).replace(b"<body>", b"<body>" + back, 1))


def setup(app):
    """Add what is made at build."""
    app.connect("source-read", put_downloads)
    app.connect("env-get-outdated", lambda app, env, added, changed, removed: ["docs/downloads"])
    app.connect("doctree-resolved", link_api)
    app.connect("doctree-resolved", link_sources)
    app.connect("doctree-resolved", link_cases)
    app.connect("html-collect-pages", source_pages)
    app.connect("build-finished", unpack_samples)
    app.connect("autodoc-process-signature", short_types)
