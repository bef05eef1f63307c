"""What a pass over a sequence tells as it goes along, to whom watches its trackers."""

from collections.abc import Mapping


class NotAttributableError(Exception):
    """Something went wrong in a pass, and which of its trackers did it can't be told."""


class Observer:
    """Is told what a pass does, and asked in the end what trackers did; this one takes no notice.

    `bench.engine.board.BoardObserver` passes it on to a supervisor.
    """

    def reading(self, frame: int) -> None:
        """Tell that a frame is fetched next."""

    def calling(self, entry: int, frame: int) -> None:
        """Tell that a tracker is called next."""

    def called(self, entry: int) -> None:
        """Tell that it has answered, or raised."""

    def shown(self, frames: int) -> None:
        """Tell that all trackers have seen so many frames.

        Raises `NotAttributableError` where one of them has done something to the process that
        others would suffer from.
        """

    def has_called(self) -> bool:
        """Ask whether any tracker was called yet."""
        return True

    def misdeeds(self) -> Mapping[int, str]:
        """Ask what trackers did to the process, by entry."""
        return {}

    def printed(self) -> Mapping[int, str]:
        """Ask what trackers printed last, by entry."""
        return {}


UNOBSERVED = Observer()
"""For a pass in the caller's own process."""
