"""A checksum inside a file: a changed bit is noticed, and no second file can get lost.

Whoever makes a file puts `PLACEHOLDER` where its format has room for text (the metadata of
Parquet and Arrow, a key of JSON, the comment of an archive). `sealed` then puts the SHA-256
of the whole content in its place, and `check` finds out whether that still is so.
"""

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
import pyarrow.feather as feather

from trackmark.bench.store.files import ResultsError, unreadable

_MARK = b"trackmark-sha256:"
_BLANK = _MARK + b"0" * 64
_ROWS = 1 << 16  # of a batch, as Feather files have them
_SEAL = re.compile(re.escape(_MARK) + b"[0-9a-f]{64}")

PLACEHOLDER = _BLANK.decode()
"""Text that stands for the checksum until it is known."""

SEAL_KEY = b"trackmark.seal"
"""Where Parquet and Arrow files have it among their metadata."""


class DamagedError(ResultsError):
    """A file is not what was written; the message names it."""


def sealed(content: bytes) -> bytes:
    """The content with its checksum in the place of `PLACEHOLDER`, wherever that stands.

    Raises `ValueError` where the content has no place for it.
    """
    if _BLANK not in content:
        raise ValueError("the content has no place for its checksum")
    return content.replace(_BLANK, _MARK + _digest(content))


def check(path: Path, content: bytes) -> None:
    """Check the content of a sealed file.

    Raises `DamagedError` naming the file, where it is not what was written.
    """
    if _MARK not in content:
        raise DamagedError(
            f"{path} has no checksum: it is damaged, or was written by an older trackmark. "
            "Remove it, or run again into another folder."
        )
    # Text in a file may look like a seal, too: a true one is that which fits.
    for seal in set(_SEAL.findall(content)):
        if seal == _MARK + _digest(content.replace(seal, _BLANK)):
            return
    raise DamagedError(
        f"{path} is damaged: its checksum does not match its content. "
        "Remove it and run the same command again."
    )


def read_sealed(path: Path) -> bytes:
    """Content of a sealed file, checked.

    Raises `DamagedError` naming the file, where it is not what was written. Raises
    `FileNotFoundError`: where it is not there. Raises `ResultsError` where it can't be read now,
    whatever stands in it.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise
    except OSError as error:
        raise unreadable(path, error) from error
    check(path, content)
    return content


def arrow_bytes(table: pa.Table, metadata: Mapping[bytes, bytes] | None = None) -> bytes:
    """A table as the sealed content of an Arrow file, with metadata of its own."""
    named = table.replace_schema_metadata({**(metadata or {}), SEAL_KEY: PLACEHOLDER.encode()})
    sink = pa.BufferOutputStream()
    # What pyarrow.feather writes, but without importing pandas to look at the table.
    packed = pa.ipc.IpcWriteOptions(compression="zstd", use_threads=False)  # small: they cost more
    with pa.ipc.new_file(sink, named.schema, options=packed) as file:
        file.write_table(named, _ROWS)
    return sealed(sink.getvalue().to_pybytes())


def read_arrow(path: Path) -> pa.Table:
    """Table of a sealed Arrow file.

    Raises `ResultsError` naming the file, where it is not what was written. Raises
    `FileNotFoundError`: where it is not there. Raises `ResultsError` where it can't be read now.
    """
    return arrow_table(read_sealed(path))


def arrow_table(content: bytes) -> pa.Table:
    """Table of an Arrow file's content."""
    return feather.read_table(pa.BufferReader(content), use_threads=False)


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()
