"""JUnit XML: every gate is a case where CI looks for it, and a failure says value, threshold and reason."""

from typing import Any
from xml.etree import ElementTree as ET

from validation.gates import Gate
from validation.report import junit


def document(*gates: Gate, left_out: dict[str, str] | None = None) -> ET.Element:
    sections = dict.fromkeys(gate.section for gate in gates)
    metrics: dict[str, Any] = {
        "started": "2026-01-01T00:00:00+00:00", "seconds": 2.5, "matrix": [{"section": name} for name in sections],
        "gates": [gate.record() for gate in gates], "left_out": left_out or {},
        **{name: {"seconds": 1.25} for name in sections},
    }  # fmt: skip
    return ET.fromstring(junit.document(metrics))


def test_suites_cases_and_failures() -> None:
    good = Gate("hits", "torus", "leaks", 0.0, "at most", 0.0, "closed")
    bad = Gate("images", "glass <b>", "ssim", 0.5, "at least", 0.998, "structure & edges")
    lost = Gate("images", "glass", "mean", float("nan"), "at most", 1.0, "brightness")
    root = document(good, bad, lost, left_out={"efficiency": "not named by --only"})
    assert (root.get("tests"), root.get("failures"), root.get("time")) == ("3", "2", "2.500")
    suites = {suite.get("name"): suite for suite in root}
    counts = {name: (s.get("tests"), s.get("failures"), s.get("skipped")) for name, s in suites.items()}
    assert counts == {"hits": ("1", "0", "0"), "images": ("2", "2", "0"), "efficiency": ("1", "0", "1")}
    case = suites["images"].find("testcase")
    assert case is not None and case.get("name") == "glass <b>: ssim"
    assert case.get("classname") == "validation.images"
    failures = [failure for failure in root.iter("failure")]
    assert failures[0].get("message") == "ssim is 0.5, expected at least 0.998"
    assert "structure & edges" in (failures[0].text or "")
    assert failures[1].get("message") == "mean is not a number, expected at most 1"
    skipped = suites["efficiency"].find("testcase/skipped")
    assert skipped is not None and skipped.get("message") == "not named by --only"


def test_characters_that_xml_cannot_hold() -> None:
    root = document(Gate("hits", "a\x01b\ud800.ply", "leaks", 1.0, "at most", 0.0, "\x00"))
    assert [case.get("name") for case in root.iter("testcase")] == ["a?b?.ply: leaks"]
