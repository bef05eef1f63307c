"""Somebody who watches a pass over a sequence from outside, and may end it."""

from collections.abc import Mapping
from typing import Protocol

__all__ = ["UNWATCHED", "NotAttributableError", "Watch"]


class NotAttributableError(Exception):
    """Something went wrong in a pass, and which of its trackers did it can't be told."""


class Watch(Protocol):
    """What a pass tells as it goes along."""

    def reading(self, frame: int) -> None:
        """Tell that a frame is fetched next."""
        ...

    def calling(self, entry: int, frame: int) -> None:
        """Tell that a tracker is called next."""
        ...

    def called(self, entry: int) -> None:
        """Tell that it has answered, or raised."""
        ...

    def shown(self, frames: int) -> None:
        """Tell that all trackers have seen so many frames.

        Raises
        ------
        NotAttributableError
            Where one of them has done something to the process that others would suffer from.
        """
        ...

    def has_called(self) -> bool:
        """Ask whether any tracker was called yet."""
        ...

    def misdeeds(self) -> Mapping[int, str]:
        """Ask in the end what trackers did to the process, by entry."""
        ...

    def printed(self) -> Mapping[int, str]:
        """Ask in the end what trackers printed last, by entry."""
        ...


class _Unwatched:
    """Nobody looks."""

    def reading(self, frame: int) -> None:
        """See `Watch`."""

    def calling(self, entry: int, frame: int) -> None:
        """See `Watch`."""

    def called(self, entry: int) -> None:
        """See `Watch`."""

    def shown(self, frames: int) -> None:
        """See `Watch`."""

    def has_called(self) -> bool:
        """See `Watch`."""
        return True

    def misdeeds(self) -> Mapping[int, str]:
        """See `Watch`."""
        return {}

    def printed(self) -> Mapping[int, str]:
        """See `Watch`."""
        return {}


UNWATCHED: Watch = _Unwatched()
"""For a pass in the caller's own process."""
