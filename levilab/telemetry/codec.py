"""One codec for what goes to other processes and to pages: a document for JSON in which arrays may stand anywhere.

====================  ==================================================================================
4 bytes               length of the head, unsigned, little-endian; a multiple of 4 with these
the head              JSON in UTF-8, filled up with blanks; in the place of an array stands
                      ``{"$array": [type, shape, first byte]}``, counted from the end of the head
the arrays            little-endian, row by row, each filled up to a multiple of 4 bytes;
                      ``<f4`` is float32, ``|b1`` is one byte for each truth value; in the place of a `Text` stands
                      ``{"$text": {"template": …, "values": …}}``
====================  ==================================================================================

`levilab/live/page/connection.js` reads the same bytes.
"""

import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from levilab.files import parse_json
from levilab.texts.text import Text, text_from

_REFERENCE, _TEXT = "$array", "$text"
_KINDS = ("<f4", "|b1")


class MalformedMessage(ValueError):
    """Bytes that are no message."""


def pack(document: dict[str, Any]) -> bytes:
    """Return the bytes of a document; a number that is not finite becomes null outside of arrays.

    >>> unpack(pack({"status": "running", "curve": {"x": np.array([1.0, 2.5])}}))
    {'status': 'running', 'curve': {'x': array([1. , 2.5], dtype=float32)}}
    """
    parts: list[bytes] = []
    head = json.dumps(_with_references(document, parts), allow_nan=False, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 4)
    return b"".join([len(head).to_bytes(4, "little"), head, *parts])


def _with_references(value: Any, parts: list[bytes]) -> Any:
    if isinstance(value, np.ndarray):
        kind = "|b1" if value.dtype == np.bool_ else "<f4"
        data = np.ascontiguousarray(value, kind).tobytes()
        first = sum(map(len, parts))
        parts.append(data + bytes(-len(data) % 4))
        return {_REFERENCE: [kind, value.shape, first]}
    if isinstance(value, Text):
        return {_TEXT: value.as_table()}
    if isinstance(value, dict):
        return {key: _with_references(item, parts) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_with_references(item, parts) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def unpack(data: bytes) -> Any:
    """Return the document that the bytes are of.  Raises MalformedMessage."""
    length = int.from_bytes(data[:4], "little")
    try:
        head = parse_json(data[4 : 4 + length].decode())
        return _with_arrays(head, data[4 + length :])
    except (ValueError, TypeError, OverflowError) as error:
        raise MalformedMessage(f"no message: {error}") from error


def _with_arrays(value: Any, data: bytes) -> Any:
    if isinstance(value, dict) and value.keys() == {_REFERENCE}:
        return _array(data, *value[_REFERENCE])
    if isinstance(value, dict) and value.keys() == {_TEXT}:
        return text_from(value[_TEXT])
    if isinstance(value, dict):
        return {key: _with_arrays(item, data) for key, item in value.items()}
    return [_with_arrays(item, data) for item in value] if isinstance(value, list) else value


def _array(data: bytes, kind: str, shape: list[int], first: int) -> NDArray[Any]:
    """Return an array.  Raises ValueError, TypeError for one that the data do not hold."""
    if kind not in _KINDS or first < 0 or any(type(n) is not int or n < 0 for n in shape):
        raise ValueError(f"an array of {kind}, {shape} from byte {first} on")
    found = np.frombuffer(data, np.uint8 if kind == "|b1" else kind, math.prod(shape), first).reshape(shape)
    return found != 0 if kind == "|b1" else found
