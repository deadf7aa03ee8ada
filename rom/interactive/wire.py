"""Messages between page and server: a JSON header, then plain arrays that a browser can look at without copying.

A reply is a little-endian uint32 N, N bytes of JSON (padded with blanks, so that the arrays begin at a multiple of 8),
then the arrays, each padded to 8 bytes. The header's ``arrays`` says name, type, shape and offset of each, counted from
the end of the header. Requests are JSON text alone.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np

LARGEST_REQUEST = 16 * 1024
"""Bytes of a request."""
LARGEST_ID = 2**53
TYPES = {"f4": "<f4", "f8": "<f8", "u4": "<u4", "u1": "|u1", "i2": "<i2"}
_STEP = 8


def encode(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray] | None = None) -> bytes:
    """One reply as bytes.

    Parameters
    ----------
    header : mapping
        JSON-able and finite.
    arrays : mapping of str to ndarray, optional
        Of the types in :data:`TYPES`.

    Raises
    ------
    ValueError
        For a number in the header that is not finite, or an array of another type.
    """
    listed, parts, offset = [], [], 0
    for name, array in (arrays or {}).items():
        kind = f"{array.dtype.kind}{array.dtype.itemsize}"
        if kind not in TYPES:
            raise ValueError(f"the array {name} is of type {array.dtype}: convert it to one of {', '.join(TYPES)}")
        data = np.ascontiguousarray(array, dtype=TYPES[kind]).tobytes()
        listed.append({"name": name, "type": kind, "shape": list(array.shape), "offset": offset})
        parts.append(data + bytes(-len(data) % _STEP))
        offset += len(parts[-1])
    text = json.dumps({**header, "arrays": listed}, allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-(len(text) + 4) % _STEP)
    return b"".join([struct.pack("<I", len(text)), text, *parts])


def decode(message: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Header and arrays of a reply: the inverse of :func:`encode`, for tests and clients in Python."""
    (length,) = struct.unpack_from("<I", message)
    header = json.loads(message[4:4 + length])
    arrays = {}
    for one in header.pop("arrays"):
        count = int(np.prod(one["shape"]))
        found = np.frombuffer(message, TYPES[one["type"]], count, 4 + length + one["offset"])
        arrays[one["name"]] = found.reshape(one["shape"])
    return header, arrays


def parse_request(text: str) -> dict[str, Any]:
    """A request as a dict with a whole number ``id`` and a text ``ask``.

    Raises
    ------
    ValueError
        For anything else; the sentence is fit to be shown.
    """
    try:
        request = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:  # RecursionError: brackets without end
        reason = str(error) if isinstance(error, _ConstantError) else "the message is no JSON: send one JSON object"
        raise ValueError(reason) from error
    if not isinstance(request, dict):
        raise ValueError("the message is no JSON object: send {\"id\": number, \"ask\": kind}")
    number = request.get("id")
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= LARGEST_ID:
        raise ValueError(f"the request's id is no whole number from 0 to {LARGEST_ID}: number the requests")
    if not isinstance(request.get("ask"), str):
        raise ValueError("the request's `ask` is no text: name what is wanted")
    return request


class _ConstantError(ValueError):
    """A number that JSON does not know."""


def _refuse_constant(name: str) -> NoReturn:
    raise _ConstantError(f"the message holds {name}: every number must be finite")
