"""Named arrays as compressed bytes."""

import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_LEVEL = 6
_HEADER = 4  # bytes of the size of the header


def pack(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return arrays by name as bytes: a header, and the bytes of the arrays, compressed together.

    The first bytes of all elements come first, then the second, …: they compress better.
    """
    header: list[tuple[str, str, tuple[int, ...]]] = []
    parts = []
    for name, values in arrays.items():
        header.append((name, values.dtype.str, values.shape))
        flat = np.ascontiguousarray(values).reshape(-1)
        parts.append(flat.view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes())
    head = json.dumps(header).encode()
    return zlib.compress(len(head).to_bytes(_HEADER, "little") + head + b"".join(parts), _LEVEL)


def unpack(data: bytes) -> dict[str, NDArray[Any]]:
    """Return the arrays that `pack` was given; they cannot be written to."""
    raw = zlib.decompress(data)
    place = _HEADER + int.from_bytes(raw[:_HEADER], "little")
    arrays = {}
    for name, text, shape in json.loads(raw[_HEADER:place]):
        dtype = np.dtype(text)
        size = int(np.prod(shape)) * dtype.itemsize
        flat = np.frombuffer(raw, np.uint8, size, place).reshape(dtype.itemsize, -1).T
        arrays[name] = np.ascontiguousarray(flat).reshape(-1).view(dtype).reshape(shape)
        arrays[name].flags.writeable = False  # runs may be shared; see `run_cache`
        place += size
    return arrays
