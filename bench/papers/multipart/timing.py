"""Time per frame of both representations (the paper's "10 milliseconds more")."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.context import Context
from bench.papers.timing import beginning, kept_times, turn_times
from trackers.base.interface import Box, Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import N_BINS, LuvBins
from trackers.histograms.counting import region_counts
from trackers.histograms.rectangles import Regions, bhattacharyya_distances, pixel_regions
from trackers.multipart import LEAST_PIXELS, LEAST_SHARE

__all__ = ["kernel_pairs", "kernel_times"]

_PARTICLES = 200
_BINS = np.arange(0, N_BINS, 5)  # about as many as a person's histogram has
_PARTS = {"single": 1, "multi": 2}
_FRAMES = 8


def kernel_pairs(context: Context) -> pd.DataFrame:
    """Weighing the same rectangles whole and by halves, in turns: a row a round.

    Returns
    -------
    DataFrame
        `kernel` (`one pass` as the tracker does; `two calls`: the plain way, a library call a
        region); `single`, `multi` and `reference` [seconds], means over sequences; `ratio`.
    """
    numbers = (8,) if context.effort.quick else range(1, 9)  # opening them takes longer than timing
    names = [f"multipart/{number}" for number in numbers]
    times = kept_times(context, kernel_times, names, frames=_FRAMES)
    means = times.groupby(["kernel", "round"], as_index=False).mean(numeric_only=True)
    return means.assign(ratio=means["multi"] / means["single"])


def kernel_times(names: Sequence[str], frames: int) -> pd.DataFrame:
    """See `kernel_pairs`; by sequence. Calls are timed on the last one alone."""
    clips = {name: beginning(name, frames, "full") for name in names}
    images, box = clips[names[-1]]
    codes = [LuvBins().codes(image).astype(np.intp) for image in images]
    pieces = []
    for kernel, way, shown in (
        ("one pass", _OnePass, clips),
        ("two calls", _Calls, {names[-1]: (codes, box)}),
    ):
        methods = {name: partial(way, parts) for name, parts in _PARTS.items()}
        pieces.append(turn_times(methods, shown).assign(kernel=kernel))
    return pd.concat(pieces, ignore_index=True)


class _OnePass:
    """What the tracker does for the distances of its particles, with one or two parts."""

    def __init__(self, parts: int) -> None:
        self._parts = parts
        self._colours = LuvBins()

    def init(self, image: Image, box: Box) -> None:
        """Scatter particles as they lie around a box after a step of the paper's noise."""
        x, y, width, height = box
        jitter = np.random.default_rng(0).uniform(-1, 1, (_PARTICLES, 3))
        jitter *= [width / 3, width / 3, width * height / 10]
        self._states = np.array([x + width / 2, y + height / 2, width * height]) + jitter
        self._aspect = float(width / height)

    def update(self, image: Image) -> None:
        """Weigh them."""
        regions, colours = self._regions(image), self._colours
        counts = region_counts(SharedFrame(image), regions, colours, _BINS)
        totals = regions.pixels * colours.votes_a_pixel
        for part in range(self._parts):
            reference = counts[part, 0]
            bhattacharyya_distances(counts[part], totals[part], reference, int(totals[part, 0]))

    def _regions(self, image: NDArray[np.generic]) -> Regions:
        height, width = image.shape[:2]
        size = width, height, LEAST_SHARE, LEAST_PIXELS
        return pixel_regions(self._states, self._aspect, self._parts, *size)


class _Calls(_OnePass):
    """A library call a region, on images of the colours' codes."""

    def init(self, image: Image, box: Box) -> None:
        """Scatter particles; regions are no part of the time."""
        super().init(image, box)
        self._places = self._regions(image).parts.reshape(-1, 4).tolist()

    def update(self, image: Image) -> None:
        """Count them."""
        n_codes = len(self._colours.votes)
        for left, top, right, bottom in self._places:
            np.bincount(image[top:bottom, left:right].ravel(), minlength=n_codes)
