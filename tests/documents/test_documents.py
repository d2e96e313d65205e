"""What README and docs say to type works as it stands, and what they name is there."""

import ast
import doctest
import inspect
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import textwrap
import tomllib
from dataclasses import fields
from functools import cache
from glob import glob
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml
from cases import cases
from furnished import write_room

from renderer import Hits, Octree, load_scene
from renderer.cli.main import main, make_parser
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import box
from validation.__main__ import make_parser as validation_parser
from validation.benchmark.__main__ import make_parser as benchmark_parser
from validation.stability.section import CASES
from validation.thresholds import HitLimits, load_thresholds

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
DOCS = sorted((ROOT / "docs").rglob("*.md"))
PAGES = [README, *DOCS, ROOT / "reports" / "README.md", *sorted(ROOT.glob("[CS]*.md"))]
PYTHON = re.compile(r"```python\n(.*?)```", re.DOTALL)
SESSION = re.compile(r"```pycon\n(.*?)```", re.DOTALL)
CODE = re.compile(r"```py(?:thon|con)\n(.*?)```", re.DOTALL)
FENCED = re.compile(r"```(toml|yaml)\n(.*?)```", re.DOTALL)
# A line of a block to type, without its comment, and commands within a sentence or a table.
TYPED = re.compile(r"^    (\S.*?)(?:\s+#.*)?$", re.MULTILINE)
COMMAND = re.compile(r"(?:make|pip|python3?|pre-commit|octree-\w+|rm) ")
SAID = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
NAMED = re.compile(
    r"(?<![\w/.-])((?:renderer|validation|tests|docs|scenes|reports|recipe|\.ci|\.github)/(?:[\w./-]*\w/?)?)(?:::(\w+))?"
)
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
# What commands write, and so may be absent.
WRITTEN = {
    "reports/index.html",
    "reports/metrics.json",
    "reports/benchmark.html",
    "renderer/__pycache__",
    "renderer/compiled",
}
PARSERS = {
    "octree-render": make_parser,
    "octree-validate": validation_parser,
    "python -m validation": validation_parser,
    "python -m validation.benchmark": benchmark_parser,
}
MOST_LINES = 110
# Packages that pages show and requirements.lock leaves out. Their Python is run where they are installed; elsewhere it
# is compiled and its names of ours are looked up.
ABSENT = {"open3d", "pyvista"}
# Commands that are run here in a short form, by how they begin: words in the place of others, and words more.
IN_SHORT: dict[str, tuple[dict[str, str], str]] = {
    "octree-render render scenes/three_models.toml -o out.png --resolution 8192x8192": (
        {"8192x8192": "64x48", "16": "1"},
        "--threads 1",
    ),
    "octree-validate --scene my.toml": ({}, "--quick"),
    "python -m validation --scene": ({}, "--quick"),
    "python -m validation.benchmark.measures.queries": (
        {"1000000": "1000", "city_100k": "city_1000", "200000": "100"},
        "--rays 100",
    ),
    "python -m validation.benchmark.measures.studies": ({}, "--mesh city --faces 1000 --points 100"),
    "python -m validation.benchmark.measures.cluster": ({}, "--mesh city_2000 --rounds 1"),
    "python tests/fuzz --inputs 100000": ({"100000": "20"}, ""),
    "python scenes/make_quarter.py": ({}, "--buildings 40"),
    "python scenes/make_car_park.py": ({}, "--frames 2"),
}
# Commands that another file runs, by how they begin.
RUN_ELSEWHERE = {
    "make lint": ".ci/run",
    "make test-slow": ".ci/run",
    "make test": ".ci/run",
    "make docs": ".ci/run",
    "make validate QUICK=1": ".ci/run",
    "python3 -m venv": "tests/packaging/test_installing.py",
    "pip install": "tests/packaging/test_installing.py",
    "python -m build": "tests/packaging/test_installing.py",
    "rm -r renderer/compiled": "tests/packaging/test_installing.py",
    "python -m wheel tags": "tests/packaging/test_installing.py",
    "octree-render view": "tests/viewer/test_viewer_server.py",
    "octree-render compile --level": "tests/packaging/test_compiling_ahead.py",
    "octree-render study sky city.ply -o sky.npy --cluster tcp://": "tests/cluster/test_commands.py",
    "octree-validate --compare": "tests/validation/recorded/test_recorded.py",
    "python -m validation.benchmark.measures.versions": "tests/validation/benchmark/test_versions.py",
}
# Commands that nothing runs, by how they begin, and why. Their options are checked as those of all others are, and what
# make would call is looked at.
NOT_RUN = {
    "make validate": "minutes to hours; CI has the short run, whose sections are the same",
    "make bench": "an hour; tests/validation/benchmark/test_command.py runs the module in short",
    "make machines": "half an hour of all tests",
    "pre-commit install": "of another project, into the checkout's own hooks",
    "python -m validation [": "a line of usage",
    "python -m validation --defects [": "a line of usage",
    "python -m validation --write-baseline [": "a line of usage",
    "python -m validation --record FILE": "a line of usage",
    "python -m validation --compare FILE": "a line of usage",
}
NOT_HERE = (*RUN_ELSEWHERE, *NOT_RUN)
# Files of a user that commands of pages name.
OWN = {"my.toml", "my.ply", "city.ply", "scan.ply", "model.stl"}


