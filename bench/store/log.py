"""The log of what was done in an experiment's folder: a file a command, a line an event.

A line is a JSON object; its last field is the CRC-32 of the line without it. A command that is
killed while it writes leaves a torn last line, which readers pass over; any other line that is not
what was written is named.
"""

import json
import os
import socket
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from zlib import crc32

from trackmark.bench.store.files import ResultsError, append

_FOLDER = "_log"


class RunLog:
    """Events of one command."""

    def __init__(self, folder: Path) -> None:
        now = datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%f")
        self.path = folder / _FOLDER / f"{now}-{socket.gethostname()}-{os.getpid()}.jsonl"

    def write(self, event: str, **told: Any) -> None:
        """Add an event; `told` is what JSON can hold.

        Raises `ResultsError` where it can't be written.
        """
        date = datetime.now(UTC).isoformat(timespec="milliseconds")
        append(self.path, _sealed(json.dumps({"event": event, "date": date, **told}).encode()))


def log_files(folder: Path) -> list[Path]:
    """Logs of an experiment, the oldest first."""
    return sorted((folder / _FOLDER).glob("*.jsonl"))


def read_log(path: Path) -> Iterator[Mapping[str, Any]]:
    """Events of a log, in order.

    Raises `ResultsError` naming a line that is not what was written.
    """
    try:
        lines = path.read_bytes().split(b"\n")
    except OSError as error:
        raise ResultsError(f"{path} can't be read: {error.strerror}.") from error
    for number, line in enumerate(lines[:-1], 1):  # what follows the last line's end is torn
        event, _, _ = line.rpartition(b", ")
        if _sealed(event + b"}") != line + b"\n":
            raise ResultsError(
                f"{path}, line {number}, is damaged. It is a log: no result depends on it, and it "
                "can be removed."
            )
        told: dict[str, Any] = json.loads(line)
        del told["crc32"]
        yield told


def _sealed(line: bytes) -> bytes:
    return b'%s, "crc32": "%08x"}\n' % (line[:-1], crc32(line))
