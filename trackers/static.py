"""Constant init box: the lower reference of every table."""

from trackmark.trackers.base.interface import (
    Box,
    Estimate,
    Image,
    Mask,
    TrackerPlugin,
    check_box,
)

__all__ = ["Static"]


class Static(TrackerPlugin):
    """Constant init box: the lower reference of every table.

    A method that is not better than this on a sequence has not tracked the target.
    """

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        self._box = check_box(box).copy()

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        return Estimate(self._box.copy())
