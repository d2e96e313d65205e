"""PLY files made by hand, with struct alone."""

import struct
from typing import Any

FORMATS = ["ascii", "binary_little_endian", "binary_big_endian"]
CODES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
# Their names in newer files.
CODES |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"}
CODES |= {"float32": "f", "float64": "d"}

Rows = list[list[Any]]


def ply(form: str, *elements: tuple[str, list[str], Rows], trailing: bytes = b"") -> bytes:
    """A PLY file of elements (name, properties like 'float x' or 'list uchar int i', rows of numbers and lists)."""
    header = ["ply", f"format {form} 1.0", "comment made for a test"]
    body = b""
    for name, properties, rows in elements:
        header += [f"element {name} {len(rows)}", *(f"property {p}" for p in properties)]
        for row in rows:
            words: list[str] = []
            for text, value in zip(properties, row, strict=True):
                types = text.split()
                values = [len(value), *value] if types[0] == "list" else [value]
                codes = [types[1], *[types[2]] * len(value)] if types[0] == "list" else [types[0]]
                words += map(str, values)
                if form != "ascii":
                    order = "<" if form == "binary_little_endian" else ">"
                    body += b"".join(struct.pack(order + CODES[c], v) for c, v in zip(codes, values, strict=True))
            if form == "ascii":
                body += " ".join(words).encode() + b"\n"
    return "\n".join([*header, "end_header", ""]).encode() + body + trailing
