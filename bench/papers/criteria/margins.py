"""Margins of the single and the two-part histogram, measured on images and ground truth.

A margin is positive if the target matches the histogram of the first frame better than clutter
does. The rectangle encloses the whole person (region `full`), as the init box of the trackers does.
Colours, bins and distances are those of the tracker in the setting `as-written`.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Sequence
from trackmark.trackers.base.interface import Image
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.bins import N_BINS, LuvBins
from trackmark.trackers.histograms.counting import count_regions
from trackmark.trackers.histograms.rectangles import bhattacharyya_distances, pixel_regions

THRESHOLD = 0.4
"""Threshold T in Eq. 7."""

JITTERS, JITTER = 50, 0.05
SAMPLES = 100
CLEAR = 0.9
"""Minimum visible share of the person in frames whose margins are measured."""

MIN_INSIDE, MIN_PIXELS = 0.5, 16
WIDTHS, STEP = 3.0, 0.5
RISES = (-0.5, -0.25, 0.0, 0.25, 0.5)
MAX_OVERLAP = 0.1

_BINS = np.arange(N_BINS)


class Appearance:
    """Histograms of a rectangle `[x, y, width, height]` [px] in a BGR image, and of its halves."""

    def __init__(self, image: Image, box: NDArray[np.float64]) -> None:
        counts, totals = _half_counts(image, box[np.newaxis])
        self._counts, self._totals = counts[:, 0], totals[:, 0]

    def distances(self, image: Image, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances (Eq. 1, 2) of rectangles with equal aspect ratios, shape (2, n).

        First row: single histogram; second row: two-part histogram. The distance is 1 if less than
        half of a rectangle is inside the image.
        """
        counts, totals = _half_counts(image, boxes)
        single = bhattacharyya_distances(
            counts.sum(axis=0, dtype=np.int32),
            totals.sum(axis=0),
            self._counts.sum(axis=0, dtype=np.int32),
            int(self._totals.sum()),
        )
        upper, lower = (
            bhattacharyya_distances(counts[k], totals[k], self._counts[k], int(self._totals[k]))
            for k in range(2)
        )
        return np.stack([single, (upper + lower) / 2])


def _half_counts(
    image: Image, boxes: NDArray[np.float64], colours: LuvBins | None = None
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Return the votes by half, rectangle and bin, and their sums by half and rectangle."""
    centres = boxes[:, :2] + boxes[:, 2:] / 2
    states = np.column_stack([centres, boxes[:, 2] * boxes[:, 3]])
    aspect = float(boxes[0, 2] / boxes[0, 3])
    height, width = image.shape[:2]
    regions = pixel_regions(states, aspect, 2, width, height, MIN_INSIDE, MIN_PIXELS)
    colours = colours or LuvBins()
    counts = count_regions(SharedFrame(image), regions, colours, _BINS)
    return counts, regions.pixels * colours.votes_a_pixel


def part_distance(image: Image, box: NDArray[np.float64], colours: LuvBins | None = None) -> float:
    """Return the distance between the histograms of a rectangle's halves (Eq. 7)."""
    counts, totals = _half_counts(image, box[np.newaxis], colours)
    return float(bhattacharyya_distances(counts[0], totals[0], counts[1, 0], int(totals[1, 0]))[0])


def right_choice(
    image: Image, box: NDArray[np.float64], two_coloured: bool, colours: LuvBins | None = None
) -> float:
    """Return the share of jittered rectangles for which Eq. 7 selects the right representation.

    Positions and sizes of the 50 rectangles vary by up to 5 % of the sides, like rectangles drawn
    by hand. `colours`: bins of the histogram, by default those of the setting `as-written`.
    """
    x, y, width, height = box
    jitters = np.random.default_rng(0).uniform(-JITTER, JITTER, (JITTERS, 4))
    rectangles = np.array([x, y, width, height]) + jitters * [width, height, width, height]
    selects_two = [part_distance(image, rectangle, colours) > THRESHOLD for rectangle in rectangles]
    return float(np.mean(np.array(selects_two) == two_coloured))


def sampled_frames(n_frames: int) -> NDArray[np.int64]:
    """Return at most 100 evenly spaced frames."""
    return np.arange(0, n_frames, -(-n_frames // SAMPLES))


def clutter_boxes(box: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rectangles up to three widths and half a height from a box that hardly overlap it."""
    across = np.arange(-WIDTHS, WIDTHS + STEP, STEP)
    offsets = np.array([(dx, dy) for dx in across for dy in RISES])
    shared = np.clip(1 - np.abs(offsets), 0, None).prod(axis=1)
    offsets = offsets[shared < MAX_OVERLAP]
    corners = box[:2] + offsets * box[2:]
    return np.hstack([corners, np.broadcast_to(box[2:], corners.shape)])


@lru_cache(maxsize=8)
def margins(
    sequence: Sequence, frames: tuple[int, ...] | None = None
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Measure how much better the target matches the first frame's histogram than clutter does.

    A margin is the smallest distance of a clutter rectangle minus the target's distance. Returns
    the frames with at least 90 % of the target visible, shape (n,), and their margins, shape (2,
    n): single histogram first, two-part histogram second.
    """
    boxes = sequence.regions["full"]
    first = sequence.first_frame
    model = Appearance(sequence[first], boxes[first])
    selected = sampled_frames(len(sequence)) if frames is None else np.array(frames)
    clear = selected[sequence.visibility[selected] >= CLEAR]
    values = []
    for frame in clear.tolist():
        box = boxes[frame]
        rectangles = np.vstack([box[np.newaxis], clutter_boxes(box)])
        distances = model.distances(sequence[frame], rectangles)
        values.append(distances[:, 1:].min(axis=1) - distances[:, 0])
    return clear, np.array(values).reshape(-1, 2).T
