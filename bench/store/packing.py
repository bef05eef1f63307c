"""Conversion of named arrays to compressed bytes and back."""

import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_LEVEL = 6  # compression level of zlib
_HEADER = 4  # number of bytes that encode the size of the header


def pack(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return named arrays as bytes: a header and the arrays' bytes, compressed together.

    The first bytes of all elements come first, then all second bytes, and so on. This order
    compresses better, because neighbouring values differ in few bytes.
    """
    header: list[tuple[str, str, tuple[int, ...]]] = []
    chunks = []
    for name, values in arrays.items():
        header.append((name, values.dtype.str, values.shape))
        flat = np.ascontiguousarray(values).reshape(-1)
        chunks.append(flat.view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes())
    encoded_header = json.dumps(header).encode()
    return zlib.compress(
        len(encoded_header).to_bytes(_HEADER, "little") + encoded_header + b"".join(chunks), _LEVEL
    )


def select_group(arrays: Mapping[str, NDArray[Any]], group: str) -> dict[str, NDArray[Any]]:
    """Return the arrays whose names start with `group/`, by their names without this prefix."""
    return {k.partition("/")[2]: a for k, a in arrays.items() if k.startswith(f"{group}/")}


def unpack(packed: bytes) -> dict[str, NDArray[Any]]:
    """Return the arrays, read-only, from the bytes that `pack` returned."""
    raw = zlib.decompress(packed)
    offset = _HEADER + int.from_bytes(raw[:_HEADER], "little")
    arrays = {}
    for name, type_name, shape in json.loads(raw[_HEADER:offset]):
        dtype = np.dtype(type_name)
        size = int(np.prod(shape)) * dtype.itemsize
        flat = np.frombuffer(raw, np.uint8, size, offset).reshape(dtype.itemsize, -1).T
        arrays[name] = np.ascontiguousarray(flat).reshape(-1).view(dtype).reshape(shape)
        arrays[name].flags.writeable = False  # several readers can share a run
        offset += size
    return arrays
