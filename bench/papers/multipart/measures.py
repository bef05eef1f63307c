"""Measures of the multi-part paper: the whole person as the target, overlap, first loss."""

from collections.abc import Callable

import numpy as np

from trackmark.bench.metrics import native
from trackmark.bench.metrics.centre_error import centre_inside
from trackmark.bench.metrics.native import SUCCESS_OVERLAP
from trackmark.bench.papers.measures import JudgedRun, Values, measure

PERSON = "full"
"""Region of the ground truth that holds the whole person."""


def inside_person(judged: JudgedRun) -> Values:
    """Return 1 in frames with the centre inside the whole person's rectangle, else 0, shape (n,).

    The rectangle does not depend on the region that the tracker started from.
    """
    return np.asarray(centre_inside(judged.truth.regions[PERSON], judged.boxes), np.float64)


SERIES: dict[str, Callable[[JudgedRun], Values]] = {"inside": inside_person}
"""Series by frame; `inside` replaces the common one, which uses the ground truth's boxes."""


@measure("frames")
def frames_overlapping(judged: JudgedRun) -> float:
    """Return the number of frames with an overlap of at least 0.5.

    The ground truth is the region that the tracker started from, so that the sizes agree.
    """
    return float((judged.overlap >= SUCCESS_OVERLAP).sum())


@measure("frames")
def frames_before_loss(judged: JudgedRun) -> float:
    """Return the number of frames before ten visible ones in a row are off the target."""
    return float(native.first_loss(judged.on_target, judged.present, judged.truth.visibility))
