"""Frames: what the server sends to the page, a head of JSON and arrays behind it.

====================  ===================================================================
4 bytes               length of the head, unsigned, little-endian; a multiple of 4 with these
the head              JSON in UTF-8, filled up with blanks; "arrays": name → [first byte, length]
the arrays            float32, little-endian; the first byte counts from the end of the head
====================  ===================================================================
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.files import finite

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray


def pack(head: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the bytes of a frame."""
    places: dict[str, list[int]] = {}
    parts: list[bytes] = []
    at = 0
    for name, array in arrays.items():
        data = np.ascontiguousarray(array, dtype="<f4").tobytes()
        places[name] = [at, len(data) // 4]
        parts.append(data)
        at += len(data)
    text = json.dumps(finite({**head, "arrays": places}), ensure_ascii=False, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([len(text).to_bytes(4, "little"), text, *parts])


def unpack(frame: bytes) -> tuple[dict[str, Any], dict[str, NDArray[np.float32]]]:
    """Return head and arrays of a frame, as the page reads it.

    >>> head, arrays = unpack(pack({"status": "running"}, {"x": np.array([1.0, 2.5])}))
    >>> head["status"], arrays["x"].tolist()
    ('running', [1.0, 2.5])
    """
    length = int.from_bytes(frame[:4], "little")
    head = json.loads(frame[4 : 4 + length])
    body = frame[4 + length :]
    return head, {name: np.frombuffer(body, "<f4", count, first) for name, (first, count) in head.pop("arrays").items()}
