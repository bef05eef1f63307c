"""Time per frame of both representations ("10 milliseconds more" in the paper)."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.timing import Methods, Values, kept_times, milliseconds
from trackmark.reports.tables import MISSING, Table, text_table
from trackmark.trackers.base.interface import Box, Image
from trackmark.trackers.histograms.bins import LuvBins
from trackmark.trackers.histograms.rectangles import pixel_regions
from trackmark.trackers.multipart import MIN_PIXELS, MIN_SHARE, MultipartParameters

SEQUENCE, FRAMES = "1", 8


class _Histograms:
    """Colour histograms of the particles of a frame, computed region by region.

    The particles are at the init box, moved by one step of the paper's noise.
    """

    def __init__(self, parameters: MultipartParameters, n_parts: int) -> None:
        self._settings, self._n_parts = parameters, n_parts
        self._colours = LuvBins(parameters.binning, parameters.uv_range)

    def init(self, image: Image, box: Box) -> None:
        settings, (x, y, width, height) = self._settings, box.tolist()
        step = width / settings.position_divisor
        noise = np.random.default_rng(0).uniform(-1, 1, (settings.particles, 3))
        noise *= [step, step, width * height / settings.size_divisor]
        states = np.array([x + width / 2, y + height / 2, width * height]) + noise
        size = image.shape[1], image.shape[0], MIN_SHARE, MIN_PIXELS
        regions = pixel_regions(states, width / height, self._n_parts, *size)
        self._regions = regions.bounds.reshape(-1, 4).tolist()

    def update(self, image: Image) -> None:
        codes, n_codes = self._colours.codes(image), len(self._colours.votes)
        for left, top, right, bottom in self._regions:
            np.bincount(codes[top:bottom, left:right].ravel(), minlength=n_codes)


def histograms(specs: Mapping[str, str]) -> Methods:
    """Return the timed histograms of a tracker in both representations."""
    (spec,) = specs.values()
    parameters = MultipartParameters(**parse_tracker(spec).parameters)
    return {name: partial(_Histograms, parameters, n) for name, n in (("single", 1), ("multi", 2))}


def _times(context: Context, setting: str) -> tuple[Values, Values]:
    """Return the times of two-part and of single histograms [s]."""
    tracker = [*context.paper.trackers][:1]  # all trackers have the same bins
    times = kept_times(context, histograms, setting, tracker, [SEQUENCE], FRAMES)[SEQUENCE]
    return times["multi"], times["single"]


def time_table(context: Context) -> Table:
    """Return the paper's difference and ours."""
    pairs = [_times(context, setting) for setting in SETTINGS]
    rows = [
        ["single", MISSING, *(milliseconds(single) for _, single in pairs)],
        ["two parts", MISSING, *(milliseconds(multi) for multi, _ in pairs)],
        ["difference", "10", *(milliseconds(multi - single) for multi, single in pairs)],
    ]
    headings = ["histograms", "paper [ms]", "as written [ms]", "recommended [ms]"]
    caption = (
        "Time to compute the histograms of a frame, section 3. Our times are those of one "
        "NumPy call per region, the median of 12 rounds on sequence 1. Times on different "
        "machines cannot be compared."
    )
    return text_table("times", caption, headings, rows, 1)
