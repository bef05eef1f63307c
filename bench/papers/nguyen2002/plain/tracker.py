"""The method frame by frame, which must wait for what comes after an occlusion's beginning."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.papers.nguyen2002.plain.matching import Pose
from bench.papers.nguyen2002.plain.offline import chosen_end
from bench.papers.nguyen2002.plain.settings import Settings
from bench.papers.nguyen2002.plain.target import Candidate, Target

__all__ = ["PlainNguyen2002"]

Box = NDArray[np.float64]


class PlainNguyen2002:
    """The tracker `nguyen2002`.

    Parameters
    ----------
    **parameters
        See `Settings`.

    Attributes
    ----------
    target : Target
    """

    def __init__(self, **parameters: Any) -> None:
        self._settings = Settings(**parameters)

    def init(self, image: NDArray[np.uint8], box: Box) -> None:
        """Take the target from a box of the first frame, BGR."""
        self.target = Target(self._settings, image, box)
        self._latest, self._next = 0, 1
        self._images: dict[int, NDArray[np.uint8]] = {}  # those that may be looked at again
        self._t_o: int | None = None
        self._candidates: dict[int, Candidate] = {}

    def update(self, image: NDArray[np.uint8]) -> tuple[Box, bool, dict[int, Box]]:
        """Box in the next frame, whether the target is hidden in it, and boxes of frames before."""
        self._latest += 1
        self._images[self._latest] = image.copy()
        said = self._catch_up()
        boxes = {frame: self.target.box(pose) for frame, pose in said.items()}
        return boxes.pop(self._latest), self._t_o is not None, boxes

    def finish(self) -> dict[int, Box]:
        """Boxes of frames before, if the last one was the sequence's last."""
        said: dict[int, Pose] = {}
        while self._candidates:
            said |= self._end_occlusion()
            said |= self._catch_up()
        return {frame: self.target.box(pose) for frame, pose in said.items()}

    def _catch_up(self) -> dict[int, Pose]:
        """See all frames that are there and were not seen by the target as it is now."""
        said: dict[int, Pose] = {}
        while self._next <= self._latest:
            frame = self._next
            self._next += 1
            if self._t_o is None:
                pose = self.target.follow(self._images[frame])
                if pose is not None:
                    said[frame] = pose
                    del self._images[frame]
                    continue
                self._t_o = frame
            n = frame - self._t_o
            said[frame] = self.target.extrapolated(n + 1)
            if n in self._settings.offsets:
                found = self.target.look(self._images[frame], n)
                self._candidates[n] = found
                accepted = self._settings.end == "first" and found.share <= self._settings.accept
                if accepted or n == self._settings.offsets[-1]:
                    said |= self._end_occlusion()
        return said

    def _end_occlusion(self) -> dict[int, Pose]:
        """Start anew at the best candidate; frames after it are to be seen once more."""
        assert self._t_o is not None
        n = chosen_end(self._candidates, self._settings)
        end = self._candidates[n].pose
        frames = range(self._t_o, self._t_o + n + 1)
        said = dict(zip(frames, [*self.target.interpolated(end, n), end], strict=True))
        self.target.take_again(self._images[frames[-1]], end, n)
        for frame in frames:
            del self._images[frame]
        self._t_o, self._next, self._candidates = None, frames[-1] + 1, {}
        return said
