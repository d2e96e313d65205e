"""Files of arrays as ``renderer.tree.container`` describes them, forged: with the right checksums."""

import json
import struct
import zlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Change = Callable[[dict[str, Any]], object]


def header_of(content: bytes) -> tuple[dict[str, Any], int]:
    """The text at the head of a file, and its end."""
    end = 24 + struct.unpack("<I", content[16:20])[0]
    return json.loads(content[24:end]), end


def forge(
    content: bytes, kinds: Mapping[str, tuple[Any, tuple[int, ...]]], change: Change, **arrays: NDArray[Any]
) -> bytes:
    """A file with other entries of the header, or other arrays of these ``kinds``; what comes after them stays."""
    told, begin = header_of(content)
    parts = []
    for entry in told["arrays"]:
        dtypes, row = kinds[entry["name"]]
        assert entry["dtype"] in dtypes
        size = entry["rows"] * int(np.prod(row)) * int(entry["dtype"][-1])
        part = content[begin : begin + size]
        begin += -(-size // 64) * 64
        if entry["name"] in arrays:
            part = arrays[entry["name"]].tobytes()
            entry["rows"] = len(part) * entry["rows"] // size
        parts.append(part + bytes(-len(part) % 64))
        entry["crc32"] = zlib.crc32(parts[-1])
    change(told)
    return with_text(content, json.dumps(told).encode()) + b"".join(parts) + content[begin:]


def with_text(content: bytes, text: bytes) -> bytes:
    """The head of a file with another text."""
    text += b" " * (-(24 + len(text)) % 64)
    start = content[:16] + struct.pack("<I", len(text))
    return start + struct.pack("<I", zlib.crc32(text, zlib.crc32(start))) + text
