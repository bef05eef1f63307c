"""Plugins whose tracker runs in another process."""

from abc import abstractmethod

from trackmark.trackers import TrackerPlugin

TRANSFER_CLOCK = "wall time with transfer"
"""Value of `clock` in the circumstances of runs with `ExternalPlugin.includes_transfer`."""


class ExternalPlugin(TrackerPlugin):
    """Base class of plugins that pass frames to a tracker in another process.

    Attributes
    ----------
    call_times : tuple of float
        Wall and CPU time of the last call of the tracker's `init` or `update` [s]. Replaces the
        times that the harness measures in its own process.
    includes_transfer : bool
        True if the times include the transfer of the frame and of the answer, and the CPU time is
        the wall time, because the tracker does not measure itself.
    """

    call_times: tuple[float, float]
    includes_transfer = False

    @abstractmethod
    def close(self) -> None:
        """Release the process; called when a run no longer needs the tracker."""
