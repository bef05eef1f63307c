"""Processes that wait for the next tracker, because the start of a process can take seconds."""

import os
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from trackmark.trackers import TrackerError

if TYPE_CHECKING:
    from trackmark.bench.external.process import LineProcess

_Process = TypeVar("_Process", bound="LineProcess")

MAX_IDLE_PROCESSES = 8
"""Maximum number of processes that wait for a tracker, because each can hold a model in memory."""

_idle: list[tuple[tuple[object, ...], Any]] = []
"""Keys and processes without a tracker; the last one was used last."""


def take_process(start: Callable[[], _Process], *key: object) -> _Process:
    """Return an idle process of a tracker, or start one; `key` are its options and digest.

    An idle process that has ended, for example because the system lacked memory, is left out.
    """
    for entry in [*_idle]:
        other, process = entry
        if other == (os.getpid(), *map(repr, key)):
            _idle.remove(entry)
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
