"""Log of an experiment: one row per event of a command."""

import json
import os
import socket
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from trackmark.bench.store.database import open_database


class RunLog:
    """Log of one command. `name` consists of the command's start time, host and process id."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        now = datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%f")
        self.name = f"{now}-{socket.gethostname()}-{os.getpid()}"

    def write(self, event: str, **fields: Any) -> None:
        """Add an event; JSON must be able to represent the fields.

        Raises `ResultsError` if it cannot be written.
        """
        date = datetime.now(UTC).isoformat(timespec="milliseconds")
        with open_database(self._folder, write=True) as database:
            (newest,) = database.select("SELECT coalesce(max(id), 0) FROM log")
            row = newest[0] + 1, self.name, date, event, json.dumps(fields)
            database.insert("log", [row])


def read_logs(folder: Path) -> dict[str, list[Mapping[str, Any]]]:
    """Return each log's events in order, by the name of the log; the oldest log comes first.

    Raises `ResultsError` if the file is damaged.
    """
    with open_database(folder) as database:
        rows = database.table("log")
    logs: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        event = {"event": row["event"], "date": row["date"], **json.loads(row["content"])}
        logs.setdefault(row["log"], []).append(event)
    return dict(sorted(logs.items()))
