"""What a rectangle looks like to the multi-part tracker in both representations; no filter."""

import numpy as np
from numpy.typing import NDArray

from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import N_BINS, LuvBins
from trackers.histograms.counting import region_counts
from trackers.histograms.rectangles import bhattacharyya_distances, pixel_regions
from trackers.multipart import LEAST_PIXELS, LEAST_SHARE

__all__ = ["Appearance", "part_distance", "states_of"]

_EVERY_BIN = np.arange(N_BINS)


def states_of(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Centre x, y [pixels] and area [pixels²] of boxes, shape (n, 3) from (n, 4)."""
    centres = boxes[:, :2] + boxes[:, 2:] / 2
    return np.column_stack([centres, boxes[:, 2] * boxes[:, 3]])


def part_distance(image: Image, box: NDArray[np.float64]) -> float:
    """d[p1, p2] of a box's upper and lower half (Eq. 7)."""
    counts, totals = _counts(image, states_of(box[np.newaxis]), box[2] / box[3])
    distances = bhattacharyya_distances(counts[0], totals[0], counts[1, 0], int(totals[1, 0]))
    return float(distances[0])


class Appearance:
    """Histograms of a box, whole and by halves, and distances of other rectangles to them.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        BGR.
    box : ndarray of float64, shape (4,)
        In pixels.
    """

    def __init__(self, image: Image, box: NDArray[np.float64]) -> None:
        self._aspect = float(box[2] / box[3])
        counts, totals = _counts(image, states_of(box[np.newaxis]), self._aspect)
        self._counts, self._totals = counts[:, 0], totals[:, 0]

    def distances(
        self, image: Image, states: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distances of rectangles of the box's aspect: to the whole, and by halves (Eq. 1, 2).

        Parameters
        ----------
        image : ndarray of uint8, shape (height, width, 3)
            BGR.
        states : ndarray of float64, shape (n, 3)
            Centre x, y [pixels] and area [pixels²].

        Returns
        -------
        single, multi : ndarray of float64, shape (n,)
            1 where too little of a rectangle is in the image.
        """
        counts, totals = _counts(image, states, self._aspect)
        single = bhattacharyya_distances(
            counts.sum(axis=0, dtype=np.int32),
            totals.sum(axis=0),
            self._counts.sum(axis=0, dtype=np.int32),
            int(self._totals.sum()),
        )
        halves = [
            bhattacharyya_distances(counts[part], totals[part], reference, int(total))
            for part, (reference, total) in enumerate(zip(self._counts, self._totals, strict=True))
        ]
        return single, (halves[0] + halves[1]) / 2


def _counts(
    image: Image, states: NDArray[np.float64], aspect: float
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Votes by half, rectangle and bin, and their sums."""
    height, width = image.shape[:2]
    regions = pixel_regions(states, aspect, 2, width, height, LEAST_SHARE, LEAST_PIXELS)
    colours = LuvBins()
    counts = region_counts(SharedFrame(image), regions, colours, _EVERY_BIN)
    return counts, regions.pixels * colours.votes_a_pixel
