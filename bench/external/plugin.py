"""Base classes of trackers that run in another process."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from trackmark import trackers
from trackmark.bench.external.process import LineProcess
from trackmark.datasets.file_digest import file_digests
from trackmark.datasets.source_digest import tree_digest
from trackmark.trackers.base.call_clock import CallTime
from trackmark.trackers.base.estimate_check import MalformedEstimateError
from trackmark.trackers.base.parameters import Parameters
from trackmark.trackers.base.plain import AdaptedTracker


class RemoteTracker:
    """Base class of trackers that pass frames to another process.

    Attributes
    ----------
    process : LineProcess
        The tracker's process, until `close` is called.
    call_time : CallTime
        Times of the last call of `init` or `update`, without conversion of images and transfer.
    device : str
        Name of the accelerator; empty if unknown.
    clock : str
        What the times of calls contain, if this differs from trackers in this process.
    drawn : list of str
        Names of the global random generators from which the tracker has drawn, if it is known.
    keeps_arrays : bool
        True if the arrays of estimates are stored; otherwise they need not be transferred.
    """

    process: LineProcess
    call_time: CallTime
    device = ""
    clock: ClassVar[str] = ""
    drawn: Sequence[str] = ()
    keeps_arrays = False

    @property
    def printed(self) -> str:
        """End of what the tracker has printed."""
        return self.process.printed()

    def reject(self, error: MalformedEstimateError) -> Exception:
        """Return the failure for an estimate that the harness rejects."""
        return error

    @abstractmethod
    def close(self) -> None:
        """Release the process; called when a run no longer needs the tracker.

        Raises `ExternalTrackerError` if the process has answered more often than it was asked.
        """


class ExternalOptions(Parameters):
    """Keys of each tracker in another environment; docs/external.md describes them."""

    parameters: Mapping[str, bool | int | float | str] = {}
    environment: Mapping[str, str] = {}
    start_limit: float = Field(300.0, gt=0)
    frame_limit: float = Field(60.0, gt=0)
    version: str = ""


class ExternalPlugin(AdaptedTracker, RemoteTracker):
    """Base class of plugins whose tracker needs nothing of trackmark.

    Attributes
    ----------
    external_options : ExternalOptions
        Options with absolute paths.
    digest : str
        Digest of the tracker's files; a process that has read other content is not used.
    version : dict
        Value of `Identity.tracker_code`.
    """

    external_options: ClassVar[ExternalOptions]
    digest: ClassVar[str]
    version: ClassVar[dict[str, Any]]

    def reject(self, error: MalformedEstimateError) -> Exception:
        """See `RemoteTracker.reject`."""
        return self.process.fail(f"returned an invalid estimate: {error}")


def digest_file(file: Path) -> str:
    """Return the digest of a file; of Python with the modules next to it that it imports."""
    with suppress(SyntaxError):  # syntax of another version of Python
        if file.suffix == ".py":
            return tree_digest(file, Path(str(trackers.__file__)).parent)
    return file_digests([file])[0][:16]
