"""The site's parts: gallery and notebooks run, links are checked, names have a place."""

import gzip
import hashlib
import json
import re
import runpy
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import pytest
from cases import cases

import renderer

ROOT = Path(__file__).parents[2]
GALLERY = sorted((ROOT / "docs" / "gallery").glob("*.py"))
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


class Entry(NamedTuple):
    """As Sphinx keeps what it has a page of."""

    docname: str
    node_id: str
    aliased: str
    objtype: str


def module(name):
    """What a module of docs/ defines; it finds those beside it, as with Sphinx."""
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(ROOT / "docs")
        return runpy.run_path(str(ROOT / "docs" / f"{name}.py"))


@pytest.mark.parametrize("script", GALLERY, ids=lambda path: path.stem)
def test_a_script_of_the_gallery_draws_a_picture(script, monkeypatch):
    """In its folder, as Sphinx runs it, with small pictures; each has something to see."""
    if script.stem == "error_map":
        pytest.importorskip("mitsuba", reason="pip install '.[validate]'")
    monkeypatch.chdir(script.parent)
    monkeypatch.setenv("GALLERY_SIZE", "48")
    monkeypatch.setattr(plt, "show", lambda: None)
    plt.switch_backend("agg")
    plt.close("all")
    try:
        runpy.run_path(str(script))
        (figure,) = map(plt.figure, plt.get_fignums())
        figure.canvas.draw()
        pixels = np.asarray(figure.canvas.buffer_rgba())
    finally:
        plt.close("all")
    assert (pixels[..., :3] != 255).any(axis=-1).mean() > 0.02


