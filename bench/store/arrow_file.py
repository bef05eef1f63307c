"""Sealed Arrow files: tables with a checksum of the whole file among their metadata."""

from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
import pyarrow.feather as feather

from bench.store.seal import PLACEHOLDER, SEAL_KEY, read_sealed, sealed

__all__ = ["arrow_bytes", "read_arrow"]


def arrow_bytes(table: pa.Table, metadata: Mapping[bytes, bytes] | None = None) -> bytes:
    """A table as the sealed content of an Arrow file, with metadata of its own."""
    named = table.replace_schema_metadata({**(metadata or {}), SEAL_KEY: PLACEHOLDER.encode()})
    sink = pa.BufferOutputStream()
    feather.write_feather(named, sink, compression="zstd")
    return sealed(sink.getvalue().to_pybytes())


def read_arrow(path: Path) -> pa.Table:
    """Table of a sealed Arrow file.

    Raises
    ------
    ResultsError
        Naming the file, where it is not what was written.
    FileNotFoundError
        Where it is not there.
    ResultsError
        Where it can't be read now.
    """
    return feather.read_table(pa.BufferReader(read_sealed(path)), use_threads=False)
