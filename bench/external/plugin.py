"""Plugins whose tracker runs in another process, and the processes that wait for a tracker."""

import os
from abc import abstractmethod
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pydantic import Field

from trackmark import trackers
from trackmark.bench.external.process import ExternalTrackerError, LineProcess
from trackmark.datasets.file_digest import file_digests
from trackmark.datasets.source_digest import tree_digest
from trackmark.trackers.base.parameters import Parameters
from trackmark.trackers.base.plain import AdaptedTracker


class Definition(Parameters):
    """Keys of each tracker in a process of its own; docs/external.md describes them."""

    parameters: Mapping[str, bool | int | float | str] = {}
    environment: Mapping[str, str] = {}
    start_timeout: float = Field(300.0, gt=0)
    frame_timeout: float = Field(60.0, gt=0)
    version: str = ""


class ExternalPlugin(AdaptedTracker):
    """Base class of plugins that pass frames to a tracker in another process.

    Attributes
    ----------
    definition : Definition
        Definition with absolute paths.
    digest : str
        Digest of the tracker's files; a process that has read other content is not used.
    version : dict
        Value of `Identity.tracker_version`.
    clock : str
        What the times of calls contain, if this differs from trackers in this process.
    drawn : list of str
        Names of the global random generators from which the tracker has drawn, if it is known.
    process : LineProcess
        The tracker's process, until `close` is called.
    """

    definition: ClassVar[Definition]
    digest: ClassVar[str]
    version: ClassVar[dict[str, Any]]
    clock: ClassVar[str] = ""
    drawn: Sequence[str] = ()
    process: LineProcess

    @abstractmethod
    def close(self) -> None:
        """Release the process; called when a run no longer needs the tracker.

        Raises `ExternalTrackerError` if the process has answered more often than it was asked.
        """


_Process = TypeVar("_Process", bound=LineProcess)

_idle: defaultdict[tuple[object, ...], list[Any]] = defaultdict(list)
"""Processes without a tracker."""


def take_process(start: Callable[[Any], _Process], *key: Any) -> _Process:
    """Return an idle process of a tracker, or start one; `key` is its definition and digest."""
    processes = _idle[os.getpid(), *map(repr, key)]
    return processes.pop() if processes else start(key[0])


def keep_process(process: LineProcess, *key: object) -> None:
    """Keep a process for the next tracker of its key, because a start can take seconds."""
    _idle[os.getpid(), *map(repr, key)].append(process)


def close_idle_processes() -> None:
    """End the processes that wait for a tracker."""
    for processes in _idle.values():
        while processes:
            with suppress(ExternalTrackerError):  # no run needs its answers any more
                processes.pop().close()


def digest_file(file: Path) -> str:
    """Return the digest of a file; of Python with the modules next to it that it imports."""
    with suppress(SyntaxError):  # syntax of another version of Python
        if file.suffix == ".py":
            return tree_digest(file, Path(str(trackers.__file__)).parent)
    return file_digests([file])[0][:16]
