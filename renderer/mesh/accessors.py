"""The arrays of a glTF document: integers, and numbers that may be stored as normalized integers, sparse or strided."""

from __future__ import annotations

import base64
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from renderer.errors import MeshError

_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def data_of(uri: str) -> bytes:
    """The bytes in a data URI, in base64."""
    return base64.b64decode(unquote(uri.partition(",")[2]))


class Accessors:
    """The accessors of a document, over the bytes of its buffers."""

    def __init__(self, document: dict[str, Any], buffers: list[bytes]) -> None:
        self._accessors = document.get("accessors") or []
        self._views = document.get("bufferViews") or []
        self._buffers = buffers
        # A count that all bytes together cannot hold is refused before anything is allocated.
        self._most = sum(map(len, buffers))

    def floats(self, number: int) -> NDArray[np.float64]:
        """Numbers (count, components); those that are normalized are from 0, or -1, to 1."""
        accessor = self._accessor(number)
        values = self._stored(number, accessor)
        found = values.astype(np.float64)
        if accessor.get("normalized") and values.dtype.kind in "iu":
            found = np.maximum(found / np.iinfo(values.dtype).max, -1.0)
        return found

    def integers(self, number: int) -> NDArray[np.int64]:
        """Indices (count,), or (count, components)."""
        values = self._stored(number, self._accessor(number)).astype(np.int64)
        return values[:, 0] if values.shape[1] == 1 else values

    def content(self, number: int) -> bytes:
        """The bytes of a buffer view, such as those of an image."""
        view = self._views[number]
        first, size, buffer = int(view.get("byteOffset", 0)), int(view["byteLength"]), self._buffers[view["buffer"]]
        if min(first, size) < 0 or first + size > len(buffer):
            raise MeshError(f"truncated: glTF: buffer view {number} ends beyond its bytes")
        return buffer[first : first + size]

    def _accessor(self, number: int) -> dict[str, Any]:
        if not isinstance(number, int) or not 0 <= number < len(self._accessors):
            raise MeshError(f"glTF: expected an accessor of {len(self._accessors)}, got number {number}")
        found: dict[str, Any] = self._accessors[number]
        return found

    def _stored(self, number: int, accessor: dict[str, Any]) -> NDArray[Any]:
        """The values as they are stored, (count, components)."""
        dtype, components = np.dtype(_TYPES[accessor["componentType"]]), _COMPONENTS[accessor["type"]]
        count, sparse = int(accessor["count"]), accessor.get("sparse")
        if not 0 <= count <= self._most:
            raise MeshError(f"glTF: accessor {number}: its {count} rows are more than the buffers hold")
        if "bufferView" in accessor:
            values = self._view(accessor, count, dtype, components, f"accessor {number}")
        elif sparse:
            values = np.zeros((count, components), dtype)
        else:
            raise MeshError(f"glTF: expected accessors with data, got none in accessor {number}")
        return self._filled(values, sparse, number) if sparse else values

    def _filled(self, values: NDArray[Any], sparse: dict[str, Any], number: int) -> NDArray[Any]:
        """The values with those rows that a sparse accessor replaces."""
        count, where = int(sparse["count"]), f"accessor {number}, sparse"
        places, rows = sparse["indices"], sparse["values"]
        at = self._view(places, count, np.dtype(_TYPES[places["componentType"]]), 1, where)[:, 0].astype(np.int64)
        if len(at) and at.max() >= len(values):
            raise MeshError(f"glTF: {where}: row {at.max()} of {len(values)}")
        values = values.copy()
        values[at] = self._view(rows, count, values.dtype, values.shape[1], where)
        return values

    def _view(self, at: dict[str, Any], count: int, dtype: np.dtype[Any], components: int, where: str) -> NDArray[Any]:
        """Rows of a buffer view, (count, components)."""
        view = self._views[at["bufferView"]]
        buffer = self._buffers[view["buffer"]]
        first, size = int(view.get("byteOffset", 0)), int(view["byteLength"])
        begin, row = first + int(at.get("byteOffset", 0)), components * dtype.itemsize
        stride = int(view.get("byteStride") or row)
        end = begin + (count - 1) * stride + row if count else begin
        if min(first, begin, size) < 0 or stride < row or end > min(first + size, len(buffer)):
            raise MeshError(f"truncated: glTF: {where}: its {count} rows end beyond their bytes")
        return np.ndarray((count, components), dtype, buffer, begin, (stride, dtype.itemsize))