def shown(value):
    return value.name if isinstance(value, Path) else str(value)[:60]


def snippets():
    return [(page, block) for page in PAGES for block in PYTHON.findall(page.read_text(encoding="utf-8"))]


def typed(page):
    """The commands of a page's blocks, without folders of executables and variables of the environment before them."""
    text = CODE.sub("", page.read_text(encoding="utf-8"))
    lines = [re.sub(r"^(?:[A-Z_]+=\S+ )+", "", line) for line in TYPED.findall(text)]
    return [re.sub(r"^\.venv/bin/", "", part.strip()) for line in lines for part in line.split("&&")]


def said(page):
    """The commands in a page's sentences that are whole: with an option, an argument or a target."""
    found = [re.sub(r"^\.venv/bin/", "", words) for words in SAID.findall(page.read_text(encoding="utf-8"))]
    return [words for words in found if " " in words]


def commands(*starts):
    """(page, command) of all commands with one of these first words, each once."""
    pairs = [(page, line) for page in PAGES for line in [*typed(page), *said(page)] if line.startswith(starts)]
    return list(dict.fromkeys(pairs))


@pytest.mark.judges("Hits.hit")
@pytest.mark.parametrize(("page", "block"), snippets(), ids=shown)
def test_python_in_a_page_runs_as_it_stands(page, block, tmp_path, monkeypatch):
    """In a checkout, of which nothing is changed: pictures go elsewhere."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    code = compile(block, str(page), "exec")
    for package in sorted(ABSENT & set(re.findall(r"^import (\w+)", block, re.MULTILINE))):
        if find_spec(package) is None:
            assert unknown_names(block) == []
            pytest.skip(f"compiled and its names of ours found, but not run: {package} is not installed")
    names: dict[str, object] = {"__name__": "__main__"}
    exec(code, names)


@pytest.mark.judges("Hits.hit")
@pytest.mark.parametrize("page", [page for page in PAGES if "```pycon" in page.read_text(encoding="utf-8")], ids=shown)
def test_a_session_in_a_page_prints_what_stands_there(page, tmp_path, monkeypatch):
    """All sessions of a page in one interpreter, one after the other."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    text = "\n".join(SESSION.findall(page.read_text(encoding="utf-8")))
    examples = doctest.DocTestParser().get_examples(text)
    runner = doctest.DocTestRunner(verbose=False)
    runner.run(doctest.DocTest(examples, {}, page.name, str(page), 0, text))
    assert runner.tries == text.count(">>> ") > 0 and runner.failures == 0


