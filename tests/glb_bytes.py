"""GLB files made by hand, with struct and json alone."""

import json
import struct
from typing import Any

import numpy as np


class Glb:
    """The bytes and accessors of a file."""

    def __init__(self) -> None:
        self.data = b""
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, rows: list[Any], letter: str, kind: int, shape: str, gap: int, **more: Any) -> int:
        """An accessor of rows that begin at a multiple of four bytes, ``gap`` bytes behind each of several numbers."""
        self.data += b"\0" * (-len(self.data) % 4) + b"\xaa" * 4 * bool(gap)
        packed = [struct.pack(f"<{np.size(row)}{letter}", *np.ravel(row).tolist()) for row in rows]
        stride = len(packed[0]) + gap
        content = b"".join(row + b"\xbb" * gap for row in packed)
        view = {"buffer": 0, "byteOffset": len(self.data) - 4 * bool(gap), "byteLength": len(content) + 4 * bool(gap)}
        self.views.append(view | ({"byteStride": stride} if gap else {}))
        self.accessors.append({
            "bufferView": len(self.views) - 1, "byteOffset": 4 * bool(gap), "componentType": kind, "count": len(rows),
            "type": shape, "min": np.min(rows, axis=0).tolist(), "max": np.max(rows, axis=0).tolist(), **more,
        })  # fmt: skip
        if shape == "SCALAR":
            self.accessors[-1] |= {"min": [int(np.min(rows))], "max": [int(np.max(rows))]}
        self.data += content
        return len(self.accessors) - 1

    def file(self, **document: Any) -> bytes:
        whole = {"asset": {"version": "2.0"}, "accessors": self.accessors, "bufferViews": self.views,
                 "buffers": [{"byteLength": len(self.data)}], **document}  # fmt: skip
        text, data = json.dumps(whole).encode(), self.data + b"\0" * (-len(self.data) % 4)
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
