"""The seam of the seeded defects replaces exactly once and reaches kernels; a defect that is none is not caught."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from validation.defects import list as defects_list
from validation.defects import run as defects
from validation.defects.inject import Replacement, inject
from validation.defects.list import DEFECTS, Defect
from validation.defects.run import Answer
from validation.report import page as report

ROOT = Path(__file__).parents[3]
HARMLESS = Replacement("image._encoded", "encoded * 255.0 + 0.5", "0.5 + encoded * 255.0")
# Black, a middle grey and white, by hand: 255 (1.055 x .5^(1 / 2.4) - .055) = 187.5160.
TINY_CHECKS = """
from renderer.picture.image import srgb
from validation.gates import Gate

def run(groups):
    wrong = float(srgb([0.0, 0.5, 1.0]).tolist() != [0, 188, 255])
    return [Gate("images", group, "8-bit steps", wrong, "at most", 0.0, "the formula") for group in groups]
"""


@pytest.fixture
def tiny_checks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A module of checks that compiles no kernel, in reach of the processes in which defects are injected."""
    (tmp_path / "tiny_checks.py").write_text(TINY_CHECKS, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return "tiny_checks"


def python(program: str, cache: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, env=environment, check=False
    )


class TestSeam:
    @pytest.mark.parametrize("defect", DEFECTS, ids=lambda defect: defect.name)
    def test_each_rule_stands_once_and_the_broken_text_compiles(self, defect: Defect) -> None:
        text = defect.replacement.text()
        assert text != defect.replacement.path.read_text(encoding="utf-8")
        compile(text, defect.replacement.path.name, "exec")

    @pytest.mark.parametrize(("rule", "times"), [("encoded * 254.0", 0), ("255.0", 1), ("encoded", 9)])
    def test_a_rule_that_does_not_stand_once_is_refused(self, rule: str, times: int) -> None:
        replacement = Replacement("image._encoded", rule, "0.0")
        if times == 1:
            assert "0.0" in replacement.text()
            return
        with pytest.raises(ValueError, match=r"rule: expected once in renderer\..*image\._encoded, got \d+ times"):
            replacement.text()

    def test_a_process_that_has_the_renderer_is_refused(self) -> None:
        import renderer.picture.image  # noqa: F401

        with pytest.raises(RuntimeError, match="expected a process without modules of renderer"):
            inject(HARMLESS)

    def test_kernels_follow_though_the_cache_holds_sound_ones(self, tmp_path: Path) -> None:
        """The digest of ``shading`` and of what imports it changes; that of ``simd`` does not."""
        call = (
            "from renderer.shade.shading import fresnel; from renderer.jit.digest import source_digest\n"
            "from pathlib import Path; import json\n"
            "digests = [source_digest(Path('renderer').resolve() / f'{m}.py')"
            " for m in ('shade/shading', 'shade/direct', 'numerics/simd')]\n"
            "print(json.dumps([fresnel(1.0, 1.0, 1.0, 1.5), *digests]))"
        )
        alter = (
            "from validation.defects.inject import Replacement, inject\n"
            "inject(Replacement('fresnel', 'return 0.5 * (s * s + p * p)', 'return 7.0'))\n"
        )
        sound, broken, again = (json.loads(python(p, tmp_path).stdout) for p in (call, alter + call, call))
        assert sound[0] == pytest.approx(0.04, rel=1e-12)
        assert broken[0] == 7.0
        assert [a == b for a, b in zip(sound[1:], broken[1:], strict=True)] == [False, False, True]
        assert again == sound


def test_no_two_are_the_same() -> None:
    assert len({d.name for d in DEFECTS}) == len({d.replacement for d in DEFECTS}) == len(DEFECTS)


def test_a_real_defect_is_caught_and_a_harmless_change_is_not(tiny_checks: str) -> None:
    """The harmless one stands for a defect that no gate sees: it is told, and its gate fails. The control passes."""
    twice = next(d for d in DEFECTS if d.name == "sRGB applied twice")
    before = twice.replacement.path.read_bytes()
    harmless = Defect("another word in a docstring", "pictures", HARMLESS, kernel=False)
    slow = next(d for d in DEFECTS if d.kernel)
    record, gates = defects.run(True, lambda name: None, [twice, slow, harmless], checks=tiny_checks)
    assert twice.replacement.path.read_bytes() == before
    assert (record["control"]["gates"], record["control"]["red"], record["control"]["error"]) == (1, [], None)
    assert [(row["caught"], row["error"]) for row in record["defects"]] == [(True, None), (False, None)]
    assert record["defects"][0]["red"] == ["images: pictures: 8-bit steps"]
    assert (record["caught"], record["gates"][0]["alone"]) == (1, ["sRGB applied twice"])
    assert [gate.passed for gate in gates] == [True, True, False]
    drawn = page_of(record)
    assert "1 of 2 defects" in drawn and "not caught" in drawn


def page_of(record: dict[str, Any]) -> str:
    templates = FileSystemLoader(ROOT / "validation" / "report" / "templates")
    page = Environment(loader=templates, autoescape=True, undefined=StrictUndefined)
    page.filters["number"] = report.number
    return page.get_template("defects.html").render(m={"defects": json.loads(json.dumps(record))})


def test_an_error_is_no_verdict(tmp_path: Path, tiny_checks: str) -> None:
    """A replacement that breaks the program itself must not pass for one that was caught."""
    nonsense = Replacement("image._encoded", "encoded * 255.0 + 0.5", "nowhere")
    answer = defects.run_checks(nonsense, ("pictures",), tmp_path, tiny_checks)
    assert answer.error == "NameError: name 'nowhere' is not defined"
    assert answer.red == ()
    defect = Defect("nonsense", "pictures", nonsense, kernel=False)
    control = Answer(("images: a: b",), (), None, 1.0)
    assert [gate.passed for gate in defects.gates([defect], control, [answer])] == [True, False]
    assert not defects.record([defect], control, [answer])["defects"][0]["caught"]


def test_a_defect_that_never_ends_is_caught(tmp_path: Path, tiny_checks: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was counted as an error, and the suite said that nothing had noticed it."""
    monkeypatch.setattr(defects, "_PATIENCE", 3.0)
    endless = Replacement("image._encoded", "encoded * 255.0 + 0.5", "exec('while True: pass')")
    answer = defects.run_checks(endless, ("pictures",), tmp_path, tiny_checks)
    assert answer.red == (defects.HANGS,) and answer.error is None
    defect = Defect("endless", "pictures", endless, kernel=False)
    control = Answer(("images: a: b",), (), None, 1.0)
    assert [gate.passed for gate in defects.gates([defect], control, [answer])] == [True, True]
    assert not next(iter(defects.gates([defect], answer, [answer]))).passed


def test_record_tells_what_each_measure_caught_alone() -> None:
    """Places and views of one measure are one kind; an extreme case is one of its own, and is kept with a reason."""
    chosen = list(defects_list.PICTURES[:3])
    names = ("images: a, own offset: ssim", "images: b, matched offset: ssim_foreground", "images: b: mean_error",
             "hits: sphere, camera rays: wrong", "hits: soup, camera rays: wrong",
             "stability: extreme case 7: a ray: at 0: holds")  # fmt: skip
    control = Answer(names, (), None, 1.0)
    answers = [Answer(names, names[:2], None, 1.0), Answer(names, names[2:5], None, 1.0), Answer(names, (), None, 1.0)]
    record = defects.record(chosen, control, answers)
    found = {row["gate"]: (row["caught"], row["alone"], row["kept"] is not None) for row in record["gates"]}
    assert found == {
        "ssim": (1, [chosen[0].name], True),
        "mean_error": (1, [], False),
        "wrong": (1, [], False),
        "extreme case 7": (0, [], True),
    }
    assert record["caught"] == 2
    assert not defects.gates(chosen, Answer(names, names[:1], None, 1.0), answers)[0].passed
    assert defects.idle(record).value == 2.0  # mean_error and wrong: each was red together with the other