def unknown_names(block):
    """What a block takes from our modules, or asks an octree for, and which is not there."""
    absent = []
    for node in ast.walk(ast.parse(block)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "renderer":
            module = import_module(node.module)
            absent += [f"{node.module}.{name.name}" for name in node.names if not hasattr(module, name.name)]
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value).split(".")[-1] == "octree":
            call = next((c for c in ast.walk(ast.parse(block)) if isinstance(c, ast.Call) and same(c.func, node)), None)
            found = getattr(Octree, node.attr, None)
            known = set(inspect.signature(found).parameters) if call and callable(found) else set()
            if found is None or (call and not {k.arg for k in call.keywords} <= known):
                absent.append(ast.unparse(call or node))
    return absent


def same(one, other):
    return ast.dump(one) == ast.dump(other)


def test_names_that_are_not_there_are_found():
    assert unknown_names("from renderer import Octree\nball.octree.contains([1], rule='nonzero').all()") == []
    assert unknown_names("from renderer import Octtree") == ["renderer.Octtree"]
    assert unknown_names("octree.first_hit(1)\nball.octree.contains(1, rules=2)") == [
        "octree.first_hit(1)",
        "ball.octree.contains(1, rules=2)",
    ]


def runnable():
    """(page, command) of all commands of blocks that are run here."""
    pairs = dict.fromkeys((page, line) for page in PAGES for line in typed(page) if COMMAND.match(line))
    return [(page, line) for page, line in pairs if not line.startswith(NOT_HERE)]


def in_short(line):
    """The words of a command, as it is run here."""
    words = shlex.split(line)
    for start, (others, more) in IN_SHORT.items():
        if line.startswith(start):
            assert others.keys() <= set(words) or "queries" in start
            words = [others.get(word, word) for word in words] + shlex.split(more)
    return words


def blocks(kind):
    """(page, block) of all blocks of TOML or YAML."""
    return [(p, text) for p in PAGES for of, text in FENCED.findall(p.read_text(encoding="utf-8")) if of == kind]


