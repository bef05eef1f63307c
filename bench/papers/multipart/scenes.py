"""Measure of scenes without stored runs: the choice between one and two parts (Eq. 7).

The choice is made in the first frame, whose rectangle encloses the whole person (region `full`), as
the init box of the trackers does. Distances are those of the tracker.
"""

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers.measures import measure
from trackmark.bench.papers.multipart.measures import PERSON
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.synthetic.multipart.designs import DESIGNS
from trackmark.trackers.base.interface import Image
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.bins import N_BINS, LuvBins
from trackmark.trackers.histograms.counting import count_regions
from trackmark.trackers.histograms.rectangles import bhattacharyya_distances, pixel_regions

THRESHOLD = 0.4
"""Threshold T in Eq. 7."""

JITTERS, JITTER = 50, 0.05
MIN_INSIDE, MIN_PIXELS = 0.5, 16

_BINS = np.arange(N_BINS)


def half_counts(
    image: Image, boxes: NDArray[np.float64], colours: LuvBins
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Return the votes by half, rectangle and bin, and their sums by half and rectangle."""
    centres = boxes[:, :2] + boxes[:, 2:] / 2
    states = np.column_stack([centres, boxes[:, 2] * boxes[:, 3]])
    aspect = float(boxes[0, 2] / boxes[0, 3])
    height, width = image.shape[:2]
    regions = pixel_regions(states, aspect, 2, width, height, MIN_INSIDE, MIN_PIXELS)
    counts = count_regions(SharedFrame(image), regions, colours, _BINS)
    return counts, regions.pixels * colours.votes_a_pixel


def part_distance(image: Image, box: NDArray[np.float64], colours: LuvBins) -> float:
    """Return the distance between the histograms of a rectangle's halves (Eq. 7)."""
    counts, totals = half_counts(image, box[np.newaxis], colours)
    return float(bhattacharyya_distances(counts[0], totals[0], counts[1, 0], int(totals[1, 0]))[0])


def right_choice_rate(
    image: Image, box: NDArray[np.float64], two_coloured: bool, colours: LuvBins
) -> float:
    """Return the share of jittered rectangles for which Eq. 7 selects the right representation.

    Positions and sizes of the 50 rectangles vary by up to 5 % of the sides, like rectangles drawn
    by hand. `colours`: bins of the histogram.
    """
    x, y, width, height = box
    jitters = np.random.default_rng(0).uniform(-JITTER, JITTER, (JITTERS, 4))
    rectangles = np.array([x, y, width, height]) + jitters * [width, height, width, height]
    selects_two = [part_distance(image, rectangle, colours) > THRESHOLD for rectangle in rectangles]
    return float(np.mean(np.array(selects_two) == two_coloured))


@measure("share")
def right_choice(scene: str, tracker: str) -> float:
    """Return 1 if Eq. 7 selects the right representation for most jittered rectangles, else 0.

    The right representation has two parts for a two-coloured target and one part for a plain one.
    """
    sequence, parameters = datasets.load(scene), parse_tracker(tracker).parameters
    name = parse_text(scene)[0].rpartition("/")[2]
    first = sequence.first_frame
    share = right_choice_rate(
        sequence[first],
        sequence.regions[PERSON][first],
        DESIGNS[name].two_coloured,
        LuvBins(parameters["binning"], parameters["uv_range"]),
    )
    return float(share > 0.5)
