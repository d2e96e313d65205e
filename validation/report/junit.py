"""The gates as JUnit XML for CI systems: a test suite for each section, a test case for each gate."""

import re
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree as ET

from validation.report import summary

# XML 1.0 cannot represent these characters, and a file name may contain them.
_FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def document(metrics: Mapping[str, Any]) -> bytes:
    """The XML for checked metrics, UTF-8. A section that was left out is a suite with one skipped case."""
    gates: list[Mapping[str, Any]] = metrics["gates"]
    failed = sum(not gate["passed"] for gate in gates)
    root = ET.Element("testsuites", name="octree-renderer validation", tests=str(len(gates)), failures=str(failed))
    root.set("time", _time(metrics["seconds"]))
    for section in dict.fromkeys(row["section"] for row in metrics["matrix"]):
        _suite(root, section, [gate for gate in gates if gate["section"] == section], metrics)
    for section, reason in metrics["left_out"].items():
        suite = ET.SubElement(root, "testsuite", name=section, tests="1", failures="0", errors="0", skipped="1")
        case = ET.SubElement(suite, "testcase", classname=f"validation.{section}", name="the section")
        ET.SubElement(case, "skipped", message=_legal(reason))
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True)


def _suite(root: ET.Element, section: str, gates: list[Mapping[str, Any]], metrics: Mapping[str, Any]) -> None:
    failures = str(sum(not gate["passed"] for gate in gates))
    suite = ET.SubElement(root, "testsuite", name=section, tests=str(len(gates)), failures=failures, errors="0")
    suite.set("skipped", "0")
    suite.set("timestamp", metrics["started"])
    suite.set("time", _time(metrics[section]["seconds"]))
    for gate in gates:
        name = _legal(f"{gate['subject']}: {gate['quantity']}")
        case = ET.SubElement(suite, "testcase", classname=f"validation.{section}", name=name)
        if not gate["passed"]:
            message = summary.failure(gate)
            failure = ET.SubElement(case, "failure", message=_legal(message), type="gate")
            failure.text = _legal(f"{gate['subject']}: {message}\nwhy: {gate['reason']}")


def _time(seconds: float) -> str:
    return f"{seconds:.3f}"


def _legal(text: str) -> str:
    return _FORBIDDEN.sub("?", text)