def kind_of(toml):
    """What a block of TOML is: a scene, thresholds, or part of a project file."""
    keys = set(tomllib.loads(toml))
    return "scene" if "camera" in keys else "project" if "project" in keys else "thresholds"


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder with what the pages' commands name: parts of a checkout, and a user's own files."""
    for name in ("scenes", "renderer", "validation", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "houses").mkdir()
    for z, name in enumerate(("houses/1.obj", "houses/tree_1.obj", "terrain.obj")):
        (tmp_path / name).write_text(f"v 0 0 {z}\nv 1 0 {z}\nv 0 1 {z}\nf 1 2 3\n")
    for name in ("city.ply", "scan.ply"):
        save_ply(box((0.0, 0.0, 0.0), (4.0, 3.0, 2.0)), tmp_path / name)
    write_room(tmp_path)
    (tmp_path / "suns.txt").write_text("1 0 1\n-1 0 1\n")
    (tmp_path / "suns.csv").write_text("azimuth,elevation,hours\n90,45,1\n270,45,2\n")
    save_ply(box((0.0, 0.0, 0.0), (4.0, 3.0, 2.0)), tmp_path / "my.ply")
    (tmp_path / "script.py").write_text("from renderer import Octree\n")
    for _, text in blocks("toml"):
        if kind_of(text) != "project":
            (tmp_path / {"scene": "my.toml", "thresholds": "thresholds.toml"}[kind_of(text)]).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(("page", "line"), runnable(), ids=shown)
def test_a_command_of_a_page_runs(page, line, checkout):
    before = set(checkout.iterdir())
    program, *arguments = [path for word in in_short(line) for path in sorted(glob(word)) or [word]]
    if program == "octree-render":
        assert make_parser().prog == program and main(arguments) == 0
    else:
        known = {"python": [sys.executable], "octree-validate": [Path(sys.executable).with_name("octree-validate")]}
        command = [*known[program], *arguments]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    named = ("hours.ply", "shaded.ply", "factors.csv")
    written = {word for word in arguments if word.endswith((".png", ".npy", ".npz")) or word in named}
    assert written <= {path.name for path in set(checkout.iterdir()) - before}
    if "--output" in arguments:
        page = checkout / arguments[arguments.index("--output") + 1] / "index.html"
        assert "PASS" in done.stdout and page.stat().st_size > 10_000


@pytest.mark.parametrize(("page", "text"), blocks("toml"), ids=shown)
def test_toml_in_a_page_is_what_it_stands_for(page, text, checkout):
    kind = kind_of(text)
    if kind == "scene":
        assert load_scene("my.toml").instances
    elif kind == "thresholds":
        assert load_thresholds("thresholds.toml").moved()
    else:
        groups = set(tomllib.loads(text)["project"]["entry-points"])
        own = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
        assert groups <= set(own)


def workflows(host):
    """(page, block) of the blocks of YAML for that host: GitHub's have jobs, GitLab's are jobs."""
    return [(p, text) for p, text in blocks("yaml") if ("jobs" in yaml.safe_load(text)) == (host == "GitHub")]


@pytest.mark.parametrize(("page", "text"), workflows("GitHub"), ids=shown)
def test_a_workflow_in_a_page_has_our_own_actions_and_options_that_there_are(page, text):
    """Its commands are run by tests/packaging/test_installing.py."""
    used, own = (
        set(re.findall(r"uses: (\S+ # v[\d.]+)$", of, re.MULTILINE))
        for of in (text, (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
    )
    assert used and used <= own and text.count("uses:") == len(used)
    (job,) = yaml.safe_load(text)["jobs"].values()
    (line,) = [step["run"] for step in job["steps"] if step.get("run", "").startswith("octree-validate")]
    options = validation_parser().parse_args(shlex.split(line)[1:])
    (upload,) = [step["with"] for step in job["steps"] if "upload-artifact" in step.get("uses", "")]
    assert Path(upload["path"]) == options.output


@pytest.mark.parametrize(("page", "text"), workflows("GitLab"), ids=shown)
def test_a_job_in_a_page_has_the_commands_of_the_workflow_and_keeps_what_they_write(page, text):
    """So what is run for the workflow is run for it too, but for where the wheel comes from."""
    (job,) = yaml.safe_load(text).values()
    install, validate = job["script"]
    (other,) = [of for p, of in workflows("GitHub") if p == page]
    assert validate in other and re.fullmatch(
        r'pip install "octree_renderer-[\d.]+-py3-none-any\.whl\[validate]"', install
    )
    output = validation_parser().parse_args(shlex.split(validate)[1:]).output
    assert [Path(kept) for kept in job["artifacts"]["paths"]] == [output]
    assert Path(job["artifacts"]["reports"]["junit"]) == output / "junit.xml"


def test_what_is_not_run_here_is_a_command_of_a_page_and_its_file_is_there():
    lines = [line for page in PAGES for line in [*typed(page), *said(page)]]
    for start in (*IN_SHORT, *RUN_ELSEWHERE, *NOT_RUN):
        assert any(line.startswith(start) for line in lines), start
    named = [path for why in NOT_RUN.values() for path in re.findall(r"[\w.]+(?:/[\w.]+)+", why)]
    for path in (*RUN_ELSEWHERE.values(), *named):
        assert (ROOT / path).is_file(), path


@pytest.mark.parametrize(("page", "line"), commands("python -m validation ["), ids=shown)
def test_options_of_a_line_of_usage_are_ones_that_there_are(page, line):
    known = validation_parser().format_help()
    words = re.findall(r"--[\w-]+", line)
    assert words and all(re.search(rf"{word}\b", known) for word in words)


def test_thresholds_in_a_page_are_ones_that_there_are(tmp_path):
    text = (ROOT / "reports" / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^    (\[pictures\.own\]\n(?:    .*\n|\n)+)", text, re.MULTILINE)
    (tmp_path / "thresholds.toml").write_text(textwrap.dedent("    " + block))
    thresholds = load_thresholds(tmp_path / "thresholds.toml")
    assert (thresholds.pictures.own.ssim, thresholds.hits.near_edge) == (0.997, 2)


@cases("page", PAGES)
def test_every_block_is_of_a_kind_that_is_run(page):
    """Python is run above, TOML and YAML are read; what Sphinx and BibTeX read is neither's; nothing hides as text."""
    kinds = re.findall(r"^```(.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    kinds = {kind.split()[0] for kind in kinds}
    of_sphinx = {"index.md": {"{include}", "{toctree}", "{raw}"}, "downloads.md": {"{raw}"}}.get(page.name, set())
    assert kinds <= {"python", "pycon", "toml", "yaml", "bibtex", *of_sphinx}


@cases(("page", "line"), commands("octree-", "python -m validation"))
def test_options_in_a_page_are_ones_that_there_are(page, line):
    words = shlex.split(line.split(" [--")[0])  # of a usage line what comes before its options
    if any("..." in word for word in words):
        return
    start = max((s for s in PARSERS if words[: len(s.split())] == s.split()), key=len, default=None)
    if start is None:
        assert find_spec(words[2]), f"{page}: {line}"  # a module of its own
        return
    parser = PARSERS[start]()
    arguments = words[len(start.split()) :]
    if start == "octree-render" and len(arguments) == 1:  # a command by its name alone
        arguments.append("--help")
    try:
        parser.parse_args(arguments)
    except SystemExit as ended:
        assert ended.code == 0, f"{page}: {line}"  # --help


# What each target calls at last; lint and docs have more than one command.
CALLS = {
    "validate": "python -m validation", "test": "python -m pytest", "test-slow": "python -m pytest",
    "machines": "python tests/machines.py",
    "bench": "python -m validation.benchmark", "conformance": "python -m validation.conformance",
    "docs": "python docs/links.py", "lint": "lint-imports",
}  # fmt: skip


@pytest.mark.parametrize(("page", "line"), commands("make "), ids=shown)
def test_make_passes_on_what_a_page_gives_it(page, line):
    """By a dry run, which prints what would be run."""
    if shutil.which("make") is None:
        pytest.skip("no make")
    command = ["make", "--dry-run", "--no-print-directory", *shlex.split(line)[1:]]
    # `make test ARGS=...` hands ARGS down to what it runs, this test too: found when it was called so.
    handed_down = {"MAKEFLAGS", "MAKEOVERRIDES", "MFLAGS", "ARGS", "QUICK"}
    own = {name: value for name, value in os.environ.items() if name not in handed_down}
    done = subprocess.run(command, cwd=ROOT, env=own, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    target = shlex.split(line)[1]
    if target == "clean":
        assert "rm -rf .venv " in done.stdout
        return
    if target == "docs":  # from nothing, or pages of files that are gone stay
        assert "\nrm -rf build/site\n" in f"\n{done.stdout}" and " --fresh-env " in done.stdout
    (called,) = [words for words in done.stdout.splitlines() if words.startswith(f".venv/bin/{CALLS[target]}")]
    passed = called.removeprefix(f".venv/bin/{CALLS[target]}").split("--ignore=tests/page")[-1].strip()
    quick = ["--quick"] * ("QUICK=1" in line)
    options = [word for text in shlex.split(line) if text.startswith("ARGS=") for word in shlex.split(text[5:])]
    if target in ("validate", "test", "machines", "bench"):
        assert shlex.split(passed) == quick + options
    if target in ("validate", "bench"):
        assert (validation_parser() if target == "validate" else benchmark_parser()).parse_args(options)
    if target == "machines":
        assert set(options) <= set(runpy.run_path(str(ROOT / "tests" / "machines.py"))["MACHINES"])


def test_no_page_promises_a_package_on_an_index():
    for page in PAGES:
        assert "pip install octree-renderer" not in page.read_text(encoding="utf-8")
        assert "'octree-renderer[" not in page.read_text(encoding="utf-8")


def test_the_readme_stays_short():
    assert len(README.read_text(encoding="utf-8").splitlines()) <= MOST_LINES


def test_the_readme_uses_nothing_before_it_is_installed():
    """Line by line on a fresh clone: a .venv, then what is installed into it, then what that brings."""
    there = {"python3", "make"}
    for line in TYPED.findall(README.read_text(encoding="utf-8")):
        program = line.split()[0]
        assert program in there, line
        if line.startswith("python3 -m venv .venv"):
            there |= {".venv/bin/pip", ".venv/bin/python"}
        elif program == ".venv/bin/pip":
            assert "install -e '.[viewer]'" in line  # what `view` needs as well
            there |= {".venv/bin/octree-render"}
        elif line.startswith("make "):
            there |= {".venv/bin/octree-validate"}
    assert ".venv/bin/octree-render" in there


def anchors(page):
    """The anchors of a page's headings, as GitHub makes them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in HEADING.findall(text)}


def links(page):
    return [link for link in LINK.findall(CODE.sub("", page.read_text(encoding="utf-8"))) if "://" not in link]


@cases(("page", "link"), [(p, link) for p in PAGES for link in links(p)])
def test_a_link_leads_somewhere(page, link):
    path, _, anchor = link.partition("#")
    there = page.parent / path if path else page
    assert there.exists(), f"{page}: {link}"
    assert not anchor or anchor in anchors(there), f"{page}: {link}"


def test_every_page_is_reached_from_the_readme():
    reached, pending = set(), [README]
    while pending:
        page = pending.pop().resolve()
        if page not in reached:
            reached.add(page)
            pending += [page.parent / link.partition("#")[0] for link in links(page) if ".md" in link]
    assert reached >= {page.resolve() for page in PAGES}


@cache
def defined(path):
    """What a source file defines: functions, classes, constants and fields, at any depth."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.AsyncFunctionDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names |= {name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)}
    return names


@cases("page", PAGES)
def test_what_a_page_names_is_there(page):
    """Files and folders, and with ``::`` a function, class, constant or test that stands in the file."""
    absent = []
    for path, name in NAMED.findall(page.read_text(encoding="utf-8")):
        there = ROOT / path
        if path.rstrip("/") in WRITTEN:
            continue
        if not there.exists() or (path.endswith("/") and not there.is_dir()) or (name and name not in defined(there)):
            absent.append(f"{path}::{name}" if name else path)
    assert absent == []


@cases("page", PAGES)
def test_extreme_cases_and_gates_that_a_page_names_are_there(page):
    numbers = {case.number for case in CASES}
    assert {int(number) for number in re.findall(r"\b[Cc]ase (\d+)\b", page.read_text(encoding="utf-8"))} <= numbers
    attributes = {*dir(Hits), *(field.name for field in fields(Hits))}
    gates = set(re.findall(r"`hits\.(\w+)`", page.read_text(encoding="utf-8"))) - attributes
    assert gates <= set(HitLimits.model_fields)


@pytest.mark.parametrize("package", ["renderer", "validation"])
def test_the_diagram_of_the_rooms_has_the_order_of_the_contracts(package):
    """Folder by folder from above, as import-linter checks them; names that may be absent need not be drawn."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    (layers,) = (contract["layers"] for contract in contracts if contract["id"] == package)
    levels = {
        name: level for level, line in enumerate(layers) for name in line.strip("()").replace(")", "").split(" | ")
    }
    there = {name for name in levels if (ROOT / package / name).is_dir() or (ROOT / package / f"{name}.py").is_file()}
    lines = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8").splitlines()
    (top,) = (k for k, line in enumerate(lines) if re.fullmatch(r"    renderer/ +validation/", line))
    column = (
        slice(4, lines[top].index("validation/"))
        if package == "renderer"
        else slice(lines[top].index("validation/"), 999)
    )
    block = lines[top + 1 : lines.index("", top)]
    # The names, less what is said of them three spaces further on.
    drawn = [name.strip("/") for line in block for name in re.split(r" {3,}", line[column].strip())[0].split()]
    assert set(drawn) == there
    assert [levels[name] for name in drawn] == sorted(levels[name] for name in drawn)
