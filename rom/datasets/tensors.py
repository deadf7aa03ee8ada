"""Weights on disk: one safetensors file, its attributes as JSON in the header. Nothing is ever unpickled.

The header also holds digests of attributes and arrays, since the format allows nothing behind the arrays.
"""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from rom.checks import shown
from rom.errors import SchemaError
from rom.files import whole_file

REQUIRED = ("model_version", "method", "settings", "scene_parameters", "scene_hash", "mesh_hash", "offline_seconds")
DIGEST = "content_digest"
log = logging.getLogger(__name__)


def write_tensors(path: str | Path, arrays: dict[str, np.ndarray], attributes: dict[str, Any]) -> None:
    """Write arrays and attributes atomically.

    Raises
    ------
    OSError
        Where the folder cannot be written or the disk is full.
    """
    header = {name: json.dumps(value) for name, value in attributes.items()}
    # safetensors writes the memory as it lies: a transposed view would come back scrambled
    ordered = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    header[DIGEST] = f"{_of_header(header)} {_of_arrays(ordered)}"
    with whole_file(path) as temporary:
        try:
            save_file(ordered, temporary, header)
        except SafetensorError as error:
            raise OSError(f"{path} could not be written ({error}): check the disk's free space") from error


write_weights = write_tensors
"""Of a fitted network: its attributes hold at least :data:`REQUIRED`."""


def read_attributes(path: str | Path) -> dict[str, Any]:
    """Attributes of a file of weights; only its header is read.

    Raises
    ------
    SchemaError
        Where the file is missing, truncated or not one of ours.
    """
    return _read(path, with_arrays=False)[0]


def read_weights(path: str | Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Attributes and arrays of a file of weights; raises like :func:`read_attributes`."""
    return _read(path, with_arrays=True)


def read_tensors(path: str | Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Attributes and arrays of any file that :func:`write_tensors` wrote; raises like :func:`read_attributes`."""
    return _read(path, with_arrays=True, required=())


def _read(path: str | Path, with_arrays: bool,
          required: tuple[str, ...] = REQUIRED) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    if not Path(path).is_file():
        raise SchemaError(f"{path} does not exist: fit and save the network first, or correct the path")
    try:
        with safe_open(path, framework="numpy") as file:
            header = file.metadata() or {}
            names = list(file.keys()) if with_arrays else []
            arrays = {name: file.get_tensor(name) for name in names}
    except Exception as error:  # the library's words for a damaged file are of every kind
        raise SchemaError(f"{path} is truncated or no safetensors file ({_in_short(error)}): fit the network "
                          "again") from error
    of_header, _, of_arrays = header.pop(DIGEST, "").partition(" ")
    if not of_header:
        log.info("%s carries no digest: it was written by another program or an older version", path)
    elif of_header != _of_header(header) or (with_arrays and of_arrays != _of_arrays(arrays)):
        raise SchemaError(f"{path} is damaged, its content is not what was written: fit the network again")
    missing = [name for name in required if name not in header]
    if missing:
        raise SchemaError(f"{path} holds no network of this toolkit, as it lacks {', '.join(missing)}: "
                          "give a file that save() wrote")
    try:
        return {name: json.loads(text) for name, text in header.items()}, arrays
    except (ValueError, RecursionError) as error:
        raise SchemaError(f"{path} has a header that cannot be read ({_in_short(error)}): fit the network "
                          "again") from error


def _in_short(error: Exception) -> str:
    return shown(str(error))[1:-1] or type(error).__name__


def _of_header(header: dict[str, str]) -> str:
    """Digest of the attributes as they stand in the header."""
    import xxhash

    return xxhash.xxh3_128(json.dumps(header, sort_keys=True).encode()).hexdigest()


def _of_arrays(arrays: dict[str, np.ndarray]) -> str:
    """Digest of names, types, shapes and numbers."""
    import xxhash

    digest = xxhash.xxh3_128()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
    return digest.hexdigest()
