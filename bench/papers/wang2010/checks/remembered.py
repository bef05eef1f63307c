"""Frames that are rendered once: every check asks for the same ones."""

from datasets.interface import Frames, Image

__all__ = ["Remembered"]


class Remembered:
    """All frames that were asked for.

    Parameters
    ----------
    frames : Frames
        Where they come from.
    """

    def __init__(self, frames: Frames) -> None:
        self.frames = frames
        self._seen: dict[int, Image] = {}

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, frame: int) -> Image:
        if frame not in self._seen:
            self._seen[frame] = self.frames[frame]
        return self._seen[frame]
