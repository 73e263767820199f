"""GLB: the binary container of glTF 2.0, filled piece by piece.

Source: Khronos Group, glTF 2.0 Specification (2021), sections 3.6 (binary data) and 4 (GLB).
"""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MAGIC, _VERSION = 0x46546C67, 2
_JSON_CHUNK, _BINARY_CHUNK = 0x4E4F534A, 0x004E4942

VERTICES, INDICES = 34962, 34963
"""What a buffer view holds: vertex attributes, or the corners of triangles."""

_COMPONENT = {"u1": 5121, "u2": 5123, "u4": 5125, "f4": 5126}
_SHAPE = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}


class GlbBuilder:
    """A glTF document that grows, with its one buffer.

    Attributes
    ----------
    document : dict
        The JSON part; ``accessors``, ``bufferViews`` and ``buffers`` are filled by the methods, the rest by the caller.
    """

    def __init__(self) -> None:
        self.document: dict[str, Any] = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}
        self._binary = bytearray()

    def view(self, content: bytes, *, target: int | None = None) -> int:
        """Append bytes to the buffer and return the number of their view."""
        # Each view begins at a multiple of four bytes, which suits every component type.
        self._binary += b"\0" * (-len(self._binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(content)}
        if target is not None:
            view["target"] = target
        self._binary += content
        self.document["bufferViews"].append(view)
        return len(self.document["bufferViews"]) - 1

    def accessor(
        self, values: NDArray[Any], *, target: int | None = None, bounds: bool = False, normalized: bool = False
    ) -> int:
        """Append an array and return the number of its accessor.

        Parameters
        ----------
        values : (N,), (N, 2), (N, 3), (N, 4) or (N, 4, 4)
            One element in each row, of type uint8, uint16, uint32 or float32; rows must fill multiples of four bytes
            if they are vertex attributes. Matrices lie column after column.
        target : int, optional
            `VERTICES` or `INDICES`.
        bounds : bool
            Whether to tell the smallest and the largest value of each component.
        normalized : bool
            Whether whole numbers stand for 0 to 1.
        """
        flat = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
        entry = {"bufferView": self.view(flat.tobytes(), target=target), **_kind(values)}
        if bounds:
            entry |= _bounds(values)
        if normalized:
            entry["normalized"] = True
        return self._add(entry)

    def sparse(self, values: NDArray[np.float32], *, smallest: float) -> int:
        """Append an (N, 3) array most of whose rows are zero and return the number of its accessor.

        Rows whose components are all below ``smallest`` are left out.
        """
        rows = np.flatnonzero((np.abs(values) >= smallest).any(axis=1))
        entry = _kind(values)
        kept = np.zeros_like(values)
        kept[rows] = values[rows]
        if len(rows):
            narrow = np.uint16 if len(values) <= 2**16 else np.uint32
            indices = self.view(rows.astype(narrow).astype(narrow().dtype.newbyteorder("<")).tobytes())
            content = self.view(values[rows].astype("<f4").tobytes())
            entry["sparse"] = {
                "count": len(rows),
                "indices": {"bufferView": indices, "componentType": _COMPONENT[np.dtype(narrow).str[1:]]},
                "values": {"bufferView": content},
            }
        return self._add(entry | _bounds(kept))

    def zeros(self, count: int) -> int:
        """Append ``count`` rows (3,) of zeros, which take no room, and return the number of their accessor."""
        return self.sparse(np.zeros((count, 3), dtype=np.float32), smallest=1.0)

    def to_bytes(self) -> bytes:
        """Return the whole file."""
        binary = bytes(self._binary) + b"\0" * (-len(self._binary) % 4)
        document = self.document | {"buffers": [{"byteLength": len(binary)}]}
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(binary)
        head = struct.pack("<III", _MAGIC, _VERSION, length)
        chunks = (struct.pack("<II", len(text), _JSON_CHUNK), text, struct.pack("<II", len(binary), _BINARY_CHUNK))
        return b"".join([head, *chunks, binary])

    def _add(self, entry: dict[str, Any]) -> int:
        self.document["accessors"].append(entry)
        return len(self.document["accessors"]) - 1


def _kind(values: NDArray[Any]) -> dict[str, Any]:
    return {
        "componentType": _COMPONENT[values.dtype.str[1:]],
        "count": len(values),
        "type": _SHAPE[values.shape[1:]],
    }


def _bounds(values: NDArray[Any]) -> dict[str, Any]:
    return {name: np.atleast_1d(find(values, axis=0)).tolist() for name, find in (("min", np.min), ("max", np.max))}
