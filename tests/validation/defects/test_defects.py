"""The seeded defects break what they name and reach kernels; a defect that is none is not caught."""

import ast
import inspect
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import cache, reduce
from importlib import import_module
from pathlib import Path
from types import CodeType
from typing import Any

import pytest
from cases import cases
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from validation.defects import places
from validation.defects import run as defects
from validation.defects.answers import HANGS, Answer, Known, together
from validation.defects.changes import Constant, Function, Rule, Wrapped
from validation.defects.edits import value
from validation.defects.inject import PACKAGE, inject
from validation.defects.list import DEFECTS
from validation.defects.places import find_name, rules
from validation.defects.record import _VIEWS, KEPT, gates, idle, record
from validation.defects.seeded.defect import Defect
from validation.report import page as report

ROOT = Path(__file__).parents[3]
# Black, a middle grey and white, by hand: 255 (1.055 x .5^(1 / 2.4) - .055) = 187.5160.
TINY = """
from validation.defects.changes import Rule
from validation.defects.edits import operand, value
from validation.defects.list import DEFECTS as ALL
from validation.defects.seeded.defect import Defect

DEFECTS = [next(defect for defect in ALL if defect.name == "sRGB applied twice")] + [
    Defect("pictures", name, Rule("rounded-encoding", edit)) for name, edit in {
        "the same in another form": value("_ + 0"),
        "nonsense": value("1 // 0"),
        "endless": value("exec('while True: pass')"),
    }.items()
] + [Defect("studies", "public names without a test or gate", Rule("rounded-encoding", value("_")))]

def run(group):
    from renderer.picture.image import srgb
    from validation.gates import Gate

    if group == "studies":
        raise OSError("no judge")
    wrong = float(srgb([0.0, 0.5, 1.0]).tolist() != [0, 188, 255])
    return [Gate("images", group, "8-bit steps", wrong, "at most", 0.0, "the formula")]
"""


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> defects.Modules:
    """A module of defects and checks that compile no kernel, in reach of the processes with defects."""
    (tmp_path / "tiny.py").write_text(TINY, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(tmp_path)
    return defects.Modules("tiny", "tiny")


@cache
def compiled(path: Path) -> CodeType:
    return compile(path.read_bytes(), "", "exec")


def python(program: str, cache: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, env=environment, check=False
    )


@pytest.fixture(scope="module", autouse=True)
def _named_once() -> Iterator[None]:
    """Each file's module is named once, though every defect is looked for among all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(places, "module_of", cache(places.module_of))
        yield


class TestSeam:
    @cases("change", [d.change for d in DEFECTS if not isinstance(d.change, Wrapped)])
    def test_each_name_is_there_once_and_the_broken_text_compiles(self, change: Rule | Constant | Function) -> None:
        altered = change.altered(PACKAGE)
        assert compile(altered.text, altered.path.name, "exec") != compiled(altered.path)

    @pytest.mark.parametrize(
        "change", [d.change for d in DEFECTS if isinstance(d.change, Wrapped)], ids=lambda c: c.name
    )
    def test_a_wrapper_takes_what_the_sound_function_takes(self, change: Wrapped) -> None:
        module, name = find_name(PACKAGE, change.name)
        sound = reduce(getattr, name.split("."), import_module(module))
        taken = inspect.signature(getattr(sound, "py_func", sound)).parameters.values()
        required = [p.name for p in taken if p.default is p.empty and p.kind is p.POSITIONAL_OR_KEYWORD]
        assert inspect.signature(change.wrapper).bind(sound, *required)

    def test_what_wrappers_import_is_there(self) -> None:
        """They import only when they are called, once a defect is injected."""
        sources = Path(defects.__file__).parent.joinpath("seeded").glob("*.py")
        trees = [ast.parse(source.read_text(encoding="utf-8")) for source in sources]
        inner = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        names = [(node.module, alias.name) for node in inner for alias in node.names]
        assert len([module for module, _ in names if module and module.startswith("renderer.")]) > 5
        assert [name for name in names if not hasattr(import_module(str(name[0])), name[1])] == []

    def test_each_rule_in_the_sources_is_broken_by_a_defect(self) -> None:
        broken = {defect.change.name for defect in DEFECTS if isinstance(defect.change, Rule)}
        assert sorted(rules(PACKAGE)) == sorted(broken)

    def test_a_process_that_has_the_renderer_is_refused(self) -> None:
        import renderer.picture.image  # noqa: F401

        with pytest.raises(RuntimeError, match="expected a process without modules of renderer"):
            inject(Rule("rounded-encoding", value("_")))

    def test_kernels_follow_though_the_cache_holds_sound_ones(self, tmp_path: Path) -> None:
        """The digest of ``dielectric`` and of what imports it changes; that of ``simd`` does not."""
        call = (
            "from renderer.materials.dielectric import fresnel; from renderer.jit.digest import source_digest\n"
            "from pathlib import Path; import json\n"
            "digests = [source_digest(Path('renderer').resolve() / f'{m}.py')"
            " for m in ('materials/dielectric', 'shade/direct', 'numerics/simd')]\n"
            "print(json.dumps([fresnel(1.0, 1.0, 1.0, 1.5), *digests]))"
        )
        alter = (
            "from validation.defects.changes import Rule; from validation.defects.edits import value\n"
            "from validation.defects.inject import inject\n"
            "inject(Rule('both-polarisations', value('7.0')))\n"
        )
        sound, broken, again = (json.loads(python(p, tmp_path).stdout) for p in (call, alter + call, call))
        assert sound[0] == pytest.approx(0.04, rel=1e-12)
        assert broken[0] == 7.0
        assert [a == b for a, b in zip(sound[1:], broken[1:], strict=True)] == [False, False, True]
        assert again == sound

    def test_python_is_wrapped_for_all_who_import_it_or_for_one(self, tmp_path: Path) -> None:
        program = (
            "from validation.defects.changes import Wrapped; from validation.defects.inject import inject\n"
            "inject(Wrapped('{name}', lambda sound, directions: 2.0 * sound(directions)))\n"
            "from renderer.studies import share, sky; import numpy as np, json\n"
            "print(json.dumps([float(module.lengths_of(np.ones((1, 1)))[0]) for module in (share, sky)]))"
        )
        found = [
            json.loads(python(program.format(name=name), tmp_path).stdout)
            for name in ("share.lengths_of", "sky.lengths_of")
        ]
        assert found == [[2.0, 2.0], [1.0, 2.0]]


def test_no_two_are_the_same() -> None:
    assert len({d.name for d in DEFECTS}) == len(DEFECTS)


def test_a_real_defect_is_caught_and_a_harmless_change_is_not(tiny: defects.Modules) -> None:
    """The harmless one stands for a defect that no gate sees: it is told, and its gate fails. The control passes."""
    chosen = defects.chosen(True, tiny)[:2]
    found, judged = defects.run(chosen, lambda name: None, tiny)
    assert (found["control"]["gates"], found["control"]["red"], found["control"]["error"]) == (1, [], None)
    assert [(row["caught"], row["error"]) for row in found["defects"]] == [(True, None), (False, None)]
    assert found["defects"][0]["red"] == ["images: pictures: 8-bit steps"]
    assert (found["caught"], found["gates"][0]["alone"]) == (1, ["sRGB applied twice"])
    assert [gate.passed for gate in judged] == [True, True, False]
    drawn = page_of(found)
    assert "1 of 2 seeded defects were caught" in drawn and "not caught" in drawn
    # They are no part of the run's verdict, so they have none of its colours.
    assert "good" not in drawn and "bad" not in drawn


def test_an_interrupted_run_goes_on(tmp_path: Path, tiny: defects.Modules) -> None:
    """What is known is not asked again, unless the sources are others."""
    path, chosen = tmp_path / "known.json", defects.chosen(True, tiny)[:1]
    Known(path, "sources").add("sRGB applied twice", Answer(("a: b: c",), (), None, 1.0))
    for sources, caught in (("sources", 0), ("others", 1)):
        found, _ = defects.run(chosen, lambda name: None, tiny, Known(path, sources))
        assert found["caught"] == caught
    assert Known(path, "others").answers["sRGB applied twice"].red == ("images: pictures: 8-bit steps",)
    Known(path, "others").forget()
    assert not path.exists()


def page_of(record: dict[str, Any]) -> str:
    templates = FileSystemLoader(ROOT / "validation" / "report" / "templates")
    page = Environment(loader=templates, autoescape=True, undefined=StrictUndefined)
    page.filters["number"] = report.number
    stored = json.loads(json.dumps(record)) | {"started": "2026-01-01", "quick": True, "changed": False}
    return page.get_template("defects.html").render(m={"defects": stored})


def test_an_error_is_no_verdict(tmp_path: Path, tiny: defects.Modules) -> None:
    """A replacement that breaks the program itself must not pass for one that was caught; nor is it kept."""
    answer = defects.run_checks("nonsense", "pictures", tmp_path, tiny)
    assert answer.error == "ZeroDivisionError: integer division or modulo by zero"
    assert answer.red == ()
    defect = Defect("pictures", "nonsense", Rule("rounded-encoding", value("1 // 0")))
    control = Answer(("images: a: b",), (), None, 1.0)
    assert [gate.passed for gate in gates([defect], control, [answer])] == [True, False]
    assert not record([defect], control, [answer])["defects"][0]["caught"]
    known = Known(tmp_path / "known.json")
    known.add("nonsense", answer)
    assert known.answers == {}


def test_checks_that_fail_without_a_defect_end_the_run(tiny: defects.Modules) -> None:
    """Each defect was tried, though all would end with that error."""
    with pytest.raises(ChildProcessError, match="checks of the sound renderer end with OSError: no judge"):
        defects.run(defects.chosen(True, tiny)[-1:], lambda name: None, tiny)


def test_a_defect_that_never_ends_is_caught(tmp_path: Path, tiny: defects.Modules, monkeypatch: Any) -> None:
    """It was counted as an error, and the suite said that nothing had noticed it."""
    monkeypatch.setattr(defects, "_PATIENCE", 3)
    answer = defects.run_checks("endless", "pictures", tmp_path, tiny)
    assert answer.red == (HANGS,) and answer.error is None
    defect = Defect("pictures", "endless", Rule("rounded-encoding", value("0")))
    control = Answer(("images: a: b",), (), None, 1.0)
    assert [gate.passed for gate in gates([defect], control, [answer])] == [True, True]
    assert not next(iter(gates([defect], answer, [answer]))).passed
    assert together([control, answer]).red == (HANGS,)


def test_record_tells_what_each_measure_caught_alone() -> None:
    """Places and views of one measure are one kind; an extreme case is one of its own, and is kept with a reason."""
    chosen = DEFECTS[:3]
    names = ("images: a, own offset: ssim", "images: b, matched offset: ssim_foreground", "images: b: mean_error",
             "hits: sphere, camera rays: wrong", "hits: soup, camera rays: wrong",
             "stability: extreme case 7: a ray: at 0: holds")  # fmt: skip
    control = Answer(names, (), None, 1.0)
    answers = [Answer(names, names[:2], None, 1.0), Answer(names, names[2:5], None, 1.0), Answer(names, (), None, 1.0)]
    rows = record(chosen, control, answers)
    found = {row["gate"]: (row["caught"], row["alone"], row["kept"] is not None) for row in rows["gates"]}
    assert found == {
        "ssim": (1, [chosen[0].name], True),
        "mean_error": (1, [], False),
        "wrong": (1, [], False),
        "extreme case 7": (0, [], True),
    }
    assert rows["caught"] == 2
    assert not gates(chosen, Answer(names, names[:1], None, 1.0), answers)[0].passed
    assert idle(rows).value == 2.0  # mean_error and wrong: each was red together with the other


def test_kinds_with_a_reason_are_quantities_of_gates() -> None:
    """A gate that was renamed would lose its reason."""
    sources = [path for path in (ROOT / "validation").rglob("*.py") if path.name != "record.py"]
    text = "".join(path.read_text(encoding="utf-8") for path in sources)
    known = {*KEPT, *_VIEWS, *_VIEWS.values()} - {"extreme case"}
    missing = [name for name in known if f'"{name}"' not in text]
    # Made from the names of what a pixel shows.
    assert sorted(missing) == ["pixels whose distance is off", "pixels whose position is off"]
