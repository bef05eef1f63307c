"""Keeps the first box for ever: the floor of every table."""

from trackmark.trackers.base.interface import (
    Box,
    Estimate,
    Image,
    Mask,
    TrackerPlugin,
    four_numbers,
)

__all__ = ["Static"]


class Static(TrackerPlugin):
    """Keeps the first box for ever: the floor of every table.

    A method that does not beat it on a sequence has not tracked anything there.
    """

    def init(self, image: Image, box: Box, mask: Mask | None = None) -> None:
        """See `Tracker.init`."""
        self._box = four_numbers(box).copy()

    def update(self, image: Image) -> Estimate:
        """See `Tracker.update`."""
        return Estimate(self._box.copy())