def test_a_script_without_mitsuba_says_that_it_is_skipped(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    monkeypatch.chdir(ROOT / "docs" / "gallery")
    plt.close("all")
    runpy.run_path("error_map.py")
    assert capsys.readouterr().out.startswith("skipped: ") and not plt.get_fignums()


def test_names_of_the_api_in_the_text_are_links():
    """Whole names and ends, calls, what Octree and others have; not what two others have, nor titles and links."""
    nodes = pytest.importorskip("docutils.nodes", reason="pip install '.[docs]'")
    objects = {
        name: Entry("docs/api/renderer", name, "", kind)
        for name, kind in {
            "renderer.Octree": "class", "renderer.Octree.closest_hit": "method",
            "renderer.cluster.closest_hit": "function",
            "renderer.Octree.save": "method", "renderer.Image.open": "method", "renderer.Scene.open": "method",
            "renderer.Hits.t": "attribute", "renderer.render": "function",
        }.items()
    }  # fmt: skip
    domain = SimpleNamespace(objects=objects)
    app = SimpleNamespace(
        env=SimpleNamespace(get_domain=lambda name: domain),
        builder=SimpleNamespace(get_relative_uri=lambda page, to: f"{page}->{to}"),
    )
    texts = ["closest_hit", "Octree.save(path)", "renderer.Octree", "open", "t", "render", "other"]
    page = nodes.section("", nodes.title("", "", nodes.emphasis("", "", nodes.literal("", "save"))))
    page += nodes.reference("", "", nodes.strong("", "", nodes.literal("", "save")), refuri="elsewhere")
    page += [nodes.paragraph("", "", nodes.literal("", text)) for text in texts]
    module("api_links")["link_api"](app, page, "docs/page")
    found = {link.astext(): link["refuri"] for link in page.findall(nodes.reference)}
    assert found == {
        "save": "elsewhere",
        "closest_hit": "docs/page->docs/api/renderer#renderer.Octree.closest_hit",
        "Octree.save(path)": "docs/page->docs/api/renderer#renderer.Octree.save",
        "renderer.Octree": "docs/page->docs/api/renderer#renderer.Octree",
    }


def test_sources_that_the_text_names_are_pages():
    """Files and names in them; not a file that is not there, nor one that a folder does not tell apart."""
    nodes = pytest.importorskip("docutils.nodes", reason="pip install '.[docs]'")
    made, here = module("source_links"), "tests/documents/test_site.py"
    lines = (ROOT / here).read_text(encoding="utf-8").splitlines()
    (constant,) = (i for i, line in enumerate(lines, 1) if line.startswith("GALLERY = "))
    texts = [here, f"{here}::GALLERY", f"{here}::Entry", "tests/nowhere.py", "conf.py", "renderer/", "closest_hit"]
    page = nodes.section("", *(nodes.paragraph("", "", nodes.literal("", text)) for text in texts))
    page += nodes.reference("", "", nodes.literal("", here), refuri="elsewhere")
    read = page.deepcopy()
    app = SimpleNamespace(
        env=SimpleNamespace(found_docs=["docs/page"], get_doctree=lambda name: read),
        builder=SimpleNamespace(get_relative_uri=lambda page, to: f"{page}->{to}"),
    )
    made["link_sources"](app, page, "docs/page")
    assert {
        link.astext(): link["refuri"] for link in page.findall(nodes.reference) if link["refuri"] != "elsewhere"
    } == {
        here: f"docs/page->source/{here}",
        f"{here}::GALLERY": f"docs/page->source/{here}#line-{constant}",
        f"{here}::Entry": f"docs/page->source/{here}#line-{1 + lines.index('class Entry(NamedTuple):')}",
    }
    ((name, context, template),) = made["source_pages"](app)
    assert name == f"source/{here}" and template == "page.html"
    assert f'id="line-{len(lines)}"' in context["body"] and "test_twelve_examples" in context["body"]


def linked(text):
    """The address that a literal leads to, or None where it stays one."""
    nodes = pytest.importorskip("docutils.nodes", reason="pip install '.[docs]'")
    page = nodes.paragraph("", "", nodes.literal("", text))
    app = SimpleNamespace(builder=SimpleNamespace(get_relative_uri=lambda page, to: to))
    module("source_links")["link_sources"](app, page, "docs/page")
    return next((link["refuri"] for link in page.findall(nodes.reference)), None)


@cases(
    "text",
    [
        "tests/documents/test_site.py::test_of_yesterday",
        "tests/documents/test_site.py::test_of_yesterday[x]",
        "tests/documents/test_site.py::json",  # imported
        "tests/documents/test_site.py::page",  # local
        "renderer/octree.py::Octree::gone",
        "renderer/octree.py::Octree.gone",
        "renderer/gone.py::Octree",
        ".github/workflows/ci.yml::test",
    ],
)
def test_a_name_that_its_file_has_not_is_an_error_of_the_build(text):
    with pytest.raises(ValueError, match=re.escape(text.split("::")[0])) as error:
        linked(text)
    if (ROOT / text.split("::")[0]).is_file():
        assert str(error.value).startswith("docs/page: ")  # which names it


@cases(
    ("text", "line"),
    [
        ("renderer/arguments/limits.py::SHORTEST", "SHORTEST"),  # one of two that a line defines
        ("renderer/octree.py::Octree.from_mesh", "    def from_mesh("),
        ("renderer/octree.py::Octree::from_mesh", "    def from_mesh("),
        (
            "tests/documents/test_site.py::test_a_name_within_a_class_or_a_pair_is_found[x]",
            "def test_a_name_within_a_class_or",
        ),
        (".github/workflows/ci.yml", None),
    ],
)
def test_a_name_within_a_class_or_a_pair_is_found(text, line):
    path, _, anchor = linked(text).removeprefix("source/").partition("#line-")
    assert path == text.split("::")[0]
    assert line is None or line in (ROOT / path).read_text(encoding="utf-8").splitlines()[int(anchor) - 1]


@pytest.mark.parametrize("text", ["/etc/adduser.conf/x.json", "../outside.json", "docs/../../outside.json"])
def test_a_file_outside_the_project_is_no_page(text, tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "is_file", lambda path: True)
    assert linked(text) is None


def test_cases_that_the_text_names_are_links_to_their_rows():
    nodes = pytest.importorskip("docutils.nodes", reason="pip install '.[docs]'")
    page = nodes.section("", nodes.title("", "case 1"), nodes.paragraph("", "by case 12, case 3 and a showcase 4"))
    page += nodes.paragraph("", "", nodes.literal("", "case 5"))
    module("case_links")["link_cases"](None, page, "docs/guides/page")
    assert {link.astext(): link["refuri"] for link in page.findall(nodes.reference)} == {
        "case 12": "../../samples/report.html#case-12",
        "case 3": "../../samples/report.html#case-3",
    }
    assert page.astext() == "case 1\n\nby case 12, case 3 and a showcase 4\n\ncase 5"


def test_wheel_and_source_are_built_for_the_site_without_a_network(tmp_path):
    pytest.importorskip("build", reason="pip install '.[docs]'")
    (tmp_path / "octree_renderer-0.0.9.tar.gz").touch()  # of the build before
    made = module("downloads")
    files = made["build"](tmp_path)
    name = f"octree_renderer-{renderer.__version__}"
    assert [file.name for file in files] == [f"{name}-py3-none-any.whl", f"{name}.tar.gz"]
    assert sorted(tmp_path.iterdir()) == files
    shown = re.findall(
        r'<li><a href="../downloads/(.*?)">\1</a>: the (\w+).*?; ([\d.]+) MB, SHA-256 <code>(.*?)</code></li>',
        made["listed"](files),
    )
    assert shown == [
        (file.name, what, f"{file.stat().st_size / 1e6:.1f}", hashlib.sha256(file.read_bytes()).hexdigest())
        for file, what in zip(files, ("wheel", "source"), strict=True)
    ]
    assert made["listed"](files).count("<li>") == 2


@cases("script", GALLERY)
def test_a_script_is_short_and_named_by_its_title(script):
    _, head, code = script.read_text(encoding="utf-8").split('"""', 2)
    title, underline = head.strip().splitlines()[:2]
    assert set(underline) == {"="} and len(underline) == len(title)
    assert script.stem.split("_")[0] in title.lower()
    assert 10 <= len([line for line in code.splitlines() if line.strip()]) <= 30


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_cells_of_a_notebook_run_in_turn(notebook, monkeypatch):
    """Small, and without Jupyter; ``make docs`` runs them whole, in a kernel."""
    if notebook.stem == "proof":
        pytest.importorskip("embreex", reason="pip install '.[validate]'")
    else:
        pytest.importorskip("starlette", reason="pip install '.[viewer]'")
    monkeypatch.chdir(notebook.parent)
    monkeypatch.setenv("GALLERY_SIZE", "48")
    monkeypatch.setattr(plt, "show", lambda: None)
    monkeypatch.setattr("webbrowser.open", lambda url: True)
    plt.switch_backend("agg")
    names = {}
    try:
        for cell in cells(notebook, "code"):
            exec(compile("".join(cell["source"]), f"{notebook.name}, {cell['id']}", "exec"), names)
        assert plt.get_fignums()
    finally:
        plt.close("all")
        if "viewing" in names:
            names["viewing"].close()


def cells(notebook, kind):
    return [cell for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == kind]


def test_two_notebooks_without_outputs():
    """Outputs are made at build, so that they are of today's code."""
    assert [path.stem for path in NOTEBOOKS] == ["first_look", "proof"]
    for notebook in NOTEBOOKS:
        assert not any(cell["outputs"] or cell["execution_count"] for cell in cells(notebook, "code"))


def test_links_of_notebooks_lead_somewhere():
    for notebook in NOTEBOOKS:
        text = "".join("".join(cell["source"]) for cell in cells(notebook, "markdown"))
        for link in re.findall(r"\]\(([^)#]+)", text):
            assert (notebook.parent / link).is_file(), link


def test_samples_are_pages():
    for name, title in (("report", "Octree ray tracer: validation"), ("benchmark", "Octree ray tracer: benchmark")):
        text = gzip.decompress((ROOT / "docs" / "samples" / f"{name}.html.gz").read_bytes()).decode()
        assert f"<h1>{title}</h1>" in text and not re.search(r'(?:src|href)="(?!data:|#)', text)


def test_links_that_lead_nowhere_are_found(tmp_path, capsys):
    main = module("links")["main"]
    (tmp_path / "a.html").write_text(
        '<p id="here"><a href="b.html#there">b</a> <a href="#here">a</a> <img src="c.svg">'
    )
    (tmp_path / "b.html").write_text('<p id="there"><a href="https://elsewhere.example">x</a>')
    (tmp_path / "c.svg").touch()
    assert main(tmp_path / "empty") == 1  # a site without links is none
    assert main(tmp_path) == 0
    for broken in ("d.html", "b.html#nowhere", "#nowhere", "folder/"):
        (tmp_path / "b.html").write_text(f'<p id="there"><a href="{broken}">x</a>')
        assert main(tmp_path) == 1 and f"b.html: {broken}" in capsys.readouterr().out


@cases(
    "element",
    [
        '<iframe src="http://127.0.0.1:8123/"></iframe>',
        '<a href="http://localhost:8888/tree">x</a>',
        '<img src="https://[::1]/a.png">',
        '<img srcset="a.svg 1x, http://0.0.0.0:80/b.png 2x">',
        '<video poster="//app.localhost/a.png"></video>',
    ],
)
def test_a_server_on_the_machine_that_built_a_page_is_no_link(tmp_path, capsys, element):
    main = module("links")["main"]
    (tmp_path / "a.svg").touch()
    (tmp_path / "a.html").write_text(
        '<p id="x"><a href="#x">x</a><code>http://127.0.0.1:1/</code><a href="https://localhost.example/">x</a>'
    )
    assert main(tmp_path) == 0
    (tmp_path / "a.html").write_text(f'<p id="x"><a href="#x">x</a>{element}')
    assert main(tmp_path) == 1 and "a server on the machine that built it" in capsys.readouterr().out


def test_the_sites_notebook_shows_a_picture_of_the_viewer_and_no_frame():
    """In Jupyter the cell shows the viewer; the tag leaves its output out of the site's page."""
    notebook = ROOT / "docs" / "notebooks" / "first_look.ipynb"
    (cell,) = [cell for cell in cells(notebook, "code") if "renderer.view(" in "".join(cell["source"])]
    assert cell["source"][-1] == "viewing" and "remove-output" in cell["metadata"]["tags"]
    text = "".join("".join(cell["source"]) for cell in cells(notebook, "markdown"))
    (picture,) = re.findall(r"!\[[^]]+\]\((.+?)\)", text)
    assert (notebook.parent / picture).resolve() == ROOT / "docs" / "drawings" / "viewer.webp"


def test_every_public_name_is_in_the_reference():
    text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "api").glob("*.rst"))
    absent = [name for name in renderer.__all__ if f":: renderer.{name}\n" not in text]
    assert absent == ["__version__"]


def test_drawings_are_svg_without_what_lies_elsewhere():
    """Nothing fetched, and as wide as they say, so that pages of a code host show them."""
    drawings = sorted((ROOT / "docs" / "drawings").glob("*.svg"))
    assert drawings
    for path in drawings:
        text = path.read_text(encoding="utf-8")
        assert text.startswith('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ') and "aria-label" in text
        assert "href" not in text and text.count("http") == 1
