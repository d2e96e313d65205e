"""What tests of the page share: the metrics of a small run, and its pictures in ``tmp_path``."""

import struct
import zlib
from pathlib import Path
from typing import Any

import pytest

from validation.gates import Gate
from validation.report import chapters, summary
from validation.report import page as report


def png(path: Path, grey: int, width: int = 2, height: int = 1) -> None:
    """A grey picture with the least that a PNG needs."""

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    rows = (b"\x00" + bytes([grey]) * width) * height
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    chunks = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


@pytest.fixture
def metrics(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Of a run of the pictures alone, one gate of which fails; its partial shows the same pictures twice."""
    triple = '{{ triple({"ours": "a.png", "reference": "b.png", "difference": "c.png"}, "a scene") }}'
    (tmp_path / "plain.html").write_text('{% from "macros.html" import triple %}' + triple * 2)
    monkeypatch.setattr(report, "_TEMPLATES", [report._TEMPLATES, tmp_path])
    plain = chapters.PARTIALS["images"]._replace(template="plain.html")
    monkeypatch.setattr(chapters, "PARTIALS", chapters.PARTIALS | {"images": plain})
    for name, grey in (("a.png", 10), ("b.png", 20), ("c.png", 10)):
        png(tmp_path / name, grey)
    gates = [
        Gate("images", "glass", "ssim", 0.5, "at least", 0.998, "structure").record(),
        Gate("images", "stairs", "ssim", 0.9999, "at least", 0.998, "structure").record(),
    ]
    failed = {"subject": "glass", "failed": {"ours": "failed/glass-ours.exr"}}
    record = {"seconds": 2.0, "costs": {"Mitsuba <3>": 1.5}, "scenes": [failed]}
    rows = summary.matrix({"images": record}, gates)
    return {
        "schema": 3, "command": "python -m validation --only images", "quick": False, "own": True,
        "started": "2026-01-01T10:00:00+00:00", "seconds": 3.0, "verdict": summary.verdict(gates), "matrix": rows,
        "facts": summary.facts({"images": record}, gates, None), "thresholds": {"file": None, "moved": {}},
        "gates": gates,
        "left_out": {"hits": "not named by --only"}, "baseline": {"absent": "There is none."}, "images": record,
        "environment": {"python": "3.11", "processor": "one", "threads": 2, "platform": "p", "packages": {"numpy": "2"},
                        "sources": "0" * 64},
    }  # fmt: skip
