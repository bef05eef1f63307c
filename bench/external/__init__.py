"""Trackers in processes of their own, and the specifications that select such a process.

The start of a process can take seconds. A process therefore waits for the next tracker of its key
when its tracker is dropped.
"""

import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from trackmark.trackers import TrackerError
from trackmark.trackers.base.catalogue import in_file

if TYPE_CHECKING:
    from trackmark.bench.external.process import LineProcess

_Process = TypeVar("_Process", bound="LineProcess")

TABLE = re.compile(r"(?P<file>.*?\.(?:toml|ini)):(?P<name>[^:=]+)(?P<rest>(:.*)?)", re.DOTALL)
"""Specification of a tracker that a table of a file defines."""

FRAME_SECONDS = 60.0
"""Default time limit of a call of a tracker with the interpreter of trackmark [s]."""

MAX_IDLE_PROCESSES = 8
"""Maximum number of processes that wait for a tracker, because each can hold a model in memory."""

_idle: list[tuple[tuple[object, ...], Any]] = []
"""Keys and processes without a tracker; the last one was used last."""


def split_table(spec: str) -> tuple[str, str] | None:
    """Return `file.toml:name` (or `.ini`) and the rest of a specification; None for others."""
    match = TABLE.fullmatch(spec)
    return (f"{match['file']}:{match['name']}", match["rest"]) if match else None


def is_external(name: str, options: Mapping[str, str]) -> bool:
    """Return whether the name and options of a specification select another environment."""
    is_python = "python" in options and in_file(name) is not None
    return name == "trax" or is_python or split_table(name) is not None


def take_process(start: Callable[[], _Process], *key: object) -> _Process:
    """Return an idle process of a tracker, or start one; `key` are its options and digest.

    An idle process that has ended, for example because the system lacked memory, is left out.
    """
    for other, process in [*_idle]:
        if other == (os.getpid(), *map(repr, key)):
            _idle.remove((other, process))
            if process.process.poll() is None:
                process.forget_output()
                return process  # type: ignore[no-any-return]  # kept under its key
            process.close()
    return start()


def keep_process(process: "LineProcess", *key: object) -> None:
    """Keep a process for the next tracker of its key, because a start can take seconds."""
    if process.is_usable:
        _idle.append(((os.getpid(), *map(repr, key)), process))
    else:
        process.close()
    if len(_idle) > MAX_IDLE_PROCESSES:
        _close_oldest()


def close_idle_processes() -> None:
    """End the processes that wait for a tracker."""
    while _idle:
        _close_oldest()


def _close_oldest() -> None:
    with suppress(TrackerError):  # no run needs its answers any more
        _idle.pop(0)[1].close()
