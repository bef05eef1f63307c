"""Parts of timing runs: images in memory and the speed of the machine."""

from math import inf
from statistics import median
from time import thread_time

from trackmark.bench.evaluation.interleaved_timing import Reference
from trackmark.datasets.interface import Frames, Image

REFERENCE_CALLS = 15


class Remembered:
    """Frames that are decoded or rendered once; at most `most` bytes of images are kept."""

    def __init__(self, frames: Frames, most: float = inf) -> None:
        self.frames = frames
        self._seen: dict[int, Image] = {}
        self._left = most

    def __len__(self) -> int:
        return len(self.frames)

    def __contains__(self, frame: int) -> bool:
        return frame in self._seen

    def __getitem__(self, frame: int) -> Image:
        if frame in self._seen:
            return self._seen[frame]
        image = self.frames[frame]
        self._left -= image.nbytes
        if self._left >= 0:
            self._seen[frame] = image
        return image


def reference_seconds() -> float:
    """Return the median CPU time of a fixed piece of work."""
    reference, seconds = Reference(), []
    reference.init()
    for _ in range(REFERENCE_CALLS):
        began = thread_time()
        reference.update()
        seconds.append(thread_time() - began)
    return median(seconds)
